"""Planar coupon test: one direction stretched, one held, the third free (pure shear)."""

from cases.coupon import coupon_mode

MODE = coupon_mode(
    "planar",
    "one direction stretched, one held, the third free (pure shear)",
    "x",
    fixed="y",
    unit_slope=4.0,
    words=("planar", "pureshear", "shear", "schub", "scher"),
)

"""Uniaxial coupon test: one direction stretched, the others free."""

from cases.coupon import coupon_mode

MODE = coupon_mode(
    "uniaxial",
    "one direction stretched, the others free",
    "x",
    unit_slope=3.0,
    words=("uniaxial", "tension", "tensile", "zug", "uni", "compression", "druck", "stauch"),
    is_usual=True,
)

"""Equibiaxial coupon test: two directions stretched alike, the third free."""

from cases.coupon import coupon_mode

MODE = coupon_mode(
    "equibiaxial",
    "two directions stretched equally, the third free",
    "xy",
    unit_slope=6.0,
    words=("equibiaxial", "biaxial", "biax", "equibiax"),
)

"""Volumetric coupon test: all directions stretched alike."""

from cases.coupon import coupon_mode

MODE = coupon_mode(
    "volumetric",
    "all directions stretched equally",
    "xyz",
    needs_compressibility=True,
    words=("volumetric", "volumetrisch", "bulk"),
)

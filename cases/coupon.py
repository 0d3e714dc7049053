"""Homogeneous deformation of the unit coupon: driven faces follow u = q X, q = stretch - 1."""

from __future__ import annotations

from cases.mode import Array, Mode, Setting


def _affine(x: Array, q: float) -> Array:
    return q * x


def _affine_rate(x: Array, q: float) -> Array:
    return 1.0 * x


def coupon_mode(
    name: str,
    summary: str,
    stretched: str,
    fixed: str = "",
    needs_compressibility: bool = False,
    unit_slope: float | None = None,
    words: tuple[str, ...] = (),
    is_usual: bool = False,
) -> Mode:
    """Return a mode of the coupon.

    The face at 0 of every axis is a mirror plane, the face at 1 is driven, fixed or free; Q is the nominal
    stress (MPa) on one driven face.

    Parameters
    ----------
    name, summary : str
        As `bushcli list modes` shows them.
    stretched, fixed : str
        Axes that are stretched, and axes that keep their length, of "xyz".
    needs_compressibility : bool
        Whether the mode cannot load an incompressible law.
    unit_slope : float or None
        Slope of the nominal stress of an incompressible coupon at rest over the shear modulus, dimensionless.
    words : tuple of str
        Words of the names of files with recordings of this mode, in lower case.
    is_usual : bool
        As in `Mode`.
    """
    axis = {"x": 0, "y": 1, "z": 2}
    return Mode(
        name=name,
        summary=summary,
        specimen="coupon",
        rotational=False,
        solid=Setting("cartesian", _affine, _affine_rate),
        driven={f"face_{a}": (axis[a],) for a in stretched},
        held={f"mirror_{a}": (axis[a],) for a in axis} | {f"face_{a}": (axis[a],) for a in fixed},
        shares=len(stretched),
        needs_compressibility=needs_compressibility,
        unit_slope=unit_slope,
        words=words,
        is_usual=is_usual,
    )

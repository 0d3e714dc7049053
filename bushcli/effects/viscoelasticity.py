"""Viscoelasticity: one to three Maxwell branches beside the law, on the isochoric stress.

Each branch carries an overstress Q_i with Q_i' + Q_i / tau_i = g_i S_iso', S_iso the isochoric second Piola-Kirchhoff
stress. The law is what remains after long rest; g_i is the modulus of the branch over the law's initial shear modulus,
so that the stiffness of a sudden step is 1 + sum g_i times the relaxed one. Amplitudes g_i.

References
----------
Simo (1987), On a fully three-dimensional finite-strain viscoelastic damage model, Comput. Methods Appl. Mech. Eng.
60:153-173, doi:10.1016/0045-7825(87)90107-1.
Holzapfel (1996), On large strain viscoelasticity, Int. J. Numer. Methods Eng. 39:3903-3926,
doi:10.1002/(SICI)1097-0207(19961130)39:22<3903::AID-NME34>3.0.CO;2-C.
"""

from bushcli.effect import Effect, EffectParameter

# Fractions of the recording: a branch much slower than it is elastic, one much faster is spent within a sample.
_TIMES = (0.003, 0.01, 0.03, 0.1, 0.3)


def _branch(i: int, modulus: float, time: float) -> tuple[EffectParameter, EffectParameter]:
    return (
        EffectParameter(
            f"g{i}", "1", f"modulus of branch {i} over the law's", modulus, 0.0, 10.0, off=0.0, optional=i > 1
        ),
        EffectParameter(
            f"tau{i}",
            "s",
            f"relaxation time of branch {i}",
            time,
            1e-3,
            1e6,
            optional=i > 1,
            scan=_TIMES,
            scale="duration",
        ),
    )


EFFECT = Effect(
    name="viscoelasticity",
    summary="Fast motion meets more force, which relaxes in a hold; the loop grows with the rate.",
    acts="rubber",
    parameters=(*_branch(1, 0.2, 10.0), *_branch(2, 0.1, 1.0), *_branch(3, 0.1, 100.0)),
    needs="time, and two rates or a hold; a time per branch needs rates or holds that far apart",
    rivals=("friction", "mullins", "time_lag"),
    source="Simo (1987), Finite-strain viscoelastic damage model, doi:10.1016/0045-7825(87)90107-1",
    specimens=frozenset({"bushing", "coupon"}),
    needs_time=True,
)

"""Payne effect: filled rubber relaxes faster the more it moves, and the larger its motion has been.

A spectrum of Maxwell branches beside the law, with relaxation times from tau 10^-decades to tau (s, at rest), whose
modulus per decade is g time^slope times the law's initial shear modulus, time in s. Its clock runs with time and with
the path of local shear strain: dz = dt + (offset + a)^exponent (path |d gamma| + pace dt), with a half of the range of
strain so far. So the rubber is viscous in a hold, its loop hardly depends on the rate, and its stiffness falls with the
amplitude, in a quasi-static loop as in a vibration. With a pace what a large amplitude has thinned relaxes faster at
rest, too: stiffness over frequency is that at a small amplitude, at other frequencies. With a recovery time (s) the
range so far is forgotten: small vibrations about a preload are thinned, after a rest, by their own amplitude only. The
amplitude is g.

References
----------
Lion and Kardelky (2004), The Payne effect in finite viscoelasticity, Int. J. Plast. 20:1313-1345,
doi:10.1016/j.ijplas.2003.07.001 (internal clock).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from cases.sine import ThinnedSpectrum
    from forms.potential import Attached


# Offset and exponent where none are given: the former below any amplitude that matters, the latter as two loops of a
# bonded shear specimen have it (0.96 +- 0.27, `benchmarks/payne.md`).
LEAST, LINEAR = 1e-5, 1.0


def _branches(values: Values) -> list[Attached]:
    """Return the clock, and the branches on it."""
    from forms.branches.maxwell import PACED
    from forms.branches.payne import BRANCH, spectrum
    from forms.potential import Attached

    clock = {
        "path": values["path"],
        "offset": values.get("offset", LEAST),
        "exponent": values.get("exponent", LINEAR),
        "fading": 1.0 / values["recovery"] if "recovery" in values else 0.0,
        "pace": values.get("pace", 0.0),
    }
    moduli, times = spectrum(*(values[name] for name in ("g", "tau", "decades", "slope")))
    branches = [Attached(PACED, {"g": g, "tau": tau}) for g, tau in zip(moduli, times, strict=True)]
    return [Attached(BRANCH, clock), *branches]


def _thinned_spectrum(values: Mapping[str, float]) -> ThinnedSpectrum:
    """Return the same for vibrations."""
    from cases.sine import ThinnedSpectrum
    from forms.branches.payne import spectrum

    moduli, times = spectrum(*(values[name] for name in ("g", "tau", "decades", "slope")))
    offset, exponent = values.get("offset", LEAST), values.get("exponent", LINEAR)
    return ThinnedSpectrum(moduli, times, values["path"], offset, exponent, values.get("pace", 0.0))


def feature() -> Feature:
    """Return the spectrum on its clock."""
    from cases.feature import Feature

    return Feature(branches=_branches, thinned=_thinned_spectrum)


# Four strain sweeps of a carbon-black compound and two loops of a bonded shear specimen (`benchmarks/payne.md`).
_MEASURED = "engineering judgement about fits of this law to measured strain sweeps and loops"

EFFECT = Effect(
    name="payne",
    title="Payne effect",
    of_a_person=True,
    summary="Filled rubber is stiffer in small motions: it relaxes the faster, the more and the farther it moves.",
    acts="rubber",
    parameters=(
        Amplitude(
            "g",
            "1",
            "modulus per decade at a relaxation time of 1 s, over the law's",
            (0.2, 0.0, 100.0),
            per_time="slope",
            prior=Prior(
                "half_t",
                0.3,
                source="engineering judgement: over five decades and more the modulus of filled rubber falls to a half "
                "or a fifth from small to large amplitudes (Lion and Kardelky 2004, doi:10.1016/j.ijplas.2003.07.001)",
            ),
        ),
        EffectParameter(
            "tau",
            "s",
            "longest relaxation time, at rest",
            (300.0, 1e-3, 1e9),
            scan=(0.1, 1.0, 10.0),
            scale="duration",
            prior=Prior(
                "log_uniform",
                0.1,
                100.0,
                of="duration",
                source="engineering judgement: filled rubber relaxes for as long as it is watched",
            ),
        ),
        EffectParameter(
            "decades",
            "1",
            "width of the spectrum in powers of ten",
            (6.0, 0.5, 20.0),
            prior=Prior("log_normal", 5.5, 0.35, source=_MEASURED),
        ),
        EffectParameter(
            "slope",
            "1",
            "power of the time in the modulus per decade",
            (0.0, -2.0, 2.0),
            prior=Prior("t", 0.3, source=_MEASURED),
        ),
        EffectParameter(
            "path",
            "s",
            "clock's time per shear strain at an amplitude of 1",
            (1e3, 0.0, 1e12),
            scan=(1e2, 1e3, 1e4),
            prior=Prior("log_uniform", 30.0, 1e6, source=_MEASURED),
        ),
        EffectParameter(
            "exponent",
            "1",
            "power of the amplitude in the clock",
            (1.3, 0.0, 5.0),
            optional=True,
            of_amplitude=True,
            scan=(1.5,),
            prior=Prior("log_normal", 1.5, 0.4, source=_MEASURED),
        ),
        EffectParameter(
            "offset",
            "1",
            "shear strain added to the amplitude, well below which all thin alike",
            (0.01, 1e-6, 1.0),
            optional=True,
            of_amplitude=True,
            scan=(0.01,),
            prior=Prior("log_normal", 0.03, 1.5, source=_MEASURED),
        ),
        EffectParameter(
            "pace",
            "1",
            "clock's time per time at an amplitude of 1",
            (1e3, 0.0, 1e12),
            optional=True,
            of_amplitude=True,
            scan=(1e2, 1e4),
            prior=Prior(
                "log_uniform",
                1.0,
                1e7,
                source="engineering judgement: one that doubles the clock's speed between 1e-5 and 1 of shear strain",
            ),
        ),
        EffectParameter(
            "recovery",
            "s",
            "time in which the range of strain so far is forgotten",
            (1e4, 1e-3, 1e9),
            optional=True,
            scan=(0.1, 1.0),
            scale="duration",
            prior=Prior(
                "log_uniform",
                0.1,
                1e4,
                of="duration",
                source="engineering judgement: filled rubber recovers from a large amplitude in minutes to days",
            ),
        ),
    ),
    how_often="usual",
    families=("dissipation",),
    of_fillers="dissipation",
    fades=True,
    in_force_law="clock",
    needs="reversals at two amplitudes, and two rates or a hold",
    rivals=("friction", "viscoelasticity"),
    source="Lion and Kardelky (2004), The Payne effect in finite viscoelasticity, doi:10.1016/j.ijplas.2003.07.001",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    needs_time=True,
    needs_amplitudes=True,
    feature=feature,
    shown=("axial", {"g": 0.5, "tau": 300.0, "decades": 6.0, "slope": 0.0, "path": 100.0, "exponent": 1.0}),
)

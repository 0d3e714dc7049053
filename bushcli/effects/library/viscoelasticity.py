"""Viscoelasticity: Maxwell branches beside the law, or a spectrum of them.

Each branch is a neo-Hookean spring of modulus g_i times the law's initial shear modulus behind a dashpot of relaxation
time tau_i, at finite strain with a multiplicative split of the deformation. At small strain its stress obeys
s_i' + s_i / tau_i = g_i mu e', with e the shear. The law is what remains after a long rest; the stiffness at a sudden
step is 1 + sum g_i times its initial stiffness. The amplitudes are g_i.

With ``decades`` and ``slope`` the first branch is a spectrum: relaxation times from tau1 10^-decades to tau1, whose
modulus per decade is g1 time^slope times the law's, time in s. Tables of dynamic stiffness beside slow loops show five
decades and more, in which rubber relaxes everywhere (Ferry 1980): a few branches leave waves in its moduli there.

With ``exponent`` the first branch relaxes the faster, the more its spring is stretched (`forms.branches.activated`):
tau1 is then its time at a shear of 0.2 in the spring. Such a branch loses a similar force at rates of several decades,
which takes several constant times, and holds still in small vibrations: it is no part of a dynamic stiffness.

References
----------
Bergstroem and Boyce (1998), Constitutive modeling of the large strain time-dependent behavior of elastomers, J. Mech.
Phys. Solids 46:931-954, doi:10.1016/S0022-5096(97)00075-6: a rate that grows with a power of the stress.
Ferry (1980), Viscoelastic Properties of Polymers, 3rd ed., Wiley, chapter 12: spectra of rubbers.
Simo (1987), On a fully three-dimensional finite-strain viscoelastic damage model, Comput. Methods Appl. Mech. Eng.
60:153-173, doi:10.1016/0045-7825(87)90107-1.
Lion (1997), A physically based method to represent the thermo-mechanical behaviour of elastomers, Acta Mech. 123:1-25,
doi:10.1007/BF01178397: the multiplicative branch.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.exported import CardPart
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from forms.law import Scalar
    from forms.potential import Attached

#: Branches that a diagnosis tries at most; a case file gives more for a spectrum over some decades, whose fast branches
#: may be much stiffer than the relaxed rubber: five or six for tests at 1 to 80 degrees C (`benchmarks/payne.md`).
SEARCHED, MOST = 3, 6
# Start value of the first branch in periods of the highest frequency of a table; each further one is a decade slower.
_PERIODS = 0.5
# At the highest frequency of a table a branch with this time is a dashpot alone, to 1 degree.
_DASHPOT = 0.003
# Fractions of the recording's duration: a much slower branch is elastic, a much faster one relaxes within a sample.
_TIMES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)


def _branch(i: int, modulus: float, time: float) -> tuple[EffectParameter, EffectParameter]:
    return (
        Amplitude(
            f"g{i}",
            "1",
            f"modulus of branch {i} over the law's" + (", of a spectrum per decade at 1 s" if i == 1 else ""),
            (modulus, 0.0, 10.0 if i <= SEARCHED else 1000.0),
            optional=i > 1,
            searched=i <= SEARCHED,
            per_time="slope" if i == 1 else "",
            prior=Prior(
                "half_t",
                0.3,
                source="engineering judgement: dynamic over static stiffness of rubber springs is 1.1 to 1.6",
            ),
        ),
        EffectParameter(
            f"tau{i}",
            "s",
            f"relaxation time of branch {i}",
            (time, 1e-7, 1e6),
            optional=i > 1,
            searched=i <= SEARCHED,
            in_tables=(_PERIODS * 10.0 ** (i - 1), _DASHPOT),
            in_curves=1e-3,
            scan=_TIMES,
            scale="duration",
            prior=Prior(
                "log_uniform",
                0.001,
                3.0,
                of="duration",
                source="a branch much slower than the recording is elastic, one much faster is spent within a sample",
            ),
        ),
    )


_SPECTRUM = (
    EffectParameter(
        "decades",
        "1",
        "width of a spectrum in powers of ten",
        (6.0, 0.5, 20.0),
        optional=True,
        searched=False,
        prior=Prior("log_normal", 5.5, 0.35, source="engineering judgement, as for the Payne effect"),
    ),
    EffectParameter(
        "slope",
        "1",
        "power of the time in a spectrum's modulus per decade",
        (0.0, -2.0, 2.0),
        optional=True,
        belongs_to="decades",
        searched=False,
        prior=Prior("t", 0.3, source="engineering judgement, as for the Payne effect"),
    ),
)


_ACTIVATED = EffectParameter(
    "exponent",
    "1",
    "power of the overstress in the rate at which branch 1 relaxes; without it the rate is constant",
    (3.0, 0.05, 10.0),
    optional=True,
    variant=True,
    not_with="decades",
    along_path=True,
    scan=(3.0,),
    prior=Prior(
        "log_normal",
        3.0,
        0.5,
        source="engineering judgement: 3 in chloroprene rubber (Bergstroem and Boyce 1998, "
        "doi:10.1016/S0022-5096(97)00075-6)",
    ),
)


def _series(values: Values) -> list[tuple[Scalar, Scalar]]:
    """Return modulus over the law's and relaxation time (s) of each branch whose parameters have values."""
    from forms.branches.payne import spectrum

    numbers = [i for i in range(1, MOST + 1) if f"g{i}" in values]
    series = [(values[f"g{i}"], values[f"tau{i}"]) for i in numbers]
    if "decades" not in values:
        return series
    moduli, times = spectrum(*series[0], values["decades"], values["slope"])
    return [*zip(moduli, times, strict=True), *series[1:]]


def _branches(values: Values) -> list[Attached]:
    """Return the branches whose parameters have values."""
    from forms.branches import activated
    from forms.branches.maxwell import BRANCH, PACED
    from forms.potential import Attached

    branches = [Attached(BRANCH, {"g": g, "tau": tau}) for g, tau in _series(values)]
    if "exponent" not in values:
        return branches
    first, *others = branches
    clock = {"tau": values["tau1"], "exponent": values["exponent"]}
    # Behind the others, which are one family.
    return [*others, Attached(activated.BRANCH, clock), Attached(PACED, first.parameters)]


def feature() -> Feature:
    """Return the branches."""
    from cases.feature import Feature

    return Feature(branches=_branches)


def card(values: Mapping[str, float]) -> CardPart | None:
    """Return the series of branches; None with a rate that depends on the stress."""
    if "exponent" in values:
        return None
    return CardPart(series=tuple((float(g), float(tau)) for g, tau in _series(values) if float(g) > 0.0))


EFFECT = Effect(
    name="viscoelasticity",
    title="Viscoelasticity",
    summary="Fast motion needs more force, which relaxes in a hold; the loop grows with the rate.",
    acts="rubber",
    parameters=(
        *_branch(1, 0.2, 10.0),
        *_branch(2, 0.1, 1.0),
        *_branch(3, 0.1, 100.0),
        *(
            p
            for i in range(SEARCHED + 1, MOST + 1)
            for p in _branch(i, 0.1, 0.3 * 10.0 ** (i - SEARCHED - 1))
        ),
        *_SPECTRUM,
        _ACTIVATED,
    ),
    how_often="usual",
    families=("dissipation",),
    of_fillers="dissipation",
    fades=True,
    in_force_law="maxwell",
    on_card=card,
    needs="time, and two rates or a hold; several branches need rates or holds as far apart as their times",
    rivals=("drift", "friction", "mullins", "time_lag", "warming"),
    source="Lion (1997), Thermo-mechanical behaviour of elastomers, doi:10.1007/BF01178397",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    needs_time=True,
    feature=feature,
    shown=("axial", {"g1": 0.4, "tau1": 8.0}),
)

"""Misalignment: the inner sleeve is off centre at rest.

The rubber was moulded with the inner sleeve displaced by ``offset`` in the direction of the radial load: the rubber is
thinner on one side, without stress at rest. The radial response then differs between + and -. Amplitude the offset;
positive towards positive radial load.

References
----------
Kadlowec, Wineman and Hulbert (2003), Elastomer bushing response: experiments and finite element modeling, Acta Mech.
163:25-38, doi:10.1007/s00707-003-1018-1.
"""

from bushcli.effect import Effect, EffectParameter

EFFECT = Effect(
    name="misalignment",
    summary="The inner sleeve is off centre at rest: radial loading differs between + and -.",
    acts="assembly",
    parameters=(
        EffectParameter("offset", "mm", "in the direction of the radial load", 0.2, -10.0, 10.0, off=0.0),
    ),
    needs="a radial channel that goes to both sides",
    rivals=("bump_stop", "offset"),
    source="Kadlowec, Wineman and Hulbert (2003), Elastomer bushing response, doi:10.1007/s00707-003-1018-1",
)

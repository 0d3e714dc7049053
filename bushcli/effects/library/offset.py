"""Offset: transducers that do not read zero at rest.

The bushing's displacement is q - displacement and the logged force Q + force, with q the recorded displacement and Q
the force. Both are amplitudes. They do not grow with the excursion as permanent set does.

A rig that was set to zero while a preload acted logs q = 0 where the bushing is at `preload`: the bushing's
displacement is then q + preload, and the logged force Q(q + preload) - Q(preload).

References
----------
ASTM D638-14, Standard test method for tensile properties of plastics, annex A1 (toe compensation),
doi:10.1520/D0638-14.
"""

from bushcli.effects.change import Array, Given, RigChange, Signal
from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior

ZERO = "engineering judgement: sensors are zeroed by hand, to some hundredths of what is then recorded"
AT = ("at_rest", "under_preload")


def drive(q: Signal, parameters: Given) -> Signal:
    """Return the displacement from the true rest position."""
    return q - parameters["displacement"] if "displacement" in parameters else q


def read(force: Signal, time: Array | None, parameters: Given) -> Signal:
    """Add the force that the load cell reads at rest."""
    return force + parameters["force"] if "force" in parameters else force


EFFECT = Effect(
    name="offset",
    title="Zero offset",
    summary="Force and displacement do not read zero at rest.",
    acts="rig",
    parameters=(
        Amplitude(
            "force",
            "N",
            "logged without load",
            (1.0, -1e7, 1e7),
            of_channel=True,
            under=AT[0],
            prior=Prior("t", 0.03, of="force", source=ZERO),
        ),
        Amplitude(
            "displacement",
            "mm",
            "logged at rest",
            (0.01, -100.0, 100.0),
            of_channel=True,
            under=AT[0],
            prior=Prior(
                "t",
                0.03,
                of="travel",
                source=f"{ZERO}; 0.5 times travel where the force is not near zero at a displacement near zero",
                unrested=0.5,
            ),
        ),
        Amplitude(
            "preload",
            "mm",
            "displacement at which both signals were set to zero",
            (0.01, -100.0, 100.0),
            sizes=(-0.3, 0.3),
            scale="amplitude",
            of_channel=True,
            under=AT[1],
            prior=Prior(
                "normal",
                0.5,
                of="travel",
                source="engineering judgement: where a part is clamped under load, zero may be anywhere in the travel",
            ),
        ),
        EffectParameter(
            "zeroed",
            "1",
            "whether the signals were set to zero at rest or under a preload",
            (0.0, 0.0, 1.0),
            of_mesh=True,
            choices=AT,
            prior=Prior("choice", 2.0, source="engineering judgement: neither is unusual"),
        ),
    ),
    how_often="occasional",
    families=("zero error of the rig",),
    needs="curvature that differs between + and -, to separate the offsets; two amplitudes, to exclude permanent set",
    rivals=("drift", "free_play", "misalignment", "permanent_set"),
    source="ASTM D638-14, annex A1 (toe compensation), doi:10.1520/D0638-14",
    rig=RigChange(zero="preload", drive=drive, read=read, order=0),
    shown=("axial", {"force": 100.0, "displacement": -0.3}),
)

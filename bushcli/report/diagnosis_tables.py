"""Tables of a diagnosis, for the terminal and for the report alike."""

from __future__ import annotations

import math

from bushcli.diagnosis.result import Diagnosis, Hypothesis
from bushcli.effect import spoken
from bushcli.report.diagnosis_words import (
    amplitude_text,
    derived_text,
    effect_names,
    shown,
    strength,
)
from bushcli.report.quantity import number, percent, with_std
from bushcli.report.tables import Row, Table


def effect_table(found: Diagnosis) -> Table:
    """What was left out: each effect with its parameters, evidence and plausibility."""
    rows: list[Row] = []
    for effect in found.effects:
        said = f"{number(effect.evidence, 2)} ({strength(effect.evidence)})"
        first = [effect.label, said, "yes" if effect.plausible else "no"]
        for name, quantity in effect.parameters.items():
            door = shown(f"{effect.name}.{name}", quantity, found.channels)
            rows.append(
                (
                    first[0],
                    name,
                    with_std(door.value, door.std),
                    "-" if door.unit == "1" else door.unit,
                    f"{number(door.lower)} to {number(door.upper)}",
                    derived_text(quantity),
                    *first[1:],
                )
            )
            first = ["", "", ""]
    heads = ("effect", "parameter", "value", "unit", "95 % interval", "that is", "evidence", "plausible")
    return Table("Effects (evidence: change of BIC without it)", heads, tuple(rows), left=2)


def parameter_table(found: Diagnosis) -> Table:
    """All parameters of the final model."""
    rows: list[Row] = []
    for name, quantity in found.parameters.items():
        door = shown(name, quantity, found.channels)
        rows.append(
            (
                name,
                quantity.meaning,
                "-" if door.unit == "1" else door.unit,
                number(door.value, 4),
                number(door.std, 2),
                f"{number(door.lower)} to {number(door.upper)}",
                derived_text(quantity),
            )
        )
    heads = ("parameter", "meaning", "unit", "value", "std error", "95 % interval", "that is")
    title = f"Parameters of the final model: {found.material.law}"
    if found.effects:
        title += f" + {' + '.join(effect_names(found))}"
    return Table(title, heads, tuple(rows), left=3)


def misfit_table(found: Diagnosis) -> Table:
    """Misfit of each channel before and after, on the data used and on those held out."""
    any_held = any(channel.held_out.any() for channel in found.channels)
    rows = []
    for one in found.channels:
        row = [one.name, percent(one.before_percent), percent(one.after_percent), percent(one.noise_percent)]
        if any_held:
            row += [one.held_out_text or "-", percent(one.held_out_before), percent(one.held_out_after)]
        rows.append(tuple(row))
    heads: Row = ("channel", "before", "after", "noise")
    if any_held:
        heads = (*heads, "held out", "before", "after")
    title = "Rms misfit, % of the force range"
    return Table(title, heads, tuple(rows))


def hypothesis_table(found: Diagnosis, most: int | None = None) -> Table:
    """All that could be tested, or so many of it."""
    tested = [one for one in found.hypotheses if one.testable]
    rows = [_hypothesis_row(found, one) for one in tested[:most]]
    heads = ("hypothesis", "", "first estimate", "fall of chi2", "z", "p", "BIC", "misfit/noise")
    title = "Hypotheses: score test beside the plain law, then BIC and misfit after the refit"
    return Table(title, heads, tuple(rows), left=3)


def untested_table(found: Diagnosis) -> Table:
    """What could not be tested, and why."""
    rows = [(one.name, one.reason) for one in found.hypotheses if not one.testable]
    return Table("Cannot be tested with these recordings", ("hypothesis", "why"), tuple(rows), left=2)


def _hypothesis_row(found: Diagnosis, one: Hypothesis) -> Row:
    state = "chosen" if one.chosen else "refitted" if one.refitted else ""
    return (
        one.name,
        state,
        amplitude_text(one, found.channels),
        number(one.drop),
        number(one.z, 2),
        probability(one.p),
        f"{one.bic:+.0f}" if math.isfinite(one.bic) else "-",
        number(one.misfit),
    )


def path_table(found: Diagnosis, reasons: bool = False) -> Table:
    """The selection, step by step, with what was done and why if that is wanted; BIC against the first step."""
    first = next((stage.bic for stage in found.path if math.isfinite(stage.bic)), 0.0)
    rows = [
        (
            str(i),
            stage.action,
            " + ".join((stage.law, *map(spoken, stage.effects))),
            *([stage.text] if reasons else []),
            f"{stage.bic - first:+.0f}" if math.isfinite(stage.bic) else "-",
            number(stage.misfit),
            number(stage.held_out),
        )
        for i, stage in enumerate(found.path, start=1)
    ]
    first_heads = ("step", "action", "model", *(["why"] if reasons else []))
    heads = (*first_heads, "BIC", "misfit/noise", "held out/noise")
    return Table("The selection (BIC: against step 1)", heads, tuple(rows), left=len(first_heads))


def probability(p: float) -> str:
    """Show a probability; what is practically none as a limit."""
    if not math.isfinite(p):
        return "-"
    return "< 1e-9" if p < 1e-9 else f"{p:.0e}" if p < 1e-3 else f"{p:.2g}"

"""The type of a writer of another program's file, and the list of writers.

Each file in ``bushcli/export/writers`` defines one writer as ``WRITER``; no registration is needed.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from types import MappingProxyType
from typing import Literal

from bushcli import __version__
from bushcli.effects.effect import effect_in_force_law
from bushcli.errors import InputError, Problem, nearest, printable
from bushcli.export.ascii import identifier, in_ascii
from bushcli.export.curves import BushingData
from bushcli.export.rubber import ExportedRubber
from bushcli.export.units import UnitSystem

Kind = Literal["card", "bushing", "matrix", "force_law", "vibration"]
#: Forms in which a card states viscoelasticity: for marches in time, and for vibrations by a series or by a table.
TIME_PRONY, FREQUENCY_PRONY, FREQUENCY_TABULAR = "time-prony", "frequency-prony", "frequency-tabular"


@dataclass(frozen=True)
class Order:
    """Contents of a file to be written."""

    title: str  # of the case
    where: str  # case file or folder that it comes from
    units: UnitSystem
    rubber: ExportedRubber | None = None  # for material cards
    bushing: BushingData = field(default_factory=BushingData)  # for vehicle models
    form: str = TIME_PRONY  # in which a card states viscoelasticity

    @property
    def name(self) -> str:
        """The title as a name that every program accepts: letters, digits and underscores, a letter first."""
        return identifier(identifier(self.title, "")[:40].strip("_"), "rubber").strip("_")


@dataclass(frozen=True)
class Writer:
    """A program's file."""

    name: str  # as on the command line
    title: str  # of the program and its file
    kind: Kind  # the rubber; of the bushing curves, stiffness matrix, force law with memory, or dynamic stiffness
    ending: str  # usual ending of the file's name
    comment: tuple[str, str]  # beginning and end of a comment line
    #: Returns the file without the comments at the beginning; bytes if it is not text.
    write: Callable[[Order], str | bytes]
    source: str  # documentation of the formulas and the format
    laws: Mapping[str, str] = field(default_factory=dict)  # of a card: law -> the program's name of it
    series: str = ""  # the program's name of a Prony series; empty where it has none
    softening: str = ""  # that of the Ogden-Roxburgh model
    forms: tuple[str, ...] = (TIME_PRONY,)  # in which the card can state viscoelasticity
    series_laws: frozenset[str] | None = None  # laws with which the program combines a series; None = all
    softening_laws: frozenset[str] | None = None
    incompressible: bool = True  # whether the card of an incompressible rubber can be written
    #: Of a vehicle model: it takes one force for each displacement, that after a long rest.
    static: bool = False
    #: Differences between the program and bushcli, in sentences, for the file and the documentation.
    remarks: tuple[str, ...] = ()
    #: Of a card: the same about one of a rubber's `features`, for the file of a rubber that has it.
    remarks_on: Mapping[str, str] = field(default_factory=dict)

    def check_form(self, form: str) -> None:
        """Refuse a form of viscoelasticity that is unknown, or that the program's file does not have.

        Raises
        ------
        InputError
            The message names the nearest form, or the programs that have it.
        """
        cards = [writer for writer in all_writers().values() if writer.kind == "card"]
        writers_of_form = {
            known: [writer.name for writer in cards if known in writer.forms]
            for known in (TIME_PRONY, FREQUENCY_PRONY, FREQUENCY_TABULAR)
        }
        if form not in writers_of_form:
            what = f'"{form}" is not a form of viscoelasticity'
            raise InputError(
                Problem("--viscoelastic", what, nearest(form, writers_of_form), ", ".join(writers_of_form))
            )
        if form != TIME_PRONY and self.name not in writers_of_form[form]:
            what = f"{self.title} has no viscoelasticity in the form {form}"
            expected = f"it is for {', '.join(writers_of_form[form])}"
            raise InputError(Problem("--viscoelastic", what, "", expected))

    def check(self, rubber: ExportedRubber, form: str = TIME_PRONY) -> None:
        """Refuse a rubber that the program cannot express.

        Parameters
        ----------
        rubber : ExportedRubber
        form : str
            Form in which the card is to state viscoelasticity.

        Raises
        ------
        InputError
            With one sentence for each feature that the program cannot express.
        """
        problems: list[Problem] = []

        def refuse(what: str, remedy: str) -> None:
            problems.append(Problem(f"--to {self.name}", what, "", remedy))

        if form != TIME_PRONY and not rubber.series:
            effect_name = effect_in_force_law("maxwell").name
            what = f"a rubber without {effect_name} has no {form} form"
            remedy = f'add [[effects]] name = "{effect_name}", or leave --viscoelastic out'
            if effect_name in rubber.inexpressible:
                what = f"{effect_name} of this case is no series of branches, so that it has no {form} form"
                remedy = "leave exponent out of its parameters, or leave --viscoelastic out"
            refuse(what, remedy)
        if rubber.law not in self.laws:
            remedy = (
                f"identify another one: {', '.join(self.laws)}, with --model of `bushcli fit` or `inverse`"
            )
            refuse(f"{self.title} has no {rubber.law} law", remedy)
        for part, called, only in (
            ("series", self.series, self.series_laws),
            ("softening", self.softening, self.softening_laws),
        ):
            for effect in rubber.effects.get(part, ()):
                remedy = f"choose another program, or use --without {effect} for a card without it"
                if not called:
                    refuse(f"{self.title} has no model for the effect {effect}", remedy)
                elif only is not None and rubber.law not in only:
                    laws = f"the laws {', '.join(sorted(only))} only, not with {rubber.law}"
                    refuse(f"{self.title} takes {called} with {laws}", remedy)
        for name in rubber.inexpressible:
            remedy = f"use --without {name} for a card without it"
            refuse(f"a material card cannot express the effect {name}", remedy)
        if rubber.bulk_modulus == float("inf") and not self.incompressible:
            remedy = "a finite bulk modulus: --set material.bulk_modulus=2000"
            refuse(f"{self.title} cannot express an exactly incompressible rubber", remedy)
        if problems:
            raise InputError(*problems)

    def text(self, order: Order) -> bytes:
        """Return the whole file: comments on its contents and the differences, then the program's data."""
        written = self.write(order)
        if isinstance(written, bytes):
            return written
        begin, end = self.comment
        preamble = [one_line(in_ascii(line)) for line in _preamble(self, order)]
        if end:
            # In XML a comment must not contain two hyphens.
            preamble = [re.sub("-(?=-)", "- ", line) for line in preamble]
        lines = [f"{begin} {line}{end}" for line in preamble] if begin else []
        # XML begins with its declaration, before any comment.
        declaration, content = written.split("\n", 1) if written.startswith("<?xml") else ("", written)
        parts = [declaration] if declaration else []
        return ("\n".join([*parts, *lines, in_ascii(content).rstrip("\n")]) + "\n").encode("ascii")


def one_line(text: str) -> str:
    """Return a text as one line without control characters.

    The title of a case and the path of its file may contain line breaks: what follows one would no longer be part of
    the comment, and the other program would execute it.
    """
    return printable(" ".join(text.split()))


def _preamble(writer: Writer, order: Order) -> list[str]:
    units = order.units
    lines = [
        f"{writer.title}, written by bushcli {__version__}",
        f"from {order.where}: {order.title}",
        f"units: {units.force_name}, {units.length_name}, {units.time_name}"
        + (f"; stress {units.stress_name}, density {units.density_name}" if writer.kind == "card" else ""),
    ]
    rubber = order.rubber if writer.kind == "card" else None
    if rubber is not None:
        values = ", ".join(f"{name} {value:.8g}" for name, value in rubber.parameters.items())
        bulk = "incompressible" if rubber.bulk_modulus == float("inf") else f"{rubber.bulk_modulus:.8g} MPa"
        lines.append(
            f"law of bushcli: {rubber.law} ({values}; MPa), bulk modulus {bulk}, "
            f"initial shear modulus {rubber.shear_modulus:.6g} MPa"
        )
        if rubber.series:
            terms = ", ".join(f"g {g:.6g} tau {tau:.6g} s" for g, tau in rubber.series)
            lines += [
                f"viscoelasticity of bushcli: {terms}, g over the long-term shear modulus",
                "the same at small strain; at finite strain a branch of bushcli is neo-Hookean (docs/exports.md)",
            ]
        if rubber.beside:
            beside = ", ".join(rubber.beside)
            lines.append(f"not in this card, because it is not a property of the rubber: {beside}")
        lines += [remark for feature, remark in writer.remarks_on.items() if feature in rubber.features]
    return lines + list(writer.remarks)


@cache
def all_writers() -> Mapping[str, Writer]:
    """All writers found in ``bushcli/export/writers``, by name, in alphabetical order."""
    package = importlib.import_module("bushcli.export.writers")
    writers = (
        importlib.import_module(f"{package.__name__}.{m.name}").WRITER
        for m in pkgutil.iter_modules(package.__path__)
    )
    by_name = {writer.name: writer for writer in writers}
    return MappingProxyType({name: by_name[name] for name in sorted(by_name)})


def writer_for(name: str) -> Writer:
    """Return the writer called ``name``.

    Raises
    ------
    InputError
        There is no such writer; the message names the nearest.
    """
    if name in all_writers():
        return all_writers()[name]
    what = f'"{name}" is not a known program'
    raise InputError(Problem("--to", what, nearest(name, all_writers()), ", ".join(all_writers())))

"""Guess the tested mode from the name of a file: ``run_03_axial.csv``, ``Zug_23C.xlsx``."""

from __future__ import annotations

import re
from collections.abc import Mapping

from cases.mode import modes

#: Words for the sense of a load, which tests of several modes have.
SENSES = frozenset({"tension", "tensile", "zug", "compression", "druck", "stauch"})


def modes_of_name(name: str, specimen: str) -> tuple[str, ...]:
    """Return the modes that the name of a file may mean: of several, those that share no word with each other.

    A name contains a mode's word if one of its words equals it or, from four letters on, begins with it. "quad_shear"
    has a word of simple shear alone beside one that it shares with planar tests: it is simple shear; "shear" may be
    either.

    Parameters
    ----------
    name : str
        Without the suffix.
    specimen : str
        "bushing" or "coupon": the specimen whose modes are considered.
    """
    return _unambiguous_modes(_mode_words(name, specimen))


def contradicting_modes(name: str, mode: str) -> tuple[str, ...]:
    """Return the modes of which the name of a file speaks, where the given one is not among them.

    Short words, which may be units or directions ("rad", "ax"), and those for tension and compression, which a planar
    or a volumetric test has too, contradict no mode.

    Parameters
    ----------
    name : str
        Without the suffix.
    mode : str
        Name of the mode that the case file gives.
    """
    words = _mode_words(name, modes()[mode].specimen)
    if mode in words:
        return ()
    plain = {
        other: {word for word in each if len(word) > 3 and word not in SENSES}
        for other, each in words.items()
    }
    return _unambiguous_modes({other: mode_words for other, mode_words in plain.items() if mode_words})


def _unambiguous_modes(words: Mapping[str, set[str]]) -> tuple[str, ...]:
    """Return the modes with a word that no other has; all if there is none."""
    others = {mode: set().union(*(words[other] for other in words if other != mode)) for mode in words}
    return tuple(mode for mode in words if words[mode] - others[mode]) or tuple(words)


def _mode_words(name: str, specimen: str) -> dict[str, set[str]]:
    """Return the words of each mode that the name of a file contains."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower().replace("equi-biaxial", "equibiaxial")
    text = re.sub(r"(pure|simple)[\W_]+shear", r"\1shear", text)
    words = [word for word in re.split(r"[\W_\d]+", text) if word]
    words_of_modes = {
        mode.name: {
            prefix
            for prefix in mode.words
            if any(word == prefix or (len(prefix) >= 4 and word.startswith(prefix)) for word in words)
        }
        for mode in modes().values()
        if mode.specimen == specimen
    }
    return {mode: mode_words for mode, mode_words in words_of_modes.items() if mode_words}

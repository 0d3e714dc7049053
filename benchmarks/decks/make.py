"""Make from a manifest the files that a user would have, and a folder with the truth."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.make import COUPON_NOISE, COUPONS
from benchmarks.decks import manifest
from benchmarks.decks.drawing import channels_of
from benchmarks.decks.foreign.external import Failed
from benchmarks.decks.foreign.halfplane import NotSolved
from benchmarks.decks.manifest import Entry
from benchmarks.decks.sensing import compare_digests, digest, logged_signals, read_csv
from bushcli.curve.curve import Curve
from bushcli.effects.rig import NoEquilibrium
from bushcli.recording import write_curve_csv
from cases.march import NotConverged
from cases.stability import nominal_stress
from forms.law import law

Array = NDArray[np.float64]


def forces_of(entry: Entry) -> tuple[list[Array], list[Array]]:
    """Noise-free forces of the channels with the concealed physics and without it."""
    if entry.part == "own":
        from benchmarks.decks import own

        return own.forces(entry)
    if entry.part == "foreign":
        from benchmarks.decks.foreign import forces

        return forces.forces(entry)
    from benchmarks.decks import outside

    return outside.forces(entry)


def make(entry: Entry, folder: Path) -> dict[str, Any]:
    """Make a recording's case and truth, whole or not at all; return the digests."""
    begin = time.perf_counter()
    exact, plain = forces_of(entry)
    case = folder / "cases" / entry.name
    part = case.with_suffix(f".{os.getpid()}")
    part.mkdir(parents=True, exist_ok=True)
    body, digests = entry.specimen, {}
    dimensions = dict(body.dimensions) | dict(entry.said)
    text = [f'title = "bushing {entry.name}"', "", "[geometry]", f'shape = "{body.shape}"']
    text += [f"{key} = {value:g}" for key, value in dimensions.items()]
    text += ["", "[material]", f'law = "{body.law}"', f"bulk_modulus = {body.bulk_modulus:g}"]
    if body.law == "ogden":
        text.append("terms = 2")
    for channel, sensor, force in zip(channels_of(entry), entry.sensors, exact, strict=True):
        t, q, f = logged_signals(sensor, channel.time, channel.displacement, force)
        file = part / f"{channel.name}.csv"
        write_curve_csv(file, Curve(channel.name, q, f, t))
        digests[file.name] = digest(*read_csv(file))
        text += ["", "[[recordings]]", f'mode = "{channel.name}"', f'file = "{file.name}"']
    if entry.coupons:
        rng = np.random.default_rng([*entry.seed, 8])
        for mode, largest in COUPONS.items():
            stretch = np.linspace(1.0, largest, 31)[1:]
            stress = nominal_stress(law(body.law), body.parameters, mode, stretch)
            stress = stress + COUPON_NOISE / 100 * stress.max() * rng.standard_normal(len(stress))
            write_curve_csv(part / f"{mode}.csv", Curve(mode, stretch - 1.0, stress))
            text += ["", "[[coupons]]", f'mode = "{mode}"', f'file = "{mode}.csv"']
    (part / "case.toml").write_text("\n".join(text) + "\n", encoding="utf-8")
    if case.exists():
        shutil.rmtree(case)
    truth = folder / "truth"
    truth.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        truth / f"{entry.name}.npz",
        **{f"exact_{c}": f for c, f in zip(entry.channels, exact, strict=True)},
        **{f"plain_{c}": f for c, f in zip(entry.channels, plain, strict=True)},
    )
    part.rename(case)
    data = asdict(replace(entry, digest=digests)) | {"seconds": round(time.perf_counter() - begin, 1)}
    (truth / f"{entry.name}.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    return digests


def entries_to_make(deck: str, folder: Path, names: Sequence[str] = ()) -> list[Entry]:
    """Recordings of a deck that have not been made yet."""
    entries = manifest.read(deck)
    wanted = names or list(entries)
    return [entries[name] for name in wanted if not (folder / "truth" / f"{name}.json").exists()]


def make_all(deck: str, folder: Path, names: Sequence[str] = ()) -> Iterator[str]:
    """Make the recordings that do not exist yet, never overwriting one; yield a line for each."""
    for entry in entries_to_make(deck, folder, names):
        begin = time.perf_counter()
        if (folder / "truth" / f"{entry.name}.json").exists():
            continue  # made by another process meanwhile
        # Read the manifest again, which may have changed in the meantime.
        entry = manifest.read(deck)[entry.name]
        try:
            digests = make(entry, folder)
        except (NotConverged, NotSolved, Failed, NoEquilibrium) as failure:
            yield f"{entry.name}: {type(failure).__name__}: {failure}"
            continue
        current = manifest.read(deck)[entry.name]
        if not current.digest:
            manifest.put(deck, replace(current, digest=digests))
            how = "made"
        else:
            how = "made, " + compare(current, digests)
        yield f"{entry.name}: {how}, {time.perf_counter() - begin:.0f} s"


def compare(entry: Entry, digests: dict[str, Any]) -> str:
    """Compare a recording's files with the manifest; return the worst result."""
    words = [compare_digests(known, digests[file]) for file, known in entry.digest.items()]
    return max(words, key=("same", "near", "different").index)


def check_all(deck: str, folder: Path) -> Iterator[tuple[str, str]]:
    """Compare the made files with the manifest: name, and "same", "near", "different", "missing" or "no digest"."""
    for name, entry in manifest.read(deck).items():
        case = folder / "cases" / name
        if not case.exists():
            yield name, "missing"
        elif not entry.digest:
            yield name, "no digest"
        else:
            yield name, compare(entry, {file: digest(*read_csv(case / file)) for file in entry.digest})

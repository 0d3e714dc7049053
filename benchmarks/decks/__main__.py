"""Draw, make, check, diagnose and score decks of recordings."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from pathlib import Path

# Several processes share the machine: threads of the linear algebra would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

FOLDER = Path("/root/decks")


def draw(options: argparse.Namespace) -> int:
    """Draw what the manifest lacks; what it has is never drawn again."""
    from benchmarks.decks.deal import deal

    for line in deal(options.deck, options.parts or ()):
        print(line, flush=True)
    return 0


def make(options: argparse.Namespace) -> int:
    """Make the data that are not there."""
    from benchmarks.decks.make import make_all

    for line in make_all(options.deck, options.folder, options.names or ()):
        print(line, flush=True)
    return 0


def check(options: argparse.Namespace) -> int:
    """Compare data with the manifest's digests."""
    from benchmarks.decks.make import check_all

    found = list(check_all(options.deck, options.folder))
    for name, how in found:
        if how != "same":
            print(f"{name}: {how}")
    good = sum(how in ("same", "near") for _, how in found)
    print(f"{good} of {len(found)} as in the manifest")
    return 0 if good == len(found) else 1


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decks", description=__doc__)
    actions = parser.add_subparsers(required=True, metavar="draw|make|check|judge|run|score")
    one = actions.add_parser("draw", help="draw a deck into its manifest (done once)")
    one.add_argument("--parts", nargs="*", choices=["own", "foreign", "nothing"])
    one.set_defaults(act=draw)
    two = actions.add_parser("make", help="make the data of a manifest")
    two.add_argument("--names", nargs="*", help="these recordings only")
    two.set_defaults(act=make)
    three = actions.add_parser("check", help="compare data with the manifest's digests")
    three.set_defaults(act=check)
    for action in (one, two, three):
        action.add_argument("deck", metavar="DECK")
    for action in (two, three):
        action.add_argument("folder", type=Path, metavar="DIR")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    return int(options.act(options))


if __name__ == "__main__":
    sys.exit(main())

"""Draw, make, check, diagnose and score decks of recordings."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from pathlib import Path

from benchmarks.decks.manifest import DECKS

# Several processes share the machine, so that threads of the linear algebra would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")


def draw(options: argparse.Namespace) -> int:
    """Draw the recordings that the manifest lacks; existing ones are never drawn again."""
    from benchmarks.decks.deal import deal

    for line in deal(options.deck, options.parts or ()):
        print(line, flush=True)
    return 0


def make(options: argparse.Namespace) -> int:
    """Make the data that do not exist yet."""
    from benchmarks.decks.make import make_all

    for line in make_all(options.deck, options.folder, options.names or ()):
        print(line, flush=True)
    return 0


def check(options: argparse.Namespace) -> int:
    """Compare data with the manifest's digests."""
    from benchmarks.decks.make import check_all

    results = list(check_all(options.deck, options.folder))
    for name, how in results:
        if how != "same":
            print(f"{name}: {how}")
    good = sum(how in ("same", "near") for _, how in results)
    print(f"{good} of {len(results)} as in the manifest")
    return 0 if good == len(results) else 1


def judge(options: argparse.Namespace) -> int:
    """Find the effects that each recording of a deck cannot distinguish from its own."""
    from benchmarks.decks.judge import judge_all

    for line in judge_all(options.deck, options.folder):
        print(line, flush=True)
    return 0


def run(options: argparse.Namespace) -> int:
    """Diagnose the recordings that are not in the ledger."""
    from benchmarks.decks.run import run_all

    lines = run_all(
        options.deck,
        options.folder,
        options.command.split(),
        options.label,
        workers=options.workers,
        timeout=options.timeout,
        processor=options.processor,
        count=options.count,
        again=options.again,
    )
    for line in lines:
        print(line, flush=True)
    return 0


def score(options: argparse.Namespace) -> int:
    """Compare manifests and ledgers, and write the tables."""
    from benchmarks.decks.report import document
    from benchmarks.decks.summary import summary, with_new_scores

    text = document(options.labels or ["old", "new"], options.decks, options.output)
    print(text)
    if options.output:
        options.output.write_text(text, encoding="utf-8")
    if options.summary:
        page = options.summary.read_text(encoding="utf-8")
        brief = summary(options.labels or ["old", "new"], options.decks)
        options.summary.write_text(with_new_scores(page, brief), encoding="utf-8")
    return 0


def why(options: argparse.Namespace) -> int:
    """Compare right and given answers of the recordings that were not named outright."""
    from benchmarks.decks.why import why as lines

    for line in lines(options.deck, options.folder, options.label, options.names or ()):
        print(line, flush=True)
    return 0


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decks", description=__doc__)
    actions = parser.add_subparsers(required=True, metavar="draw|make|check|judge|run|score|why")
    draw_parser = actions.add_parser("draw", help="draw a deck into its manifest (done once)")
    draw_parser.add_argument("--parts", nargs="*", choices=["own", "foreign", "nothing"])
    draw_parser.set_defaults(act=draw)
    make_parser = actions.add_parser("make", help="make the data of a manifest")
    make_parser.add_argument("--names", nargs="*", help="these recordings only")
    make_parser.set_defaults(act=make)
    check_parser = actions.add_parser("check", help="compare data with the manifest's digests")
    check_parser.set_defaults(act=check)
    judge_parser = actions.add_parser(
        "judge", help="look-alikes of each recording, into the manifest (done once)"
    )
    judge_parser.set_defaults(act=judge)
    run_parser = actions.add_parser("run", help="diagnose, each recording in a process of its own")
    run_parser.add_argument("--command", default="bushcli diagnose --no-maps", help="default: %(default)s")
    run_parser.add_argument(
        "--label", required=True, help="name of the code that is run: its ledger and results"
    )
    run_parser.add_argument(
        "--timeout", type=float, default=600.0, help="seconds per recording (default: %(default)g)"
    )
    run_parser.add_argument(
        "--processor", type=int, default=None, help="seconds of processor time per recording (default: any)"
    )
    run_parser.add_argument("--workers", type=int, default=1)
    run_parser.add_argument("--count", type=int, default=None, help="no more than so many now")
    run_parser.add_argument("--again", action="store_true", help="also those that failed or ran out of time")
    run_parser.set_defaults(act=run)
    score_parser = actions.add_parser("score", help="compare truth and ledgers, write the tables")
    score_parser.add_argument(
        "--label", dest="labels", action="append", help="may be given several times (old, new)"
    )
    score_parser.add_argument("--decks", nargs="*", default=["own", "foreign", "nothing"], choices=DECKS)
    score_parser.add_argument(
        "-o", "--output", type=Path, help="write the page there, and a picture beside it"
    )
    score_parser.add_argument("--summary", type=Path, help="page whose short table of scores is renewed")
    score_parser.set_defaults(act=score)
    why_parser = actions.add_parser("why", help="what the right answer lacks where it was not named outright")
    why_parser.add_argument("--label", required=True, help="ledger whose answers are explained")
    why_parser.add_argument("--names", nargs="*", help="these recordings only")
    why_parser.set_defaults(act=why)
    for action in (draw_parser, make_parser, check_parser, judge_parser, run_parser, why_parser):
        action.add_argument("deck", choices=DECKS)
    for action in (make_parser, check_parser, judge_parser, run_parser, why_parser):
        action.add_argument("folder", type=Path, metavar="DIR")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    return int(options.act(options))


if __name__ == "__main__":
    sys.exit(main())

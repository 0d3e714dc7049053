"""Make, diagnose and score recordings with a concealed effect."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from pathlib import Path

# Two processes share the machine, so that threads of the linear algebra would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")


def make(options: argparse.Namespace) -> int:
    """Make the recordings that do not exist yet, without printing what they conceal."""
    from benchmarks.concealed.batch import make_all

    seeds = range(options.seed, options.seed + options.count)
    for line in make_all(options.folder, seeds, options.workers):
        print(line, flush=True)
    made = [seed for seed in seeds if (options.folder / "truth" / f"{seed:07d}.json").exists()]
    return 0 if len(made) == len(seeds) else 1


def run(options: argparse.Namespace) -> int:
    """Diagnose the recordings that have not been diagnosed yet."""
    from benchmarks.concealed.run import run_all

    # SIGTERM becomes an exception, so that the diagnoses in progress are ended too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    for line in run_all(
        options.folder,
        options.command.split(),
        options.workers,
        options.timeout,
        options.count,
        options.again,
    ):
        print(line, flush=True)
    return 0


def score(options: argparse.Namespace) -> int:
    """Score the results against the truth."""
    from benchmarks.concealed.report import document
    from benchmarks.concealed.score import read, undiagnosed_truths

    items = read(options.folder)
    if not items:
        print(f"{options.folder}: no recordings", file=sys.stderr)
        return 1
    text = document(items, undiagnosed_truths(options.folder))
    if options.about:
        text = f"{text}\n{options.about.read_text(encoding='utf-8')}"
    print(text)
    if options.output:
        options.output.write_text(text, encoding="utf-8")
    return 0


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.concealed", description=__doc__)
    actions = parser.add_subparsers(required=True, metavar="make|run|score")
    make_parser = actions.add_parser("make", help="make recordings")
    make_parser.add_argument("--count", type=int, default=100)
    make_parser.add_argument("--seed", type=int, default=1000, help="the first; others follow one by one")
    make_parser.add_argument("--workers", type=int, default=2)
    make_parser.set_defaults(act=make)
    make_parser.add_argument("folder", type=Path, metavar="DIR")
    run_parser = actions.add_parser("run", help="diagnose them, each in a process of its own")
    run_parser.add_argument("--command", default="bushcli diagnose --no-maps", help="default: %(default)s")
    run_parser.add_argument("--workers", type=int, default=2)
    run_parser.add_argument(
        "--timeout", type=float, default=1800.0, help="seconds per recording (default: %(default)g)"
    )
    run_parser.add_argument("--count", type=int, default=None, help="no more than so many now")
    run_parser.add_argument("--again", action="store_true", help="also those that failed or ran out of time")
    run_parser.add_argument("folder", type=Path, metavar="DIR")
    run_parser.set_defaults(act=run)
    score_parser = actions.add_parser("score", help="compare truth and results, write the tables")
    score_parser.add_argument("folder", type=Path, metavar="DIR")
    score_parser.add_argument("-o", "--output", type=Path, help="write the page there, too")
    score_parser.add_argument(
        "--about", type=Path, help="Markdown to end the page with: what else is known of the run"
    )
    score_parser.set_defaults(act=score)
    options = parser.parse_args()
    return int(options.act(options))


if __name__ == "__main__":
    sys.exit(main())

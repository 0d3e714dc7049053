"""The `dynamic` command, which computes dynamic stiffness."""

from __future__ import annotations

import click

from bushcli.cli.identification import fit_to_coupons, weighted
from bushcli.cli.progress import march_progress
from bushcli.cli.run import DONE, NOT_CONVERGED, Run, on_a_case


@click.command()
@weighted
@on_a_case
def dynamic(run: Run, weighting: str) -> int:
    """Compute dynamic stiffness and loss angle of CASE over frequency, about each preload.

    The load cases are those with a table [load_cases.dynamic]. A law without parameters is fitted to the coupon tests
    first. The rubber has relaxed under the preload. The vibration is small, or has the amplitudes that the case gives.
    """
    from bushcli.recording.dynamic.read import read_dynamic
    from bushcli.report.results import DynamicResult
    from bushcli.simulate.dynamic import DynamicInterrupted, vibrate
    from bushcli.simulate.extent import of_table, tested_temperatures

    case = run.load()
    tested = [
        *tested_temperatures(case),
        *(of_table(read_dynamic(source, run.tables)) for source in case.dynamic),
    ]
    fit = fit_to_coupons(run, case, None, weighting) if case.needs_fit else None
    interrupted = False
    with run.timer("solve"), march_progress(run) as progress:
        try:
            response = vibrate(case, fit.material if fit else None, progress=progress, tested=tested)
        except DynamicInterrupted as ended:
            response, interrupted = ended.response, True
    run.deliver(DynamicResult(response, fit))
    if interrupted:
        raise KeyboardInterrupt
    return DONE if response.complete else NOT_CONVERGED

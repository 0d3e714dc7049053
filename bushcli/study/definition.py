"""What identifies a study, so that `--resume` does not mix its rows with those of another one."""

from __future__ import annotations

import hashlib
from typing import Any

from bushcli.case import Case, resolved
from bushcli.runtime.store import code_revision
from bushcli.study.plan import Plan
from bushcli.study.task import StudyTask


def definition(task: StudyTask, plan: Plan, case: Case) -> dict[str, Any]:
    """Return what identifies a study, JSON-ready: rows of a study with another definition are not used.

    Parameters
    ----------
    task : StudyTask
    plan : Plan
    case : Case
        The case without the varied keys' values.
    """
    # Of a list `vary` has the name of the file only.
    listed = {"list": hashlib.sha256(repr(plan.rows).encode()).hexdigest()} if plan.lines else {}
    return listed | {
        "case": resolved(case),
        "set": list(task.overrides),
        "vary": {one.key: one.spec for one in plan.variables},
        "sampling": plan.sampling,
        "designs": len(plan.rows),
        "seed": plan.seed,
        "answers": {one.name: [one.channel, one.kind, one.travel] for one in task.answers},
        "curves": task.curves,
        "hardness": task.hardness,
        "data": case.data_digest(),
        "program": code_revision(),
        "material": None if task.material is None else dict(task.material.parameters),
    }

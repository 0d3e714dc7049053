"""The benchmark that replaces constants of the calculation, in the source, while a module is imported."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.constants import CONSTANTS, ROOT, Constant, replace


def source(one: Constant) -> Path:
    return ROOT / "bushcli" / (one.module.replace(".", "/") + ".py")


@pytest.mark.parametrize("one", CONSTANTS, ids=lambda one: one.name)
def test_every_constant_is_assigned_once(one: Constant):
    for value in one.tried:
        tree = ast.parse(source(one).read_text("utf-8"))
        before = ast.dump(tree)
        replace(tree, one.name, value)
        assert ast.dump(tree) != before


def test_one_of_several_names_is_replaced():
    tree = ast.parse("A, B = 1, 2\nC: int = 3\n")
    replace(tree, "B", "20")
    replace(tree, "C", "30")
    assert ast.unparse(tree) == "A, B = (1, 20)\nC: int = 30"


@pytest.mark.parametrize("text", ["A = 1\n", "B = 1\nB = 2\n"])
def test_a_name_that_is_not_assigned_once_is_refused(text):
    with pytest.raises(ValueError, match="B is assigned"):
        replace(ast.parse(text), "B", "3")


def test_modules_are_imported_with_the_other_value():
    """What a module computes from the constant when it is imported follows; its other constants stay."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]);"
        "from benchmarks.constants import Finder;"
        "sys.meta_path.insert(0, Finder('bushcli.evidence.prior', 'USUAL', '0.25'));"
        "from bushcli.evidence.prior import effect_odds, OCCASIONAL;"
        "print(effect_odds('mullins'), OCCASIONAL)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(ROOT)], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["0.25", "0.01"]

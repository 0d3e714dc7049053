"""Read a case file, apply overrides, and report every error in it."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

from bushcli.case.build import Builder
from bushcli.case.case import Case, case_json
from bushcli.case.finding import Finding, Keys
from bushcli.case.identified import IDENTIFIED
from bushcli.case.limits import (
    DEEPEST,
    LARGEST_CASE,
    LARGEST_RESULT,
    MOST_PROBLEMS,
    is_too_deep,
    too_deep_line,
)
from bushcli.case.override import Override, apply
from bushcli.case.rebuild import found_case
from bushcli.case.tolerance import nominal_tables
from bushcli.errors import CaseError, Problem, nearest
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.decode import text_of
from bushcli.runtime.bounded import TooLarge, read_bounded
from bushcli.runtime.condition import Condition
from geometry.shape import shapes

#: The numbers of a result, in its folder.
RESULT = "result.json"


def load_case(path: str | Path, overrides: Sequence[str] = (), tables: TableCache | None = None) -> Case:
    """Read a case file, or the case of a results folder.

    Parameters
    ----------
    path : path
        The case file, or a folder that a command wrote: its identified case, else the case that its result is of.
    overrides : sequence of str
        ``KEY=VALUE`` with dotted keys as in the case file; values as in TOML.
    tables : TableCache, optional
        Cache of the binary files that the caller reads.

    Raises
    ------
    CaseError
        It lists everything that is wrong, with file or override, key, and what was expected.
    """
    path = _case_file(Path(path))
    data, applied = apply(_read(path), overrides)
    if is_too_deep(data):
        raise CaseError(
            Problem(str(path), f"has tables nested more than {DEEPEST} deep", "", "see docs/case-file.md")
        )
    written, (data, deviating) = deepcopy(data), nominal_tables(data)
    return replace(_build(data, applied, path, tables), toleranced=deviating, tables=written)


def _build(
    data: dict[str, Any], applied: list[Override], path: Path, tables: TableCache | None = None
) -> Case:
    builder = Builder(path.parent, tables)
    case = builder.case(data, path)
    if case is None:
        raise CaseError(*_problems(builder.findings, path, applied))
    return case


def shape_of_part(path: Path) -> str | None:
    """Return the name of the shape that files of this kind describe; None for a case file."""
    suffix = path.suffix.lower()
    return next((name for name, shape in shapes().items() if suffix in shape.suffixes), None)


def load_part(path: Path, overrides: Sequence[str] = ()) -> Case:
    """Make a case from a CAD file or a drawing alone, with a placeholder for the rubber.

    Parameters
    ----------
    path : Path
        STEP, BREP, DXF, MSH or INP file.
    overrides : sequence of str
        ``KEY=VALUE`` with dotted keys as in a case file.

    Raises
    ------
    CaseError
    """
    data: dict[str, Any] = {
        "title": path.stem,
        "geometry": {"shape": shape_of_part(path), "file": path.name},
        "material": {"law": "neo_hookean", "parameters": {"C10": 0.5}},
    }
    return _build(*apply(data, overrides), path)


def _case_file(path: Path) -> Path:
    """Return the case file that a results folder means; any other path as it is."""
    folder = path.parent if path.name == RESULT else path
    if not (folder / RESULT).is_file():
        return path
    if (folder / IDENTIFIED).is_file():
        return folder / IDENTIFIED
    try:
        document = json.loads(read_bounded(folder / RESULT, LARGEST_RESULT))["case"]
        file = found_case(Path(document["path"]), folder)
        now = json.loads(json.dumps(case_json(load_case(file))))
    except (OSError, ValueError, KeyError, TypeError, TooLarge):
        what, expected = (
            "is a folder whose result names no case",
            "a case file, or a folder of `bushcli inverse`",
        )
        raise CaseError(Problem(str(path), what, "", expected)) from None
    differing = [key for key in now if key != "path" and now[key] != document.get(key)]
    if differing:
        what = f"holds a result of another state of {file} ({', '.join(differing)} differ)"
        raise CaseError(Problem(str(path), what, expected=f"give {file}, with --set as in that run"))
    return file


def _read(path: Path) -> dict[str, Any]:
    text = ""
    if path.is_file() and path.suffix.lower() != ".toml" and shape_of_part(path) is not None:
        what = "is a part, and this command needs a case file"
        expected = f"bushcli mesh {path} -o DIR writes DIR/case.toml to start from"
        raise CaseError(Problem(str(path), what, "", expected))
    try:
        content = read_bounded(path, LARGEST_CASE)
        text = text_of(content)
        if "\0" in text or (content and not text):
            raise CaseError(Problem(str(path), "is not a text file", expected=_readable_files()))
        deep = too_deep_line(text)
        if deep is not None:
            what = f"has a key of more than {DEEPEST + 1} parts"
            raise CaseError(Problem(f"{path}:{deep}", what, "", "see docs/case-file.md"))
        return tomllib.loads(text)
    except FileNotFoundError:
        file_names = [p.name for p in path.parent.glob("*.toml")] if path.parent.is_dir() else []
        slashed = str(path).replace("\\", "/")
        like = slashed if Path(slashed).is_file() else nearest(path.name, file_names)
        expected = ", ".join(sorted(file_names))
        raise CaseError(Problem(str(path), "no such case file", like, expected)) from None
    except IsADirectoryError:
        inside = sorted(p.name for p in path.glob("*.toml"))
        expected = f"a case file, such as {path / inside[0]}" if inside else "a case file in TOML"
        raise CaseError(Problem(str(path), "is a directory", expected=expected)) from None
    except OSError as error:
        raise CaseError(Problem(str(path), f"cannot be read: {error.strerror or error}")) from None
    except tomllib.TOMLDecodeError as error:
        # A table's head or a key somewhere: a case file with a mistake, rather than another format.
        like_toml = re.search(r"^\s*(\[+[\w.]+\]+|\w+\s*=)", text, re.MULTILINE)
        if path.suffix.lower() != ".toml" and not like_toml:
            raise CaseError(Problem(str(path), "is not a case file", "", _readable_files())) from None
        raise CaseError(_syntax(path, text, str(error))) from None
    except TooLarge as error:
        raise CaseError(Problem(str(path), str(error), expected="a case file in TOML")) from None
    except (ValueError, RecursionError) as error:
        # The name of the file has a null byte, or the reader of TOML gives up.
        digits = re.search(r"value has (\d+) digits", str(error))
        what = f"has a number of {digits[1]} digits" if digits else f"is not valid TOML: {error}"
        if isinstance(error, RecursionError):
            what = "has too many brackets inside each other"
        what = what if text else f"cannot be read: {error}"
        raise CaseError(Problem(str(path), what)) from None


def _readable_files() -> str:
    """Return what a command reads in place of a file of another format."""
    parts = [suffix for shape in shapes().values() for suffix in shape.suffixes]
    return f"a case file in TOML; bushcli mesh also reads {', '.join(parts)} files"


def _syntax(path: Path, text: str, message: str) -> Problem:
    """Return a TOML error with ``file:line:column`` and the line that it is in."""
    words, _, place = message.rpartition(" (at ")
    match = re.match(r"line (\d+), column (\d+)", place)
    lines = text.rstrip().split("\n")
    # "at end of document" gives no place.
    line, column = (int(match[1]), int(match[2])) if match else (len(lines), len(lines[-1]) + 1)
    context = lines[line - 1].strip() if line <= len(lines) else ""
    where = f"{path}:{line}:{column}"
    what = f"is not valid TOML: {words or message}"
    # The line as TOML has it where only its signs are wrong, or a number has the unit of all case files.
    ascii_text = context.translate(_PLAIN)
    pointed = _COMMA.sub(r"\1\3.\2\4", ascii_text)
    without_unit = _COMMA.sub(r"\1\3.\2\4", _WITH_UNIT.sub(r"\1", ascii_text))
    for better in (ascii_text, pointed, without_unit, pointed.replace("\\", "/")):
        with suppress(tomllib.TOMLDecodeError):
            if tomllib.loads(better) and better != context:
                return Problem(where, what, expected=f"in: {context[:80]}; write {better[:80]}")
    return Problem(where, what, expected=f"in: {context[:80]}" if context else "")


#: What word processors and spreadsheets make of signs, and what TOML has in their place.
_PLAIN = {ord(sign): plain for signs, plain in (
    ("\u201c\u201d\u201e\u201f\u00ab\u00bb\u2033", '"'), ("\u2018\u2019\u201a\u2032", "'"), ("\u2212\u2013", "-"),
    ("\u00a0\u202f\u2009", " "), ("\ufeff\u200b", ""),
) for sign in signs}  # fmt: skip
#: A number with a decimal comma, at the end of a line or in an inline table, and a number with a unit in which case
#: files give such numbers.
_COMMA = re.compile(r"(?<=[=\[\s])([-+]?\d+),(\d+)(?=\s*(?:#.*)?$)|(=\s*[-+]?\d+),(\d+)(?=\s*[,}])")
_WITH_UNIT = re.compile(r"(=\s*[-+]?\d+(?:[.,]\d+)?)\s*(?:mm|MPa|N|s|deg|\u00b0)(?=\s*(?:#.*)?$)")


def _problems(findings: Sequence[Finding], path: Path, overrides: Sequence[Override]) -> list[Problem]:
    """Return the findings as problems, one per key, each with the file or the override that it comes from."""
    # A radius that is missing because its diameter is given is said once.
    seen: set[Keys] = {
        (*finding.keys[:-1], str(finding.keys[-1]).replace("diameter", "radius"))
        for finding in findings
        if finding.keys and "half the diameter" in finding.expected
    }
    problems = []
    for finding in findings:
        if finding.keys in seen:
            continue
        seen.add(finding.keys)
        owner = next((o for o in reversed(overrides) if o.owns(finding.keys)), None)
        where = owner.where if owner else str(path)
        problems.append(Problem(where, finding.what, finding.nearest, finding.expected))
        if len(problems) == MOST_PROBLEMS:
            remaining = len({finding.keys for finding in findings}) - len(seen)
            problems += [Problem(str(path), f"has {remaining} more problems")] if remaining else []
            break
    changed = next((o for o in overrides if o.keys == ("material", "law")), None)
    if any(o.keys[:2] == ("material", "parameters") for o in overrides):
        changed = None  # the user has given other parameters
    leftover = any(f.keys[:2] == ("material", "parameters") and len(f.keys) == 3 for f in findings)
    if changed and leftover:
        what = "changes the law, but material.parameters are those of another law"
        problems.append(Problem(changed.where, what, expected="also give --set material.parameters={...}"))
    return problems


_MARK = re.compile(r"#\s*<--")


def unedited_lines(path: Path) -> tuple[Condition, ...]:
    """Return a condition if a case file still has lines that its user was asked to complete."""
    if path.suffix != ".toml" or not path.is_file():
        return ()
    text = text_of(path.read_bytes())
    lines = [i for i, line in enumerate(text.splitlines(), start=1) if _MARK.search(line)]
    if not lines:
        return ()
    places = f"{'line' if len(lines) == 1 else 'lines'} {', '.join(map(str, lines))}"
    what = f"{path.name}: `bushcli init` marked {places} with <--: it cannot know these values"
    remedy = "compare these lines with your bushing and files, and delete the marks"
    return (Condition("unedited_case", what, remedy),)

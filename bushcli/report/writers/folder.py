"""The folder of results: which files in it belong to bushcli, where a result goes, and writing files into it.

`result.json` lists the files that bushcli wrote; no other file is replaced, moved or removed, and no symbolic link is
followed. Every file is written in the folder `STAGING` and then renamed, so that nobody reads an incomplete file. The
numbers are on disk before anything is drawn.

One folder may be given to many runs. The result of the same question (command, case, data, options, program) is
replaced by the new one. Any other result is kept in a folder of its own, `earlier-COMMAND`, and the unfinished result
of an interrupted run never replaces a finished one: it goes to `unfinished-COMMAND`. What a run writes while it
calculates goes to `STAGING`, so that until it ends nothing in the folder changes.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any

from bushcli.errors import InputError, Problem
from bushcli.runtime.bounded import read_bounded
from bushcli.runtime.interrupt import let_go

RESULT = "result.json"
#: Key of `result.json` with the names of all files that bushcli wrote into the folder.
FILES = "files"
#: Key of `result.json` with the digest of the question that it answers.
QUESTION = "question"
#: Folder of the files that a run writes while it calculates, inside the folder of results.
STAGING = ".bushcli-run"
#: Bytes of a result.json; larger ones are not bushcli's.
_LARGEST = 200_000_000
#: Names of the files that a run writes without a result: a later run may replace them.
CLAIMED = ".bushcli-files"
#: Bytes of that list; a longer one is not bushcli's.
_LARGEST_CLAIM = 10_000_000
_FOLDER = "a folder for the results"

Content = str | bytes | Callable[[Path], None] | Mapping[str, Any]
"""What is in a file, a function that writes one at a path, or the result, which becomes JSON."""


class NotDrawn(Exception):
    """A result is written, but its pictures and page are not; the cause is the exception's.

    Parameters
    ----------
    place : Path
        The folder that holds the result.
    cause : BaseException
        An interruption, too.
    """

    def __init__(self, place: Path, cause: BaseException) -> None:
        self.place, self.cause = place, cause
        super().__init__(str(place), cause)


def check_folder(directory: Path) -> None:
    """Refuse a folder that is a file or lies below one, or that cannot be created or written to."""
    import tempfile  # here, because it adds 8 ms to a start-up

    try:
        for existing in (directory, *directory.absolute().parents):
            # `Path.exists` also denies a name that is too long, from Python 3.14 on.
            with suppress(FileNotFoundError, NotADirectoryError):
                existing.stat()
                break
        if existing.is_dir():
            # Tested with a temporary file: permissions alone do not reveal a full disk or /proc.
            with tempfile.TemporaryFile(dir=existing) as probe:
                probe.write(b"x")
            return
    except OSError as error:
        # The error names the temporary file.
        what = f"cannot be written: no file can be created in {existing} ({error.strerror or error})"
        raise InputError(Problem(str(directory), what, "", "give another -o")) from None
    raise InputError(Problem(str(existing), "is a file", "", _FOLDER))


# -- whose files they are ----------------------------------------------------------------------------------------------


def refuse_others(directory: Path, names: Iterable[str], inputs: Collection[Path]) -> None:
    """Refuse to replace inputs of the case, links, folders, write-protected files, or files that no run wrote."""
    if findings := _not_replaced(directory, names, inputs):
        raise InputError(*findings.values())


def _not_replaced(directory: Path, names: Iterable[str], inputs: Collection[Path]) -> dict[str, Problem]:
    """Return the names of files that must not be replaced, with the reason."""
    existing = [name for name in names if name != CLAIMED and os.path.lexists(directory / name)]
    if not existing:
        return {}
    input_paths = {path.resolve() for path in inputs}
    owned_names = own_files(directory)
    problems = {}
    for name in existing:
        path, what = directory / name, ""
        if path.is_symlink():
            what = "is a symbolic link, which is not followed"
        elif path.resolve() in input_paths:
            what = "is an input of the case, and a result would replace it"
        elif path.is_dir():
            what = "is a folder, where a file of the result belongs"
        elif _is_protected(path):
            what = "is write-protected"
        elif owned_names is None or name not in owned_names:
            why = f"the folder has no {RESULT} in which bushcli lists its files"
            why = why if owned_names is None else f"{RESULT} does not list it"
            what = f"exists already and was not written by an earlier run ({why})"
        if what:
            problems[name] = Problem(str(path), what, "", "give another -o")
    return problems


def own_files(directory: Path) -> frozenset[str] | None:
    """Return the files that bushcli wrote into a folder; None if it wrote none."""
    result, names = earlier_result(directory), claimed_files(directory)
    if result is None:
        return names or None
    return names | {name for name in result[FILES] if Path(name).name == name} | {RESULT}


def _read_json(file: Path, most: int) -> Any:
    """Return what a file of at most this many bytes holds; None for a link, and for what cannot be read."""
    try:
        return None if file.is_symlink() else json.loads(read_bounded(file, most))
    except (OSError, ValueError, RecursionError):
        return None


def earlier_result(directory: Path) -> dict[str, Any] | None:
    """Return the result that a run has written into a folder; None without one that lists its files."""
    result = _read_json(directory / RESULT, _LARGEST)
    if not isinstance(result, dict) or not {"command", "versions"} <= result.keys():
        return None
    listed = result.get(FILES)
    return result if isinstance(listed, list) and all(isinstance(name, str) for name in listed) else None


def claimed_files(directory: Path) -> frozenset[str]:
    """Return the files in a folder that a run has noted because it has no result that could list them."""
    names = _read_json(directory / CLAIMED, _LARGEST_CLAIM)
    return frozenset(map(str, names)) if isinstance(names, list) else frozenset()


def _is_protected(path: Path) -> bool:
    """Whether nobody may write a file; its owner could still replace it, but has said that nobody should."""
    return not path.stat().st_mode & 0o222


# -- one run at a time -----------------------------------------------------------------------------------------------


def occupy(directory: Path) -> Callable[[], None]:
    """Lock a folder of results, creating it if necessary, and return the function that gives it back.

    The operating system releases the lock when the process ends, in whatever way. File systems without locks, as some
    in a network, are used without one.

    Raises
    ------
    InputError
        Another run writes into the folder.
    """
    is_new = not directory.exists()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        handle = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return lambda: None  # writing will fail and say why
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        what = "is in use: another run of bushcli writes into this folder"
        raise InputError(
            Problem(str(directory), what, "", "wait until it has ended, or give another -o")
        ) from None
    except OSError:
        pass

    def leave() -> None:
        if is_new:
            with suppress(OSError):  # it is not empty: a result is in it
                directory.rmdir()
        os.close(handle)

    return leave


# -- where a result goes -----------------------------------------------------------------------------------------------


def is_finished(result: Mapping[str, Any]) -> bool:
    """Whether a run has ended by itself, and not by an interruption."""
    problems = [problem for problem in result.get("problems") or () if isinstance(problem, Mapping)]
    return not any(problem.get("name") == "interrupted" for problem in problems)


def moves_to(directory: Path, command: str, question: str) -> tuple[str, Path] | None:
    """Return the command whose result a folder holds, and where that result goes when another one is finished.

    Parameters
    ----------
    directory : Path
    command, question : str
        Of the new result.

    Returns
    -------
    tuple of str and Path, or None
        None if there is no result, or one of the same question, which the new one replaces.
    """
    earlier = earlier_result(directory)
    if earlier is None or (earlier["command"], earlier.get(QUESTION, "")) == (command, question):
        return None
    before = "".join(letter for letter in str(earlier["command"]) if letter.isalnum())

    def is_same(other: Mapping[str, Any]) -> bool:
        return is_finished(other) and other.get(QUESTION, "") == earlier.get(QUESTION)

    # A result that was moved before and calculated again is there already.
    return before, _free_place(directory / f"earlier-{before}", is_same)


def place_of(directory: Path, result: Mapping[str, Any]) -> Path:
    """Return the folder for a result: one inside the given one for an unfinished result beside a finished one."""
    earlier = earlier_result(directory)
    if earlier is None or is_finished(result) or not is_finished(earlier):
        return directory
    return _free_place(directory / f"unfinished-{result['command']}", lambda other: not is_finished(other))


def _free_place(path: Path, may_go: Callable[[Mapping[str, Any]], bool]) -> Path:
    """Return the first of a path, and the path with -2, -3, ... behind it, that is free or has a result that may go."""
    places = (path if n == 1 else path.with_name(f"{path.name}-{n}") for n in count(1))
    return next(
        place
        for place in places
        if not os.path.lexists(place)
        or (not place.is_symlink() and (result := earlier_result(place)) is not None and may_go(result))
    )


@contextmanager
def staging_folder(directory: Path) -> Iterator[Path]:
    """Make the folder for what a run writes while it calculates, and remove it with all that is left in it.

    Raises
    ------
    InputError
        Something that is no folder of bushcli has its name.
    """
    folder = directory / STAGING
    if folder.is_symlink() or (os.path.lexists(folder) and not folder.is_dir()):
        raise InputError(
            Problem(str(folder), "is not a folder of bushcli", "", "remove it, or give another -o")
        )
    try:
        shutil.rmtree(folder, ignore_errors=True)  # of a run that was killed
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritable(directory, error) from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


# -- writing -----------------------------------------------------------------------------------------------------------


def write_files(
    directory: Path,
    files: Mapping[str, Content],
    inputs: Collection[Path],
    beside: Iterable[str] = (),
    drawn: Callable[[], Mapping[str, Content]] | None = None,
) -> tuple[Path, ...]:
    """Write files into a folder, which is created if necessary; first the numbers, then what is drawn."""
    if directory.exists() and not directory.is_dir():
        raise InputError(Problem(str(directory), "is a file", "", _FOLDER))
    content = files.get(RESULT)
    result = content if isinstance(content, Mapping) else None
    place = directory if result is None else place_of(directory, result)
    parts = directory / STAGING
    staged = {name: parts / name for name in beside if (parts / name).is_file()}
    refuse_others(place, (*files, *staged), inputs)
    try:
        parts.mkdir(parents=True, exist_ok=True)
        place.mkdir(exist_ok=True)
        remaining, obsolete = _set_aside(place, result, parts)
        listed = {*remaining, *obsolete, *files, *staged}
        listed |= {name for name in beside if (place / name).is_file()}
        _write_all(place, files, listed, parts)
        for name, file in staged.items():
            file.replace(place / name)
        for name in obsolete - {*files, *staged}:
            (place / name).unlink(missing_ok=True)
        if result is not None:
            # `result.json` lists them now.
            (place / CLAIMED).unlink(missing_ok=True)
        written = tuple(place / name for name in (*files, *staged))
        return written if drawn is None else (*written, *_draw(place, files, inputs, listed, drawn, parts))
    except OSError as error:
        raise _unwritable(place, error) from None
    finally:
        with suppress(OSError):  # the run has files of its own in it
            parts.rmdir()


def _draw(
    place: Path,
    files: Mapping[str, Content],
    inputs: Collection[Path],
    listed: set[str],
    drawn: Callable[[], Mapping[str, Content]],
    parts: Path,
) -> tuple[Path, ...]:
    """Draw and write pictures and page beside the result, which lists them from now on."""
    index = {RESULT: files[RESULT]}
    try:
        let_go()
        pictures = drawn()
        refused = _not_replaced(place, pictures, inputs)
        allowed = {name: content for name, content in pictures.items() if name not in refused}
        # Listed before they are there, so that a run that is killed leaves none that nobody knows.
        listed |= allowed.keys()
        _write_all(place, index | allowed, listed, parts)
        if refused:
            raise InputError(*refused.values())
    except BaseException as error:
        with suppress(OSError):
            _write_all(place, index, {name for name in listed if os.path.lexists(place / name)}, parts)
        raise NotDrawn(place, error) from error
    return tuple(place / name for name in allowed)


def _set_aside(
    place: Path, result: Mapping[str, Any] | None, parts: Path
) -> tuple[frozenset[str], frozenset[str]]:
    """Copy the result of another question to a folder of its own; it is complete there before it changes here."""
    if result is None:
        return frozenset(), frozenset()
    before = earlier_result(place)
    owned_names = frozenset(
        name
        for name in own_files(place) or ()
        if (place / name).is_file() and not (place / name).is_symlink() and not _is_protected(place / name)
    )
    aside = moves_to(place, str(result.get("command", "")), str(result.get(QUESTION, "")))
    if before is None or aside is None:
        # The pictures of the same question stay until they are drawn again, unless they are those of a part of it.
        stays = before is None or is_finished(before)
        return (owned_names, frozenset()) if stays else (frozenset(), owned_names)
    if aside[1].exists():
        return frozenset(), owned_names
    copy = parts / "earlier"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir()
    try:
        for name in owned_names:
            try:
                os.link(place / name, copy / name)
            except OSError:  # a file system without hard links
                shutil.copy2(place / name, copy / name)
        copy.rename(aside[1])
    finally:
        shutil.rmtree(copy, ignore_errors=True)
    return frozenset(), owned_names


def _write_all(place: Path, files: Mapping[str, Content], listed: Collection[str], parts: Path) -> None:
    for name, content in files.items():
        part = parts / f"{name}.part"
        part.unlink(missing_ok=True)
        # Created exclusively, in case somebody has placed a link of this name.
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_NOFOLLOW, 0o666))
        try:
            if isinstance(content, Mapping):
                content = json.dumps({**content, FILES: sorted(listed)}, indent=2, allow_nan=False) + "\n"
            if callable(content):
                content(part)
            else:
                part.write_bytes(content.encode() if isinstance(content, str) else content)
            part.replace(place / name)
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def _unwritable(directory: Path, error: OSError) -> InputError:
    what, remedy = f"cannot be written: {error.strerror or error}", "free some space, or give another -o"
    return InputError(Problem(str(error.filename or directory), what, "", remedy))

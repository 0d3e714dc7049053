"""Print what this environment still needs of the lock file, with hashes: locked.py REQUIREMENT...

The requirements are bushcli's ("bushcli", "bushcli[dev]"), read from pyproject.toml, or any other names. A package that
the environment sees and that satisfies its requirement stays as it is: most come with the distribution's DOLFINx. A
missing package is taken from the lock file in the version given there, with all that it needs in turn. Nothing is
printed when nothing is missing.
"""

import importlib.metadata
import re
import sys
import tomllib
from pathlib import Path

from pip._vendor.packaging.markers import Marker
from pip._vendor.packaging.requirements import Requirement
from pip._vendor.packaging.utils import canonicalize_name

HERE = Path(__file__).resolve().parent


class Entry:
    """A package of the lock file: its text for pip, its version, and who needs it."""

    def __init__(self, text: str) -> None:
        head = re.match(r"([^\s=]+)==(\S+?)(?: ; (.*?))? \\\n", text)
        assert head is not None, text
        self.name, self.version, marker = canonicalize_name(head[1]), head[2], head[3]
        self.counts = marker is None or Marker(marker).evaluate()
        self.text = "".join(
            line for line in text.splitlines(keepends=True) if not line.lstrip().startswith("#")
        )
        self.needed_by = {canonicalize_name(name) for name in re.findall(r"#\s+(?:via )?([\w.-]+)", text)}


def lock() -> dict[str, Entry]:
    """Return the entries that apply to this machine, by name."""
    text = (HERE / "requirements.lock").read_text(encoding="utf-8")
    entries = [Entry(part) for part in re.split(r"\n(?=[^\s#])", text) if re.match(r"[\w.-]+==", part)]
    return {entry.name: entry for entry in entries if entry.counts}


def project(extras: set[str]) -> list[Requirement]:
    """Return the requirements of bushcli with these extras."""
    table = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lists = [table["dependencies"], *(table["optional-dependencies"][extra] for extra in sorted(extras))]
    return expanded([Requirement(line) for lines in lists for line in lines])


def expanded(requirements: list[Requirement]) -> list[Requirement]:
    """Replace bushcli by its requirements."""
    found = []
    for one in requirements:
        found += project(one.extras) if one.name == "bushcli" else [one]
    return found


def own_requirements(entries: dict[str, Entry]) -> list[Requirement]:
    """Return the requirements of the packages that were installed from the lock file into this virtual environment."""
    found: list[Requirement] = []
    for distribution in importlib.metadata.distributions(path=[str(site())]):
        if canonicalize_name(distribution.name) in entries:
            found += map(Requirement, distribution.requires or [])
    return [one for one in found if one.marker is None or one.marker.evaluate({"extra": ""})]


def site() -> Path:
    """Return the folder of the virtual environment's own packages."""
    return (
        Path(sys.prefix)
        / "lib"
        / f"python{sys.version_info.major}.{sys.version_info.minor}"
        / "site-packages"
    )


def is_there(one: Requirement, locked: Entry | None) -> bool:
    """Whether the environment has a suitable package; in its own folder, it has to be that of the lock file."""
    try:
        found = importlib.metadata.distribution(one.name)
    except importlib.metadata.PackageNotFoundError:
        return False
    if Path(str(found.locate_file(""))) == site():
        return locked is not None and found.version == locked.version
    return one.specifier.contains(found.version, prereleases=True)


def missing(requirements: list[Requirement], entries: dict[str, Entry]) -> dict[str, Entry]:
    """Return the entries to install, by name."""
    found: dict[str, Entry] = {}
    waiting = list(requirements)
    while waiting:
        one = waiting.pop()
        name = canonicalize_name(one.name)
        entry = entries.get(name)
        if name in found or (one.marker is not None and not one.marker.evaluate({"extra": ""})):
            continue
        if is_there(one, entry):
            continue
        if entry is None or not one.specifier.contains(entry.version, prereleases=True):
            sys.exit(f'setup/requirements.lock has no {one}: run "make lock"')
        found[name] = entry
        waiting += [Requirement(other.name) for other in entries.values() if name in other.needed_by]
    return found


def main() -> None:
    """Print the missing entries."""
    entries = lock()
    wanted = expanded([Requirement(name) for name in sys.argv[1:]]) + own_requirements(entries)
    for _, entry in sorted(missing(wanted, entries).items()):
        sys.stdout.write(entry.text.rstrip("\\\n ") + "\n")


main()

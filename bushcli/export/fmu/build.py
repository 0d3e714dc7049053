"""A force law -> an FMU: a script that contains the law's code, packed by PythonFMU or PythonFMU3."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import io
import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

from bushcli.errors import InputError, Problem
from bushcli.runtime.extras import remedy

_HERE = Path(__file__).parent
_LIBRARIES = {2: "pythonfmu", 3: "pythonfmu3"}


def build(data: dict[str, Any], version: Literal[2, 3]) -> bytes:
    """Return the FMU as an archive; refuse where the library that packs it is not installed."""
    library = _LIBRARIES[version]
    try:
        builder = importlib.import_module(f"{library}.builder").FmuBuilder
    except ImportError:
        what = f"needs {library}, which is not installed"
        raise InputError(Problem(f"--to fmu{version}", what, "", remedy("fmu"))) from None
    with tempfile.TemporaryDirectory(prefix="bushcli-fmu-") as folder, _undo_side_effects():
        text = json.dumps(data)
        # The module's name is unique: a program may load several FMUs into one Python.
        digest = hashlib.sha256(f"{version}{text}".encode()).hexdigest()[:12]
        script = Path(folder) / f"{data['name']}_{digest}_slave.py"
        script.write_text(_script(version, text), encoding="utf-8")
        state = "FMUstate" if version == 2 else "FMUState"
        abilities = {f"canGetAndSet{state}": True, f"canSerialize{state}": True}
        packed = builder.build_FMU(script, dest=Path(folder) / "out", **abilities)
        return Path(packed).read_bytes()


def _script(version: int, data: str) -> str:
    """Return one script that contains the force law, its data, the variables and the slave."""
    parts = []
    for name in ("force_law", "slave", f"slave{version}"):
        source = (_HERE / f"{name}.py").read_text(encoding="utf-8")
        _, _, code = source.partition('"""\n')
        parts += [
            line for line in code.splitlines() if not line.startswith(("from __future__", "from bushcli."))
        ]
    code = "\n".join(parts).replace('DATA = ""', f"DATA = {data!r}")
    return (
        f'"""A bushing: its force law, written by bushcli."""\n\nfrom __future__ import annotations\n{code}\n'
    )


@contextlib.contextmanager
def _undo_side_effects() -> Iterator[None]:
    """Undo side effects of the builders: folders on the search path, modules, printed lines."""
    path, modules = list(sys.path), set(sys.modules)
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            yield
        finally:
            sys.path[:] = path
            for name in set(sys.modules) - modules:
                if name.endswith("_slave"):
                    del sys.modules[name]

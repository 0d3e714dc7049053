"""Let a virtual environment see all packages that the interpreter which made it sees: parent_paths.py VENV.

`--system-site-packages` stops at the base installation. The packages of an interpreter that is itself in a
virtual environment, and those on PYTHONPATH (where the DOLFINx containers keep DOLFINx), are added by a .pth
file.
"""

import sys
from pathlib import Path

venv = Path(sys.argv[1])
version = f"python{sys.version_info.major}.{sys.version_info.minor}"
parents = [p for p in sys.path[1:] if Path(p).name in ("site-packages", "dist-packages")]
(venv / "lib" / version / "site-packages" / "parent.pth").write_text("\n".join(parents) + "\n")

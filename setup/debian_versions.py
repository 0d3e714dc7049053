"""Print constraints for the lock file: no newer versions than Debian's of the packages that Debian installs."""

import importlib.metadata
import sys

for distribution in sorted(importlib.metadata.distributions(), key=lambda one: one.name.lower()):
    if "/usr/lib/" in str(distribution.locate_file("")):
        version = distribution.version.partition("+")[0].partition(".dev")[0]
        sys.stdout.write(f"{distribution.name}<={version} ; python_version < '3.15'\n")

#!/bin/bash
# Rewrites requirements.lock: bushcli's requirements from PyPI, with versions and hashes, for all versions of Python
# from 3.11 on and all processors. They are no newer than Debian's packages allow, so that none of these is replaced.
# Versions in the present lock file stay as long as they serve; for the newest ones remove the file first.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd -P)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$here/enter" /usr/bin/python3 "$here/debian_versions.py" >"$work/constraints.txt"
python3 -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -q uv
cd "$here/.."
[ ! -f setup/requirements.lock ] || cp setup/requirements.lock "$work/requirements.lock"
# uv has its own settings for an index and certificates; a machine's settings of pip do not belong in a lock file.
"$work/venv/bin/uv" pip compile -q --no-config --system-certs --universal --python-version 3.11 --generate-hashes \
    --all-extras --constraints "$work/constraints.txt" --custom-compile-command "make lock" \
    --output-file "$work/requirements.lock" pyproject.toml setup/build.in
sed "s#$work/##" "$work/requirements.lock" >setup/requirements.lock

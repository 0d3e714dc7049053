#!/bin/bash
# Makes the environment of this checkout, in the shortest way available:
#   python   a python3 that imports a DOLFINx that was tested (conda-forge, container, Debian 13) is used as it is
#   apt      Debian or Ubuntu whose own packages carry such a DOLFINx
#   root     anything else with apt-get: a Debian 13 root, entered with bubblewrap; the system stays as it is
# Each way ends with .venv, which has the packages from PyPI and the `enter` script. BUSHCLI_WAY=python|apt|root chooses.
# Running it again is quick when nothing has changed, and finishes what was interrupted.
# BUSHCLI_SUITE=sid takes the root way with Debian's newest packages, in an environment of its own: .venv-sid.
#
# With an argument: the same for an installed bushcli, which does not need the checkout any more, in that directory.
set -euo pipefail
# shellcheck source=setup/lib.sh
source "$(dirname "$0")/lib.sh"
# shellcheck source=setup/ways.sh
source "$checkout/setup/ways.sh"
# shellcheck source=setup/venv.sh
source "$checkout/setup/venv.sh"
venv=${1:-$checkout/.venv}
if [ $# = 0 ] && [ "$suite" != "$usual_suite" ]; then venv+=-$suite; fi

# What the environment is made from. The settings of the checking tools, in the same file, do not matter here.
made_from() {
    { sed '/^\[tool\.ruff\]/,$d' "$checkout/pyproject.toml" && cat "$checkout"/setup/*; } | digest
    printf '%s\n' "${BUSHCLI_WAY:-shortest}" "$suite" "$checkout" "$home"
    if (($# > 0)); then printf '%s\n' "$extras" && find "$checkout"/{bushcli,cases,forms,geometry,examples} -type f | sort | xargs sha256sum; fi
}

is_complete() {
    [ -f "$venv/complete" ] && [ "$(<"$venv/complete")" = "$(made_from "$@")" ] && "$venv/enter" "$venv/bin/python" -c ''
}

is_complete "$@" 2>/dev/null && exit 0

{ mkdir -p "$home" && : >>"$home/lock"; } 2>/dev/null ||
    fail "cannot write in $home; choose another place with BUSHCLI_HOME=/path."
[ -w "$checkout" ] || [ $# -gt 0 ] || fail "cannot write in $checkout, where .venv is to be."
exec 9>>"$home/lock"
if ! flock -n 9; then
    say "another set-up is at work in $home; waiting for it to end"
    flock 9
    is_complete "$@" 2>/dev/null && exit 0
fi
trap 'say "interrupted; run it again to finish."; exit 130' INT TERM HUP
: >"$log"

choose_way # sets way
say "$(describe)"
"prepare_$way" # sets python and, for an isolated root, root
make_venv "$@"
# The checkout's modules are compiled too: where PYTHONDONTWRITEBYTECODE is set, or files are read-only, each start
# would compile all of them.
(($# > 0)) || "$venv/enter" "$venv/bin/python" -m compileall -q "$checkout"/{bushcli,cases,forms,geometry} >>"$log" || true
# So that the first result does not wait for a compiler. A kernel that fails here is compiled when it is needed.
say "compiling the common kernels"
if kernels=$("$venv/enter" "$venv/bin/python" -m cases.precompile 2>>"$log"); then
    say "$kernels"
else
    say "the kernels could not be compiled now; $log says why. They will be when they are needed."
fi
made_from "$@" >"$venv/complete"
say "ready after $SECONDS s"

#!/bin/bash
# Puts bushcli on the PATH, in an environment of its own that does not need this checkout any more:
#   bushcli        the program
#   bushcli-env    runs any command in its environment: bushcli-env mpirun -n 2 bushcli direct case.toml
#   mpirun         the same mpirun by its own name, where there is no other
# install.sh --remove takes them off again. BINDIR chooses the directory.
set -euo pipefail
# shellcheck source=setup/lib.sh
source "$(dirname "$0")/lib.sh"
installed=$home/installed
if ((EUID == 0)); then bindir=${BINDIR:-/usr/local/bin}; else bindir=${BINDIR:-$HOME/.local/bin}; fi

mark="# bushcli's set-up wrote this"
is_ours() { [ -f "$1" ] && grep -qF "$mark" "$1"; }

if [ "${1:-}" = --remove ]; then
    for name in bushcli bushcli-env mpirun; do
        if is_ours "$bindir/$name"; then rm -v "$bindir/$name"; fi
    done
    rm -rf "$installed"
    say "what is left in $home can be deleted unless a checkout uses it"
    exit
fi

bash "$checkout/setup/setup.sh" "$installed"
mkdir -p "$bindir" && [ -w "$bindir" ] || fail "cannot write in $bindir; choose another directory with BINDIR=/path."

launcher() { # name, what to run
    printf '#!/bin/sh\n%s\nexec "%s/enter" %s"$@"\n' "$mark" "$installed" "${2:+\"$2\" }" >"$bindir/.$1.new"
    chmod 755 "$bindir/.$1.new"
    mv "$bindir/.$1.new" "$bindir/$1"
    say "installed $bindir/$1"
}

for name in bushcli bushcli-env; do
    if [ -e "$bindir/$name" ] && ! is_ours "$bindir/$name"; then
        fail "$bindir/$name is there already and is not this program's; choose another directory with BINDIR=/path."
    fi
done
launcher bushcli "$installed/bin/bushcli"
launcher bushcli-env ""
if grep -q bwrap "$installed/enter"; then # the other ways use the system's own mpirun
    other=$(command -v mpirun || true)
    if [ -z "$other" ] || is_ours "$other"; then launcher mpirun mpirun; fi
fi

if [[ :$PATH: != *:$bindir:* ]]; then
    say "$bindir is not on your PATH yet: add the line  export PATH=\"$bindir:\$PATH\"  to ~/.profile and log in again"
fi
if ((EUID == 0)) && [[ $home = /root/* ]]; then
    say "only root can use it there; for all users: BUSHCLI_HOME=$shared_home make install"
fi

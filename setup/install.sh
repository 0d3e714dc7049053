#!/bin/bash
# Puts bushcli on the PATH, in an environment of its own that does not need this checkout any more:
#   bushcli        the program
#   bushcli-env    runs any command in its environment: bushcli-env mpirun -n 2 bushcli direct case.toml
#   mpirun         the same mpirun by its own name, where there is no other
# Beside them, in share/: the completion of bash, zsh and fish, and the manual page.
# The optional parts come with it; EXTRAS=rig,fmu chooses fewer, EXTRAS= none, EXTRAS=rig,fmu,study,slurm one more.
# install.sh --remove removes them again. BINDIR chooses the directory.
set -euo pipefail
# shellcheck source=setup/lib.sh
source "$(dirname "$0")/lib.sh"
installed=$home/installed
if ((EUID == 0)); then bindir=${BINDIR:-/usr/local/bin}; else bindir=${BINDIR:-$HOME/.local/bin}; fi

share=$(dirname "$bindir")/share
mark="# bushcli's set-up wrote this"
# The files in share/, each with the command that prints it.
beside=(
    "bash-completion/completions/bushcli|env _BUSHCLI_COMPLETE=bash_source bushcli"
    "zsh/site-functions/_bushcli|env _BUSHCLI_COMPLETE=zsh_source bushcli"
    "fish/vendor_completions.d/bushcli.fish|env _BUSHCLI_COMPLETE=fish_source bushcli"
    "man/man1/bushcli.1|python -m bushcli.cli.manual"
)
is_ours() { [ -f "$1" ] && grep -qF "$mark" "$1"; }

if [ "${1:-}" = --remove ]; then
    for name in bushcli bushcli-env mpirun; do
        if is_ours "$bindir/$name"; then rm -v "$bindir/$name"; fi
    done
    for one in "${beside[@]}"; do
        if is_ours "$share/${one%%|*}"; then rm -v "$share/${one%%|*}"; fi
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

# Completion and manual are no reason to fail: without them everything works.
extra() { # file below share/, command that prints it
    local file=$share/$1 text
    if [ -e "$file" ] && ! is_ours "$file"; then
        say "$file is there already and is not this program's; left as it is"
        return
    fi
    # shellcheck disable=SC2086
    if ! text=$("$installed/enter" $2 2>/dev/null) || [ -z "$text" ] || ! mkdir -p "$(dirname "$file")" 2>/dev/null ||
        ! [ -w "$(dirname "$file")" ]; then
        say "could not write $file"
        return
    fi
    local comment=$mark
    if [[ $file = *.1 ]]; then comment=".\\\" $mark"; fi
    printf '%s\n%s\n' "$text" "$comment" >"$file"
    say "installed $file"
}

for one in "${beside[@]}"; do extra "${one%%|*}" "${one#*|}"; done

if [[ :$PATH: != *:$bindir:* ]]; then
    say "$bindir is not on your PATH yet: add the line  export PATH=\"$bindir:\$PATH\"  to ~/.profile and log in again"
fi
if ((EUID == 0)) && [[ $home = /root/* ]]; then
    say "only root can use it there; for all users: BUSHCLI_HOME=$shared_home make install"
fi

# The virtual environment and its `enter` script. Sourced by setup.sh.
# shellcheck shell=bash disable=SC2154

# Optional parts of an installed bushcli: readers of rigs' files, FMUs, studies. EXTRAS chooses others, or none.
extras=${EXTRAS-rig,fmu,study}

# Installs packages from PyPI in addition to those of $python. With an argument: an ordinary installation, without the
# checking tools.
make_venv() {
    local options=(--system-site-packages) target=(-e "$checkout") wanted=("bushcli[dev]")
    local base="$python $root $checkout $(digest <"$checkout/setup/requirements.lock")"
    if (($# > 0)); then target=("$checkout") wanted=("bushcli${extras:+[$extras]}"); fi
    mkdir -p "$(dirname "$venv")"
    need_space "$(dirname "$venv")" 500 "the virtual environment"
    if [ "$(cat "$venv/base" 2>/dev/null)" != "$base" ]; then rm -rf "$venv"; fi
    rm -f "$venv/complete"
    mkdir -p "$venv"
    write_enter
    say "installing what PyPI has"
    # Without a pip of its own where the interpreter has one: this saves three seconds.
    if "$venv/enter" "$python" -c 'import pip' 2>/dev/null; then options+=(--without-pip); fi
    logged "$venv/enter" "$python" -m venv "${options[@]}" "$venv" ||
        fail "$python cannot make a virtual environment in $venv; see $log."
    "$venv/enter" "$python" "$checkout/setup/parent_paths.py" "$venv"
    "$venv/enter" "$venv/bin/python" -c 'import gmsh' 2>>"$log" || wanted+=(gmsh)
    install_locked hatchling setuptools # what the others are built with
    install_locked "${wanted[@]}"
    pip_install --no-deps --no-build-isolation "${target[@]}"
    echo "$base" >"$venv/base"
}

# Installs what is missing, in the versions of the lock file and with its hashes. What the packages themselves require
# is known only once they are installed; as a rule, a second round finds nothing more.
install_locked() { # requirements...
    local round list=$venv/missing.txt
    for round in 1 2 3 4; do
        "$venv/enter" "$venv/bin/python" "$checkout/setup/locked.py" "$@" >"$list" 2>>"$log" ||
            fail "$(tail -n 1 "$log")"
        if [ ! -s "$list" ]; then rm "$list" && return; fi
        pip_install --no-deps --require-hashes --no-build-isolation -r "$list"
    done
    fail "packages of the lock file are still missing after four rounds of installation: see $list."
}

pip_install() {
    # The number of retries is in the environment, so that the pip that pip starts for building has it too: without a
    # network, set-up then fails in less than a minute.
    PIP_RETRIES=${PIP_RETRIES:-2} logged "$venv/enter" "$venv/bin/python" -m pip install -q \
        --disable-pip-version-check "$@" ||
        fail "pip could not install what bushcli needs from PyPI: there is no network, or it wants a proxy" \
            "(https_proxy) or another index (PIP_INDEX_URL). See $log for details."
}

quoted() { printf "'%s'" "${1//\'/\'\\\'\'}"; }

# Writes $venv/enter, which runs a command in the environment: enter bushcli --help, enter mpirun -n 2 bushcli ...
# Plain sh with every path written out, because it runs at each start of bushcli.
write_enter() {
    local bin dir overlay=
    bin=$(quoted "$venv/bin")
    {
        echo '#!/bin/sh'
        echo "# Runs a command in bushcli's environment. Written by setup/venv.sh; set-up writes it anew."
        # One thread: the factorisations are too small for more to pay.
        echo 'export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"'
        # Open MPI refuses to run as root, the usual user in a container, unless this is allowed twice.
        echo 'export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1'
        if [ "$way" != python ]; then
            # Ranks on one machine communicate through shared memory; otherwise Open MPI looks for TCP, with warnings.
            echo 'export OMPI_MCA_btl="${OMPI_MCA_btl:-self,sm}"'
        fi
        if [ -z "$root" ]; then
            echo "export PATH=$bin:\"\$PATH\""
            echo 'exec "$@"'
        else
            # / stays as it is, with all files of the user; the root's programs and their settings are mounted over it.
            overlay="--ro-bind $(quoted "$root/usr") /usr --ro-bind $(quoted "$root/etc") /etc"
            for dir in bin sbin lib lib64; do # a system from before the merger of / and /usr
                if [ -d "/$dir" ] && [ ! -L "/$dir" ]; then overlay+=" --ro-bind $(quoted "$root/usr/$dir") /$dir"; fi
            done
            for dir in resolv.conf hosts passwd group pip.conf ssl/certs; do
                overlay+=" --ro-bind-try /etc/$dir /etc/$dir"
            done
            cat <<END
export PATH=$bin:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin
[ "\$BUSHCLI_ROOT" = $(quoted "$root") ] && exec "\$@"
if [ "\${OMPI_COMM_WORLD_SIZE:-\${PMI_SIZE:-1}}" -gt 1 ]; then
    echo "bushcli: the mpirun of this system cannot start ranks of another one; use: bushcli-env mpirun ..." >&2
    exit 2
fi
[ -d "\$(pwd -P 2>/dev/null)" ] && [ . -ef "\$PWD" ] || {
    echo "error: the working directory no longer exists (change to another one: cd DIRECTORY)" >&2
    exit 2
}
case \$PWD/ in /usr/* | /etc/*)
    echo "bushcli: cannot work in \$PWD: /usr and /etc are not the system's own here; use another directory" >&2
    exit 2 ;;
esac
# The system's libraries and modules are not those of the root.
unset LD_LIBRARY_PATH LD_PRELOAD PYTHONHOME PYTHONPATH
export BUSHCLI_ROOT=$(quoted "$root")
# bubblewrap stays between this script and the command. It is deaf to Ctrl-C and SIGTERM, which are the command's to
# answer: this script passes them on and waits, so that nothing runs any more when the prompt is back. A terminal sends
# Ctrl-C to all of them by itself. Should this script be killed, setpriv ends bubblewrap and with it, by SIGTERM, the
# command; a logout does not, as --die-with-parent would.
#
# mpirun would kill its ranks a quarter of a second after Ctrl-C. Away from the terminal it does not hear of it, and
# passes SIGUSR1 on, at which the ranks save what they have; a second Ctrl-C ends it all the same.
session=
case \${1##*/} in mpirun | mpiexec | prterun) session=setsid ;; esac
forward() { # signal
    signal=\$1
    read -r stat <"/proc/\$\$/stat" && set -- \${stat##*) }
    # In the terminal's foreground (state, parent, GROUP, session, tty, GROUP) the command has it already.
    [ -z "\$session" ] && [ "\$signal" = INT ] && [ "\$3" = "\$6" ] && return
    if [ -n "\$session" ]; then
        [ -n "\$asked" ] && signal=TERM || signal=USR1
        asked=yes
    fi
    child=
    read -r child rest <"/proc/\$pid/task/\$pid/children"
    if [ -n "\$child" ]; then kill -s "\$signal" "\$child"; else kill -s KILL "\$pid"; fi
} 2>/dev/null
asked=
trap 'forward INT' INT
trap 'forward TERM' TERM
[ -e /proc/self/fd/0 ] || exec </dev/null
exec 9<&0 # a shell takes the standard input from what it does not wait for
(
    trap '' INT TERM
    exec \$session setpriv --pdeathsig KILL bwrap --dev-bind / / $overlay setpriv --pdeathsig TERM \\
        env --default-signal=INT,QUIT,TERM "\$@"
) <&9 9<&- &
pid=\$!
while
    wait "\$pid"
    status=\$?
    kill -s 0 "\$pid" 2>/dev/null
do :; done
exit "\$status"
END
        fi
    } >"$venv/enter.new"
    chmod +x "$venv/enter.new"
    mv "$venv/enter.new" "$venv/enter"
}

# Shared by the set-up scripts: paths, messages, failures, rights. Sourced by bash.
# shellcheck shell=bash disable=SC2034

checkout=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
home=${BUSHCLI_HOME:-${XDG_DATA_HOME:-${HOME:-/root}/.local/share}/bushcli}
[[ $home = /* ]] || home=$PWD/$home
shared_home=/opt/bushcli # where an administrator may have built the root for everybody
log=$home/setup.log

# The Debian release whose DOLFINx is used in an isolated root. Each release has a root and an environment of its own:
# with another release than the usual one, a checkout is tested with another DOLFINx, and existing ones do not change.
usual_suite=trixie
suite=${BUSHCLI_SUITE:-$usual_suite}

say() { printf 'bushcli set-up: %s\n' "$*" >&2; }

fail() {
    say "$*"
    exit 1
}

# The Debian column of the list of packages.
debian_packages() { awk '!/^#/ && NF && $1 != "-" { print $1 }' "$checkout/setup/packages.txt"; }

# The tested releases of DOLFINx: at least $oldest_dolfinx, before $next_dolfinx.
read -r oldest_dolfinx next_dolfinx < <(
    sed -nE 's/.* fenics-dolfinx>=([0-9.]+),<([0-9.]+)$/\1 \2/p' "$checkout/setup/packages.txt"
)
tried_dolfinx="DOLFINx >= $oldest_dolfinx, < $next_dolfinx"

digest() { sha256sum | cut -c1-12; }

# Runs a command with its output in the log; when it fails, the end of that output is shown.
logged() {
    printf '\n$ %s\n' "$*" >>"$log"
    local status=0
    "$@" >>"$log" 2>&1 </dev/null || status=$?
    ((status == 0 || status == 126)) || tail -n 3 "$log" | sed 's/^/    /' >&2
    return $status
}

need_space() { # directory, MB, what for
    local free
    free=$(df -Pm "$1" | awk 'NR == 2 { print $4 }')
    ((free >= $2)) || fail "$3 needs $2 MB of disk, and only $free MB are free where $1 is." \
        "Free some, or choose another place with BUSHCLI_HOME=/path."
}

# Runs a command as root: directly, through sudo, or (status 126) not at all.
as_root() {
    if ((EUID == 0)); then
        "$@"
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        sudo -n --preserve-env=http_proxy,https_proxy,no_proxy,BUSHCLI_MIRROR "$@"
    else
        return 126
    fi
}

# In a terminal, asks for sudo's password once, before anything needs it.
ask_for_rights() {
    as_root true && return
    if command -v sudo >/dev/null && [ -t 0 ] && sudo -v; then return; fi
    fail "installing Debian packages needs root rights, once, and there is no sudo here that gives them." \
        "Let an administrator run \"BUSHCLI_HOME=$shared_home make setup\" here, then run this again;" \
        "or activate a conda environment made from environment.yml: its DOLFINx is used as it is."
}

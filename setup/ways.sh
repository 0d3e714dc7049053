# The three ways to DOLFINx. Sourced by setup.sh.
# shellcheck shell=bash disable=SC2154,SC2046

way=    # python, apt or root
root=   # the isolated root, when there is one
python= # the interpreter that imports DOLFINx, as seen from inside

# An interpreter of this machine that imports DOLFINx.
find_python() {
    local candidate
    for candidate in python3 /usr/bin/python3; do
        python=$("$candidate" "$checkout/setup/has_dolfinx.py" 2>>"$log") && return
    done
    return 1
}

# DOLFINx among the machine's own packages.
packaged() { LC_ALL=C apt-cache policy python3-dolfinx-real 2>/dev/null | awk '$1 == "Candidate:" { print $2 }'; }
is_packaged() {
    dpkg --compare-versions "$(packaged)" ge "1:$oldest_dolfinx~" &&
        dpkg --compare-versions "$(packaged)" lt "1:$next_dolfinx~"
}

choose_way() {
    local suites="trixie sid" # those with which the list of packages was tested
    [[ " $suites " = *" $suite "* ]] ||
        fail "BUSHCLI_SUITE=$suite is not a release bushcli was tried on: ${suites// /, }."
    case ${BUSHCLI_WAY:-} in
    "" | python | apt | root) ;;
    *) fail "BUSHCLI_WAY=$BUSHCLI_WAY is not a way of setting up: python, apt or root." ;;
    esac
    if [ "$suite" != "$usual_suite" ]; then # only an isolated root has another release
        [ "${BUSHCLI_WAY:-root}" = root ] ||
            fail "BUSHCLI_SUITE=$suite asks for an isolated root, BUSHCLI_WAY=$BUSHCLI_WAY for none: unset one of them."
        way=root
        return
    fi
    case ${BUSHCLI_WAY:-} in
    python) find_python || fail "BUSHCLI_WAY=python, but no python3 here imports a real-valued $tried_dolfinx: see $log." ;;
    apt | root) ;;
    "") find_python || true ;;
    esac
    if [ -n "${BUSHCLI_WAY:-}" ]; then
        way=$BUSHCLI_WAY
    elif [ -n "$python" ]; then
        way=python
    elif ! command -v apt-get >/dev/null; then
        fail "this system has neither a python3 with $tried_dolfinx nor apt-get to install one." \
            "\"conda env create -f environment.yml && conda activate bushcli\" brings one; or use the Dockerfile."
    else
        # A machine whose package lists were never fetched knows of no DOLFINx at all, not even an old one.
        if [ -z "$(packaged)" ] && as_root true; then update_lists; fi
        if is_packaged; then way=apt; else way=root; fi
    fi
}

describe() {
    case $way in
    python) echo "using the DOLFINx of $python" ;;
    apt) echo "installing DOLFINx $(packaged) and what it needs with apt-get (3 GB, about 2 minutes)" ;;
    root)
        if [ "$suite" = "$usual_suite" ]; then
            echo "no $tried_dolfinx on this system or in its packages: using an isolated Debian 13 root"
        else
            echo "using an isolated Debian root ($suite)"
        fi
        ;;
    esac
}

update_lists() { as_root apt-get update -q >>"$log" 2>&1 </dev/null || true; }

apt_install() { # packages...
    local install=(env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends
        -o DPkg::Lock::Timeout=600)
    ask_for_rights
    as_root "${install[@]}" "$@" >>"$log" 2>&1 </dev/null && return
    update_lists # lists older than the archive name files that it no longer has
    logged as_root "${install[@]}" "$@" ||
        fail "apt-get could not install $*. Is there a network? See $log for details."
}

prepare_python() { :; }

prepare_apt() {
    need_space /usr 3500 "the finite-element stack"
    apt_install $(debian_packages)
    find_python || fail "apt-get has installed DOLFINx, but python3 cannot import it; see $log."
}

build_root() {
    local status=0
    as_root bash "$checkout/setup/build-root.sh" "$suite" "$root" $(debian_packages) >>"$log" </dev/null || status=$?
    case $status in
    0) return ;;
    3) exit 1 ;; # it has said why
    esac
    tail -n 5 "$log" | sed 's/^/    /' >&2
    fail "the Debian root ($suite) could not be built. See $log for details."
}

prepare_root() {
    local key
    key=$suite-$({ debian_packages && grep -v '^ *#' "$checkout/setup/build-root.sh"; } | digest)
    root=$home/root-$key
    if [ ! -f "$root/complete" ] && [ -f "$shared_home/root-$key/complete" ]; then root=$shared_home/root-$key; fi
    python=/usr/bin/python3
    if [ ! -f "$root/complete" ]; then
        [[ $root != *[[:space:]]* ]] || fail "debootstrap needs a path without spaces, and $root has one;" \
            "choose another place with BUSHCLI_HOME=/path."
        ask_for_rights
        need_space "$home" 4000 "the Debian root ($suite)"
        command -v debootstrap >/dev/null && [ -f /usr/share/keyrings/debian-archive-keyring.gpg ] ||
            apt_install debootstrap debian-archive-keyring
    fi
    command -v bwrap >/dev/null || apt_install bubblewrap
    bwrap --dev-bind / / true 2>>"$log" ||
        fail "bubblewrap cannot make a namespace here. A container has to be run with --privileged, or built from" \
            "the Dockerfile; elsewhere unprivileged user namespaces are switched off. See $log for details."
    if [ ! -f "$root/complete" ]; then
        say "building the Debian root ($suite) in $root (3 GB, about 3 minutes, once)"
        build_root
    fi
}

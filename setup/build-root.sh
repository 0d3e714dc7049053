#!/bin/bash
# Builds a Debian root with the given packages: build-root.sh SUITE ROOT PACKAGE... (as root). Progress goes to standard
# output, what a user must know to standard error. The directory gets its final name only when it is complete.
set -euo pipefail
suite=$1
root=$2
new=$root.new
mirror=${BUSHCLI_MIRROR:-http://deb.debian.org/debian}

# In mount and process namespaces of its own: whatever ends this script also ends its children and their mounts.
if [ -z "${BUSHCLI_IN_NAMESPACE:-}" ]; then
    BUSHCLI_IN_NAMESPACE=1 exec unshare --mount --pid --fork --kill-child --mount-proc bash "$0" "$@"
fi
trap "exit 130" INT TERM # the first process of a namespace is deaf to signals that it does not handle
shift 2

# debootstrap downloads with wget, which does not know apt's own proxy.
eval "$(apt-config shell proxy Acquire::http::Proxy)"
export http_proxy=${http_proxy:-${proxy:-}}
[ -n "$http_proxy" ] || unset http_proxy

if ! /usr/lib/apt/apt-helper -o Acquire::Retries=0 download-file "$mirror/dists/$suite/InRelease" "$new.release" 2>&1; then
    rm -f "$new.release"
    echo "bushcli set-up: cannot reach $mirror: there is no network, or it wants a proxy (http_proxy)" \
        "or another mirror (BUSHCLI_MIRROR)." >&2
    exit 3
fi
rm -rf --one-file-system "$new" "$new.release"
# Without the keys of Debian's archive debootstrap would only warn, and install what nobody has signed.
debootstrap --force-check-gpg --variant=minbase "$suite" "$new" "$mirror" 2>&1

# Nothing of this has to survive a power cut, and nobody reads its manuals.
cat >"$new/etc/dpkg/dpkg.cfg.d/bushcli" <<'END'
force-unsafe-io
path-exclude=/usr/share/doc/*
path-exclude=/usr/share/man/*
path-exclude=/usr/share/locale/*
END
inside() {
    bwrap --bind "$new" / --dev /dev --proc /proc --ro-bind /sys /sys --tmpfs /tmp --tmpfs /run \
        --ro-bind-try /etc/resolv.conf /etc/resolv.conf \
        --ro-bind-try /etc/ssl/certs/ca-certificates.crt /run/ca-certificates.crt \
        --setenv PATH /usr/sbin:/usr/bin:/sbin:/bin --setenv HOME /root --setenv LC_ALL C.UTF-8 \
        --setenv DEBIAN_FRONTEND noninteractive "$@" 2>&1
}
options=(-q -o Acquire::https::CAInfo=/run/ca-certificates.crt -o Acquire::Retries=3)
inside apt-get "${options[@]}" update
inside apt-get "${options[@]}" install -y --no-install-recommends "$@"
inside apt-get clean
rm -rf "$new"/var/lib/apt/lists/*

# The places over which the machine's own files are mounted (see write_enter in venv.sh) have to exist.
mkdir -p "$new/etc/ssl/certs"
touch "$new"/etc/{resolv.conf,hosts,passwd,group,pip.conf}
touch "$new/complete"
mv "$new" "$root"

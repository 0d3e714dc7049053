#!/bin/bash
# The launcher, tested from outside: when it has ended after a signal, the command has handled the signal and ended too.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Takes half a second to save its results, as a search does.
job='
import os, signal, sys, time
def save(number, frame):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(0.5)
    open(sys.argv[1] + "/saved", "w").close()
    sys.exit(130)
signal.signal(signal.SIGINT, save)
signal.signal(signal.SIGTERM, save)
signal.signal(signal.SIGUSR1, save)
open(f"{sys.argv[1]}/ready-{os.getpid()}", "w").close()
time.sleep(60)
'

# What the tests say is seen although mpirun's own messages are thrown away.
exec 3>&2

wait_for() { # beginning of the files' names, their number
    for _ in $(seq 300); do
        if [ "$(find "$folder" -name "$1*" | wc -l)" -ge "$2" ]; then return 0; fi
        sleep 0.1
    done
    return 1
}

stop() { # signal, launcher or group, what the command is started by
    rm -f "$folder"/*
    # A shell lets its background processes ignore Ctrl-C; `env` restores the default.
    setsid env --default-signal=INT setup/enter "${@:3}" python -c "$job" "$folder" &
    local launcher=$! status=0 ranks=1
    if [ "${3:-}" = mpirun ]; then ranks=2; fi
    # A rank that is not ready yet would end at once, and mpirun would then end the others before they have saved.
    wait_for ready- $ranks || { echo "launcher: the command does not start" >&3 && exit 1; }
    if [ "$2" = group ]; then kill -s "$1" -- "-$launcher"; else kill -s "$1" "$launcher"; fi
    wait "$launcher" || status=$?
    if [ "$1" = KILL ]; then wait_for saved 1 || true; fi
    if [ ! -e "$folder/saved" ]; then
        echo "launcher: after SIG$1 to the $2 the command went on, or was ended before it could save" >&3
        exit 1
    fi
    if [ "$1" != KILL ] && [ $status != 130 ]; then
        echo "launcher: exit code $status after SIG$1 to the $2, not that of the command" >&3
        exit 1
    fi
}

stop INT launcher
stop TERM launcher
stop INT group # what a terminal does
stop TERM group
# Only with bubblewrap is there a process in between; otherwise the launcher becomes the command.
if grep -q bwrap .venv/enter 2>/dev/null; then
    stop KILL launcher 2>/dev/null
    # mpirun by itself kills its ranks before they have saved anything.
    stop INT launcher mpirun -n 2 2>/dev/null
    stop TERM group mpirun -n 2 2>/dev/null
fi
status=0
echo words | setup/enter sh -c 'read -r line; [ "$line" = words ] && exit 7' || status=$?
[ $status = 7 ] || { echo "launcher: standard input or exit code is lost" >&2 && exit 1; }

#!/bin/sh
# Diagnose the decks in turn, some recordings of each at a time, so that a part of each is there whenever it is cut off:
#   benchmarks/decks/turns.sh LABEL DIR SECONDS BATCH "COMMAND" [DECK...]
# SECONDS are of processor time: a machine that does other work must not decide what is out of time.
# What is in the ledgers is done: start it again and it goes on.
label=$1 folder=$2 seconds=$3 batch=$4 command=$5
shift 5
here=$(cd "$(dirname "$0")/../.." && pwd)
cd "$here" || exit 1
[ $# -gt 0 ] || set -- own foreign nothing
# A quiet round ends it: nothing was left in any deck.
left=1
while [ "$left" = 1 ]; do
    left=0
    for deck in "$@"; do
        setup/enter python -m benchmarks.decks run "$deck" "$folder/$deck" --label "$label" --command "$command" \
            --processor "$seconds" --timeout $((60 * seconds)) --workers 1 --count "$batch" >"$folder/turn-$label.txt" || exit 1
        [ -s "$folder/turn-$label.txt" ] && left=1 && cat "$folder/turn-$label.txt"
    done
done

#!/bin/sh
# Diagnose the decks in turn, some recordings of each at a time, so that there are results of each whenever it is stopped:
#   benchmarks/decks/turns.sh LABEL DIR SECONDS BATCH "COMMAND" [DECK...]
# SECONDS limit the processor time, which does not depend on other work on the machine.
# Recordings in the ledgers are done: started again, it continues.
label=$1 folder=$2 seconds=$3 batch=$4 command=$5
shift 5
here=$(cd "$(dirname "$0")/../.." && pwd)
cd "$here" || exit 1
[ $# -gt 0 ] || set -- own foreign nothing
# It ends with a round in which no deck had a recording left.
left=1
while [ "$left" = 1 ]; do
    left=0
    for deck in "$@"; do
        setup/enter python -m benchmarks.decks run "$deck" "$folder/$deck" --label "$label" --command "$command" \
            --processor "$seconds" --timeout $((60 * seconds)) --workers 1 --count "$batch" >"$folder/turn-$label.txt" || exit 1
        [ -s "$folder/turn-$label.txt" ] && left=1 && cat "$folder/turn-$label.txt"
    done
done

#!/bin/sh
# Renders the sequences that the shipped models are trained on, and those they are judged on.
#   make_data.sh CLARUS DIRECTORY [SCALE] [WIDTHxHEIGHT] [FRAMES]
# CLARUS is the clarus program. DIRECTORY receives train/NN and held-out/NN, NN a camera path. Each path has its own
# placement of objects; paths 1 to 3, which the demo and the figures use, are only ever held out. What is there already
# is left alone, so that an interrupted run continues.
set -eu
clarus=$1 directory=$2 scale=${3:-2} size=${4:-320x180} frames=${5:-56}

render() { # folder, path, frames
    [ -f "$1/sequence.json" ] && return
    rm -rf "$1.part"
    "$clarus" render --scene demo --size "$size" --scale "$scale" --frames "$3" --path "$2" -o "$1.part"
    mv "$1.part" "$1"
}

mkdir -p "$directory/train" "$directory/held-out"
for path in 1 2 3; do render "$directory/held-out/$path" "$path" "$frames"; done
for path in $(seq 10 49); do render "$directory/train/$path" "$path" "$frames"; done

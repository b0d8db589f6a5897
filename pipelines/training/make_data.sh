#!/bin/sh
# Renders the sequences that the shipped models are trained on, and those they are judged on.
#   make_data.sh CLARUS DIRECTORY [SCALE] [WIDTHxHEIGHT]
# CLARUS is the clarus program. DIRECTORY receives train/NN and held-out/N, named by the camera path. Each path has its
# own placement of objects; paths 1 to 3, which the demo and the figures use, are only ever held out. Even paths are cut
# from the moving part of a path, odd ones stand still from frame 10. What is there already is left alone, so that an
# interrupted run continues.
set -eu
clarus=$1 directory=$2 scale=${3:-2} size=${4:-320x180}

render() { # folder, path
    [ -f "$1/sequence.json" ] && return
    "$clarus" render --scene demo --size "$size" --scale "$scale" --frames 24 --first-frame $(($2 % 2 * 14)) \
        --path "$2" --output "$1.part" --force
    mv "$1.part" "$1"
}

mkdir -p "$directory/train" "$directory/held-out"
for path in 1 2 3; do render "$directory/held-out/$path" "$path"; done
for path in $(seq 10 49); do render "$directory/train/$path" "$path"; done

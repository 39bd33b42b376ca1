#!/usr/bin/env bash
# Makes the pictures of the documentation from the programs' own output.
#
#   docs/pictures/make.sh [PYTHON]
#
# PYTHON has cadquery-ocp, matplotlib and pillow. Recorded scans are drawn where they are to
# be had (../shared/data beside the repository), with their table in docs/studies. Those of
# docs/reproduction.md are made by `cargo xtask reproduce`.
set -euo pipefail
cd "$(dirname "$0")/../.."
python=${1:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
relief() { cargo run --quiet --release --bin relief -- "$@"; }

relief demo --out "$work/house"
"$python" docs/pictures/render_iges.py "$work/house/house.igs" "$work/house.png" \
    --elevation 25 --azimuth=-80
"$python" docs/pictures/beside.py docs/pictures/demo.png \
    "$work/house/range.png" "$work/house/regions.png" "$work/house.png"

scan=../shared/data/stanford_bunny/bun000.ply.gz
if [ -e "$scan" ]; then
    relief convert "$scan" -o "$work/bunny.igs" --pictures "$work/bunny"
    "$python" docs/pictures/render_iges.py "$work/bunny.igs" "$work/bunny.png" \
        --elevation 20 --azimuth=-75
    "$python" docs/pictures/beside.py docs/pictures/bunny.png \
        "$work/bunny/range.png" "$work/bunny/regions.png" "$work/bunny.png"
fi

if [ -d ../shared/data ]; then
    cargo xtask study real-scans --pictures "$work/real" --write docs/studies/real-scans.md
    mkdir -p docs/pictures/real
    for range in "$work"/real/*-range.png; do
        name=$(basename "$range" -range.png)
        "$python" docs/pictures/beside.py "docs/pictures/real/$name.png" \
            "$range" "$work/real/$name-regions.png" --height 420 --colours 96
    done
fi

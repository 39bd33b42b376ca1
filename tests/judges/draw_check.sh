#!/bin/sh
# Load an IGES file in OpenCASCADE's DRAW (Debian: occt-draw) and require that no face
# lost its trim (tplosttrim) and that the shape is valid (checkshape).
# Usage: draw_check.sh FILE.igs [DRAW program, default occt-draw]
set -eu
file=${1:?usage: draw_check.sh FILE.igs [DRAWEXE]}
draw=${2:-occt-draw}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# DRAW opens its plugins by names without a version, which only development packages have.
for library in /usr/lib/*/libTK*.so.[0-9]*; do
    name=${library##*/}
    ln -sf "$library" "$work/${name%%.so.*}.so"
done
cat >"$work/script.tcl" <<END
pload MODELING
pload XDE
igesread {$file} result *
puts "LOSTTRIM [tplosttrim]"
puts "CHECK [checkshape result]"
puts "STAT [statshape result]"
exit
END
# Messages of DRAW may go to either stream.
output=$(LD_LIBRARY_PATH=$work "$draw" -b -f "$work/script.tcl" 2>&1) || true
printf '%s\n' "$output"
printf '%s\n' "$output" | grep -q '^LOSTTRIM No untrimmed faces' ||
    { echo "draw_check: faces lost their trim, or DRAW did not run" >&2; exit 1; }
printf '%s\n' "$output" | grep -q 'This shape seems to be valid' ||
    { echo "draw_check: the shape is not valid" >&2; exit 1; }

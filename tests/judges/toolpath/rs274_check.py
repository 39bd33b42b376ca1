"""LinuxCNC's interpreter as the judge of our NC code.

usage: rs274_check.py DIR [--rs274 PROGRAM]

DIR has a folder for each seed, as `judge_toolpath` leaves them. The stand-alone interpreter of
LinuxCNC must take each `path.nc` and `scallop.nc`, and what it makes of the first must be the moves in
`moves.f64`: as many, of the same kind, ending at the same places, arcs around the same centres in the
same sense.
"""

import argparse
import pathlib
import re
import subprocess
import sys

import numpy as np

# The interpreter prints four decimals, which are those that are written.
SAME_MM = 1.01e-4
CALL = re.compile(r"(STRAIGHT_TRAVERSE|STRAIGHT_FEED|ARC_FEED|SELECT_PLANE)\(([^)]*)\)")
# Axes of a plane, the first and the second, and the one across.
PLANES = {"CANON_PLANE_XY": (0, 1, 2), "CANON_PLANE_XZ": (2, 0, 1), "CANON_PLANE_YZ": (1, 2, 0)}


def interpreted(text):
    """Moves as kind, end, centre and sense."""
    plane, at, moves = PLANES["CANON_PLANE_XY"], [0.0] * 3, []
    for name, words in CALL.findall(text):
        if name == "SELECT_PLANE":
            plane = PLANES[words.strip()]
            continue
        numbers = [float(word) for word in words.split(",")]
        centre, sense = [0.0] * 3, 0.0
        if name == "ARC_FEED":
            first, second, across = plane
            end = [0.0] * 3
            end[first], end[second], end[across] = numbers[0], numbers[1], numbers[5]
            centre[first], centre[second] = numbers[2], numbers[3]
            centre[across] = at[across]
            sense = 1.0 if numbers[4] > 0 else -1.0
            kind = 2.0
        else:
            end = numbers[:3]
            kind = 0.0 if name == "STRAIGHT_TRAVERSE" else 1.0
        at = end
        moves.append([kind, *end, *centre, sense])
    return np.array(moves)


def read(program, folder, name):
    """What the interpreter prints, and why it does not take the program."""
    done = subprocess.run(
        [program, "-g", "-t", folder / "tool.tbl", folder / name],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0 or "PROGRAM_END" not in done.stdout:
        return "", f"{name} is not taken: {done.stderr.strip()[-300:]}"
    return done.stdout, None


def judge(folder, program):
    if (folder / "scallop.nc").exists():
        _, why = read(program, folder, "scallop.nc")
        if why:
            return why
    text, why = read(program, folder, "path.nc")
    if why:
        return why
    theirs = interpreted(text)
    ours = np.fromfile(folder / "moves.f64").reshape(-1, 8)
    # Before ours it goes up by the machine's own coordinates and to the first place in two moves;
    # behind them it goes up again.
    start = np.flatnonzero(np.abs(theirs[:, 1:4] - ours[0, 1:4]).max(axis=1) < SAME_MM)
    if not len(start):
        return "never where the path begins"
    theirs = theirs[start[0] : start[0] + len(ours)]
    if len(theirs) < len(ours):
        return f"{len(theirs)} moves, not {len(ours)}"
    if (theirs[:, 0] != ours[:, 0]).any() or (theirs[:, 7] != ours[:, 7]).any():
        return "moves of another kind"
    off = np.abs(theirs[:, 1:7] - ours[:, 1:7]).max()
    if off > SAME_MM:
        return f"places that differ by {off} mm"
    arcs = int((ours[:, 0] == 2).sum())
    print(f"{folder.name}: {len(ours)} moves, {arcs} of them arcs, off by {off:.6f} mm at most")
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--rs274", default="rs274", help="the interpreter")
    options = parser.parse_args()
    missed = []
    for folder in sorted(options.folder.iterdir()):
        if folder.is_dir():
            why = judge(folder, options.rs274)
            if why:
                missed.append(f"{folder.name}: {why}")
    if missed:
        sys.exit("\n".join(missed))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Holds our B-spline surfaces against SciPy's, which are FITPACK's, on the same grids.

    python tests/judges/surfacing/check.py FOLDER [--bisplrep]

FOLDER holds what `study-surfaces --data FOLDER` left: grids, and the control points, greatest and
root mean square deviations of our surfaces of them. SciPy's `RectBivariateSpline` (FITPACK's
`regrid`) is asked for a surface with the same root mean square deviation, and with `--bisplrep`
also `bisplrep` (`surfit`), which takes minutes and stops at large numbers of knots. `regrid` takes
no grids with masked nodes: there these are filled from its own surface, again and again, until that
changes little; `bisplrep` is given the other nodes alone. Deviations are of those alone with both.
With `--append PAGE` the table goes to the end of that page, too.

Exits with 1 where ours has more control points than either.
"""

import argparse
import json
import pathlib
import sys
import warnings

import numpy
import scipy
from scipy.interpolate import RectBivariateSpline, bisplev, bisplrep
from scipy.ndimage import distance_transform_edt

# A root mean square deviation this little above ours is equal to it: FITPACK stops within a
# thousandth of the sum of squares that it is given.
SLACK = 1.001


# Of FITPACK's search for the smoothing.
MOST_ITERATIONS = 200
# Rounds in which masked nodes are filled.
ROUNDS = 12
# With more control points than this bisplrep takes hours.
MOST_FOR_SURFIT = 1200


def told(z, fitted, count):
    off = (fitted - z)[~numpy.isnan(z)]
    return count, float(numpy.sqrt(numpy.mean(off**2))), float(numpy.max(numpy.abs(off)))


def regrid(x, y, z, rms, _):
    masked = numpy.isnan(z)
    filled = z.copy()
    if masked.any():
        # From the nearest node with a value.
        nearest = distance_transform_edt(masked, return_distances=False, return_indices=True)
        filled = z[tuple(nearest)]
    smooth = (~masked).sum() * (rms * SLACK) ** 2
    for _ in range(ROUNDS if masked.any() else 1):
        try:
            spline = RectBivariateSpline(x, y, filled, s=smooth, maxit=MOST_ITERATIONS)
        except ValueError as error:
            return " ".join(str(error).split())[:80]
        filled[masked] = spline(x, y)[masked]
    u, v = spline.get_knots()
    return told(z, spline(x, y), (len(u) - 4) * (len(v) - 4))


def surfit(x, y, z, rms, ours):
    if ours > MOST_FOR_SURFIT:
        return "not asked"
    xs, ys = numpy.meshgrid(x, y, indexing="ij")
    given = ~numpy.isnan(z)
    side = len(x) // 2 + 4
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            tck = bisplrep(
                xs[given],
                ys[given],
                z[given],
                s=given.sum() * (rms * SLACK) ** 2,
                nxest=side,
                nyest=side,
            )
        except (Warning, ValueError) as error:
            return str(error).strip().splitlines()[0]
    return told(z, bisplev(x, y, tck), (len(tck[0]) - 4) * (len(tck[1]) - 4))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--bisplrep", action="store_true")
    parser.add_argument("--append", type=pathlib.Path)
    options = parser.parse_args()
    lines = []

    def say(line):
        print(line, flush=True)
        lines.append(line)

    files = sorted(options.folder.glob("*.json"))
    if not files:
        sys.exit(f"{options.folder}: no grids; study-surfaces --data leaves them")
    say(f"SciPy {scipy.__version__}; control points at the same root mean square deviation:\n")
    say("| surface | rms mm | ours | max mm | RectBivariateSpline | max mm | bisplrep | max mm |")
    say("| --- | --- | --- | --- | --- | --- | --- | --- |")
    worse = []
    for file in files:
        case = json.loads(file.read_text())
        z = numpy.array([numpy.nan if v is None else v for v in case["z_mm"]], dtype=float)
        z = z.reshape(case["columns"], case["rows"])
        x, y = numpy.arange(z.shape[0], dtype=float), numpy.arange(z.shape[1], dtype=float)
        for ours in case["ours"]:
            cells = [
                case["name"],
                f"{ours['rms_mm']:.5f}",
                str(ours["control_points"]),
                f"{ours['max_mm']:.4f}",
            ]
            theirs = [regrid(x, y, z, ours["rms_mm"], ours["control_points"])]
            if options.bisplrep:
                theirs.append(surfit(x, y, z, ours["rms_mm"], ours["control_points"]))
            for result in theirs:
                if isinstance(result, str):
                    cells += [result, "-"]
                    continue
                count, _, most = result
                cells += [str(count), f"{most:.4f}"]
                if ours["control_points"] > count:
                    worse.append(f"{case['name']} at {ours['rms_mm']:.5f} mm: {ours['control_points']} against {count}")
            cells += ["-"] * (8 - len(cells))
            say("| " + " | ".join(cells) + " |")
    if options.append:
        with options.append.open("a") as page:
            page.write("\n" + "\n".join(lines) + "\n")
    if worse:
        sys.exit("more control points than SciPy: " + "; ".join(worse))


if __name__ == "__main__":
    main()

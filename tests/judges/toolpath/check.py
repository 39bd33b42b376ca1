"""opencamlib as the referee of our cutters and paths.

usage: check.py DIR [--check] [--faster TIMES]

DIR has a folder for each seed, as `judge_toolpath` (an example of geometry/toolpath) leaves them:
the surface, where our cutter stands at random places, and points all along the finishing path. For
each, opencamlib's BatchDropCutter says where the tip must be: how far ours differs, how much deeper
than that the path goes (a gouge), how far above it runs, and how long either took on the same
places, two threads each, in this one run.
"""

import argparse
import json
import pathlib
import struct
import sys
import time

import numpy as np
import opencamlib as ocl

# Gouges beyond this fail: one micrometre, millimetres. The surface is its triangles here.
GOUGE_MM = 1e-3
# Tips may differ by what opencamlib's own search for the place on a bull-nose leaves, and at the
# rim of a flat end by walls that one sees at the last digit of a place.
TIP_MM = 1e-5
# A rim that a wall just touches: places move by so much to see whether a gouge is one.
ASIDE_MM = 2e-4
NOTHING = -1e6
# Points of a path that are asked for, spread over all of it: opencamlib takes its time.
MOST_POINTS = 1200
# The same of the places; our time is taken for as many.
MOST_PLACES = 300


def surface(path):
    """Triangles of a binary STL file, as numpy has them and as opencamlib does."""
    data = path.read_bytes()
    (count,) = struct.unpack("<I", data[80:84])
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    corners = np.frombuffer(data[84:], kind, count)["corners"].astype(float)
    facets = ocl.STLSurf()
    for a, b, c in corners.tolist():
        facets.addTriangle(ocl.Triangle(ocl.Point(*a), ocl.Point(*b), ocl.Point(*c)))
    return facets


def cutter(told):
    diameter, corner = 2 * told["radius_mm"], told["corner_mm"]
    if corner == 0:
        return ocl.CylCutter(diameter, 100)
    if corner == told["radius_mm"]:
        return ocl.BallCutter(diameter, 100)
    return ocl.BullCutter(diameter, corner, 100)


def drop(facets, tool, places):
    """Heights at places, and the seconds of the drop alone."""
    batch = ocl.BatchDropCutter()
    batch.setSTL(facets)
    batch.setCutter(tool)
    batch.setThreads(2)
    # The fastest of 1, 10 and its own choice.
    batch.setBucketSize(1)
    for x, y in places.tolist():
        batch.appendPoint(ocl.CLPoint(x, y, NOTHING))
    began = time.perf_counter()
    batch.run()
    took = time.perf_counter() - began
    return np.array([point.z for point in batch.getCLPoints()]), took


def deepest(facets, tool, path):
    """How far below the referee's tip the path runs, and how far above at the median."""
    z, _ = drop(facets, tool, path[:, :2])
    below = z - path[:, 2]
    suspects = np.flatnonzero(below > GOUGE_MM)
    real = below.copy()
    # At walls a hair's breadth decides: it is a gouge if it is one a hair's breadth aside, too.
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        if len(suspects):
            aside = path[suspects, :2] + np.array([dx, dy]) * ASIDE_MM
            z, _ = drop(facets, tool, aside)
            real[suspects] = np.minimum(real[suspects], z - path[suspects, 2])
    return real.max(), len(suspects), np.median(-below)


def judge(folder):
    told = json.loads((folder / "told.json").read_text())
    facets = surface(folder / "surface.stl")
    tips = np.fromfile(folder / "tips.f64").reshape(-1, 3)
    ours_s = told["drop_s"] * min(1.0, MOST_PLACES / len(tips))
    tips = tips[:MOST_PLACES]
    tool = cutter(told)
    z, took = drop(facets, tool, tips[:, :2])
    theirs = z > NOTHING
    ours = ~np.isnan(tips[:, 2])
    both = theirs & ours
    off = np.abs(z - tips[:, 2])[both]
    path = np.fromfile(folder / "path.f64").reshape(-1, 3)
    # Drawn, so that no pattern of the path is missed.
    draw = np.random.default_rng(int(folder.name))
    path = path[np.sort(draw.permutation(len(path))[:MOST_POINTS])]
    gouge, suspects, above = deepest(facets, tool, path)
    return {
        "seed": folder.name,
        "cutter": told["cutter"],
        "triangles": int(told["triangles"]),
        "places": len(tips),
        "one_sees_none": int((theirs != ours).sum()),
        "tip_um": 1e3 * off.max(),
        "tip_999_um": 1e3 * np.quantile(off, 0.999),
        "gouge_um": 1e3 * gouge,
        "suspects": suspects,
        "above_um": 1e3 * above,
        "path_points": len(path),
        "ocl_s": took,
        "ours_s": ours_s,
        "times": took / ours_s,
        "build_s": told["build_s"],
        "plan_s": told["plan_s"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--check", action="store_true", help="fail where a bar is missed")
    parser.add_argument("--faster", type=float, default=5.0, help="how many times opencamlib")
    options = parser.parse_args()
    rows = []
    for folder in sorted(options.folder.iterdir()):
        if not folder.is_dir():
            continue
        row = judge(folder)
        rows.append(row)
        if len(rows) == 1:
            print("| " + " | ".join(row) + " |")
            print("|" + " --- |" * len(row))
        cells = [f"{v:.4g}" if isinstance(v, float) else str(v) for v in row.values()]
        print("| " + " | ".join(cells) + " |", flush=True)
    theirs, ours = sum(r["ocl_s"] for r in rows), sum(r["ours_s"] for r in rows)
    gouge = max(r["gouge_um"] for r in rows)
    tip = max(r["tip_999_um"] for r in rows)
    print(
        f"\nlargest gouge {gouge:.3f} um; tips differ by {tip:.4f} um at most in 999 of 1000; "
        f"{theirs / ours:.1f} times as fast"
    )
    missed = []
    if gouge > 1e3 * GOUGE_MM:
        missed.append(f"a gouge of {gouge:.3f} um")
    lone = sum(result["one_sees_none"] for result in rows)
    if lone > 0:
        missed.append(f"{lone} places where only one of both finds a contact")
    if tip > 1e3 * TIP_MM:
        missed.append(f"tips differ by {tip:.4f} um")
    if theirs / ours < options.faster:
        missed.append(f"only {theirs / ours:.1f} times as fast")
    if options.check and missed:
        sys.exit("missed: " + "; ".join(missed))


if __name__ == "__main__":
    main()

"""B-spline surfaces of a grid with an oblique step, by `relief surface` and by FITPACK (SciPy).

    step_surface.py RELIEF FOLDER

Makes a scan of 241 x 241 points with a step of 8 mm across the grid and noise, has RELIEF make a
surface of it, and asks `RectBivariateSpline` (FITPACK's `regrid`) for one with the same root mean
square deviation. Prints seconds (ours with reading the scan and writing the file), control points
and deviations from the points. Exits with 1 if ours has more than a tenth of the control points; how much
time it takes beside FITPACK is told.
"""

import json
import pathlib
import subprocess
import sys
import time

import numpy as np
import scipy
from scipy.interpolate import RectBivariateSpline

COLUMNS = ROWS = 241
LENGTH_MM = 100.0
STEP_MM = 8.0
NOISE_MM = 0.02
TOLERANCE_MM = 0.1
SEED = 41
TURNS = 3
# FITPACK stops within a thousandth of the sum of squares that it is given.
SLACK = 1.001
MOST_ITERATIONS = 200


def grid():
    x, y = np.arange(COLUMNS) / (COLUMNS - 1), np.arange(ROWS) / (ROWS - 1)
    u, v = np.meshgrid(x, y, indexing="ij")
    past = 0.8 * (u - 0.45) + 0.6 * (v - 0.52)
    z = 3 * np.sin(4 * u) * np.cos(3 * v) + 2 * u * v + STEP_MM * (past > 0)
    noise = np.random.default_rng(SEED).standard_normal(z.shape)
    return LENGTH_MM * x, LENGTH_MM * y, z + NOISE_MM * noise


def fastest(work):
    seconds, answer = np.inf, None
    for _ in range(TURNS):
        begun = time.perf_counter()
        answer = work()
        seconds = min(seconds, time.perf_counter() - begun)
    return seconds, answer


def row(name, seconds, ours, points, rms, worst):
    times = seconds / ours
    print(f"| {name} | {seconds:.2f} | {times:.1f} | {points} | {rms:.4f} | {worst:.4f} |", flush=True)


def main():
    relief, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    x, y, z = grid()
    u, v = np.meshgrid(x, y, indexing="ij")
    scan = folder / "step.xyz"
    np.savetxt(scan, np.column_stack([u.ravel(), v.ravel(), z.ravel()]), fmt="%.6f")
    words = [relief, "surface", scan, "-o", folder / "step.igs"]
    words += ["--tolerance-mm", str(TOLERANCE_MM), "--json"]
    run = lambda: subprocess.run(words, check=True, capture_output=True, text=True).stdout
    ours_s, told = fastest(run)
    surface = json.loads(told)["surface"]
    rms = surface["rms_mm"]
    print("| method | s | times ours | control points | rms, mm | greatest, mm |")
    print("|---|---:|---:|---:|---:|---:|")
    row("`relief surface`, file to file", ours_s, ours_s, surface["control_points"], rms, surface["max_mm"])
    smooth = z.size * (SLACK * rms) ** 2
    fit = lambda: RectBivariateSpline(x, y, z, s=smooth, maxit=MOST_ITERATIONS)
    theirs_s, spline = fastest(fit)
    knots = spline.get_knots()
    points = (len(knots[0]) - 4) * (len(knots[1]) - 4)
    off = spline(x, y) - z
    name = f"SciPy {scipy.__version__}, `RectBivariateSpline`"
    row(name, theirs_s, ours_s, points, float(np.sqrt(np.mean(off**2))), float(np.abs(off).max()))
    if 10 * surface["control_points"] > points:
        sys.exit("ours has more than a tenth of the control points")


if __name__ == "__main__":
    main()

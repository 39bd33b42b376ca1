"""Medians of a million samples in the cells of a grid, by SciPy and Verde, beside the product.

    grid_medians.py FOLDER...

Each FOLDER is one that `bench --scattered` wrote: the samples, the truth, what the product found
and in how many seconds. Prints a row for each method: seconds, how many times the product's with
MLMS, and errors against the truth away from the step.
"""

import json
import pathlib
import sys
import time

import numpy as np
import pandas
import scipy
import verde
from scipy.stats import binned_statistic_2d

TURNS = 3
# A method that takes longer than this gets one turn.
LONG_S = 10
# As in the study of the regridder: where no window of ours meets the step, and gross errors.
AWAY_MM = 1.5
GROSS_MM = 0.5


def scipy_median(samples, side, pitch_mm):
    edges = (np.arange(side + 1) - 0.5) * pitch_mm
    x, y, z = samples.T
    return binned_statistic_2d(x, y, z, "median", [edges, edges]).statistic


def verde_median(samples, side, pitch_mm):
    x, y, z = samples.T
    low, high = -0.5 * pitch_mm, (side - 0.5) * pitch_mm
    reducer = verde.BlockReduce(
        np.median, spacing=pitch_mm, region=(low, high, low, high), center_coordinates=True
    )
    (east, north), median = reducer.filter((x, y), z)
    grid = np.full((side, side), np.nan)
    column = np.rint(east / pitch_mm).astype(int)
    row = np.rint(north / pitch_mm).astype(int)
    grid[column, row] = median
    return grid


PEERS = {
    f"SciPy {scipy.__version__}, `binned_statistic_2d(median)`": scipy_median,
    f"Verde {verde.__version__.lstrip('v')}, `BlockReduce(median)`": verde_median,
}
OURS = {"ours, MLMS": "least-median", "ours, consensus": "consensus"}


def fastest(method, *arguments):
    seconds, answer = np.inf, None
    for _ in range(TURNS):
        begun = time.perf_counter()
        answer = method(*arguments)
        seconds = min(seconds, time.perf_counter() - begun)
        if seconds > LONG_S:
            break
    return seconds, answer


def row(outliers, name, seconds, ours, found, truth, away):
    error = np.abs(found - truth)[away]
    has_value = ~np.isnan(error)
    error = error[has_value]
    rms = np.sqrt(np.mean(error**2))
    gross = 100 * np.mean(error > GROSS_MM)
    holes = 100 * np.mean(~has_value)
    print(
        f"| {100 * outliers:.0f} | {name} | {seconds:.2f} | {seconds / ours:.1f} "
        f"| {rms:.4f} | {gross:.3f} | {holes:.2f} |",
        flush=True,
    )
    return rms


def judge(folder):
    told = json.loads((folder / "told.json").read_text())
    side, pitch_mm, outliers = told["side"], told["pitch_mm"], told["outliers"]
    grid = lambda name: np.fromfile(folder / name, "<f8").reshape(side, side)
    samples = np.fromfile(folder / "samples", "<f8").reshape(-1, 3)
    truth = grid("truth")
    away = np.abs(grid("from-step")) > AWAY_MM
    # The outermost nodes have samples on one side only.
    away[[0, -1], :] = away[:, [0, -1]] = False
    taken = dict(told["seconds"])
    ours = taken["least-median"]
    for name, key in OURS.items():
        row(outliers, name, taken[key], ours, grid(key), truth, away)
    for name, method in PEERS.items():
        seconds, found = fastest(method, samples, side, pitch_mm)
        row(outliers, name, seconds, ours, found, truth, away)


def main():
    print("| outliers, % | method | s | times ours with MLMS | rms away from the step, mm | gross, % | without a value, % |")
    print("|---:|---|---:|---:|---:|---:|---:|", flush=True)
    for folder in sys.argv[1:]:
        judge(pathlib.Path(folder))
    print(f"pandas {pandas.__version__}, NumPy {np.__version__}", file=sys.stderr)


if __name__ == "__main__":
    main()

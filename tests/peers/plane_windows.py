"""z at nodes from scattered samples, by other programs.

    plane_windows.py METHOD SAMPLES NODES ANSWERS NEIGHBOURS NOISE_MM PITCH_MM

SAMPLES holds x, y, z and NODES x, y as little-endian doubles; ANSWERS gets z of each node,
NaN where there is none. Prints the seconds spent in the method.
"""

import sys
import time
import warnings

import numpy as np
from scipy.spatial import cKDTree


def sklearn_ransac(samples, nodes, neighbours, noise_mm, _pitch_mm):
    from sklearn.linear_model import RANSACRegressor

    warnings.filterwarnings("ignore")
    near = cKDTree(samples[:, :2]).query(nodes, neighbours)[1]
    z = np.full(len(nodes), np.nan)
    for k, node in enumerate(nodes):
        window = samples[near[k]]
        fit = RANSACRegressor(residual_threshold=3 * noise_mm, random_state=k)
        try:
            fit.fit(window[:, :2] - node, window[:, 2])
        except ValueError:
            continue
        z[k] = fit.predict(np.zeros((1, 2)))[0]
    return z


def binned_medians(samples, nodes, neighbours, _noise_mm, pitch_mm):
    """The median of the samples in a square around the node that holds as many."""
    half_mm = 0.5 * neighbours**0.5 * pitch_mm
    found = cKDTree(samples[:, :2]).query_ball_point(nodes, half_mm, p=np.inf)
    return np.array([np.median(samples[f, 2]) if f else np.nan for f in found])


def main():
    method, samples, nodes, answers, neighbours, noise_mm, pitch_mm = sys.argv[1:]
    samples = np.fromfile(samples, "<f8").reshape(-1, 3)
    nodes = np.fromfile(nodes, "<f8").reshape(-1, 2)
    run = {"sklearn-ransac": sklearn_ransac, "binned-medians": binned_medians}[method]
    begun = time.perf_counter()
    z = run(samples, nodes, int(neighbours), float(noise_mm), float(pitch_mm))
    print(time.perf_counter() - begun)
    z.astype("<f8").tofile(answers)


main()

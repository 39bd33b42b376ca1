#!/usr/bin/env python3
"""Compare the faces of an IGES file, as OpenCASCADE reads them, with the true ones.

    python scene_check.py FILE.igs TRUTH.json

TRUTH.json comes from the simulator: {"pitch_mm": P, "faces": [{"name": ...,
"area_mm2": A, "corners": N, "outline_mm": [[x, y, z], ...]}]}. Prints a table; exit
code 0 when everything holds, 1 when not. Needs cadquery-ocp and numpy.
"""

import argparse
import json
import sys

import numpy as np

import occ_check

AREA_TOLERANCE = 0.02
OUTLINE_PITCHES = 1.0
SPARE_VERTICES = 12
# Points on both outlines are this close together.
SPACING_MM = 0.05


def densified(outline, spacing):
    """Points at most `spacing` apart along a closed polyline."""
    points = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0)):
        steps = max(1, int(np.ceil(np.linalg.norm(b - a) / spacing)))
        points.append(a + (b - a) * np.arange(steps)[:, None] / steps)
    return np.concatenate(points)


def farthest(these, those):
    """Greatest distance of a point of `these` from its nearest of `those`."""
    worst = 0.0
    for chunk in np.array_split(these, max(1, len(these) // 256)):
        squared = ((chunk[:, None, :] - those[None, :, :]) ** 2).sum(axis=2)
        worst = max(worst, squared.min(axis=1).max())
    return float(np.sqrt(worst))


def pair(faces, truths):
    """The true face of each face: that whose outline has the nearest middle."""
    pairs, left = [], list(range(len(truths)))
    for face in faces:
        middle = np.mean(face["loops"][0]["points"], axis=0)
        if not left:
            break
        best = min(left, key=lambda k: np.linalg.norm(truths[k]["outline"].mean(axis=0) - middle))
        left.remove(best)
        pairs.append((face, truths[best]))
    return pairs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("truth")
    arguments = parser.parse_args()
    with open(arguments.truth, encoding="utf-8") as file:
        truth = json.load(file)
    for face in truth["faces"]:
        face["outline"] = densified(np.array(face["outline_mm"]), SPACING_MM)
    occ_check.silence()
    words = ["--spacing-mm", str(SPACING_MM), "--expect-faces", str(len(truth["faces"]))]
    report = occ_check.judge(arguments.file, occ_check.options([*words, arguments.file]))
    problems = list(report["problems"])
    pitch, vertices, corners = truth["pitch_mm"], 0, 0
    print(f"{'face':<12}{'area mm2':>10}{'of truth':>10}{'loop->true':>12}{'true->loop':>12}"
          f"{'in 3-D':>9}{'vertices':>10}{'corners':>9}   (outlines in pitches)")
    for face, true in pair(report["faces"], truth["faces"]):
        loop = np.array(face["loops"][0]["points"])
        flat, true_flat = loop[:, :2], true["outline"][:, :2]
        outward, inward = farthest(flat, true_flat) / pitch, farthest(true_flat, flat) / pitch
        space = max(farthest(loop, true["outline"]), farthest(true["outline"], loop)) / pitch
        share = face["area_mm2"] / true["area_mm2"]
        name = true["name"]
        print(f"{name:<12}{face['area_mm2']:>10.1f}{share:>10.4f}{outward:>12.2f}{inward:>12.2f}"
              f"{space:>9.2f}{face['vertices']:>10}{true['corners']:>9}")
        vertices += face["vertices"]
        corners += true["corners"]
        if abs(share - 1) > AREA_TOLERANCE:
            problems.append(f"{name}: area is {share:.4f} of the truth")
        if max(outward, inward) > OUTLINE_PITCHES:
            problems.append(f"{name}: outline off by {max(outward, inward):.2f} pitches")
        if len(face["loops"]) != 1:
            problems.append(f"{name}: {len(face['loops']) - 1} holes in a face without any")
    # A curved outline has no corners; its segments are bounded by the outline's error.
    if corners and vertices > corners + SPARE_VERTICES:
        problems.append(f"{vertices} vertices where the truth has {corners} corners")
    for problem in problems:
        print(f"  does not hold: {problem}")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()

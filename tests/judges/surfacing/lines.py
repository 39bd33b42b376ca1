#!/usr/bin/env python3
"""Has `relief surface` part surfaces at character lines across the grid, and judges its files.

    python tests/judges/surfacing/lines.py RELIEF FOLDER [--seeds N]

Makes scans of an oblique ridge, of oblique and round steps and of a cone, with noise, in FOLDER,
lets the program RELIEF make a surface of each, as IGES 144 on 128, on 114, and as STEP, reads these
with OpenCASCADE and measures the distance of every grid point from the nearest trimmed face. A
smooth scan is written untrimmed as 128 and 114, which must be the same surface. A table; exits with
1 where a point is farther off than the tolerance, where a file is not sound, or where it has not
the faces that its shape asks for: two on either side of a ridge, a step or a foot, one of what is smooth.
"""

import argparse
import json
import pathlib
import subprocess
import sys

import numpy
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.gp import gp_Pnt

SIDE = 61
TOLERANCE_MM = 0.1
NOISE_MM = 0.02


def waves(x, y):
    return 3 * numpy.sin(4 * x) * numpy.cos(3 * y) + 2 * x * y


def past(x, y):
    return 0.8 * (x - 0.45) + 0.6 * (y - 0.52)


def radius(x, y):
    return numpy.hypot(x - 0.45, y - 0.52)


# Name, shape, faces that are required. The creases are of 23 and 27 degrees.
SHAPES = [
    ("oblique ridge", lambda x, y: waves(x, y) - 12 * abs(past(x, y)), 2),
    ("oblique step", lambda x, y: waves(x, y) + 8 * (past(x, y) > 0), 2),
    ("round step", lambda x, y: waves(x, y) + 8 * (radius(x, y) < 0.3), 2),
    ("cone on a plane", lambda x, y: waves(x, y) + 30 * numpy.maximum(0.35 - radius(x, y), 0), 2),
    ("smooth", waves, 1),
]


def read(path):
    reader = STEPControl_Reader() if path.suffix == ".step" else IGESControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        sys.exit(f"{path}: OpenCASCADE cannot read it")
    reader.TransferRoots()
    return reader.OneShape()


def faces(shape):
    explorer, found = TopExp_Explorer(shape, TopAbs_FACE), []
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def farthest(points, shape):
    worst = 0.0
    for point in points:
        vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*map(float, point))).Vertex()
        worst = max(worst, BRepExtrema_DistShapeShape(vertex, shape).Value())
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("relief", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    print("| shape | seed | file | faces | control points | farthest point mm | sound |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    wrong = []
    for name, shape, expected in SHAPES:
        for seed in range(31, 31 + options.seeds):
            noise = numpy.random.default_rng(seed)
            share = numpy.arange(SIDE) / (SIDE - 1)
            x, y = numpy.meshgrid(share, share, indexing="ij")
            z = shape(x, y) + NOISE_MM * noise.standard_normal(x.shape)
            points = numpy.column_stack([(60 * x).ravel(), (60 * y).ravel(), z.ravel()])
            stem = options.folder / f"{name.replace(' ', '-')}-{seed}"
            scan = stem.with_suffix(".xyz")
            numpy.savetxt(scan, points, fmt="%.6f")
            for kind in ["128", "114", "step"]:
                words = [] if kind == "step" else ["--entities", kind]
                path = stem.with_suffix(".step") if kind == "step" else pathlib.Path(f"{stem}-{kind}.igs")
                told = subprocess.run(
                    [options.relief, "surface", scan, "-o", path, "--tolerance-mm", str(TOLERANCE_MM),
                     "--json", *words],
                    check=True, capture_output=True, text=True,
                )
                count = json.loads(told.stdout)["surface"]["control_points"]
                made = read(path)
                found, off = len(faces(made)), farthest(points, made)
                sound = BRepCheck_Analyzer(made).IsValid()
                print(f"| {name} | {seed} | {kind} | {found} | {count} | {off:.4f} | {sound} |", flush=True)
                if found != expected or off > TOLERANCE_MM or not sound:
                    wrong.append(f"{name}, seed {seed}, {kind}")
    if wrong:
        sys.exit("not as they should be: " + "; ".join(wrong))


if __name__ == "__main__":
    main()

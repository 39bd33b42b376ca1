#!/usr/bin/env python3
"""Make random parts as B-reps by OpenCASCADE, with what each of their faces really is.

    python make.py --out DIR SEED [SEED ...]

For each seed: SEED.stl (fine triangles, by face), SEED.json (seed, name, per face the kind of
surface with its numbers and the range of its triangles, and the edges between faces) and
SEED.brep (the part itself). Parts are about 100 mm wide, look towards +z, and are turned a few
degrees off the axes. The same seed gives the same part. A file that is there is not made again,
unless --anew is given.
"""

import argparse
import json
import math
import os
import random
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bases
import features
import solids
import truth
from OCP.BRepTools import BRepTools

ATTEMPTS = 20


def drawn(seed, attempt):
    """A part before and after its features, with their names."""
    dice = random.Random(f"part {seed} {attempt}")
    base = bases.KINDS[int(dice.random() * len(bases.KINDS))](dice)
    solid, names = base.solid, []
    kinds = features.ON_FLAT if base.is_flat else features.ON_FREE_FORM
    for x, y, room, z in base.places:
        if dice.random() < 0.12:
            continue
        solid, name = features.add(dice, solid, kinds, (x, y), 0.95 * room, z)
        if name:
            names.append(name)

    def either_way(least, most):
        return math.radians(dice.uniform(least, most)) * (1.0 if dice.random() < 0.5 else -1.0)

    solid = solids.turned(solid, (0, 0, 1), math.radians(dice.uniform(-15.0, 15.0)))
    solid = solids.turned(solid, (1, 0, 0), either_way(2.0, 8.0))
    solid = solids.turned(solid, (0, 1, 0), either_way(2.0, 8.0))
    return base.name, names, solids.only_solid(solid)


def part(seed):
    """The part of a seed: the first attempt that OpenCASCADE finds sound."""
    for attempt in range(ATTEMPTS):
        try:
            name, names, solid = drawn(seed, attempt)
            told, triangles = truth.of(solid)
        except solids.Failed:
            continue
        except Exception as error:  # of OpenCASCADE, which have no common base in Python
            print(f"seed {seed}, attempt {attempt}: {error}", file=sys.stderr)
            continue
        return {"seed": seed, "name": name, "features": names, **told}, triangles, solid
    sys.exit(f"seed {seed}: no sound part in {ATTEMPTS} attempts")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", nargs="+", type=int)
    parser.add_argument("--out", required=True)
    parser.add_argument("--anew", action="store_true")
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    for seed in arguments.seeds:
        stem = os.path.join(arguments.out, str(seed))
        # The truth is written last: where it is, the rest is whole.
        if os.path.exists(stem + ".json") and not arguments.anew:
            continue
        told, triangles, solid = part(seed)
        truth.write_stl(stem + ".stl", triangles)
        BRepTools.Write_s(solid, stem + ".brep")
        with open(stem + ".json.part", "w", encoding="utf-8") as file:
            json.dump(told, file)
        os.replace(stem + ".json.part", stem + ".json")
        kinds = [face["kind"] for face in told["faces"]]
        print(f"part {seed}: {told['name']} with {', '.join(told['features']) or 'nothing'}; "
              f"{len(kinds)} faces, {len(triangles)} triangles")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Make random parts of known machining features by OpenCASCADE, and say how each is to be scanned.

    python make.py --out DIR SEED [SEED ...]

For each seed: SEED.stl (triangles by face), SEED.step (the part) and SEED.json: the features as a
tree, with where they are and how large, in the scan's frame; the surface and the triangles of every
face; the conditions of the scan. Seeds 1 to 300 are for judging, 1001 to 1400 for tuning. The same
seed gives the same part. A part that is there is not made again, unless --anew is given.

A block of 40 to 120 by 30 to 80 by 10 to 40 mm has one to eight features: pockets, slots, steps,
holes, bosses, one on another to a depth of three, edges broken or rounded, equal holes in patterns,
free-form floors. Each is at least ten pitches wide (chamfers, rounds and fillets five) and at least
1 mm or eight standard deviations of the noise deep; between two of them at least four pitches of
their ground can be seen.
"""

import argparse
import math
import os
import random
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import kinds
import parts
import solids
from parts import Part

ATTEMPTS = 60
# Of the scans: in so many the table around the part is not seen; so many parts are not turned.
NO_TABLE, NOT_TURNED = 0.25, 0.15


class Plan:
    """What a part is drawn from: the dice, the scan's conditions, how near things may be."""

    def __init__(self, dice, wanted):
        self.dice, self.wanted = dice, wanted
        self.pitch = dice.uniform(0.25, 0.5)
        self.noise = math.exp(dice.uniform(math.log(0.02), math.log(0.2)))
        self.outliers = dice.uniform(0.0, 0.05)
        self.mixed = dice.uniform(0.0, 0.3)
        # A little more than what is promised, for what is cut at a slant by the grid.
        self.least = 10.5 * self.pitch
        self.land = max(4.5 * self.pitch, 1.8)
        self.shallow = max(1.0, 8.0 * self.noise) * 1.05


def drawn(seed, attempt):
    dice = random.Random(f"part of features {seed} {attempt}")
    # Of the seed alone: else parts of few features, which are made at once, were the most.
    plan = Plan(dice, random.Random(f"features of part {seed}").randint(1, 8))
    size = (dice.uniform(40.0, 120.0), dice.uniform(30.0, 80.0), dice.uniform(10.0, 40.0))
    if size[1] > size[0]:
        size = (size[1], size[0], size[2])
    made = Part(*size)
    state = kinds.begin(plan, made)
    tries = 0
    while len(made.features) - 1 < plan.wanted and tries < 60:
        tries += 1
        kinds.add(plan, made, state)
    if len(made.features) - 1 < plan.wanted:
        raise solids.Failed("no room for all features")
    return plan, made


def scanned(plan, made, seed):
    """How the part lies and is scanned."""
    dice = plan.dice
    turn = 0.0 if dice.random() < NOT_TURNED else dice.uniform(0.0, 2.0 * math.pi)
    table_seen = dice.random() >= NO_TABLE
    length, width, height = made.size
    to = tuple(dice.uniform(-20.0, 20.0) for _ in range(3))
    own = parts.pose(turn, (length / 2, width / 2), to)
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    margin = dice.uniform(6.0, 10.0)
    half = [(length * c + width * s) / 2 + margin, (length * s + width * c) / 2 + margin]
    low, high = to[2] - height, to[2] + 12.0
    # The box is on whole millimetres: where columns fall on the part is chance.
    view = [[math.floor(to[0] - half[0]), math.floor(to[1] - half[1]), low],
            [math.ceil(to[0] + half[0]), math.ceil(to[1] + half[1]), high]]
    scan = {"seed": seed, "pitch_mm": plan.pitch, "noise_mm": plan.noise,
            "outliers": plan.outliers, "mixed": plan.mixed, "dropouts": 0.02,
            "spot_radius_mm": 0.05, "table_z_mm": low if table_seen else None,
            "view_mm": view, "window_mm": None}
    return own, turn, table_seen, scan


def write(folder, seed):
    for attempt in range(ATTEMPTS):
        try:
            plan, made = drawn(seed, attempt)
            own, turn, table_seen, scan = scanned(plan, made, seed)
            solid, features = parts.placed(made, own)
            solid = solids.only_solid(solid)
            parts.write(folder, str(seed), solid, features, scan, seed=seed, attempt=attempt,
                        turn_deg=math.degrees(turn), patterns=made.patterns,
                        table_seen=table_seen)
        except solids.Failed:
            continue
        except parts.NotAsTold as error:
            # Where OpenCASCADE has lost a cut, or tools met as they were not planned to.
            print(f"seed {seed}, attempt {attempt}: {error}", file=sys.stderr)
            continue
        except Exception as error:  # of OpenCASCADE, which have no common base in Python
            if not type(error).__module__.startswith("OCP"):
                raise
            print(f"seed {seed}, attempt {attempt}: {error}", file=sys.stderr)
            continue
        said = ", ".join(f"{told['type']}" + (f" on {told['parent']}" if told["parent"] else "")
                         for told in features[1:])
        print(f"part {seed}: {said}", flush=True)
        return
    sys.exit(f"seed {seed}: no sound part in {ATTEMPTS} attempts")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", nargs="+", type=int)
    parser.add_argument("--out", required=True)
    parser.add_argument("--anew", action="store_true")
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    for seed in arguments.seeds:
        if arguments.anew or not os.path.exists(os.path.join(arguments.out, f"{seed}.json")):
            write(arguments.out, seed)


if __name__ == "__main__":
    main()

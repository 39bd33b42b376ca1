#!/usr/bin/env python3
"""The part of Jun and Park, section 7, completed where the paper leaves it open.

    python published.py --step FILE
    python published.py --out DIR [--turn-deg 5] [--no-table] SEED [SEED ...]

The paper gives the sizes of Table 3 and four points; it does not say where the pockets and the slot
lie, nor how high the boss and how deep the hole are, and its picture shows no numbers. Taken here:

- The frame of Table 3: origin at a corner, x along the length, the block's top at z = 0.
- The first pocket lies in the middle of the block, its corners of radius 3; its floor at -7.85, its
  depth in the table. The centres of boss and hole were measured, at -7.60 and -7.58; here they lie
  on the floor.
- The boss is 4 high, the hole 10 deep with a flat bottom.
- The slot comes in from the block's side at y = 0, through the wall of the first pocket, over its
  floor and into the floor of the second: so it lies on the floors of both, and its three sizes are
  those of the table, its depth from the block's top, where it is open to. Its length is along its
  run, shorter than it is wide.
- The second pocket is 50 by 8.5 with corners of radius 4, below the boss, beside whose foot 2 mm
  of floor are left, and about the point (25.12, 17.97, -14.87), which lies on its bottom. The slot
  crosses it in the middle: its ends, and a ledge behind the slot's end, remain.
"""

import argparse
import math
import os
import random
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import parts
import solids
from parts import ABOVE, Circle, Part, Rectangle

LENGTH, WIDTH, HEIGHT = 100.871, 50.160, 23.762
FLOOR = -7.85
POCKET = (79.811, 28.557)
BOSS, BOSS_AT, BOSS_HIGH = 8.026, (20.29, 24.95), 4.0
HOLE, HOLE_AT, HOLE_DEEP = 8.019, (79.99, 25.25), 10.0
SLOT_LENGTH, SLOT_WIDTH, SLOT_DEEP, SLOT_X = 18.36, 20.211, 14.436, 48.0
SECOND, SECOND_AT, SECOND_CORNER = (50.0, 8.5), (47.4, 16.75), 4.0
FREE_POINT = (25.12, 17.97, -14.87)
# Of columns and samples: about 33,000 samples of the part come back.
PITCH_MM = 0.3795
MARGIN_MM = 4.0


def free_form():
    """The bottom of the second pocket: a hollow about the paper's point, a rise under the slot's
    end, a lesser hollow beyond."""
    def shape(x, y):
        left = math.exp(-(((x - 26.0) / 6.5) ** 2 + ((y - 17.0) / 9.0) ** 2))
        right = math.exp(-(((x - 66.0) / 6.0) ** 2 + ((y - 15.5) / 7.0) ** 2))
        return -12.2 - 2.3 * left - 1.1 * right + 0.12 * math.sin(0.45 * x + 0.5 * y)

    low, high = (18.0, 9.0), (76.0, 24.0)
    _, at = parts.wavy(low, high, shape)
    short = FREE_POINT[2] - at(FREE_POINT[0], FREE_POINT[1])
    # A hollow that is deeper by what is short there: the rest stays where it is.
    reach = math.exp(-(((FREE_POINT[0] - 26.0) / 6.5) ** 2 + ((FREE_POINT[1] - 17.0) / 9.0) ** 2))

    def mended(x, y, by):
        left = math.exp(-(((x - 26.0) / 6.5) ** 2 + ((y - 17.0) / 9.0) ** 2))
        return shape(x, y) + by * left

    by = short / reach
    for _ in range(4):
        surface, at = parts.wavy(low, high, lambda x, y: mended(x, y, by))
        by += (FREE_POINT[2] - at(FREE_POINT[0], FREE_POINT[1])) / reach
    return parts.wavy(low, high, lambda x, y: mended(x, y, by))


def part():
    made = Part(LENGTH, WIDTH, HEIGHT)
    pocket = Rectangle((LENGTH / 2, WIDTH / 2), *POCKET, corner=3.0)
    made.solid = solids.cut(made.solid, pocket.prism(FLOOR, ABOVE))
    first = made.tell("pocket", 0, pocket, 0.0, FLOOR,
                      {"length": POCKET[0], "width": POCKET[1], "depth": -FLOOR,
                       "corner_radius": 3.0})
    boss = Circle(BOSS_AT, BOSS)
    made.solid = solids.fuse(made.solid, boss.prism(FLOOR - 1.0, FLOOR + BOSS_HIGH))
    made.tell("boss", first, boss, FLOOR, FLOOR + BOSS_HIGH,
              {"diameter": BOSS, "height": BOSS_HIGH})
    hole = Circle(HOLE_AT, HOLE)
    made.solid = solids.cut(made.solid, hole.prism(FLOOR - HOLE_DEEP, ABOVE))
    made.tell("hole", first, hole, FLOOR, FLOOR - HOLE_DEEP,
              {"diameter": HOLE, "depth": HOLE_DEEP}, through=False)
    second = Rectangle(SECOND_AT, *SECOND, corner=SECOND_CORNER)
    surface, at = free_form()
    made.solid = solids.cut(made.solid,
                            solids.common(second.prism(-HEIGHT, ABOVE), parts.above(surface)))
    slot = Rectangle((SLOT_X, SLOT_LENGTH / 2), SLOT_LENGTH, SLOT_WIDTH, turn=math.pi / 2)
    made.solid = solids.cut(made.solid, Rectangle(
        (SLOT_X, SLOT_LENGTH / 2 - 5.0), SLOT_LENGTH + 10.0, SLOT_WIDTH,
        turn=math.pi / 2).prism(-SLOT_DEEP, ABOVE))
    heights = [at(*second.point(u / 10, v / 10)) for u in range(-9, 10) for v in range(-9, 10)]
    made.tell("pocket", first, second, FLOOR, sum(heights) / len(heights),
              {"length": SECOND[0], "width": SECOND[1], "corner_radius": SECOND_CORNER},
              free_form=True, depth_mm=[FLOOR - max(heights), FLOOR - min(heights)],
              points_mm=[list(FREE_POINT)])
    made.tell("slot", 0, slot, 0.0, -SLOT_DEEP,
              {"length": SLOT_LENGTH, "width": SLOT_WIDTH, "depth": SLOT_DEEP})
    return made


def conditions(seed, to, turn_deg, pitch_mm, table_seen):
    """The scan: the box that it covers does not follow the part, which lies a little elsewhere for
    every seed."""
    c, s = abs(math.cos(math.radians(turn_deg))), abs(math.sin(math.radians(turn_deg)))
    half = [(LENGTH * c + WIDTH * s) / 2 + MARGIN_MM, (LENGTH * s + WIDTH * c) / 2 + MARGIN_MM]
    low = to[2] - HEIGHT
    return {"seed": seed, "pitch_mm": pitch_mm, "noise_mm": 0.05, "outliers": 0.01, "mixed": 0.1,
            "dropouts": 0.001, "spot_radius_mm": 0.05, "table_z_mm": low if table_seen else None,
            "view_mm": [[-half[0], -half[1], low], [half[0], half[1], to[2]]], "window_mm": None}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", nargs="*", type=int)
    parser.add_argument("--out")
    parser.add_argument("--step")
    parser.add_argument("--turn-deg", type=float, default=5.0)
    parser.add_argument("--pitch-mm", type=float, default=PITCH_MM)
    parser.add_argument("--name", default="published-{turn:g}deg-{seed}")
    parser.add_argument("--no-table", action="store_true")
    parser.add_argument("--anew", action="store_true")
    arguments = parser.parse_args()
    made = part()
    if arguments.step:
        parts.write_step(arguments.step, made.solid)
    if arguments.out:
        os.makedirs(arguments.out, exist_ok=True)
    for seed in arguments.seeds:
        name = arguments.name.format(turn=arguments.turn_deg, seed=seed)
        if os.path.exists(os.path.join(arguments.out, name + ".json")) and not arguments.anew:
            continue
        dice = random.Random(f"published part {seed}")
        to = (dice.uniform(-0.5, 0.5), dice.uniform(-0.5, 0.5), dice.uniform(-0.5, 0.5))
        own = parts.pose(math.radians(arguments.turn_deg), (LENGTH / 2, WIDTH / 2), to)
        solid, features = parts.placed(made, own)
        table_seen = not arguments.no_table
        scan = conditions(seed, to, arguments.turn_deg, arguments.pitch_mm, table_seen)
        parts.write(arguments.out, name, solid, features, scan, seed=seed,
                    turn_deg=arguments.turn_deg, to_mm=list(to), about_mm=[LENGTH / 2, WIDTH / 2],
                    patterns=[], table_seen=table_seen)
        print(f"part {name}: {len(features)} features")


if __name__ == "__main__":
    main()

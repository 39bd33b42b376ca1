#!/usr/bin/env python3
"""Make parts of which little can be told, and scans that do not show all of a part.

    python odd.py --out DIR

`blank` is a block with nothing on it, `free-form` a block whose top is nothing else; `half` shows one
half of a part, `cut` all of a part but for the end of one pocket. In the truth `cut` marks what the
border of the scan cuts, `out_of_view` what it leaves out: of the first no size that the scan does
not show may be stated without a warning, of the second nothing can be said. The table is seen
around the blank block and the free form.
"""

import argparse
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import parts
import solids
from parts import ABOVE, Circle, Part, Rectangle

MARGIN_MM = 8.0


def blank():
    return Part(80.0, 50.0, 20.0), None


def free_form():
    made = Part(80.0, 60.0, 25.0)

    def shape(x, y):
        return (-4.0 + 1.9 * math.sin(0.11 * x + 0.05 * y) + 1.4 * math.cos(0.13 * y - 0.04 * x)
                + 0.5 * math.sin(0.21 * x))

    surface, _ = parts.wavy((-2.0, -2.0), (82.0, 62.0), shape)
    everything = solids.box((-5.0, -5.0, -20.0), (85.0, 65.0, ABOVE))
    made.solid = solids.cut(made.solid, solids.common(everything, parts.above(surface)))
    # Where its top is, is nobody's to say.
    del made.features[0]["dimensions_mm"]["height"]
    made.features[0]["free_form"] = True
    return made, None


def some_features():
    """A pocket with a hole in it at one end, a boss and a slot at the other."""
    made = Part(90.0, 60.0, 25.0)
    pocket = Rectangle((62.0, 30.0), 36.0, 26.0, corner=3.0)
    made.solid = solids.cut(made.solid, pocket.prism(-6.0, ABOVE))
    first = made.tell("pocket", 0, pocket, 0.0, -6.0,
                      {"length": 36.0, "width": 26.0, "depth": 6.0, "corner_radius": 3.0})
    hole = Circle((56.0, 30.0), 7.0)
    made.solid = solids.cut(made.solid, hole.prism(-12.0, ABOVE))
    made.tell("hole", first, hole, -6.0, -12.0, {"diameter": 7.0, "depth": 6.0}, through=False)
    boss = Circle((18.0, 42.0), 12.0)
    made.solid = solids.fuse(made.solid, boss.prism(-1.0, 5.0))
    made.tell("boss", 0, boss, 0.0, 5.0, {"diameter": 12.0, "height": 5.0})
    slot = Rectangle((19.0, 12.5), 25.0, 9.0, turn=math.pi / 2)
    made.solid = solids.cut(made.solid, Rectangle((19.0, 7.5), 35.0, 9.0, turn=math.pi / 2).prism(
        -5.0, ABOVE))
    made.tell("slot", 0, slot, 0.0, -5.0, {"length": 25.0, "width": 9.0, "depth": 5.0})
    return made


def half():
    """What lies left of x = 52 is seen: of the pocket a strip, of the hole nothing."""
    made = some_features()
    made.features[0]["cut"] = ["length"]
    made.features[1]["cut"] = ["length"]
    made.features[2]["out_of_view"] = True
    return made, [[-200.0, -200.0], [52.0 - 45.0, 200.0]]


def cut():
    """All is seen but for what lies right of x = 74: the pocket's end and the block's."""
    made = some_features()
    made.features[0]["cut"] = ["length"]
    made.features[1]["cut"] = ["length"]
    return made, [[-200.0, -200.0], [74.0 - 45.0, 200.0]]


ODD = {"blank": blank, "free-form": free_form, "half": half, "cut": cut}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", required=True)
    parser.add_argument("--anew", action="store_true")
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    for seed, (name, make) in enumerate(ODD.items(), 1):
        name = f"odd-{name}"
        if os.path.exists(os.path.join(arguments.out, name + ".json")) and not arguments.anew:
            continue
        made, window = make()
        length, width, height = made.size
        # What is cut by the border of the scan is not turned: the border is along y.
        turn = 0.0 if window else math.radians(12.0)
        own = parts.pose(turn, (length / 2, width / 2), (0.0, 0.0, 0.0))
        solid, features = parts.placed(made, own)
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        side = [(length * c + width * s) / 2 + MARGIN_MM, (length * s + width * c) / 2 + MARGIN_MM]
        scan = {"seed": seed, "pitch_mm": 0.35, "noise_mm": 0.05, "outliers": 0.01, "mixed": 0.1,
                "dropouts": 0.02, "spot_radius_mm": 0.05, "table_z_mm": -height,
                "view_mm": [[-side[0], -side[1], -height], [side[0], side[1], 10.0]],
                "window_mm": window}
        parts.write(arguments.out, name, solid, features, scan, seed=seed,
                    turn_deg=math.degrees(turn), patterns=[], table_seen=True)
        print(f"part {name}: {len(features)} features")


if __name__ == "__main__":
    main()

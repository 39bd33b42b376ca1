"""The judge of range images itself, held against faces whose faults are known."""

import math

import numpy as np
import range_loops

TOP_MM, TABLE_MM, FLOOR_MM = 10.0, 0.0, 7.0
HOLE = {"centre_mm": [20.0, 15.0, TOP_MM], "diameter_mm": 6.0, "depth_mm": 3.0, "sort": "shallow"}
BOSS = (40.0, 15.0)
# What no part has, and how large it is.
STAIN, STAIN_MM = (30.0, 25.0), 3.0


def expect(what, is_so):
    if not is_so:
        raise SystemExit(f"the judge of range images is wrong about {what}")


def circle(at, diameter, z=TOP_MM):
    turn = np.radians(np.arange(0, 360, 3))
    return np.stack([at[0] + diameter / 2 * np.cos(turn), at[1] + diameter / 2 * np.sin(turn),
                     np.full(len(turn), z)], axis=1)


def square(low, high, z):
    return np.array([[low[0], low[1], z], [high[0], low[1], z], [high[0], high[1], z], [low[0], high[1], z]])


def truth():
    stain = {"centre_mm": list(STAIN), "radius_mm": STAIN_MM / 2, "rim_mm": 0.5, "loss": 1.0}
    scan = {"view_mm": [[0.0, 0.0, TABLE_MM], [60.0, 40.0, 20.0]], "table_z_mm": TABLE_MM, "stains": [stain],
            "standoff_mm": 750.0, "baseline_mm": 150.0, "glare": 0.5, "glare_width_deg": 1.0}
    return range_loops.Truth({
        "name": "planted", "top": {"kind": "flat", "at_mm": [30.0, 20.0, TOP_MM], "lean_deg": 0.0},
        "outline_mm": square((10, 5), (50, 35), 0)[:, :2].tolist(), "holes": [HOLE],
        "bosses": [{"outline_mm": circle(BOSS, 8.0)[:, :2].tolist(), "top_z_mm": TOP_MM + 5.0}], "pockets": [],
        "scan": scan, "extent_mm": [[10.0, 5.0, TABLE_MM], [50.0, 35.0, TOP_MM + 5.0]]})


def part(*inner, more=()):
    """A file's faces: the top with these inner loops, the hole's floor, the boss, the table around the part."""
    return [(square((10, 5), (50, 35), TOP_MM), list(inner)), (circle(HOLE["centre_mm"], 5.8, FLOOR_MM), []),
            (circle(BOSS, 8.0, TOP_MM + 5.0), []),
            (square((0, 0), (60, 40), TABLE_MM), [square((9.5, 3), (50.5, 35.5), TABLE_MM)]), *more]


def run():
    known = truth()
    disc = known.grid.inside(circle((20.0, 15.0), 6.0))
    expect("the area of a loop", abs(disc.sum() * range_loops.STEP_MM ** 2 - 9 * math.pi) < 0.3)
    expect("the size of a loop", abs(range_loops.size_mm(square((0, 0), (3, 4), 0)) - 5.0) < 0.01)
    # The sensor looks from larger y: what it does not see lies on the other side, as far as its slant has it.
    y = known.y[known.hidden]
    expect("shadows", known.hidden.any() and 9.0 < y.min() < 11.0 and y.max() < 15.0)
    hole, boss = circle(HOLE["centre_mm"], 6.2), circle(BOSS, 9.0)
    stain, other = circle(STAIN, STAIN_MM), circle((25.0, 10.0), 2.0)
    said = lambda off, on: range_loops.compare(known, {"off": off, "on": on}, {"holes": []}, 15.0)
    good = said(part(hole, boss, stain), part(hole, boss))
    expect("a needless loop", [loop["cause"] for loop in good["off"]["loops"]] == ["black"])
    expect("a loop that is closed", good["off"]["loops"][0]["closed"] and not good["on"]["loops"])
    expect("a hole that is kept", good["on"]["holes"] == [{"open": 1.0, "kept": True, "loop": True}])
    area_mm2 = 40 * 30 - math.pi * (9 + 16)
    rims_mm2 = math.pi / 4 * (6.2 ** 2 - 36 + 81 - 64)
    for name, open_mm2 in (("on", rims_mm2), ("off", rims_mm2 + math.pi / 4 * STAIN_MM ** 2)):
        expect("what is covered", abs(good[name]["covered"] - (1 - open_mm2 / area_mm2)) < 0.002)
    expect("nothing wrong", not good["wrong"])
    lost = said(part(hole, boss, stain), part(boss))
    expect("a hole that is lost", [one["what"] for one in lost["wrong"]] == ["lost"])
    half = said(part(hole, boss), part(circle((21.5, 15.0), 4.0), boss))
    expect("half a hole", not half["on"]["holes"][0]["kept"])
    left = said(part(hole, boss, stain), part(hole, boss, circle(STAIN, 2.0)))
    expect("a loop that is left", [one["what"] for one in left["wrong"]] == ["left"])
    bare = said(part(hole, boss, stain), [*part(hole, boss, stain)[1:]])
    expect("a loop that went with its face", not bare["off"]["loops"][0]["closed"])
    new = said(part(hole, boss), part(hole, boss, other))
    expect("a new loop", [one["what"] for one in new["wrong"]] == ["new"] and new["on"]["loops"][0]["new"])
    table = part(hole, boss)
    table[3][1].append(circle((55.0, 30.0), 2.0, TABLE_MM))
    expect("a loop on the table", [loop["where"] for loop in said(table, table)["off"]["loops"]] == ["table"])
    floor = part(hole, boss, more=[(circle(HOLE["centre_mm"], 5.0, FLOOR_MM), [circle(HOLE["centre_mm"], 2.0, FLOOR_MM)])])
    expect("a loop on a floor", [loop["where"] for loop in said(floor, floor)["off"]["loops"]] == ["elsewhere"])

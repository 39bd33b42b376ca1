#!/usr/bin/env python3
"""Make glossy, stained parts with drilled holes by OpenCASCADE, and say how each is to be scanned.

    python range_parts.py --out DIR SEED [SEED ...]

For each seed: SEED.stl (triangles by face) and SEED.json: drilled holes, bosses, pockets and stains,
where they are and how large, in the scan's frame; the top; the surface and the triangles of every face;
the conditions of the scan. Seeds 1 to 50 are for judging, 1001 and above for tuning. The same seed gives
the same part. A part that is there is not made again, unless --anew is given.

A block of 60 to 110 by 45 to 75 by 12 to 30 mm, turned at random. Its top is flat, leans along x by 3
to 9 degrees, or is a cylinder or a ball of 60 to 200 mm. It has one to five holes drilled along z, up to
three bosses and two pockets, and one to five stains. Gloss loses readings where the top mirrors the
laser's beam at the sensor. On a flat top that place lies beyond the part or is a stripe across all of
it, since laser and sensor travel along x together; a ball leaves a round hole, and a cylinder that falls
with y an oval one.
"""

import argparse
import json
import math
import os
import random
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "parts"))
sys.path.insert(0, os.path.join(HERE, "..", "features"))

import parts
import range_tops
import solids
import truth
from parts import Circle, Rectangle, apart, gap, is_inside

ATTEMPTS = 400
# Of the scans: in so many the table around the part is not seen; so many parts are not turned.
NO_TABLE, NOT_TURNED = 0.25, 0.15
# Laser and sensor look from aside: a wall hides so much of the ground at its foot, by its height.
SHADOW = 0.35
# Clear ground around a hole, pitches; a little more than what is promised, for what is cut at a slant.
CLEAR = 4.5
# Least width of what is to be found, pitches.
LEAST = 10.5
# Least material under what is deepest, millimetres.
BOTTOM = 1.5
# Within the clear ground around a hole no more readings than that are lost to gloss.
GLARE_AT_HOLES = 0.1
# Where more are lost than this, the range image has a hole; and how large those shall be, millimetres.
GLARE_HOLE, GLARE_LEAST_MM, GLARE_MOST_MM = 0.8, 2.0, 12.0


class Plan:
    """What a part is drawn from. What it is to have depends on the seed alone: else parts with little on
    them, which are made at once, were the most."""

    def __init__(self, seed, attempt):
        first = random.Random(f"kind of glossy part {seed}")
        self.top = first.choice(("flat", "leaning", "cylinder", "ball"))
        self.holes = first.randint(1, 5)
        self.bosses, self.pockets = first.randint(0, 3), first.randint(0, 2)
        self.stains = first.randint(1, 5)
        self.table_seen = first.random() >= NO_TABLE
        dice = self.dice = random.Random(f"glossy part {seed} {attempt}")
        self.pitch = dice.uniform(0.3, 0.5)
        self.noise = math.exp(dice.uniform(math.log(0.02), math.log(0.1)))
        self.clear = CLEAR * self.pitch
        # On tops without a mirror all is salt and pepper at most; the others shall have holes.
        self.glare = dice.uniform(0.5 if self.top in ("flat", "leaning") else 0.9, 1.0)


class Made:
    """A part in the making: the solid, the footprints on it, and what is told of it."""

    def __init__(self, plan):
        dice = plan.dice
        self.size = (dice.uniform(60.0, 110.0), dice.uniform(45.0, 75.0), dice.uniform(12.0, 30.0))
        self.middle = (dice.uniform(-20.0, 20.0), dice.uniform(-20.0, 20.0), dice.uniform(-20.0, 20.0))
        turn = 0.0 if dice.random() < NOT_TURNED else dice.uniform(0.0, 2.0 * math.pi)
        self.block = Rectangle(self.middle[:2], self.size[0], self.size[1], turn=turn)
        self.bottom = self.middle[2] - self.size[2]
        self.taken = []
        self.holes, self.bosses, self.pockets, self.stains = [], [], [], []

    def heights(self, footprint):
        return [self.top.height(*p) for p in footprint.outline()]

    def place(self, plan, footprint_at, clear, high=0.0):
        """A footprint with clear ground around it, and around what there is, shadows counted."""
        own = self.block.outline()
        for _ in range(60):
            at = self.block.point(plan.dice.uniform(-0.95, 0.95), plan.dice.uniform(-0.95, 0.95))
            footprint = footprint_at(at)
            outline = footprint.outline()
            if not all(is_inside(p, own) for p in outline) or gap(outline, own) < clear:
                continue
            if all(apart(outline, other) >= clear + SHADOW * max(high, other_high)
                   for other, other_high in self.taken):
                return footprint
        raise solids.Failed("no room")


def hole(plan, made):
    dice, least = plan.dice, LEAST * plan.pitch
    sort = dice.choice(("shallow", "deep", "through"))
    shallowest = max(1.0, 8.0 * plan.noise)
    most = 12.0 if sort != "deep" else min(12.0, (made.size[2] - BOTTOM) / 3.2)
    if most < least:
        raise solids.Failed("too wide")
    diameter = dice.uniform(least, most)
    footprint = made.place(plan, lambda at: Circle(at, diameter), plan.clear)
    heights = made.heights(footprint)
    room = min(heights) - made.bottom - BOTTOM
    if sort == "through":
        depth = None
    elif sort == "deep":
        depth = dice.uniform(3.0, 8.0) * diameter
        if depth > room:
            depth = dice.uniform(3.0 * diameter, room) if room >= 3.0 * diameter else math.inf
    else:
        depth = dice.uniform(shallowest, max(shallowest, 1.5 * diameter))
    if depth is not None and depth > room:
        raise solids.Failed("too deep")
    floor = made.bottom - 5.0 if depth is None else min(heights) - depth
    made.solid = solids.cut(made.solid, footprint.prism(floor, max(heights) + 5.0))
    made.taken.append((footprint.outline(), 0.0))
    made.holes.append({"centre_mm": [*footprint.at, made.top.height(*footprint.at)],
                       "diameter_mm": diameter, "depth_mm": depth, "sort": sort})


def either(plan, low, high):
    """A round or a rectangular footprint, at a place."""
    dice = plan.dice
    if dice.random() < 0.5:
        diameter = dice.uniform(low, high)
        return lambda at: Circle(at, diameter)
    length, width = dice.uniform(low, high), dice.uniform(low, high)
    turn = dice.uniform(0.0, math.pi)
    return lambda at: Rectangle(at, length, width, 0.0, turn)


def boss(plan, made):
    high = plan.dice.uniform(2.0, 8.0)
    footprint = made.place(plan, either(plan, 5.0, 15.0), plan.clear, high)
    heights = made.heights(footprint)
    top = max(heights) + high
    made.solid = solids.fuse(made.solid, footprint.prism(min(heights) - 1.0, top))
    made.taken.append((footprint.outline(), top - min(heights)))
    made.bosses.append({"outline_mm": footprint.outline(), "top_z_mm": top})


def pocket(plan, made):
    footprint = made.place(plan, either(plan, LEAST * plan.pitch, 18.0), plan.clear)
    heights = made.heights(footprint)
    floor = min(heights) - plan.dice.uniform(max(1.0, 8.0 * plan.noise), 6.0)
    if floor < made.bottom + BOTTOM:
        raise solids.Failed("too deep")
    made.solid = solids.cut(made.solid, footprint.prism(floor, max(heights) + 5.0))
    made.taken.append((footprint.outline(), 0.0))
    made.pockets.append({"outline_mm": footprint.outline(), "floor_z_mm": floor})


def stain(plan, made):
    dice = plan.dice
    radius, rim = dice.uniform(0.8, 4.0), dice.uniform(0.5, 3.0)
    footprint = made.place(plan, lambda at: Circle(at, 2.0 * radius + rim), plan.clear)
    made.stains.append({"centre_mm": list(footprint.at), "radius_mm": radius, "rim_mm": rim,
                        "loss": dice.uniform(0.6, 1.0)})


def topped(plan, made):
    """The block under its top, and the scanner before it."""
    dice = plan.dice
    # From nearby the mirrored beam strays faster, and the oval on a cylinder is no longer than wanted;
    # laser and sensor see the part under the same angle as from afar.
    near = plan.top == "cylinder" or (plan.top == "ball" and dice.random() < 0.5)
    made.standoff = dice.uniform(280.0, 360.0) if near else 750.0
    made.baseline = made.standoff / 5.0
    half = math.hypot(made.size[0], made.size[1]) / 2
    # Where the glare is to be.
    at = made.block.point(dice.uniform(-0.6, 0.6), dice.uniform(-0.6, 0.6))
    made.top = range_tops.draw(plan.top, dice, made.middle, half, at, made.standoff, made.baseline)
    made.solid = made.top.cut(made.block.prism(made.bottom, made.middle[2] + 60.0))
    heights = made.heights(made.block)
    if min(heights) < made.bottom + 6.0:
        raise solids.Failed("the block is too thin")
    made.glare_at = at if plan.top in ("cylinder", "ball") else None


def scanned(plan, made):
    dice = plan.dice
    margin = dice.uniform(6.0, 10.0)
    outline = made.block.outline()
    low = [min(p[k] for p in outline) - margin for k in range(2)]
    high = [max(p[k] for p in outline) + margin for k in range(2)]
    highest = max([z for z in made.heights(made.block)] + [made.top.highest(made.block)]
                  + [one["top_z_mm"] for one in made.bosses])
    # The box is on whole millimetres: where columns fall on the part is chance.
    view = [[math.floor(low[0]), math.floor(low[1]), made.bottom],
            [math.ceil(high[0]), math.ceil(high[1]), highest + 4.0]]
    return {"pitch_mm": plan.pitch, "noise_mm": plan.noise, "outliers": dice.uniform(0.0, 0.03),
            "mixed": dice.uniform(0.0, 0.3), "dropouts": dice.uniform(0.005, 0.05),
            "spot_radius_mm": 0.05, "table_z_mm": made.bottom if plan.table_seen else None,
            "view_mm": view, "window_mm": None, "standoff_mm": made.standoff,
            "baseline_mm": made.baseline, "glare": plan.glare, "stains": made.stains}


def glossy(plan, made, scan, extent):
    """The width of the glare: such that its hole in the range image has the size that it shall have."""
    def off(x, y):
        return made.top.mirror_off_rad(x, y, extent, made.standoff, made.baseline)

    if made.glare_at is None:
        width = math.radians(plan.dice.uniform(1.0, 4.0))
    else:
        x, y = made.glare_at
        if any(is_inside((x, y), outline) for outline, _ in made.taken):
            raise solids.Failed("nothing glares")
        # Radians a millimetre, along x and y.
        rates = (off(x + 1.0, y), off(x, y + 1.0))
        reach = math.sqrt(2.0 * math.log(plan.glare / GLARE_HOLE))
        wanted = plan.dice.uniform(GLARE_LEAST_MM, GLARE_MOST_MM)
        width = wanted / 2.0 * min(rates) / reach
        width = min(max(width, math.radians(1.0)), math.radians(4.0))
        if 2.0 * reach * width / min(rates) > GLARE_MOST_MM:
            raise solids.Failed("too much would be lost")
    for one in made.holes:
        ring = Circle(one["centre_mm"][:2], one["diameter_mm"] + 2.0 * plan.clear)
        for p in ring.outline():
            if plan.glare * math.exp(-(off(*p) / width) ** 2 / 2.0) > GLARE_AT_HOLES:
                raise solids.Failed("glare at a hole")
    scan["glare_width_deg"] = math.degrees(width)


def drawn(seed, attempt):
    plan = Plan(seed, attempt)
    made = Made(plan)
    topped(plan, made)
    for kind, count in ((hole, plan.holes), (boss, plan.bosses), (pocket, plan.pockets),
                        (stain, plan.stains)):
        for _ in range(count):
            kind(plan, made)
    scan = {"seed": seed, **scanned(plan, made)}
    return plan, made, scan


def write(folder, seed):
    for attempt in range(ATTEMPTS):
        try:
            plan, made, scan = drawn(seed, attempt)
            solid = solids.only_solid(made.solid)
            faces, triangles = parts.faces(solid)
            corners = [p for triangle in triangles for p in triangle]
            extent = [[side(p[k] for p in corners) for k in range(3)] for side in (min, max)]
            glossy(plan, made, scan, extent)
            check(made, triangles)
        except solids.Failed:
            continue
        except Exception as error:  # of OpenCASCADE, which have no common base in Python
            if not type(error).__module__.startswith("OCP"):
                raise
            print(f"seed {seed}, attempt {attempt}: {error}", file=sys.stderr)
            continue
        stem = os.path.join(folder, str(seed))
        truth.write_stl(stem + ".stl", triangles)
        told = {"name": str(seed), "attempt": attempt, "block_mm": made.size,
                "outline_mm": made.block.outline(), "top": made.top.told(), "glare_at_mm": made.glare_at,
                "holes": made.holes, "bosses": made.bosses, "pockets": made.pockets, "scan": scan,
                "extent_mm": extent, "faces": faces}
        with open(stem + ".json.part", "w", encoding="utf-8") as file:
            json.dump(parts.rounded(told), file)
        os.replace(stem + ".json.part", stem + ".json")
        sorts = ", ".join(one["sort"] for one in made.holes)
        print(f"part {seed}, attempt {attempt}: {plan.top}; holes {sorts}; {plan.bosses} bosses, "
              f"{plan.pockets} pockets, {plan.stains} stains", flush=True)
        return
    sys.exit(f"seed {seed}: no sound part in {ATTEMPTS} attempts")


# Places at which what is told of a part is held against its triangles.
CHECKED = 100


def check(made, triangles):
    dice = random.Random(len(triangles))
    places, expected = [], []
    for one in made.holes:
        places.append(one["centre_mm"][:2])
        radius, depth = one["diameter_mm"] / 2, one["depth_mm"]
        low = min(made.heights(Circle(one["centre_mm"][:2], 2 * radius)))
        expected.append(-math.inf if depth is None else low - depth)
    for one in made.pockets + made.bosses:
        places.append(parts.middle(one["outline_mm"]))
        expected.append(one.get("floor_z_mm", one.get("top_z_mm")))
    for _ in range(CHECKED):
        place = made.block.point(dice.uniform(-0.99, 0.99), dice.uniform(-0.99, 0.99))
        if all(not is_inside(place, outline) and gap([place, place], outline) > 0.2
               for outline, _ in made.taken):
            places.append(place)
            expected.append(made.top.height(*place))
    for place, wanted, (height, _) in zip(places, expected, parts.from_above(triangles, places)):
        if height != wanted and not abs(height - wanted) < 0.02:
            raise ValueError(f"at {place} the part is {height:.3f} high and is told to be {wanted:.3f}")


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

"""Features that a part may have on a flat top or on a free-form one: each takes the dice, the
solid, the place, the room around it and the height of the top there, and gives the solid with the
feature, or fails.
"""

import math

import solids
from solids import Failed


def near_circle(x, y, radius, z):
    """Whether points lie on a level circle."""
    return lambda p: abs(math.hypot(p[0] - x, p[1] - y) - radius) < 1e-4 and abs(p[2] - z) < 1e-4


def at_level(x, y, room, z):
    return lambda p: (abs(p[2] - z) < 1e-4 and abs(p[0] - x) < room and abs(p[1] - y) < room)


def round_boss(dice, solid, x, y, room, z):
    """A boss with a rounded or chamfered rim, and sometimes a rounded foot: tori, or a cone."""
    radius = dice.uniform(0.55, 0.8) * room
    height = dice.uniform(5.0, 11.0)
    boss = solids.cylinder((x, y, z - 3.0), radius, height + 3.0)
    rim = near_circle(x, y, radius, z + height)
    width = dice.uniform(0.3, 0.6) * min(radius, height)
    if dice.random() < 0.6:
        boss = solids.filleted(boss, width, rim)
    else:
        boss = solids.chamfered(boss, width, rim)
    made = solids.fuse(solid, boss)
    if dice.random() < 0.6:
        foot = min(dice.uniform(2.5, 4.5), 0.9 * (room - radius), 0.8 * (height - width))
        if foot > 1.0:
            made = solids.filleted(made, foot, near_circle(x, y, radius, z))
    return made


def cone_boss(dice, solid, x, y, room, z):
    """A frustum: the slope of a cone and a disc."""
    radius, half = dice.uniform(0.7, 0.95) * room, math.radians(dice.uniform(25.0, 55.0))
    height = min(dice.uniform(5.0, 14.0), 0.75 * radius / math.tan(half))
    below = 3.0
    top = radius - height * math.tan(half)
    made = solids.fuse(solid, solids.cone((x, y, z - below), radius + below * math.tan(half), top,
                                          height + below))
    if dice.random() < 0.4:
        made = solids.filleted(made, dice.uniform(2.0, 5.0), near_circle(x, y, top, z + height))
    return made


def dome(dice, solid, x, y, room, z):
    """A cap of a sphere."""
    radius = dice.uniform(1.0, 1.8) * room
    sunk = radius - dice.uniform(0.3, 0.6) * room
    return solids.fuse(solid, solids.sphere((x, y, z - sunk), radius))


def dimple(dice, solid, x, y, room, z):
    """A hollow of a sphere."""
    radius = dice.uniform(1.0, 1.8) * room
    raised = radius - dice.uniform(0.25, 0.5) * room
    return solids.cut(solid, solids.sphere((x, y, z + raised), radius))


def countersink(dice, solid, x, y, room, z):
    """A through hole with a conical mouth."""
    radius, half = dice.uniform(0.65, 0.9) * room, math.radians(dice.uniform(35.0, 55.0))
    hole = dice.uniform(0.25, 0.45) * radius
    depth = (radius - hole) / math.tan(half)
    mouth = solids.cone((x, y, z - depth), hole, radius + 2.0 * math.tan(half), depth + 2.0)
    made = solids.cut(solid, mouth)
    return solids.cut(made, solids.cylinder((x, y, z - 200.0), hole, 250.0))


def blind_hole(dice, solid, x, y, room, z):
    """A hole with a flat or a conical floor, and sometimes a rounded rim."""
    radius, depth = dice.uniform(0.55, 0.75) * room, dice.uniform(3.0, 8.0)
    hole = solids.cylinder((x, y, z - depth), radius, depth + 30.0)
    if dice.random() < 0.5:
        half = math.radians(dice.uniform(50.0, 70.0))
        tip = solids.cone((x, y, z - depth - radius / math.tan(half)), 0.0, radius,
                          radius / math.tan(half))
        hole = solids.fuse(hole, tip)
    made = solids.cut(solid, hole)
    if dice.random() < 0.5:
        made = solids.filleted(made, dice.uniform(2.0, 0.9 * min(depth, room - radius) + 2.0),
                               near_circle(x, y, radius, z))
    return made


def ring(dice, solid, x, y, room, z):
    """A ring-shaped ridge or groove: the better part of a torus."""
    tube = dice.uniform(0.22, 0.38) * room
    radius = dice.uniform(0.85, 0.95) * room - tube
    if dice.random() < 0.5:
        lift = dice.uniform(-0.3, 0.2) * tube
        return solids.fuse(solid, solids.torus((x, y, z + lift), radius, tube))
    lift = dice.uniform(0.1, 0.4) * tube
    return solids.cut(solid, solids.torus((x, y, z + lift), radius, tube))


def frame(dice, x, y):
    """A direction in the plane and the one across it."""
    angle = dice.uniform(0.0, math.pi)
    return (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))


def prism_at(x, y, z, half_long, half_wide, height, ways, draft):
    """A block with walls that lean inwards by a tangent, from z upwards (or down)."""
    (a, b), (c, d) = ways
    shift = height * draft

    def ring_at(level, less):
        corners = []
        for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
            p, q = u * (half_long - less), v * (half_wide - less)
            corners.append((x + p * a + q * c, y + p * b + q * d, level))
        return corners

    low, high = ring_at(z, 0.0), ring_at(z + height, shift)
    sides = [(low[k], low[k - 1], high[k - 1], high[k]) for k in range(4)]
    return solids.polyhedron([low, high, *sides])


def pad(dice, solid, x, y, room, z):
    """A raised pad with leaning walls, its top chamfered, rounded or sharp."""
    long, wide = dice.uniform(0.55, 0.7) * room, dice.uniform(0.4, 0.6) * room
    height, ways = dice.uniform(4.0, 10.0), frame(dice, x, y)
    draft = dice.uniform(0.35, 0.8) if dice.random() < 0.7 else 0.0
    draft = min(draft, 0.4 * wide / height)
    block = prism_at(x, y, z, long, wide, height, ways, draft)
    finish = dice.random()
    top = at_level(x, y, 2.0 * room, z + height)
    width = dice.uniform(1.5, 3.0)
    if finish < 0.35:
        block = solids.filleted(block, width, top)
    elif finish < 0.55:
        block = solids.chamfered(block, width, top)
    return solids.fuse(solid, block)


def pocket(dice, solid, x, y, room, z):
    """A pocket with leaning walls; the edges of its floor sharp or rounded."""
    long, wide = dice.uniform(0.6, 0.7) * room, dice.uniform(0.5, 0.65) * room
    depth, ways = dice.uniform(3.0, 7.0), frame(dice, x, y)
    draft = min(dice.uniform(0.4, 0.9), 0.5 * wide / depth)
    hole = prism_at(x, y, z, long, wide, -depth, ways, draft)
    made = solids.cut(solid, hole)
    if dice.random() < 0.5:
        made = solids.filleted(made, dice.uniform(2.0, 4.0),
                               at_level(x, y, room, z - depth))
    return made


def bar(dice, solid, x, y, room, z):
    """A lying rod or groove: a part of a cylinder, its ends flat or round."""
    (a, b), _ = frame(dice, x, y)
    radius, half = dice.uniform(0.3, 0.5) * room, dice.uniform(0.6, 0.8) * room
    is_groove = dice.random() < 0.5
    lift = (0.35 if is_groove else -0.35) * radius * dice.uniform(0.3, 1.2)
    ends = [(x + s * half * a, y + s * half * b, z + lift) for s in (-1.0, 1.0)]
    rod = solids.cylinder(ends[0], radius, 2.0 * half, (a, b, 0.0))
    if dice.random() < 0.5:
        for end in ends:
            rod = solids.fuse(rod, solids.sphere(end, radius))
    return solids.cut(solid, rod) if is_groove else solids.fuse(solid, rod)


def ramp(dice, solid, x, y, room, z):
    """A wedge."""
    (a, b), (c, d) = frame(dice, x, y)
    half, wide = dice.uniform(0.6, 0.75) * room, dice.uniform(0.35, 0.55) * room
    height = dice.uniform(0.3, 0.7) * half
    profile = ((-half, -2.0), (half, -2.0), (half, height * dice.uniform(0.0, 0.6)),
               (half * dice.uniform(-0.2, 0.3), height), (-half, 0.0))
    corners = [(x + u * a - wide * c, y + u * b - wide * d, z + w) for u, w in profile]
    return solids.fuse(solid, solids.extruded(corners, (2 * wide * c, 2 * wide * d, 0.0)))


ON_FLAT = (round_boss, cone_boss, dome, dimple, countersink, blind_hole, ring, pad, pocket, bar,
           ramp)
# What needs no circle on a plane to be rounded.
ON_FREE_FORM = (dome, dimple, countersink, blind_hole, cone_boss, round_boss, ring)


def add(dice, solid, kinds, place, room, z):
    """One of the features, tried until one can be made; the solid as it was if none can."""
    for _ in range(4):
        kind = kinds[int(dice.random() * len(kinds))]
        try:
            return kind(dice, solid, *place, room, z), kind.__name__
        except Failed:
            continue
        except Exception:  # of OpenCASCADE, which have no common base in Python
            continue
    return solid, None

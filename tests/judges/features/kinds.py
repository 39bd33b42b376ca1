"""Features that random parts may have: each finds itself a place on some ground, is cut or added, and
is noted in the truth.
"""

import math

import parts
import solids
from parts import ABOVE, Circle, Rectangle, apart, gap, is_inside

# The sensor stands aside: a wall hides so much of the floor at its foot, by its height.
SHADOW = 0.27
# Least material under what is deepest.
BOTTOM = 2.0
DRILL = math.radians(59.0)


class Ground:
    """A level area that features may stand on or go into."""

    def __init__(self, feature, z, footprint, level, wall=0.0):
        self.feature, self.z, self.footprint, self.level = feature, z, footprint, level
        self.wall, self.taken = wall, []

    def has_room(self, plan, outline, high=0.0):
        own = self.footprint.outline()
        if not all(is_inside(p, own) for p in outline):
            return False
        if gap(outline, own) < plan.land + SHADOW * max(self.wall, high):
            return False
        return self.is_free(plan, outline, high)

    def is_free(self, plan, outline, high=0.0):
        return all(apart(outline, other) >= plan.land + SHADOW * max(high, other_high)
                   for other, other_high in self.taken)

    def place(self, plan, footprint_at, high=0.0, around=0.0):
        """A footprint where there is room for it and what is `around` it."""
        for _ in range(25):
            at = self.footprint.point(plan.dice.uniform(-1.0, 1.0), plan.dice.uniform(-1.0, 1.0))
            footprint = footprint_at(at)
            if self.has_room(plan, footprint.smaller(-around).outline(), high):
                return footprint
        raise solids.Failed("no room")

    def take(self, footprint, high=0.0, around=0.0):
        self.taken.append((footprint.smaller(-around).outline(), high))


class State:
    """The grounds of a part, and what it allows."""

    def __init__(self, made, top, has_rim):
        self.made, self.grounds, self.has_rim = made, [top], has_rim


def begin(plan, made):
    """The block, its rim sometimes broken or rounded."""
    footprint = Rectangle((made.size[0] / 2, made.size[1] / 2), made.size[0], made.size[1])
    width = 0.0
    if plan.dice.random() < 0.15:
        width = plan.dice.uniform(5.0 * plan.pitch, 5.0 * plan.pitch + 1.5)
        finish(plan, made, 0, footprint, 0.0, 0.0, width)
    top = Ground(0, 0.0, footprint.smaller(width), 0)
    return State(made, top, width > 0.0)


def add(plan, made, state):
    """One more feature, or a few that belong together; nothing where that fails."""
    before = (made.solid, len(made.features), len(made.patterns))
    grounds = [(ground, list(ground.taken)) for ground in state.grounds]
    kind = plan.dice.choices([k for k, _ in KINDS], [w for _, w in KINDS])[0]
    try:
        kind(plan, made, state)
        if len(made.features) - 1 > plan.wanted:
            raise solids.Failed("too many")
    except solids.Failed:
        made.solid = before[0]
        del made.features[before[1]:], made.patterns[before[2]:]
        for ground, taken in grounds:
            ground.taken = taken
        state.grounds = [ground for ground, _ in grounds]


def some_ground(plan, state, deepest=2):
    """Any ground that is not too deep in the tree; those on features as often as the block's top."""
    fit = [ground for ground in state.grounds if ground.level <= deepest]
    if len(fit) > 1 and plan.dice.random() < 0.7:
        return plan.dice.choice(fit[1:])
    return fit[0]


def between(plan, low, high):
    if high < low:
        raise solids.Failed("no such size")
    return plan.dice.uniform(low, high)


def remaining(made, z):
    return z + made.size[2] - BOTTOM


def is_on(outline, z):
    """Edges at a height, on or within an outline."""
    def is_wanted(p):
        if abs(p[2] - z) > 1e-5:
            return False
        near = min(parts.to_segment(p, a, b) for a, b in zip(outline, outline[1:] + outline[:1]))
        return near < 0.15 or is_inside(p, outline)

    return is_wanted


def finish(plan, made, feature, footprint, z, foot_z, width, kind=None):
    """A rim at `z` chamfered or rounded, or a foot at `foot_z` filleted."""
    kind = kind or ("chamfer" if plan.dice.random() < 0.5 else "round")
    if kind == "chamfer":
        made.solid = solids.chamfered(made.solid, width, is_on(footprint.outline(), z))
        made.tell("chamfer", feature, footprint, z, z - width, {"width": width})
    elif kind == "round":
        made.solid = solids.filleted(made.solid, width, is_on(footprint.outline(), z))
        made.tell("round", feature, footprint, z, z - width, {"radius": width})
    else:
        made.solid = solids.filleted(made.solid, width, is_on(footprint.outline(), foot_z))
        made.tell("fillet", feature, footprint, foot_z, foot_z + width, {"radius": width})


def finishing(plan, height, share=0.35):
    """What is done to a feature's edges, and how wide: nothing mostly."""
    if plan.dice.random() >= share or height < 5.0 * plan.pitch + 1.0:
        return None, 0.0
    kind = plan.dice.choice(["chamfer", "round", "fillet"])
    return kind, plan.dice.uniform(5.0 * plan.pitch, min(height - 1.0, 5.0 * plan.pitch + 1.5))


def turn_of(plan, ground):
    """Mostly along the ground's own directions, else turned a bit."""
    own = ground.footprint.turn if isinstance(ground.footprint, Rectangle) else 0.0
    return own + (0.0 if plan.dice.random() < 0.6 else
                  math.radians(plan.dice.uniform(5.0, 40.0)) * plan.dice.choice((-1.0, 1.0)))


def floor_depth(plan, made, ground, least, most=12.0):
    """A depth at which the floor of something so wide is still seen."""
    seen = (least - 8.0 * plan.pitch) / SHADOW
    return between(plan, plan.shallow, min(most, seen, 0.6 * remaining(made, ground.z)))


def rectangle_on(plan, ground, share=0.6, corners=0.5):
    """Sizes of something rectangular on a ground."""
    room = ground.footprint.least() - 2.0 * plan.land
    width = between(plan, plan.least, min(35.0, share * room))
    length = between(plan, width * 1.05, max(width * 1.05, min(width * 2.5, 60.0)))
    corner = 0.0
    if plan.dice.random() < corners:
        corner = plan.dice.uniform(0.1, 0.35) * width
    turn = turn_of(plan, ground)
    return lambda at: Rectangle(at, length, width, corner, turn)


def pocket(plan, made, state):
    ground = some_ground(plan, state)
    shape = rectangle_on(plan, ground)
    least = shape((0.0, 0.0)).width
    depth = floor_depth(plan, made, ground, least)
    kind, width = finishing(plan, depth)
    around = 0.0 if kind == "fillet" else width
    footprint = ground.place(plan, shape, around=around)
    floor = ground.z - depth
    dimensions = {"length": footprint.length, "width": footprint.width, "depth": depth}
    if footprint.corner > 0.0:
        dimensions["corner_radius"] = footprint.corner
    if kind is None and depth > 3.0 and plan.dice.random() < 0.12:
        return free_pocket(plan, made, ground, footprint, depth, dimensions)
    made.solid = solids.cut(made.solid, footprint.prism(floor, ABOVE))
    own = made.tell("pocket", ground.feature, footprint, ground.z, floor, dimensions)
    if kind:
        finish(plan, made, own, footprint, ground.z, floor, width, kind)
    ground.take(footprint, around=around)
    inner = footprint.smaller(width if kind == "fillet" else 0.0)
    state.grounds.append(Ground(own, floor, inner, ground.level + 1, depth))
    return None


def free_pocket(plan, made, ground, footprint, depth, dimensions):
    """A pocket whose bottom is free-form."""
    high = min(0.35 * depth, 1.2)
    waves = [(plan.dice.uniform(0.3, 0.5) * high, 2 * math.pi / plan.dice.uniform(15.0, 35.0),
              plan.dice.uniform(0.0, math.pi), plan.dice.uniform(0.0, 2 * math.pi))
             for _ in range(2)]

    def shape(x, y):
        return ground.z - depth + sum(
            a * math.sin(k * (x * math.cos(t) + y * math.sin(t)) + f) for a, k, t, f in waves)

    outline = footprint.outline()
    low = [min(p[k] for p in outline) - 2.0 for k in range(2)]
    far = [max(p[k] for p in outline) + 2.0 for k in range(2)]
    surface, at = parts.wavy(low, far, shape)
    tool = solids.common(footprint.prism(ground.z - 2 * depth, ABOVE), parts.above(surface))
    made.solid = solids.cut(made.solid, tool)
    heights = [at(*footprint.point(u / 8, v / 8)) for u in range(-8, 9) for v in range(-8, 9)]
    del dimensions["depth"]
    made.tell("pocket", ground.feature, footprint, ground.z, sum(heights) / len(heights),
              dimensions, free_form=True,
              depth_mm=[ground.z - max(heights), ground.z - min(heights)])
    ground.take(footprint)


def boss(plan, made, state):
    ground = some_ground(plan, state, 1)
    room = ground.footprint.least() - 2.0 * plan.land
    is_round = plan.dice.random() < 0.6
    if is_round:
        diameter = between(plan, plan.least, min(25.0, 0.5 * room))
        least, shape = diameter, lambda at: Circle(at, diameter)
    else:
        shape = rectangle_on(plan, ground, 0.45, 0.3)
        least = shape((0.0, 0.0)).width
    height = between(plan, plan.shallow, min(10.0, least))
    kind, width = finishing(plan, height)
    if kind in ("chamfer", "round") and 2.0 * width > 0.5 * least:
        kind, width = None, 0.0
    around = width if kind == "fillet" else 0.0
    footprint = ground.place(plan, shape, high=height, around=around)
    top = ground.z + height
    made.solid = solids.fuse(made.solid, footprint.prism(ground.z - 1.0, top))
    if is_round:
        dimensions = {"diameter": footprint.diameter, "height": height}
    else:
        dimensions = {"length": footprint.length, "width": footprint.width, "height": height}
        if footprint.corner > 0.0:
            dimensions["corner_radius"] = footprint.corner
    own = made.tell("boss", ground.feature, footprint, ground.z, top, dimensions)
    if kind:
        finish(plan, made, own, footprint, top, ground.z, width, kind)
    ground.take(footprint, high=height, around=around)
    inner = footprint.smaller(0.0 if kind == "fillet" else width)
    state.grounds.append(Ground(own, top, inner, ground.level + 1))


def depth_of_hole(plan, made, z, diameter):
    """How deep a hole is; `None` for through."""
    if plan.dice.random() < 0.35:
        return None
    room = remaining(made, z) - 0.31 * diameter
    if plan.dice.random() < 0.12:
        return between(plan, min(2.5 * diameter, room), min(5.0 * diameter, room))
    return between(plan, plan.shallow,
                   min(room, 3.0 * diameter, (diameter - 6.0 * plan.pitch) / SHADOW))


def drill(made, parent, footprint, z, depth, tip):
    """Cuts a hole and notes it."""
    low = -made.size[2] - 1.0 if depth is None else z - depth
    made.solid = solids.cut(made.solid, footprint.prism(low, ABOVE))
    dimensions = {"diameter": footprint.diameter}
    if depth is None:
        return made.tell("hole", parent, footprint, z, -made.size[2], dimensions, through=True)
    dimensions["depth"] = depth
    if tip:
        r = footprint.diameter / 2
        high = r / math.tan(DRILL)
        made.solid = solids.cut(made.solid, solids.cone(
            (footprint.at[0], footprint.at[1], low - high), 0.0, r, high))
    return made.tell("hole", parent, footprint, z, low, dimensions, through=False, tip=tip)


def hole(plan, made, state):
    ground = some_ground(plan, state)
    room = ground.footprint.least() - 2.0 * plan.land - 2.0 * SHADOW * ground.wall
    kind = plan.dice.random()
    if kind < 0.15:
        return counterbored(plan, made, ground, room)
    if kind < 0.3:
        return countersunk(plan, made, ground, room)
    diameter = between(plan, plan.least, min(16.0, room))
    footprint = ground.place(plan, lambda at: Circle(at, diameter))
    depth = depth_of_hole(plan, made, ground.z, diameter)
    drill(made, ground.feature, footprint, ground.z, depth, plan.dice.random() < 0.5)
    ground.take(footprint)
    return None


def counterbored(plan, made, ground, room):
    """A hole on the floor of a wider one."""
    inner = between(plan, plan.least, plan.least + 4.0)
    depth = between(plan, plan.shallow, min(4.0, 0.5 * remaining(made, ground.z)))
    least = inner + 2.0 * (plan.land + SHADOW * depth)
    outer = between(plan, least, min(20.0, room, least + 4.0))
    footprint = ground.place(plan, lambda at: Circle(at, outer))
    first = drill(made, ground.feature, footprint, ground.z, depth, False)
    below = depth_of_hole(plan, made, ground.z - depth, inner)
    drill(made, first, Circle(footprint.at, inner), ground.z - depth, below,
          plan.dice.random() < 0.5)
    ground.take(footprint)


def countersunk(plan, made, ground, room):
    """A hole with a cone of 90 degrees at its mouth."""
    diameter = between(plan, plan.least, plan.least + 5.0)
    width = between(plan, 5.0 * plan.pitch,
                    min(5.0 * plan.pitch + 1.5, 0.5 * remaining(made, ground.z)))
    mouth = diameter + 2.0 * width
    if mouth > room:
        raise solids.Failed("no room")
    wide = ground.place(plan, lambda at: Circle(at, mouth))
    depth = depth_of_hole(plan, made, ground.z, diameter)
    if depth is not None and depth < width + plan.shallow:
        depth = None
    own = drill(made, ground.feature, Circle(wide.at, diameter), ground.z, depth, False)
    made.solid = solids.cut(made.solid, solids.cone(
        (wide.at[0], wide.at[1], ground.z - width), diameter / 2, mouth / 2 + 1.0, width + 1.0))
    number = made.tell("countersink", own, wide, ground.z, ground.z - width,
                       {"diameter": mouth, "depth": width}, or_parents=[ground.feature])
    # Who sees the hole begin at the foot of the cone is not wrong.
    made.features[own]["or_parents"] = [number]
    ground.take(wide)


def pattern(plan, made, state):
    """Equal holes on a line or a circle."""
    ground = some_ground(plan, state, 1)
    most = plan.wanted - (len(made.features) - 1)
    if most < 3:
        raise solids.Failed("too many")
    diameter = between(plan, plan.least, min(8.0, plan.least + 2.5))
    depth = depth_of_hole(plan, made, ground.z, diameter)
    tip = plan.dice.random() < 0.5
    on_line = plan.dice.random() < 0.5
    least = diameter + plan.land + 0.5
    if on_line:
        count = plan.dice.randint(3, min(most, 5))
        step, angle = between(plan, least, least + 6.0), turn_of(plan, ground)
        offsets = [((k - (count - 1) / 2) * step * math.cos(angle),
                    (k - (count - 1) / 2) * step * math.sin(angle)) for k in range(count)]
    else:
        count = plan.dice.randint(min(most, 4), min(most, 6))
        if count < 4:
            raise solids.Failed("too few")
        radius = between(plan, least / (2.0 * math.sin(math.pi / count)),
                         least / (2.0 * math.sin(math.pi / count)) + 6.0)
        begin_at = plan.dice.uniform(0.0, math.pi)
        offsets = [(radius * math.cos(begin_at + 2 * math.pi * k / count),
                    radius * math.sin(begin_at + 2 * math.pi * k / count)) for k in range(count)]
    for _ in range(25):
        at = ground.footprint.point(plan.dice.uniform(-1.0, 1.0), plan.dice.uniform(-1.0, 1.0))
        holes = [Circle((at[0] + x, at[1] + y), diameter) for x, y in offsets]
        if all(ground.has_room(plan, footprint.outline()) for footprint in holes):
            break
    else:
        raise solids.Failed("no room")
    members = []
    for footprint in holes:
        members.append(drill(made, ground.feature, footprint, ground.z, depth, tip))
        ground.take(footprint)
    made.patterns.append({"kind": "line" if on_line else "circle", "members": members})


def side_of(made, side):
    """Of a side of the block (0: x = 0, 1: y = 0, 2: x = length, 3: y = width) the way inwards, how
    far it is to the other side, how long the side is; and a footprint from coordinates along the
    way in and along the side."""
    length, width, _ = made.size
    along_x = side in (0, 2)
    far, long = (length, width) if along_x else (width, length)

    def footprint(near, deep, begin_at, end, corner=0.0):
        """From `near` to `deep` off the side, from `begin_at` to `end` along it; its length is that
        inwards."""
        inwards = (near + deep) / 2 if side in (0, 1) else far - (near + deep) / 2
        across = (begin_at + end) / 2
        at = (inwards, across) if along_x else (across, inwards)
        return Rectangle(at, deep - near, end - begin_at, corner, 0.0 if along_x else math.pi / 2)

    return far, long, footprint


def slot(plan, made, state):
    """From a side of the block inwards, or to the other side."""
    if state.has_rim:
        raise solids.Failed("the rim would be cut")
    ground = state.grounds[0]
    far, long, footprint = side_of(made, plan.dice.randrange(4))
    width = between(plan, plan.least, min(25.0, 0.4 * long))
    begin_at = between(plan, plan.land + 1.0, long - width - plan.land - 1.0)
    is_through = plan.dice.random() < 0.4
    length = far if is_through else between(plan, max(plan.least, 0.6 * width), 0.7 * far)
    corner = width / 2 - 1e-4 if not is_through and plan.dice.random() < 0.3 else 0.0
    if corner and length < width:
        raise solids.Failed("too short for a round end")
    own = footprint(0.0, length, begin_at, begin_at + width)
    if not ground.is_free(plan, own.outline()):
        raise solids.Failed("no room")
    depth = floor_depth(plan, made, ground, width, 0.6 * made.size[2])
    beyond = width + 5.0
    tool = footprint(-beyond, length + (beyond if is_through else 0.0), begin_at,
                     begin_at + width, corner)
    made.solid = solids.cut(made.solid, tool.prism(-depth, ABOVE))
    made.tell("slot", 0, own, 0.0, -depth, {"length": length, "width": width, "depth": depth},
              open_ends=2 if is_through else 1, round_end=corner > 0.0)
    if corner:
        made.features[-1]["outline_mm"] = [(min(max(x, 0.0), made.size[0]),
                                            min(max(y, 0.0), made.size[1]))
                                           for x, y in tool.outline()]
    ground.take(own)


def step(plan, made, state):
    """Along a whole side of the block, or at a corner of it."""
    if state.has_rim:
        raise solids.Failed("the rim would be cut")
    ground = state.grounds[0]
    far, long, footprint = side_of(made, plan.dice.randrange(4))
    deep = between(plan, plan.least, min(0.3 * far, 0.9 * long))
    at_corner = plan.dice.random() < 0.35
    begin_at, end = 0.0, long
    if at_corner:
        wide = between(plan, plan.least, 0.4 * long)
        begin_at, end = plan.dice.choice([(0.0, wide), (long - wide, long)])
    area = footprint(0.0, deep, begin_at, end)
    if not ground.is_free(plan, area.outline()):
        raise solids.Failed("no room")
    depth = floor_depth(plan, made, ground, deep, 0.6 * made.size[2])
    tool = footprint(-5.0, deep, begin_at - 5.0 * (begin_at == 0.0), end + 5.0 * (end == long))
    made.solid = solids.cut(made.solid, tool.prism(-depth, ABOVE))
    # The length is that along the longer side.
    longer = area if area.length >= area.width else Rectangle(
        area.at, area.width, area.length, 0.0, area.turn + math.pi / 2)
    own = made.tell("step", 0, longer, 0.0, -depth,
                    {"length": longer.length, "width": longer.width, "depth": depth},
                    at_corner=at_corner)
    ground.take(area)
    state.grounds.append(Ground(own, -depth, longer, 1, depth))


def channel(plan, made, state):
    """A slot from a pocket to the block's side, or to another pocket, less deep than they are."""
    ground = state.grounds[0]
    to_side = not state.has_rim and plan.dice.random() < 0.5
    far, long, footprint = side_of(made, plan.dice.randrange(4))
    width = between(plan, plan.least, min(15.0, 0.3 * long))
    length = between(plan, plan.least, plan.least + 12.0)
    middle = between(plan, 0.3 * long, 0.7 * long)
    depth = floor_depth(plan, made, ground, width, 0.35 * made.size[2])

    def chamber(near, deep):
        half = width / 2 + plan.land + plan.dice.uniform(1.0, 6.0)
        room = (deep - near, 2 * half)
        corner = plan.dice.choice((0.0, 0.15)) * min(room)
        if half - corner < width / 2 + 1.0 or min(room) < plan.least:
            raise solids.Failed("too small")
        lower = floor_depth(plan, made, ground, min(room), 0.6 * made.size[2])
        if lower < depth + plan.shallow:
            raise solids.Failed("not deep enough")
        return footprint(near, deep, middle - half, middle + half, corner), lower

    begin_at = 0.0 if to_side else between(plan, plan.least + plan.land + 1.0, 0.4 * far)
    chambers = [chamber(begin_at + length, begin_at + length + plan.dice.uniform(0.15, 0.4) * far)]
    if not to_side:
        chambers.append(chamber(plan.land + plan.dice.uniform(0.5, 3.0), begin_at))
    for area, _ in chambers:
        if not ground.has_room(plan, area.outline()):
            raise solids.Failed("no room")
    own = footprint(begin_at, begin_at + length, middle - width / 2, middle + width / 2)
    if not ground.is_free(plan, own.outline()):
        raise solids.Failed("no room")
    for area, lower in chambers:
        made.solid = solids.cut(made.solid, area.prism(-lower, ABOVE))
        longer = area if area.length >= area.width else Rectangle(
            area.at, area.width, area.length, area.corner, area.turn + math.pi / 2)
        dimensions = {"length": longer.length, "width": longer.width, "depth": lower}
        if area.corner:
            dimensions["corner_radius"] = area.corner
        number = made.tell("pocket", 0, longer, 0.0, -lower, dimensions)
        state.grounds.append(Ground(number, -lower, longer, 1, lower))
    # The tool ends within the pockets, where it meets nothing.
    tool = footprint(begin_at - (8.0 if to_side else 1.0), begin_at + length + 1.0,
                     middle - width / 2, middle + width / 2)
    made.solid = solids.cut(made.solid, tool.prism(-depth, ABOVE))
    made.tell("slot", 0, own, 0.0, -depth, {"length": length, "width": width, "depth": depth},
              open_ends=2, into_pockets=len(chambers))
    for area, _ in chambers:
        ground.take(area)
    ground.take(own)


KINDS = ((pocket, 4.0), (boss, 3.5), (hole, 4.0), (pattern, 1.6), (slot, 2.5), (step, 2.5),
         (channel, 2.5))

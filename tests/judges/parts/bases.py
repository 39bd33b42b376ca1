"""What parts are made from: a solid, and the places on its top that features may take."""

import math

import solids
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.GeomAbs import GeomAbs_C2
from OCP.collections import Array2_double

DEEP = 25.0


class Base:
    """A solid; `places` are (x, y, room, height of the top there)."""

    def __init__(self, name, solid, places, is_flat=True):
        self.name, self.solid, self.places, self.is_flat = name, solid, places, is_flat


def cells(width, depth, dice):
    """Places in a rectangle: the middles of two by two or of three by two cells."""
    across = 3 if dice.random() < 0.4 else 2
    room = min(width / across, depth / 2) / 2
    return [((i + 0.5) * width / across - width / 2, (j + 0.5) * depth / 2 - depth / 2, room, 0.0)
            for i in range(across) for j in range(2)]


def rim_finished(dice, solid, is_rim):
    """The rim of the top rounded, chamfered, or as it was."""
    choice = dice.random()
    try:
        if choice < 0.35:
            return solids.filleted(solid, dice.uniform(3.0, 7.0), is_rim)
        if choice < 0.6:
            return solids.chamfered(solid, dice.uniform(2.5, 6.0), is_rim)
    except solids.Failed:
        pass
    return solid


def top(p):
    return abs(p[2]) < 1e-6


def plate(dice):
    w, d = dice.uniform(84.0, 92.0), dice.uniform(66.0, 82.0)
    solid = solids.box((-w / 2, -d / 2, -DEEP), (w / 2, d / 2, 0.0))
    solid = rim_finished(dice, solid, top)
    return Base("plate", solid, cells(w - 14.0, d - 14.0, dice))


def prism(dice):
    sides, radius = 5 + int(dice.random() * 3), dice.uniform(46.0, 50.0)
    begin = dice.uniform(0.0, math.pi)
    angles = [begin + 2 * math.pi * k / sides for k in range(sides)]
    corners = [(radius * math.cos(a), radius * math.sin(a), -DEEP) for a in angles]
    solid = rim_finished(dice, solids.extruded(corners, (0.0, 0.0, DEEP)), top)
    turn = dice.uniform(0.0, math.pi)
    places = [(21.0 * math.cos(turn + a), 21.0 * math.sin(turn + a), 14.0, 0.0)
              for a in (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)]
    return Base("prism", solid, places)


def disc(dice):
    radius = dice.uniform(44.0, 50.0)
    solid = solids.cylinder((0.0, 0.0, -DEEP), radius, DEEP)
    solid = rim_finished(dice, solid, top)
    turn, count = dice.uniform(0.0, math.pi), 3 + int(dice.random() * 2)
    room = 13.5 if count == 4 else 15.5
    places = [(21.0 * math.cos(turn + 2 * math.pi * k / count),
               21.0 * math.sin(turn + 2 * math.pi * k / count), room, 0.0) for k in range(count)]
    return Base("disc", solid, places)


def stepped(dice):
    """Two levels, the wall between them leaning; the fold at its foot sometimes rounded."""
    w, d, step = dice.uniform(84.0, 92.0), dice.uniform(68.0, 82.0), dice.uniform(6.0, 14.0)
    lean = dice.uniform(0.4, 1.2) * step
    profile = [(-w / 2, -DEEP), (w / 2, -DEEP), (w / 2, 0.0), (lean / 2, 0.0), (-lean / 2, -step),
               (-w / 2, -step)]
    corners = [(x, -d / 2, z) for x, z in profile]
    solid = solids.extruded(corners, (0.0, d, 0.0))
    for x, z in ((-lean / 2, -step), (lean / 2, 0.0)):
        if dice.random() < 0.6:
            solid = solids.filleted(solid, dice.uniform(3.0, 9.0),
                                    lambda p: abs(p[0] - x) < 1e-5 and abs(p[2] - z) < 1e-5)
    places = []
    for side, z in ((-1.0, -step), (1.0, 0.0)):
        for j in (-1.0, 1.0):
            places.append((side * (w / 4 + lean / 8 + 1.0), j * d / 4, 15.0, z))
    return Base("stepped", solid, places)


def roof(dice):
    """Two or three slopes over a rectangle."""
    w, d = dice.uniform(84.0, 92.0), dice.uniform(68.0, 82.0)
    ridge = dice.uniform(-0.2, 0.2) * w
    high = dice.uniform(8.0, 22.0)
    profile = [(-w / 2, -DEEP), (w / 2, -DEEP), (w / 2, -high)]
    flat = dice.uniform(15.0, 30.0) if dice.random() < 0.5 else 0.0
    profile += [(ridge + flat / 2, 0.0)] + ([(ridge - flat / 2, 0.0)] if flat else [])
    profile += [(-w / 2, -high * dice.uniform(0.6, 1.2))]
    solid = solids.extruded([(x, -d / 2, z) for x, z in profile], (0.0, d, 0.0))
    if dice.random() < 0.5:
        solid = solids.filleted(solid, dice.uniform(6.0, 15.0), top)
    places = [(x * w, y * d, 14.0, -0.55 * high)
              for x, y in ((-0.28, -0.25), (0.28, -0.25), (-0.28, 0.25), (0.28, 0.25))]
    return Base("roof", solid, places, is_flat=False)


def log(dice):
    """A part of a lying cylinder or cone."""
    radius, length, d = dice.uniform(50.0, 85.0), dice.uniform(84.0, 92.0), dice.uniform(66.0, 78.0)
    if dice.random() < 0.5:
        round_body = solids.cylinder((-length / 2, 0.0, -radius), radius, length, (1.0, 0.0, 0.0))
    else:
        less = radius - dice.uniform(8.0, 16.0)
        round_body = solids.cone((-length / 2, 0.0, -radius), radius, less, length,
                                 (1.0, 0.0, 0.0))
    slab = solids.box((-length, -d / 2, -radius), (length, d / 2, 10.0))
    solid = solids.common(round_body, slab)
    places = [(x * length, 0.0, 16.0, -3.0) for x in (-0.27, 0.27)]
    return Base("log", solid, places, is_flat=False)


def shaft(dice):
    """A turned part lying along x: cylinders, cones, and arcs between them."""
    radius, x, end = dice.uniform(22.0, 32.0), -48.0, 48.0
    steps = [(x, radius)]
    while x < end - 22.0:
        run = dice.uniform(12.0, 24.0)
        steps.append((x + run, radius))
        x += run
        other = min(42.0, max(16.0, radius + dice.uniform(-11.0, 11.0)))
        run = dice.uniform(6.0, 14.0)
        kind = dice.random()
        bulge = 0.0
        if kind < 0.5:
            bulge = dice.uniform(1.5, 3.0) * (1.0 if dice.random() < 0.5 else -1.0)
        steps.append((x + run, other, bulge) if bulge else (x + run, other))
        x, radius = x + run, other
    steps.append((max(end, x + 8.0), radius))
    solid = solids.revolved(steps, (steps[0][0], steps[-1][0]))
    return Base("shaft", solids.only_solid(solid), [], is_flat=False)


def sheet(dice):
    """A free-form top over a rectangle: waves that no simple surface has."""
    w, d = dice.uniform(84.0, 92.0), dice.uniform(68.0, 82.0)
    waves = [(dice.uniform(0.8, 2.5), 2 * math.pi / dice.uniform(55.0, 110.0),
              dice.uniform(0.0, math.pi), dice.uniform(0.0, 2 * math.pi)) for _ in range(4)]

    def height(x, y):
        return sum(a * math.sin(k * (x * math.cos(t) + y * math.sin(t)) + f)
                   for a, k, t, f in waves)

    count = 14
    grid = Array2_double(1, count, 1, count)
    dx, dy = (w + 4.0) / (count - 1), (d + 4.0) / (count - 1)
    for i in range(count):
        for j in range(count):
            grid.SetValue(i + 1, j + 1, height(i * dx - w / 2 - 2.0, j * dy - d / 2 - 2.0))
    surface = GeomAPI_PointsToBSplineSurface(grid, -w / 2 - 2.0, dx, -d / 2 - 2.0, dy, 3, 5,
                                             GeomAbs_C2, 1e-3).Surface()
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    solid = solids.common(solids.thickened(face, (0.0, 0.0, -30.0)),
                          solids.box((-w / 2, -d / 2, -DEEP), (w / 2, d / 2, 30.0)))
    places = [(x, y, room, height(x, y)) for x, y, room, _ in cells(w - 14.0, d - 14.0, dice)]
    return Base("sheet", solid, places, is_flat=False)


KINDS = (plate, plate, plate, prism, disc, stepped, stepped, roof, log, shaft, sheet, sheet)

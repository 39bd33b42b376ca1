"""Tops of glossy parts: how high, which way they face, and where they mirror the laser at the sensor."""

import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "parts"))

import solids

# No place of a top is steeper.
STEEPEST = math.sin(math.radians(33.0))


def unit(v):
    length = math.sqrt(sum(c * c for c in v))
    return [c / length for c in v]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


class Top:
    """A top over x and y. Subclasses say how high it is and its unit normal."""

    def mirror_off_rad(self, x, y, extent, standoff, baseline):
        """Angle between the laser's beam, mirrored there, and the way to the sensor. The laser stands
        `standoff` from the middle of the part's `extent` (lower and upper corner), the sensor beside it
        along y."""
        low, high = extent
        laser = [x, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2 + standoff]
        sensor = [x, laser[1] + baseline, laser[2]]
        place = [x, y, self.height(x, y)]
        n = self.normal(x, y)
        beam = unit([p - q for p, q in zip(place, laser)])
        along = dot(beam, n)
        mirrored = [b - 2.0 * along * c for b, c in zip(beam, n)]
        towards = unit([q - p for p, q in zip(place, sensor)])
        return math.acos(max(-1.0, min(1.0, dot(mirrored, towards))))

    def highest(self, block):
        """Greatest height over a footprint, by places all over it."""
        return max(self.height(*block.point(u / 10, v / 10)) for u in range(-10, 11)
                   for v in range(-10, 11))


class Plane(Top):
    """Through a place, leaning along x."""

    def __init__(self, at, lean):
        self.at, self.lean = at, lean

    def height(self, x, _y):
        return self.at[2] + math.tan(self.lean) * (x - self.at[0])

    def normal(self, _x, _y):
        return [-math.sin(self.lean), 0.0, math.cos(self.lean)]

    def cut(self, block):
        low, high = (self.at[0] - 150.0, self.at[1] - 150.0), (self.at[0] + 150.0, self.at[1] + 150.0)
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        under = solids.extruded([(x, y, self.height(x, y)) for x, y in corners], (0.0, 0.0, -150.0))
        return solids.common(block, under)

    def told(self):
        return {"kind": "flat" if self.lean == 0.0 else "leaning", "at_mm": list(self.at),
                "lean_deg": math.degrees(self.lean)}


class Cylinder(Top):
    """A ridge through a place that falls with y."""

    def __init__(self, at, radius, fall):
        self.at, self.radius, self.fall = at, radius, fall
        # On the axis, and along it.
        self.base = (at[0], at[1] - radius * math.sin(fall), at[2] - radius * math.cos(fall))
        self.axis = (0.0, math.cos(fall), -math.sin(fall))

    def height(self, x, y):
        # On the upper side: off the axis by the radius, measured square to it.
        across = x - self.base[0]
        up = math.sqrt(self.radius ** 2 - across ** 2)
        # A point of the axis plus `up` along the ridge's normal has this y.
        along = (y - self.base[1] - up * math.sin(self.fall)) / self.axis[1]
        return self.base[2] + along * self.axis[2] + up * math.cos(self.fall)

    def normal(self, x, _y):
        across = (x - self.base[0]) / self.radius
        up = math.sqrt(1.0 - across ** 2)
        return [across, up * math.sin(self.fall), up * math.cos(self.fall)]

    def cut(self, block):
        begin = [b - 200.0 * a for b, a in zip(self.base, self.axis)]
        return solids.common(block, solids.cylinder(begin, self.radius, 400.0, self.axis))

    def told(self):
        return {"kind": "cylinder", "at_mm": list(self.at), "radius_mm": self.radius,
                "fall_deg": math.degrees(self.fall)}


class Ball(Top):
    def __init__(self, centre, radius):
        self.centre, self.radius = centre, radius

    def height(self, x, y):
        off2 = (x - self.centre[0]) ** 2 + (y - self.centre[1]) ** 2
        return self.centre[2] + math.sqrt(self.radius ** 2 - off2)

    def normal(self, x, y):
        place = (x, y, self.height(x, y))
        return [(p - c) / self.radius for p, c in zip(place, self.centre)]

    def cut(self, block):
        return solids.common(block, solids.sphere(self.centre, self.radius))

    def told(self):
        return {"kind": "ball", "centre_mm": list(self.centre), "radius_mm": self.radius}


def of_told(told):
    """The top that is told of in a part's file."""
    kind = told["kind"]
    if kind in ("flat", "leaning"):
        return Plane(told["at_mm"], math.radians(told["lean_deg"]))
    if kind == "cylinder":
        return Cylinder(told["at_mm"], told["radius_mm"], math.radians(told["fall_deg"]))
    return Ball(told["centre_mm"], told["radius_mm"])


def draw(kind, dice, middle, half, at, standoff, baseline):
    """A top of a kind over a block whose corners lie `half` from its `middle`. A round one glares at a
    place `at` (x, y): its normal there halves the angle between laser and sensor."""
    if kind == "flat":
        return Plane(middle, 0.0)
    if kind == "leaning":
        return Plane(middle, math.radians(dice.uniform(3.0, 9.0)) * dice.choice((-1.0, 1.0)))
    towards = middle[1] + baseline / 2 - at[1]
    fall = math.atan2(towards, standoff)
    reach = half + math.hypot(at[0] - middle[0], at[1] - middle[1])
    least = max(60.0, (abs(at[0] - middle[0]) + half if kind == "cylinder" else reach) / STEEPEST)
    if least > 200.0:
        raise solids.Failed("too steep")
    radius = dice.uniform(least, 200.0)
    place = (at[0], at[1], middle[2])
    if kind == "cylinder":
        return Cylinder(place, radius, fall)
    centre = (at[0], at[1] - radius * math.sin(fall), middle[2] - radius * math.cos(fall))
    if (half + math.hypot(centre[0] - middle[0], centre[1] - middle[1])) / radius > STEEPEST:
        raise solids.Failed("too steep")
    return Ball(centre, radius)

"""What parts of known features are made with: footprints, tools to cut with, and how a part with the
truth about it is placed before the scanner and written.

A part is made in a frame of its own: a corner of the block at the origin, x along its length, the
block's top at z = 0, the part below. `placed` turns it about z and moves it into the scan's frame.
"""

import json
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "parts"))

import numpy
import solids
import truth
from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Transform
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.TCollection import TCollection_HAsciiString
from OCP.collections import Array2_double
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

UP = [0.0, 0.0, 1.0]
# What is done to the edges of others.
EDGES = ("chamfer", "round", "fillet")
# Height of tools above what they cut.
ABOVE = 40.0


class Rectangle:
    """A footprint: length along a direction, width across, corners rounded or sharp."""

    def __init__(self, at, length, width, corner=0.0, turn=0.0):
        self.at, self.length, self.width, self.corner, self.turn = at, length, width, corner, turn

    def outline(self):
        half_l, half_w, r = self.length / 2, self.width / 2, self.corner
        points = []
        for k, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
            if r <= 0.0:
                points.append((sx * half_l, sy * half_w))
                continue
            for step in range(7):
                angle = (k + step / 6) * math.pi / 2
                points.append((sx * (half_l - r) + r * math.cos(angle),
                               sy * (half_w - r) + r * math.sin(angle)))
        c, s = math.cos(self.turn), math.sin(self.turn)
        return [(self.at[0] + c * x - s * y, self.at[1] + s * x + c * y) for x, y in points]

    def prism(self, low, high):
        body = solids.box((-self.length / 2, -self.width / 2, low),
                          (self.length / 2, self.width / 2, high))
        if self.corner > 0.0:
            def is_upright(p):
                return (abs(abs(p[0]) - self.length / 2) < 1e-6
                        and abs(abs(p[1]) - self.width / 2) < 1e-6)

            body = solids.filleted(body, self.corner, is_upright)
        return moved(solids.turned(body, (0, 0, 1), self.turn), (self.at[0], self.at[1], 0.0))

    def smaller(self, by):
        return Rectangle(self.at, self.length - 2 * by, self.width - 2 * by,
                         max(0.0, self.corner - by), self.turn)

    def direction(self):
        return [math.cos(self.turn), math.sin(self.turn), 0.0]

    def least(self):
        return min(self.length, self.width)

    def point(self, u, v):
        """A place in it, u and v from -1 to 1."""
        x, y = u * self.length / 2, v * self.width / 2
        c, s = math.cos(self.turn), math.sin(self.turn)
        return (self.at[0] + c * x - s * y, self.at[1] + s * x + c * y)


class Circle:
    """A round footprint."""

    def __init__(self, at, diameter):
        self.at, self.diameter = at, diameter

    def outline(self):
        return [(self.at[0] + self.diameter / 2 * math.cos(k * math.pi / 18),
                 self.at[1] + self.diameter / 2 * math.sin(k * math.pi / 18)) for k in range(36)]

    def prism(self, low, high):
        return solids.cylinder((self.at[0], self.at[1], low), self.diameter / 2, high - low)

    def smaller(self, by):
        return Circle(self.at, self.diameter - 2 * by)

    def direction(self):
        return None

    def least(self):
        return self.diameter

    def point(self, u, v):
        r = self.diameter / 2 / math.sqrt(2.0)
        return (self.at[0] + u * r, self.at[1] + v * r)


def is_inside(point, outline):
    x, y = point[:2]
    inside = False
    for (ax, ay), (bx, by) in zip(outline, outline[1:] + outline[:1]):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
    return inside


def to_segment(p, a, b):
    dx, dy = b[0] - a[0], b[1] - a[1]
    length2 = dx * dx + dy * dy
    t = 0.0 if length2 == 0.0 else ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length2
    t = min(1.0, max(0.0, t))
    return math.hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy)


def crosses(a, b, c, d):
    def side(p, q, r):
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0


def gap(first, second):
    """Least distance of two outlines' lines; 0 where they cross."""
    least = math.inf
    sides = list(zip(second, second[1:] + second[:1]))
    for a, b in zip(first, first[1:] + first[:1]):
        for c, d in sides:
            if crosses(a, b, c, d):
                return 0.0
            least = min(least, to_segment(a, c, d), to_segment(c, a, b))
    return least


def apart(first, second):
    """Distance of two areas; 0 where they overlap."""
    if is_inside(first[0], second) or is_inside(second[0], first):
        return 0.0
    return gap(first, second)


def moved(shape, by):
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(*map(float, by)))
    return BRepBuilderAPI_Transform(shape, move, True).Shape()


def wavy(low, high, height):
    """A B-spline surface over a rectangle (x, y), and how high it is at a place."""
    count = 14
    grid = Array2_double(1, count, 1, count)
    dx, dy = (high[0] - low[0]) / (count - 1), (high[1] - low[1]) / (count - 1)
    for i in range(count):
        for j in range(count):
            grid.SetValue(i + 1, j + 1, height(low[0] + i * dx, low[1] + j * dy))
    fit = GeomAPI_PointsToBSplineSurface()
    fit.Interpolate(grid, low[0], dx, low[1], dy)
    surface = fit.Surface()
    u0, u1, v0, v1 = surface.Bounds()

    def at(x, y):
        """The surface is a graph with uniform parameters: x goes with u, y with v."""
        u = u0 + (u1 - u0) * (x - low[0]) / (high[0] - low[0])
        v = v0 + (v1 - v0) * (y - low[1]) / (high[1] - low[1])
        for _ in range(30):
            p, e = surface.Value(u, v), 1e-6
            ex, ey = x - p.X(), y - p.Y()
            if abs(ex) + abs(ey) < 1e-11:
                break
            q, r = surface.Value(u + e, v), surface.Value(u, v + e)
            a, b, c, d = (q.X() - p.X()) / e, (r.X() - p.X()) / e, (q.Y() - p.Y()) / e, \
                (r.Y() - p.Y()) / e
            det = a * d - b * c
            u, v = u + (ex * d - ey * b) / det, v + (ey * a - ex * c) / det
        return surface.Value(u, v).Z()

    return surface, at


def above(surface):
    """The body above a free-form surface."""
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    return solids.thickened(face, (0.0, 0.0, 2 * ABOVE))


def middle(points):
    return sum(p[0] for p in points) / len(points), sum(p[1] for p in points) / len(points)


class Part:
    """A solid and the truth about its features, in the part's own frame."""

    def __init__(self, length, width, height):
        self.size = (length, width, height)
        self.solid = solids.box((0.0, 0.0, -height), (length, width, 0.0))
        self.features, self.patterns, self.notes = [], [], []
        footprint = Rectangle((length / 2, width / 2), length, width)
        if width > length:
            footprint = Rectangle((length / 2, width / 2), width, length, turn=math.pi / 2)
        dimensions = {"length": footprint.length, "width": footprint.width, "height": height}
        self.tell("block", None, footprint, 0.0, 0.0, dimensions)

    def tell(self, kind, parent, footprint, z, floor_z, dimensions, **more):
        """Notes a feature: where it stands or goes in (`z`), and its floor or top (`floor_z`)."""
        number = len(self.features)
        told = {"id": number, "parent": parent, "type": kind,
                "center_mm": [footprint.at[0], footprint.at[1], z], "axis": UP,
                "dimensions_mm": dimensions, "floor_z_mm": floor_z,
                "outline_mm": footprint.outline(),
                "probes_mm": [footprint.point(u, v) for u in (-0.6, 0.0, 0.6)
                              for v in (-0.6, 0.0, 0.6)]}
        if footprint.direction() is not None:
            told["direction"] = footprint.direction()
        told.update(more)
        self.features.append(told)
        return number


def from_above(triangles, places):
    """For each place (x, y) the height there as seen from above, and which triangle is seen; minus
    infinity and -1 where there is none."""
    corners = numpy.asarray(triangles, dtype=float)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    det = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    level = numpy.abs(det) > 1e-12
    which = numpy.flatnonzero(level)
    a, b, c, det = a[level], b[level], c[level], det[level]
    found = []
    for x, y in places:
        s = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (y - a[:, 1])) / det
        t = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (x - a[:, 0]) * (b[:, 1] - a[:, 1])) / det
        met = (s > -1e-9) & (t > -1e-9) & (s + t < 1.0 + 1e-9)
        z = numpy.where(met, a[:, 2] + s * (b[:, 2] - a[:, 2]) + t * (c[:, 2] - a[:, 2]), -math.inf)
        best = int(numpy.argmax(z))
        found.append((float(z[best]), int(which[best]) if met.any() else -1))
    return found


def faces_below(faces, triangles, places):
    """For each place (x, y) the face that is seen there from above; `None` for none."""
    of = {}
    for number, face in enumerate(faces):
        for k in range(face["triangles"]):
            of[face["first_triangle"] + k] = number
    return [of.get(triangle) for _, triangle in from_above(triangles, places)]


# Places of a part at which what is told of its features is held against its triangles.
CHECKED = 150


def told_height(features, place):
    """How high the part is at a place by what is told of its features: least and greatest; `None`
    near a border, on a broken edge, and on a cone."""
    low = high = None
    for told in features:
        if told["type"] in EDGES:
            continue
        outline = told["outline_mm"]
        border = 0.4 + max((e["dimensions_mm"].get("width", e["dimensions_mm"].get("radius"))
                            for e in features
                            if e["parent"] == told["id"] and e["type"] in EDGES), default=0.0)
        if min(to_segment(place, p, q) for p, q in zip(outline, outline[1:] + outline[:1])) < border:
            return None
        if not is_inside(place, outline):
            continue
        if told["type"] == "countersink":
            # Its hole, which comes before it, is seen through it.
            if not is_inside(place, features[told["parent"]]["outline_mm"]):
                return None
            continue
        low = high = told["floor_z_mm"]
        if "depth_mm" in told:
            # The greatest depths are sampled ones.
            low = told["center_mm"][2] - told["depth_mm"][1] - 0.2
            high = told["center_mm"][2] - told["depth_mm"][0] + 0.2
        elif told.get("through"):
            low = high = -math.inf
        elif told.get("tip"):
            r = told["dimensions_mm"]["diameter"] / 2
            off = math.dist(place, told["center_mm"][:2])
            low = high = low - (r - off) / math.tan(math.radians(59.0))
        elif told.get("free_form"):
            return None
    return None if low is None else (low, high)


class NotAsTold(ValueError):
    """A part that is not what is told of its features."""


def check(features, triangles):
    """Whether the part is what is told of it: its height at places all over it."""
    dice = random.Random(len(triangles))
    outline = features[0]["outline_mm"]
    low = [min(p[k] for p in outline) for k in range(2)]
    high = [max(p[k] for p in outline) for k in range(2)]
    places = [(dice.uniform(low[0], high[0]), dice.uniform(low[1], high[1]))
              for _ in range(CHECKED)]
    for told in features:
        places += [tuple(p) for p in told["probes_mm"]]
    for place, (height, _) in zip(places, from_above(triangles, places)):
        expected = told_height(features, place)
        if expected and not expected[0] - 0.01 <= height <= expected[1] + 0.01:
            raise NotAsTold(f"at {place} the part is {height:.3f} high and is told to be "
                            f"{expected[0]:.3f} to {expected[1]:.3f}")


def pose(turn_rad, about, to):
    """From the part's frame into the scan's: turned about z at a place, that place moved."""
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    return (c, s, about, to)


def place_point(own, p):
    c, s, about, to = own
    x, y = p[0] - about[0], p[1] - about[1]
    moved_xy = [to[0] + c * x - s * y, to[1] + s * x + c * y]
    return moved_xy + ([p[2] + to[2]] if len(p) == 3 else [])


def place_direction(own, d):
    c, s = own[0], own[1]
    return [c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]]


def placed(part, own):
    """The solid in the scan's frame, and the truth about its features there."""
    c, s, about, to = own
    solid = moved(part.solid, (-about[0], -about[1], 0.0))
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0)), math.atan2(s, c))
    solid = moved(BRepBuilderAPI_Transform(solid, turn, True).Shape(), to)
    features = []
    for told in part.features:
        told = dict(told)
        told["center_mm"] = place_point(own, told["center_mm"])
        told["outline_mm"] = [place_point(own, p) for p in told["outline_mm"]]
        told["probes_mm"] = [place_point(own, p) for p in told["probes_mm"]]
        told["floor_z_mm"] += to[2]
        if "direction" in told:
            told["direction"] = place_direction(own, told["direction"])
        if "points_mm" in told:
            told["points_mm"] = [place_point(own, p) for p in told["points_mm"]]
        features.append(told)
    return solid, features


def faces(solid):
    """The faces with their surfaces, and their triangles."""
    BRepTools.Clean_s(solid)
    BRepMesh_IncrementalMesh(solid, truth.DEFLECTION_MM, False, truth.DEFLECTION_RAD, False)
    triangles, told = [], []
    for face in truth.faces_of(solid):
        own = truth.triangles_of(face)
        if not own:
            raise solids.Failed("a face without triangles")
        told.append({**truth.surface(face), "first_triangle": len(triangles),
                     "triangles": len(own)})
        triangles += own
    return told, triangles


def write_step(path, solid):
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    # Made first: settings are not there before.
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.schema", "AP242DIS")
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    # Curves on surfaces can be computed from the edges and would be most of the file.
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
    writer.Transfer(solid, STEPControl_AsIs)
    # The same part gives the same file.
    header = APIHeaderSection_MakeHeader(writer.Model())
    header.SetTimeStamp(TCollection_HAsciiString("1970-01-01T00:00:00"))
    header.SetName(TCollection_HAsciiString("part"))
    header.SetAuthorValue(1, TCollection_HAsciiString(""))
    if writer.Write(path) != IFSelect_RetDone:
        raise solids.Failed(f"cannot write {path}")


def write(folder, stem, solid, features, scan, **more):
    """NAME.stl, NAME.step and NAME.json, which is written last: where it is, the rest is whole."""
    own_faces, triangles = faces(solid)
    check(features, triangles)
    for told in features:
        told["floor_faces"] = faces_below(own_faces, triangles, told["probes_mm"])
        told.pop("probes_mm")
    stem = os.path.join(folder, stem)
    truth.write_stl(stem + ".stl", triangles)
    write_step(stem + ".step", solid)
    told = {"name": os.path.basename(stem), **more, "scan": scan, "features": features, "faces": own_faces}
    with open(stem + ".json.part", "w", encoding="utf-8") as file:
        json.dump(rounded(told), file)
    os.replace(stem + ".json.part", stem + ".json")


def rounded(value):
    """Numbers to a picometre: what is beyond depends on the machine's library."""
    if isinstance(value, float):
        return round(value, 9)
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(item) for item in value]
    return value

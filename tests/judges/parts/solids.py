"""Solids by OpenCASCADE, in few words: primitives, Boolean operations, fillets."""

import math

from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeSolid,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Sewing,
    BRepBuilderAPI_Transform,
)
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepGProp import BRepGProp
from OCP.BRepLib import BRepLib
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.GProp import GProp_GProps
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec


class Failed(Exception):
    """A feature that cannot be made here."""


def point(p):
    return gp_Pnt(float(p[0]), float(p[1]), float(p[2]))


def axes(at, along=(0.0, 0.0, 1.0)):
    return gp_Ax2(point(at), gp_Dir(float(along[0]), float(along[1]), float(along[2])))


def box(low, high):
    return BRepPrimAPI_MakeBox(point(low), point(high)).Shape()


def cylinder(at, radius, height, along=(0.0, 0.0, 1.0)):
    return BRepPrimAPI_MakeCylinder(axes(at, along), radius, height).Shape()


def cone(at, first_radius, last_radius, height, along=(0.0, 0.0, 1.0)):
    return BRepPrimAPI_MakeCone(axes(at, along), first_radius, last_radius, height).Shape()


def sphere(at, radius):
    return BRepPrimAPI_MakeSphere(axes(at), radius).Shape()


def torus(at, radius, tube, along=(0.0, 0.0, 1.0)):
    return BRepPrimAPI_MakeTorus(axes(at, along), radius, tube).Shape()


def extruded(corners, by):
    """A polygon in space, moved along a vector."""
    polygon = BRepBuilderAPI_MakePolygon()
    for corner in corners:
        polygon.Add(point(corner))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(*map(float, by))).Shape()


def polyhedron(polygons):
    """The body that flat polygons enclose."""
    sewing = BRepBuilderAPI_Sewing(1e-6)
    for corners in polygons:
        polygon = BRepBuilderAPI_MakePolygon()
        for corner in corners:
            polygon.Add(point(corner))
        polygon.Close()
        sewing.Add(BRepBuilderAPI_MakeFace(polygon.Wire(), True).Face())
    sewing.Perform()
    shell = sewing.SewedShape()
    if shell.ShapeType() != TopAbs_SHELL:
        raise Failed("polygons do not meet")
    solid = BRepBuilderAPI_MakeSolid(TopoDS.Shell(shell)).Solid()
    BRepLib.OrientClosedSolid_s(solid)
    return only_solid(solid)


def thickened(face, by):
    return BRepPrimAPI_MakePrism(face, gp_Vec(*map(float, by))).Shape()


def revolved(steps, along_x):
    """A profile (x, radius) turned about the x axis. A step of three numbers, (x, radius, bulge),
    is reached by an arc whose middle lies so far off the chord, to the left."""
    wire = BRepBuilderAPI_MakeWire()
    closed = [(along_x[0], 0.0), *steps, (along_x[1], 0.0)]
    for a, b in zip(closed, closed[1:] + closed[:1]):
        start, end = point((a[0], 0.0, a[1])), point((b[0], 0.0, b[1]))
        if len(b) == 3 and b[2] != 0.0:
            dx, dz = b[0] - a[0], b[1] - a[1]
            length = math.hypot(dx, dz)
            middle = point(((a[0] + b[0]) / 2 - dz / length * b[2], 0.0,
                            (a[1] + b[1]) / 2 + dx / length * b[2]))
            arc = GC_MakeArcOfCircle(start, middle, end).Value()
            wire.Add(BRepBuilderAPI_MakeEdge(arc).Edge())
        else:
            wire.Add(BRepBuilderAPI_MakeEdge(start, end).Edge())
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    axis = gp_Ax1(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(1.0, 0.0, 0.0))
    return BRepPrimAPI_MakeRevol(face, axis).Shape()


def turned(shape, about, angle_rad):
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(*map(float, about))), angle_rad)
    return BRepBuilderAPI_Transform(shape, turn, True).Shape()


def volume(shape):
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    return found.Mass()


def only_solid(shape):
    """The one solid of a shape, with its faces on one surface made one."""
    unify = ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    unify.Build()
    solids = []
    explorer = TopExp_Explorer(unify.Shape(), TopAbs_SOLID)
    while explorer.More():
        solids.append(explorer.Current())
        explorer.Next()
    if len(solids) != 1:
        raise Failed(f"{len(solids)} solids")
    if not BRepCheck_Analyzer(solids[0]).IsValid() or volume(solids[0]) <= 0.0:
        raise Failed("not valid")
    return solids[0]


def combined(kind, a, b):
    operation = kind(a, b)
    operation.Build()
    if not operation.IsDone():
        raise Failed("no Boolean operation")
    made = only_solid(operation.Shape())
    if abs(volume(made) - volume(a)) < 1e-3:
        raise Failed("nothing changed")
    return made


def cut(a, b):
    return combined(BRepAlgoAPI_Cut, a, b)


def fuse(a, b):
    return combined(BRepAlgoAPI_Fuse, a, b)


def common(a, b):
    return combined(BRepAlgoAPI_Common, a, b)


def points_on(edge, count=9):
    curve = BRepAdaptor_Curve(edge)
    first, last = curve.FirstParameter(), curve.LastParameter()
    places = [curve.Value(first + (last - first) * k / (count - 1)) for k in range(count)]
    return [(p.X(), p.Y(), p.Z()) for p in places]


def edges(shape, is_wanted):
    """The distinct edges all points of which are wanted."""
    found = []
    explorer = TopExp_Explorer(shape, TopAbs_EDGE)
    while explorer.More():
        edge = TopoDS.Edge(explorer.Current())
        explorer.Next()
        if BRep_Tool.Degenerated_s(edge) or any(edge.IsSame(other) for other in found):
            continue
        if all(is_wanted(p) for p in points_on(edge)):
            found.append(edge)
    if not found:
        raise Failed("no such edge")
    return found


def finished(operation):
    try:
        operation.Build()
        is_done = operation.IsDone()
    except Exception as error:  # OpenCASCADE's exceptions have no common base in Python
        raise Failed(str(error)) from error
    if not is_done:
        raise Failed("not done")
    return only_solid(operation.Shape())


def filleted(shape, radius, is_wanted):
    operation = BRepFilletAPI_MakeFillet(shape)
    for edge in edges(shape, is_wanted):
        operation.Add(radius, edge)
    return finished(operation)


def chamfered(shape, width, is_wanted):
    operation = BRepFilletAPI_MakeChamfer(shape)
    for edge in edges(shape, is_wanted):
        operation.Add(width, edge)
    return finished(operation)

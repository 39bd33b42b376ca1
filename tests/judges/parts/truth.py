"""What a part really is: triangles by face, the surface of each face, the edges between faces."""

import math
import struct

import solids
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.GCPnts import GCPnts_QuasiUniformAbscissa
from OCP.GeomAbs import (
    GeomAbs_Cone,
    GeomAbs_Cylinder,
    GeomAbs_Plane,
    GeomAbs_Sphere,
    GeomAbs_Torus,
)
from OCP.GeomLProp import GeomLProp_SLProps
from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_REVERSED
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.gp import gp_Cone, gp_Cylinder, gp_Pln, gp_Sphere

# Greatest distance of a triangle from its face, and angle between neighbours.
DEFLECTION_MM = 0.0015
DEFLECTION_RAD = 0.12
# A free-form face that is as near as this to a plane, cylinder, cone or sphere is none.
SIMPLE_MM = 0.005
# Distance of points along edges.
SPACING_MM = 0.25
# Faces that meet at less than this angle all along are smoothly joined.
SMOOTH_RAD = math.radians(1.0)


def triple(v):
    return [v.X(), v.Y(), v.Z()]


def surface(face):
    """Kind and numbers of a face's surface."""
    found = BRepAdaptor_Surface(face)
    kind = found.GetType()
    if kind == GeomAbs_Plane:
        plane = found.Plane()
        return {"kind": "plane", "point_mm": triple(plane.Location()),
                "direction": triple(plane.Axis().Direction())}
    if kind == GeomAbs_Cylinder:
        round_ = found.Cylinder()
        return {"kind": "cylinder", "point_mm": triple(round_.Location()),
                "direction": triple(round_.Axis().Direction()), "radius_mm": round_.Radius()}
    if kind == GeomAbs_Cone:
        cone = found.Cone()
        half = cone.SemiAngle()
        # From the apex into the half of the double cone that the face lies on.
        into = [math.copysign(1.0, half) * c for c in triple(cone.Axis().Direction())]
        apex = triple(cone.Apex())
        u = (found.FirstUParameter() + found.LastUParameter()) / 2
        v = (found.FirstVParameter() + found.LastVParameter()) / 2
        middle = triple(found.Value(u, v))
        if sum((m - a) * d for m, a, d in zip(middle, apex, into)) < 0.0:
            into = [-c for c in into]
        return {"kind": "cone", "point_mm": apex, "direction": into,
                "half_angle_rad": abs(half)}
    if kind == GeomAbs_Sphere:
        ball = found.Sphere()
        return {"kind": "sphere", "point_mm": triple(ball.Location()),
                "radius_mm": ball.Radius()}
    if kind == GeomAbs_Torus:
        ring = found.Torus()
        return {"kind": "torus", "point_mm": triple(ring.Location()),
                "direction": triple(ring.Axis().Direction()),
                "radius_mm": ring.MajorRadius(), "tube_mm": ring.MinorRadius()}
    return {"kind": "free-form"}


def is_simple(face):
    """Whether a spline stands for a surface with a name: a plane, a cylinder, a cone, a sphere."""
    found = ShapeAnalysis_CanonicalRecognition(face)
    asked = ((found.IsPlane, gp_Pln), (found.IsCylinder, gp_Cylinder), (found.IsCone, gp_Cone),
             (found.IsSphere, gp_Sphere))
    return any(is_kind(SIMPLE_MM, kind()) for is_kind, kind in asked)


def faces_of(solid):
    faces = []
    explorer = TopExp_Explorer(solid, TopAbs_FACE)
    while explorer.More():
        faces.append(TopoDS.Face(explorer.Current()))
        explorer.Next()
    return faces


def triangles_of(face):
    """Corners of the triangles, counter-clockwise from outside."""
    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, location)
    if mesh is None:
        return []
    move = location.Transformation()
    nodes = [triple(mesh.Node(k).Transformed(move)) for k in range(1, mesh.NbNodes() + 1)]
    is_reversed = face.Orientation() == TopAbs_REVERSED
    corners = []
    for k in range(1, mesh.NbTriangles() + 1):
        a, b, c = mesh.Triangle(k).Get()
        if is_reversed:
            b, c = c, b
        corners.append((nodes[a - 1], nodes[b - 1], nodes[c - 1]))
    return corners


def normal_at(edge, face, parameter):
    """Unit normal of a face, out of the solid, at a place on its edge."""
    curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
    place = curve.Value(parameter)
    props = GeomLProp_SLProps(BRep_Tool.Surface_s(face), place.X(), place.Y(), 1, 1e-9)
    if not props.IsNormalDefined():
        return None
    normal = triple(props.Normal())
    return [-c for c in normal] if face.Orientation() == TopAbs_REVERSED else normal


def edges_between(faces):
    """Edges that two different faces share: the faces, points along, whether they join smoothly."""
    known = []
    for number, face in enumerate(faces):
        explorer = TopExp_Explorer(face, TopAbs_EDGE)
        while explorer.More():
            edge = TopoDS.Edge(explorer.Current())
            explorer.Next()
            if BRep_Tool.Degenerated_s(edge):
                continue
            for entry in known:
                if entry["edge"].IsSame(edge):
                    entry["faces"].append(number)
                    break
            else:
                known.append({"edge": edge, "faces": [number]})
    found = []
    for entry in known:
        pair = sorted(set(entry["faces"]))
        if len(pair) != 2:
            continue
        curve = BRepAdaptor_Curve(entry["edge"])
        first, last = curve.FirstParameter(), curve.LastParameter()
        angles = []
        for k in range(1, 8):
            at = first + (last - first) * k / 8
            try:
                a, b = (normal_at(entry["edge"], faces[n], at) for n in pair)
            except Exception:  # of OpenCASCADE, which have no common base in Python
                continue
            if a is not None and b is not None:
                cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]]
                dot = sum(p * q for p, q in zip(a, b))
                angles.append(math.atan2(math.sqrt(sum(c * c for c in cross)), dot))
        along = GCPnts_QuasiUniformAbscissa(curve, 4)
        rough = [curve.Value(along.Parameter(k)) for k in range(1, 5)]
        length = sum(p.Distance(q) for p, q in zip(rough, rough[1:]))
        count = max(3, int(1.2 * length / SPACING_MM) + 2)
        along = GCPnts_QuasiUniformAbscissa(curve, count)
        points = [triple(curve.Value(along.Parameter(k))) for k in range(1, along.NbPoints() + 1)]
        found.append({
            "faces": pair,
            "is_smooth": bool(angles) and max(angles) < SMOOTH_RAD,
            "points_mm": [[round(c, 5) for c in p] for p in points],
        })
    return found


def of(solid):
    """The truth, and the triangles in the order of the faces."""
    BRepTools.Clean_s(solid)
    BRepMesh_IncrementalMesh(solid, DEFLECTION_MM, False, DEFLECTION_RAD, False)
    faces = faces_of(solid)
    triangles, told = [], []
    for face in faces:
        own = triangles_of(face)
        if not own:
            raise solids.Failed("a face without triangles")
        if surface(face)["kind"] == "free-form" and is_simple(face):
            raise solids.Failed("a spline that is a simple surface")
        told.append({**surface(face), "first_triangle": len(triangles), "triangles": len(own)})
        triangles += own
    return {"faces": told, "edges": edges_between(faces)}, triangles


def write_stl(path, triangles):
    """Binary STL: the simulator takes it as it is."""
    with open(path, "wb") as file:
        file.write(b"a part of known faces".ljust(80, b" "))
        file.write(struct.pack("<I", len(triangles)))
        for corners in triangles:
            a, b, c = corners
            u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
            normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
            length = math.sqrt(sum(n * n for n in normal)) or 1.0
            file.write(struct.pack("<12fH", *(n / length for n in normal), *a, *b, *c, 0))

"""Judge the solid that was rebuilt from features: one valid closed solid, as near to the part's visible
faces as was promised.
"""

import math
import os
import random
import struct
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

import occ_check
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopoDS import TopoDS
from OCP.gp import gp_Pnt

POINTS = 400
# Walls send nothing back: beyond 75 degrees the simulated scanner sees no face.
LEAST_COS = math.cos(math.radians(75.0))
SEEN_LEAST = 12


def triangles(path):
    with open(path, "rb") as file:
        data = file.read()
    count = struct.unpack_from("<I", data, 80)[0]
    for k in range(count):
        n = struct.unpack_from("<12f", data, 84 + 50 * k)
        yield n[3:6], n[6:9], n[9:12]


def visible_points(path, truth, seen):
    """Points on faces that the scanner saw, as dense as seen from above, and of which face each is."""
    own = list(triangles(path))
    dice = random.Random(f"points of {truth['name']}")
    window = truth["scan"]["window_mm"]
    there, total = [], 0.0
    for number, face in enumerate(truth["faces"]):
        if seen["faces"][number] < SEEN_LEAST:
            continue
        first = face["first_triangle"]
        for a, b, c in own[first:first + face["triangles"]]:
            u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
            n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
            length = math.sqrt(sum(x * x for x in n))
            if length > 0.0 and n[2] / length > LEAST_COS:
                total += n[2] / 2
                there.append((total, a, b, c, number))
    points = []
    # Evenly over the area, each in its stretch of it.
    at = 0
    for k in range(POINTS):
        wanted = (k + dice.random()) / POINTS * total
        while at + 1 < len(there) and there[at][0] < wanted:
            at += 1
        _, a, b, c, number = there[at]
        s, t = dice.random(), dice.random()
        if s + t > 1.0:
            s, t = 1.0 - s, 1.0 - t
        p = [a[i] + s * (b[i] - a[i]) + t * (c[i] - a[i]) for i in range(3)]
        if window is None or all(window[0][i] < p[i] < window[1][i] for i in range(2)):
            points.append((p, number))
    return points


def judged(step, stl, truth, seen):
    occ_check.silence()
    reader = STEPControl_Reader()
    if reader.ReadFile(step) != IFSelect_RetDone:
        return {"is_read": False}
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape.IsNull():
        return {"is_read": False}
    solids = list(occ_check.explore(shape, TopAbs_SOLID, TopoDS.Solid))
    shells = list(occ_check.explore(shape, TopAbs_SHELL, TopoDS.Shell))
    faces = list(occ_check.explore(shape, TopAbs_FACE, TopoDS.Face))
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    deviations = {}
    for point, face in visible_points(stl, truth, seen):
        deviations.setdefault(face, []).append(distance_to(shells, point))
    free = [distance_to(shells, p) for f in truth["features"] for p in f.get("points_mm", [])]
    everything = [d for own in deviations.values() for d in own]
    return {
        "is_read": True,
        "solids": len(solids),
        "faces": len(faces),
        "is_valid": bool(BRepCheck_Analyzer(shape).IsValid()),
        "is_closed": bool(shells) and all(BRep_Tool.IsClosed_s(shell) for shell in shells),
        "volume_mm3": found.Mass(),
        "points": len(everything),
        "rms_mm": rms(everything),
        "most_mm": max(everything, default=0.0),
        "faces_off": sum(rms(own) > 0.1 for own in deviations.values()),
        "faces_judged": len(deviations),
        "free_points_mm": free,
    }


def distance_to(shells, point):
    """From the shells, not the solid: within that every point is at no distance."""
    vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*map(float, point))).Vertex()
    least = math.inf
    for shell in shells:
        distance = BRepExtrema_DistShapeShape(vertex, shell)
        if distance.IsDone():
            least = min(least, distance.Value())
    return least


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else 0.0

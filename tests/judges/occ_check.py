#!/usr/bin/env python3
"""Judge an IGES file with OpenCASCADE, independently of the code that wrote it.

Needs nothing but `pip install cadquery-ocp` (see README.md for the version).
Prints one JSON document; exit code 0 when the file is sound, 1 when it is not,
2 on wrong usage or an unreadable file.
"""

import argparse
import json
import math
import sys

from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools, BRepTools_WireExplorer
from OCP.GProp import GProp_GProps
from OCP.GeomAbs import GeomAbs_Cone, GeomAbs_Cylinder, GeomAbs_Sphere, GeomAbs_Torus
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.Interface import Interface_CheckTool
from OCP.Message import Message
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_REVERSED, TopAbs_VERTEX, TopAbs_WIRE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_DocumentTool
from OCP.collections import Sequence_TDF_Label
from OCP.gp import gp_Pnt, gp_Vec


# Surfaces whose normal always points away from their axis: entities 192 to 198 have no other side,
# and a trimmed surface (144) has none of its own.
ROUND = (GeomAbs_Cylinder, GeomAbs_Cone, GeomAbs_Sphere, GeomAbs_Torus)

# Relative error allowed to the integration of areas.
AREA_PRECISION = 1e-6


def explore(shape, kind, cast):
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield cast(explorer.Current())
        explorer.Next()


def distinct(shape, kind):
    """Number of different sub-shapes of a kind."""
    seen = []
    for sub in explore(shape, kind, lambda s: s):
        if not any(sub.IsSame(other) for other in seen):
            seen.append(sub)
    return len(seen)


def entity_checks(reader):
    """What OpenCASCADE's own checks say of each entity: lists of fails and warnings."""
    model = reader.IGESModel()
    tool = Interface_CheckTool(model)
    fails, warnings = [], []
    checks = tool.CompleteCheckList()
    checks.Start()
    while checks.More():
        check = checks.Value()
        number = checks.Number()
        where = "global"
        if number > 0:
            entity = model.Entity(number)
            where = f"entity {entity.TypeNumber()} at D{2 * number - 1}"
        for k in range(1, check.NbFails() + 1):
            fails.append(f"{where}: {check.CFail(k)}")
        for k in range(1, check.NbWarnings() + 1):
            warnings.append(f"{where}: {check.CWarning(k)}")
        checks.Next()
    return fails, warnings


def transfer_checks(reader):
    """Messages of the transfer of entities to shapes: a lost trim is one of these."""
    fails, warnings = [], []
    process = reader.WS().TransferReader().TransientProcess()
    checks = process.CheckList(False)
    checks.Start()
    while checks.More():
        check = checks.Value()
        for k in range(1, check.NbFails() + 1):
            fails.append(check.CFail(k))
        for k in range(1, check.NbWarnings() + 1):
            warnings.append(check.CWarning(k))
        checks.Next()
    return fails, warnings


def sample_wire(wire, face, spacing):
    """Points along a wire in its sense of travel, the first not repeated at the end."""
    points = []
    explorer = BRepTools_WireExplorer(wire, face)
    while explorer.More():
        edge = explorer.Current()
        curve = BRepAdaptor_Curve(edge)
        first, last = curve.FirstParameter(), curve.LastParameter()
        properties = GProp_GProps()
        BRepGProp.LinearProperties_s(edge, properties)
        steps = max(4, math.ceil(properties.Mass() / spacing))
        reverse = edge.Orientation() == TopAbs_REVERSED
        for k in range(steps):
            f = k / steps
            t = last + (first - last) * f if reverse else first + (last - first) * f
            p = curve.Value(t)
            points.append([p.X(), p.Y(), p.Z()])
        explorer.Next()
    return points


def signed_area_xy(points):
    return 0.5 * sum(
        a[0] * b[1] - b[0] * a[1] for a, b in zip(points, points[1:] + points[:1])
    )


def normal_towards_camera(face):
    """z of the unit normal, orientation counted, at the middle of the parameter range."""
    surface = BRepAdaptor_Surface(face, True)
    u = 0.5 * (surface.FirstUParameter() + surface.LastUParameter())
    v = 0.5 * (surface.FirstVParameter() + surface.LastVParameter())
    point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    surface.D1(u, v, point, du, dv)
    normal = du.Crossed(dv)
    z = normal.Z() / (normal.Magnitude() or 1.0)
    return -z if face.Orientation() == TopAbs_REVERSED else z


def judge_face(face, spacing):
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties, AREA_PRECISION)
    outer = BRepTools.OuterWire_s(face)
    loops = []
    for wire in explore(face, TopAbs_WIRE, TopoDS.Wire):
        points = sample_wire(wire, face, spacing)
        loops.append({
            "outer": wire.IsSame(outer),
            "vertices": distinct(wire, TopAbs_VERTEX),
            "edges": distinct(wire, TopAbs_EDGE),
            "signed_area_xy_mm2": signed_area_xy(points),
            "points": points,
        })
    loops.sort(key=lambda loop: not loop["outer"])
    tolerance = max(
        (BRep_Tool.Tolerance_s(e) for e in explore(face, TopAbs_EDGE, TopoDS.Edge)),
        default=0.0,
    )
    return {
        "valid": BRepCheck_Analyzer(face).IsValid(),
        "area_mm2": properties.Mass(),
        "normal_z": normal_towards_camera(face),
        "round": BRepAdaptor_Surface(face, True).GetType() in ROUND,
        "vertices": distinct(face, TopAbs_VERTEX),
        "tolerance_mm": tolerance,
        "loops": loops,
    }


def uses_of_edges(faces):
    """How many of the faces each edge belongs to, without sewing: edges are the same or not."""
    edges = []
    for face in faces:
        for edge in explore(face, TopAbs_EDGE, TopoDS.Edge):
            for known in edges:
                if known[0].IsSame(edge):
                    known[1] += 1
                    break
            else:
                edges.append([edge, 1])
    return [uses for _, uses in edges]


def sew(faces, tolerance):
    sewing = BRepBuilderAPI_Sewing(tolerance)
    for face in faces:
        sewing.Add(face)
    sewing.Perform()
    return {
        "tolerance_mm": tolerance,
        "free_edges": sewing.NbFreeEdges(),
        "shared_edges": sewing.NbContigousEdges(),
        "multiple_edges": sewing.NbMultipleEdges(),
    }


def labels_of(made):
    """All labels of shapes, those of parts of shapes included."""
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(made.Main())
    top = Sequence_TDF_Label()
    shapes.GetShapes(top)
    for k in range(1, top.Length() + 1):
        yield shapes, top.Value(k)
        parts = Sequence_TDF_Label()
        shapes.GetSubShapes_s(top.Value(k), parts)
        for n in range(1, parts.Length() + 1):
            yield shapes, parts.Value(n)


def names_and_colours(path):
    """Name, colour and layer of each face as a program with a tree would show them."""
    from OCP.IGESCAFControl import IGESCAFControl_Reader
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_ColorSurf

    document = TDocStd_Document(TCollection_ExtendedString("judge"))
    reader = IGESCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetLayerMode(True)
    if reader.ReadFile(path) != IFSelect_RetDone or not reader.Transfer(document):
        return []
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    layers = XCAFDoc_DocumentTool.LayerTool_s(document.Main())
    found = []
    for shapes, label in labels_of(document):
        shape = shapes.GetShape_s(label)
        if shape.ShapeType() != TopAbs_FACE:
            continue
        name = TDataStd_Name()
        has_name = label.FindAttribute(TDataStd_Name.GetID_s(), name)
        colour = Quantity_Color()
        has_colour = any(
            colours.GetColor(shape, kind, colour) for kind in (XCAFDoc_ColorSurf, XCAFDoc_ColorGen)
        )
        level = layers.GetLayers(label)
        found.append({
            "name": name.Get().ToExtString() if has_name else None,
            "rgb": [round(255 * c) for c in colour.Values(Quantity_TOC_sRGB)] if has_colour else None,
            "layers": [level.Value(i).ToExtString() for i in range(1, level.Length() + 1)]
            if level is not None
            else [],
        })
    return found


def compare(report, expected, tolerance):
    """Differences from a list of faces with names and areas."""
    problems = []
    got = report["faces"]
    if len(got) != len(expected):
        return [f"{len(got)} faces instead of {len(expected)}"]
    for number, (face, want) in enumerate(zip(got, expected), 1):
        area = want.get("area_mm2")
        if area is not None and not abs(face["area_mm2"] - area) <= tolerance * area:
            problems.append(f"face {number}: area {face['area_mm2']} instead of {area}")
        name = want.get("name")
        if name is not None and name not in [tree["name"] for tree in report["tree"]]:
            problems.append(f"face {number}: no face is named {name!r}")
    return problems


def judge(path, arguments):
    reader = IGESControl_Reader()
    status = reader.ReadFile(path)
    if status != IFSelect_RetDone:
        sys.exit(f"{path}: OpenCASCADE cannot read it ({status})")
    fails, warnings = entity_checks(reader)
    model = reader.IGESModel()
    section = model.GlobalSection()
    reader.TransferRoots()
    shape = reader.OneShape()
    transfer_fails, transfer_warnings = transfer_checks(reader)
    faces = [] if shape.IsNull() else list(explore(shape, TopAbs_FACE, TopoDS.Face))
    types = [model.Entity(k).TypeNumber() for k in range(1, model.NbEntities() + 1)]
    report = {
        "file": path,
        "entities": {str(t): types.count(t) for t in sorted(set(types))},
        "unit": section.UnitName().ToCString() if section.UnitName() is not None else None,
        "resolution": section.Resolution(),
        "fails": fails,
        "warnings": warnings,
        "transfer_fails": transfer_fails,
        "transfer_warnings": transfer_warnings,
        "faces": [judge_face(face, arguments.spacing_mm) for face in faces],
        "edges_of_two_faces": sum(n == 2 for n in uses_of_edges(faces)),
        "sewing": sew(faces, arguments.sewing_mm),
        "tree": names_and_colours(path),
    }
    problems = []
    if not faces:
        problems.append("no faces")
    written = types.count(144) + types.count(510)
    if written != len(faces):
        problems.append(f"{written} entities 144 and 510 became {len(faces)} faces")
    problems += fails + warnings + transfer_fails
    if not arguments.allow_transfer_warnings:
        problems += transfer_warnings
    for number, face in enumerate(report["faces"], 1):
        if not face["valid"]:
            problems.append(f"face {number} is not valid by BRepCheck")
        if not face["area_mm2"] > 0.0:
            problems.append(f"face {number} has area {face['area_mm2']}")
        is_hollow = face["round"] and face["normal_z"] < 0.0
        if not (face["normal_z"] > 0.0 or is_hollow):
            problems.append(f"face {number} turns its back to the camera")
        for k, loop in enumerate(face["loops"]):
            if (loop["signed_area_xy_mm2"] > 0.0) != (loop["outer"] != is_hollow):
                problems.append(f"face {number}, loop {k} runs the wrong way")
    if arguments.expect_faces is not None and len(faces) != arguments.expect_faces:
        problems.append(f"{len(faces)} faces instead of {arguments.expect_faces}")
    shared = report["edges_of_two_faces"]
    if shared < arguments.min_shared_edges:
        problems.append(f"{shared} edges of two faces instead of {arguments.min_shared_edges}")
    if arguments.max_free_edges is not None:
        free = report["sewing"]["free_edges"]
        if free > arguments.max_free_edges:
            problems.append(f"{free} free edges instead of {arguments.max_free_edges} at most")
    if arguments.expect is not None:
        with open(arguments.expect, encoding="utf-8") as file:
            expected = json.load(file)["faces"]
        problems += compare(report, expected, arguments.area_tolerance)
    report["problems"] = problems
    report["ok"] = not problems
    if arguments.no_points:
        for face in report["faces"]:
            for loop in face["loops"]:
                del loop["points"]
    return report


def silence():
    """Keep OpenCASCADE's own messages from standard output."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()


def options(words=None):
    """The command line `words`, or the program's own."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--expect-faces", type=int, metavar="N")
    parser.add_argument(
        "--expect", metavar="FILE.json", help='{"faces": [{"name": ..., "area_mm2": ...}]}'
    )
    parser.add_argument("--area-tolerance", type=float, default=1e-3, help="relative")
    parser.add_argument("--max-free-edges", type=int, metavar="N")
    parser.add_argument(
        "--min-shared-edges", type=int, metavar="N", default=0, help="without sewing (shells)"
    )
    parser.add_argument("--sewing-mm", type=float, default=1e-3, help="tolerance for sewing")
    parser.add_argument("--spacing-mm", type=float, default=0.25, help="of the points on loops")
    parser.add_argument(
        "--allow-transfer-warnings",
        action="store_true",
        help="such as those of surfaces whose patches meet without a common tangent",
    )
    parser.add_argument("--no-points", action="store_true", help="leave out points on loops")
    return parser.parse_args(words)


def main():
    arguments = options()
    silence()
    report = judge(arguments.file, arguments)
    json.dump(report, sys.stdout, indent=1)
    print()
    sys.exit(0 if report["ok"] else 1)


if __name__ == "__main__":
    main()

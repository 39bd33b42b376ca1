#!/usr/bin/env python3
"""Judge a STEP file with OpenCASCADE, independently of the code that wrote it.

Needs nothing but `pip install cadquery-ocp` (see README.md for the version).
Prints one JSON document; exit code 0 when the file is sound, 1 when it is not,
2 on wrong usage or an unreadable file.
"""

import argparse
import json
import math
import re
import sys

from OCP.BRep import BRep_Tool
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_CheckTool, Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL, TopAbs_VERTEX
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_Area, XCAFDoc_Centroid, XCAFDoc_DocumentTool

import occ_check

# Area and centroid found by OpenCASCADE may differ from those in the file by this part of
# the area, and of the part's size: it trims by projecting the edges onto the surfaces.
PROPERTY_PRECISION = 1e-4


def checks(list_of_checks):
    """Fails and warnings of a list of checks."""
    fails, warnings = [], []
    list_of_checks.Start()
    while list_of_checks.More():
        check = list_of_checks.Value()
        where = f"#{list_of_checks.Number()}"
        fails += [f"{where}: {check.CFail(k)}" for k in range(1, check.NbFails() + 1)]
        warnings += [f"{where}: {check.CWarning(k)}" for k in range(1, check.NbWarnings() + 1)]
        list_of_checks.Next()
    return fails, warnings


def document(path):
    """The file as a program with a tree would show it: a document of names and colours."""
    made = TDocStd_Document(TCollection_ExtendedString("judge"))
    reader = STEPCAFControl_Reader()
    # Names of faces are left out unless they are asked for; the setting is there once a
    # reader has been made.
    if not Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", 1):
        sys.exit("OpenCASCADE does not know the setting for names of faces")
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetPropsMode(True)
    if reader.ReadFile(path) != IFSelect_RetDone or not reader.Transfer(made):
        sys.exit(f"{path}: OpenCASCADE cannot make a document of it")
    return made


def attribute(label, kind):
    """The attribute of a kind that a label has, or None."""
    # Where there is none, FindAttribute does not come back.
    if not label.IsAttribute(kind.GetID_s()):
        return None
    found = kind()
    return found if label.FindAttribute(kind.GetID_s(), found) else None


def tree(made):
    """Name and colour of each face."""
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_ColorSurf

    colours = XCAFDoc_DocumentTool.ColorTool_s(made.Main())
    found = []
    for shapes, label in occ_check.labels_of(made):
        shape = shapes.GetShape_s(label)
        if shape.ShapeType() != TopAbs_FACE:
            continue
        name, colour = attribute(label, TDataStd_Name), Quantity_Color()
        kinds = (XCAFDoc_ColorSurf, XCAFDoc_ColorGen)
        has_colour = any(colours.GetColor(shape, kind, colour) for kind in kinds)
        rgb = [round(255 * c) for c in colour.Values(Quantity_TOC_sRGB)]
        found.append({
            "name": name.Get().ToExtString() if name is not None else None,
            "rgb": rgb if has_colour else None,
        })
    return found


def properties(made):
    """Area and centroid that the file states, as OpenCASCADE reads them."""
    stated = {"area_mm2": None, "centroid_mm": None}
    for _, label in occ_check.labels_of(made):
        area, centroid = attribute(label, XCAFDoc_Area), attribute(label, XCAFDoc_Centroid)
        if area is not None:
            stated["area_mm2"] = area.Get()
        if centroid is not None:
            point = centroid.Get()
            stated["centroid_mm"] = [point.X(), point.Y(), point.Z()]
    return stated


def box(shape):
    """Least and greatest coordinates."""
    found = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, found, False, False)
    return [[c.X(), c.Y(), c.Z()] for c in (found.CornerMin(), found.CornerMax())]


def measured(shape, is_adaptive=True):
    """Area, centroid and size by one of OpenCASCADE's own integrations. The adaptive one is off by
    1e-4 of the area of some extruded splines, the other by up to a third of rings."""
    found = GProp_GProps()
    if is_adaptive:
        BRepGProp.SurfaceProperties_s(shape, found, occ_check.AREA_PRECISION)
    else:
        BRepGProp.SurfaceProperties_s(shape, found)
    centre = found.CentreOfMass()
    return {"area_mm2": found.Mass(), "centroid_mm": [centre.X(), centre.Y(), centre.Z()]}


def written(path):
    """What the text says, apart from OpenCASCADE: how often each edge is used."""
    with open(path, encoding="ascii") as file:
        text = file.read().replace("\n", "")
    uses = {}
    for edge in re.findall(r"=ORIENTED_EDGE\('',\*,\*,(#\d+),", text):
        uses[edge] = uses.get(edge, 0) + 1
    uncertainty = re.search(r"UNCERTAINTY_MEASURE_WITH_UNIT\(LENGTH_MEASURE\(([^)]*)\)", text)
    return {
        "faces": len(re.findall("=ADVANCED_FACE\\(", text)),
        "shells": len(re.findall("=OPEN_SHELL\\(", text)),
        "edges": len(uses),
        "shared_edges": sum(1 for n in uses.values() if n == 2),
        "unit_mm": 25.4 if "'INCH'" in text else 1.0,
        "uncertainty": float(uncertainty.group(1)),
    }


def differences(report, iges, size):
    """What the IGES file of the same scan has otherwise."""
    problems = []
    if len(report["faces"]) != len(iges["faces"]):
        problems.append(f"{len(report['faces'])} faces, but {len(iges['faces'])} in the IGES file")
    look = lambda trees: sorted((t["name"] or "", t["rgb"] or []) for t in trees)
    if look(report["tree"]) != look(iges["tree"]):
        problems.append(f"names or colours differ from the IGES file's: {report['tree']}")
    area = sum(face["area_mm2"] for face in iges["faces"])
    if not abs(report["measured"]["area_mm2"] / area - 1.0) <= PROPERTY_PRECISION:
        problems.append(f"area {report['measured']['area_mm2']}, but {area} in the IGES file")
    off = max(
        abs(a - b)
        for mine, other in zip(report["box_mm"], iges["box_mm"])
        for a, b in zip(mine, other)
    )
    # The box of a spline face is that of more than its trimmed part.
    allowed = 4.0 * report["written"]["uncertainty"] * report["written"]["unit_mm"] + 1e-3 * size
    if not off <= allowed:
        problems.append(f"its box differs from the IGES file's by {off} mm")
    return problems


def judge(path, arguments):
    reader = STEPControl_Reader()
    status = reader.ReadFile(path)
    if status != IFSelect_RetDone:
        sys.exit(f"{path}: OpenCASCADE cannot read it ({status})")
    fails, warnings = checks(Interface_CheckTool(reader.Model()).CompleteCheckList())
    roots = reader.TransferRoots()
    process = reader.WS().TransferReader().TransientProcess()
    transfer_fails, transfer_warnings = checks(process.CheckList(False))
    shape = reader.OneShape()
    faces = [] if shape.IsNull() else list(occ_check.explore(shape, TopAbs_FACE, TopoDS.Face))
    if not faces:
        sys.exit(f"{path}: OpenCASCADE finds no faces in it")
    made = document(path)
    uses = occ_check.uses_of_edges(occ_check.explore(shape, TopAbs_FACE, TopoDS.Face))
    report = {
        "file": path,
        "written": written(path),
        "roots": roots,
        "fails": fails,
        "warnings": warnings,
        "transfer_fails": transfer_fails,
        "transfer_warnings": transfer_warnings,
        "valid": BRepCheck_Analyzer(shape).IsValid(),
        "faces": [
            {
                "valid": BRepCheck_Analyzer(face).IsValid(),
                "normal_z": occ_check.normal_towards_camera(face),
                "area_mm2": measured(face)["area_mm2"],
            }
            for face in faces
        ],
        "shells": occ_check.distinct(shape, TopAbs_SHELL),
        "edges": len(uses),
        "shared_edges": sum(1 for n in uses if n == 2),
        "free_edges": sum(1 for n in uses if n == 1),
        "tolerance_mm": max(
            [BRep_Tool.Tolerance_s(e) for e in occ_check.explore(shape, TopAbs_EDGE, TopoDS.Edge)]
            + [
                BRep_Tool.Tolerance_s(v)
                for v in occ_check.explore(shape, TopAbs_VERTEX, TopoDS.Vertex)
            ]
        ),
        "box_mm": box(shape),
        "measured": measured(shape),
        "stated": properties(made),
        "tree": tree(made),
    }
    problems = fails + warnings + transfer_fails + transfer_warnings
    text, stated, found = report["written"], report["stated"], report["measured"]
    if not report["valid"]:
        problems.append("the shape is not valid by BRepCheck")
    for number, face in enumerate(report["faces"], 1):
        if not face["valid"]:
            problems.append(f"face {number} is not valid by BRepCheck")
        if not face["area_mm2"] > 0.0 or not face["normal_z"] > 0.0:
            problems.append(f"face {number} turns its back to the camera, or has no area")
    for what, got in [
        ("faces", len(faces)),
        ("shells", report["shells"]),
        ("edges", report["edges"]),
        ("shared_edges", report["shared_edges"]),
    ]:
        if got != text[what]:
            problems.append(f"{got} {what} were read, {text[what]} are written")
    size = math.dist(*report["box_mm"])
    if stated["area_mm2"] is None or stated["centroid_mm"] is None:
        problems.append("the validation properties were not read")
    else:
        plain = measured(shape, is_adaptive=False)
        found = min(found, plain, key=lambda of: abs(of["area_mm2"] - stated["area_mm2"]))
        if not abs(stated["area_mm2"] / found["area_mm2"] - 1.0) <= PROPERTY_PRECISION:
            problems.append(f"area {found['area_mm2']}, {stated['area_mm2']} is stated")
        if not math.dist(stated["centroid_mm"], found["centroid_mm"]) <= PROPERTY_PRECISION * size:
            problems.append(f"centroid {found['centroid_mm']}, {stated['centroid_mm']} is stated")
    names = [entry["name"] for entry in report["tree"]]
    if len(names) != len(faces) or None in names or len(set(names)) != len(names):
        problems.append(f"the names of the faces are {names}")
    if any(entry["rgb"] is None for entry in report["tree"]):
        problems.append("a face has no colour")
    if arguments.expect_faces is not None and len(faces) != arguments.expect_faces:
        problems.append(f"{len(faces)} faces instead of {arguments.expect_faces}")
    if arguments.min_shared_edges is not None and report["shared_edges"] < arguments.min_shared_edges:
        problems.append(
            f"{report['shared_edges']} shared edges instead of {arguments.min_shared_edges} or more"
        )
    if arguments.iges is not None:
        problems += differences(report, iges_report(arguments.iges), size)
    report["problems"] = problems
    report["ok"] = not problems
    return report


def iges_report(path):
    """What OpenCASCADE makes of the IGES file of the same scan."""
    report = occ_check.judge(path, occ_check.options([path, "--no-points"]))
    reader = occ_check.IGESControl_Reader()
    reader.ReadFile(path)
    reader.TransferRoots()
    report["box_mm"] = box(reader.OneShape())
    return report


def options(words=None):
    """The command line `words`, or the program's own."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--iges", metavar="FILE.igs", help="the same scan: the two must agree")
    parser.add_argument("--expect-faces", type=int, metavar="N")
    parser.add_argument(
        "--min-shared-edges", type=int, metavar="N", help="edges of two faces, without sewing"
    )
    return parser.parse_args(words)


def main():
    arguments = options()
    occ_check.silence()
    report = judge(arguments.file, arguments)
    json.dump(report, sys.stdout, indent=1)
    print()
    sys.exit(0 if report["ok"] else 1)


if __name__ == "__main__":
    main()

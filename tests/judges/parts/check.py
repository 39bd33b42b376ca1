#!/usr/bin/env python3
"""Judge models of parts with OpenCASCADE: valid faces, and free edges only where they belong.

    python check.py DIR SEED [SEED ...]

DIR holds, for each seed, SEED.igs and SEED.step, and SEED.mask.json, which says where an edge of
one face only belongs: {"low_mm": [x, y], "step_mm": [dx, dy], "rows": R, "cells": "0110..."},
cells column by column, 1 near a silhouette or a step. Prints a JSON list, one entry for each
file: the number of faces and of those that are not valid, and after sewing at 0.01 mm the length
of the free edges, and of those parts of them that lie where no edge of one face belongs.
"""

import json
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

import occ_check
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopoDS import TopoDS

SEWING_MM = 0.01
SPACING_MM = 0.1


def shape_of(path):
    reader = IGESControl_Reader() if path.endswith(".igs") else STEPControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone:
        return None
    reader.TransferRoots()
    shape = reader.OneShape()
    return None if shape.IsNull() else shape


def points_along(edge):
    """Places in the middle of equal parts of an edge, and the length of a part."""
    properties = GProp_GProps()
    BRepGProp.LinearProperties_s(edge, properties)
    length = properties.Mass()
    count = max(1, math.ceil(length / SPACING_MM))
    curve = BRepAdaptor_Curve(edge)
    first, last = curve.FirstParameter(), curve.LastParameter()
    places = [curve.Value(first + (last - first) * (k + 0.5) / count) for k in range(count)]
    return [(p.X(), p.Y()) for p in places], length / count


def belongs(mask, x, y):
    column = int((x - mask["low_mm"][0]) // mask["step_mm"][0])
    row = int((y - mask["low_mm"][1]) // mask["step_mm"][1])
    columns = len(mask["cells"]) // mask["rows"]
    if not (0 <= column < columns and 0 <= row < mask["rows"]):
        return True
    return mask["cells"][column * mask["rows"] + row] == "1"


def judged(path, mask):
    shape = shape_of(path)
    if shape is None:
        return {"faces": 0, "invalid": 0, "free_mm": 0.0, "misplaced_mm": 0.0, "is_read": False}
    faces = list(occ_check.explore(shape, TopAbs_FACE, TopoDS.Face))
    sewing = BRepBuilderAPI_Sewing(SEWING_MM)
    for face in faces:
        sewing.Add(face)
    sewing.Perform()
    free, misplaced = 0.0, 0.0
    for k in range(1, sewing.NbFreeEdges() + 1):
        points, each = points_along(sewing.FreeEdge(k))
        free += each * len(points)
        misplaced += each * sum(not belongs(mask, x, y) for x, y in points)
    return {
        "faces": len(faces),
        "invalid": sum(not BRepCheck_Analyzer(face).IsValid() for face in faces),
        "free_mm": free,
        "misplaced_mm": misplaced,
        "is_read": True,
    }


def main():
    folder, seeds = sys.argv[1], sys.argv[2:]
    occ_check.silence()
    found = []
    for seed in seeds:
        with open(os.path.join(folder, f"{seed}.mask.json"), encoding="utf-8") as file:
            mask = json.load(file)
        for ending in ("igs", "step"):
            path = os.path.join(folder, f"{seed}.{ending}")
            found.append({"seed": int(seed), "file": ending, **judged(path, mask)})
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()

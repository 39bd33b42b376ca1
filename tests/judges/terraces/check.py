#!/usr/bin/env python3
"""Judge solids rebuilt from features with OpenCASCADE, which shares no code with their writer.

Reads FOLDER/SEED.step and what should be found, FOLDER/SEED.json, of
`cargo run -p cad-exchange --example random_solids`: one solid of one closed shell, valid
(BRepCheck), without free edges, of the volume and box told; faces of the kinds, names and colours
told; places on the part's top, which follow from its operations alone, on its faces.
Prints a line for each file that does not hold and a summary; exit code 1 if there is one.
"""

import argparse
import collections
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))

from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepClass3d import BRepClass3d_SolidClassifier
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.GeomAbs import (
    GeomAbs_BSplineSurface,
    GeomAbs_Cone,
    GeomAbs_Cylinder,
    GeomAbs_Plane,
    GeomAbs_Sphere,
    GeomAbs_Torus,
)
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_IN, TopAbs_OUT, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.gp import gp_Pnt

import step_check

KINDS = {
    GeomAbs_Plane: "plane",
    GeomAbs_Cylinder: "cylinder",
    GeomAbs_Cone: "cone",
    GeomAbs_Sphere: "sphere",
    GeomAbs_Torus: "torus",
    GeomAbs_BSplineSurface: "spline",
}
# Volumes agree to this part of them; free-form floors are integrated by rules on either side.
EXACT, FREE_FORM = 1e-6, 1e-5
# Places are this near to a face, and a little above and below it on the sides that they should be;
# nearer than that OpenCASCADE's classifier errs at times.
NEAR_MM, BESIDE_MM = 1e-5, 0.02
# The file's uncertainty: edges lie on their faces as near as this, or the reader widens them.
WIDEST_MM = 1.01e-4


def explored(shape, kind):
    found, explorer = [], TopExp_Explorer(shape, kind)
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def free_edges(shape):
    """Edges that are not of two faces, nor twice of one, and are no points."""
    edges = [TopoDS.Edge(e) for f in explored(shape, TopAbs_FACE) for e in explored(f, TopAbs_EDGE)]
    free = []
    for edge in edges:
        if BRep_Tool.Degenerated_s(edge):
            continue
        # The second use takes the first away.
        other = next((k for k, known in enumerate(free) if known.IsSame(edge)), None)
        if other is None:
            free.append(edge)
        else:
            free.pop(other)
    return len(free)


def widest(shape):
    """The largest tolerance of an edge: how far it is from the surfaces that it bounds."""
    edges = (TopoDS.Edge(edge) for edge in explored(shape, TopAbs_EDGE))
    return max(BRep_Tool.Tolerance_s(edge) for edge in edges)


def judge(step, told, has_tree):
    """What is wrong with a file."""
    wrong = []
    reader = STEPControl_Reader()
    if reader.ReadFile(str(step)) != IFSelect_RetDone or not reader.TransferRoots():
        return ["OpenCASCADE cannot read it"]
    shape = reader.OneShape()
    solids, shells = explored(shape, TopAbs_SOLID), explored(shape, TopAbs_SHELL)
    if len(solids) != 1 or len(shells) != 1:
        return [f"{len(solids)} solids and {len(shells)} shells instead of one"]
    if not BRepCheck_Analyzer(shape, True).IsValid():
        faces = explored(shape, TopAbs_FACE)
        bad = [k for k, face in enumerate(faces) if not BRepCheck_Analyzer(face, True).IsValid()]
        wrong.append(f"not valid (faces {[told['faces'][k][0] for k in bad if k < len(told['faces'])]})")
    if not BRep_Tool.IsClosed_s(shells[0]):
        wrong.append("the shell is not closed")
    if count := free_edges(shape):
        wrong.append(f"{count} edges are not of two faces")
    if (tolerance := widest(shape)) > WIDEST_MM:
        wrong.append(f"an edge is {tolerance:.1e} mm from its faces")
    mass = GProp_GProps()
    # The other two integrations are off by up to 1e-5 where a face has a tip.
    BRepGProp.VolumePropertiesGK_s(shape, mass, 1e-8)
    volume, expected = mass.Mass(), told["volume_mm3"]
    off = abs(volume / expected - 1)
    if volume <= 0 or off > (EXACT if told["is_exact"] else FREE_FORM):
        wrong.append(f"volume {volume:.6f} instead of {expected:.6f} ({off:.1e})")
    kinds = collections.Counter(
        KINDS.get(BRepAdaptor_Surface(TopoDS.Face(face)).GetType(), "other")
        for face in explored(shape, TopAbs_FACE)
    )
    if dict(kinds) != told["kinds"]:
        wrong.append(f"faces {dict(kinds)} instead of {told['kinds']}")
    (low, high), slack = step_check.box(shape), 1e-3
    for k in range(3):
        # Round faces reach beyond the edges, of which the box is told.
        if low[k] > told["box_mm"][0][k] + slack or high[k] < told["box_mm"][1][k] - slack:
            wrong.append(f"box {low} {high} instead of {told['box_mm']}")
            break
    wrong += places(solids[0], told)
    text = step.read_text(encoding="ascii").replace("\n", "")
    if (25.4 if "'INCH'" in text else 1.0) != told["unit_mm"]:
        wrong.append("another unit")
    stated = re.search(r"VOLUME_MEASURE\(([^)]*)\)", text)
    if stated is None or abs(float(stated[1]) * told["unit_mm"] ** 3 / expected - 1) > 1e-12:
        wrong.append("another volume is stated")
    if f"MANIFOLD_SOLID_BREP('{told['name']}'" not in text:
        wrong.append("the solid has another name")
    if has_tree:
        found = step_check.tree(step_check.document(str(step)))
        found = sorted((face["name"] or "", tuple(face["rgb"] or ())) for face in found)
        if found != sorted((name, tuple(rgb)) for name, rgb in told["faces"]):
            wrong.append("names or colours of faces differ")
    return wrong


def places(solid, told):
    """Places on the part's top that are not on its faces, or have material on the wrong side."""
    classifier = BRepClass3d_SolidClassifier(solid)

    def state(at, up):
        p = gp_Pnt(*(a + up * z for a, z in zip(at, told["z"])))
        classifier.Perform(p, 1e-7)
        return classifier.State()

    wrong = 0
    for n, at in enumerate(told["on"]):
        bad = state(at, BESIDE_MM) != TopAbs_OUT or state(at, -BESIDE_MM) != TopAbs_IN
        # The distance itself takes long, and is asked for of some.
        if not bad and n % 10 == 0:
            vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*at)).Vertex()
            shell = explored(solid, TopAbs_SHELL)[0]
            bad = BRepExtrema_DistShapeShape(vertex, shell).Value() > NEAR_MM
        wrong += bad
    wrong += sum(state(at, 0) != TopAbs_OUT for at in told["void"])
    return [f"{wrong} of {len(told['on']) + len(told['void'])} places are wrong"] if wrong else []


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--least", type=int, default=1, help="files that there must be at least")
    parser.add_argument("--no-tree", action="store_true", help="leave out names and colours")
    options = parser.parse_args()
    files = sorted(options.folder.glob("*.json"), key=lambda path: int(path.stem))
    bad, kinds, seen = 0, collections.Counter(), 0
    for path in files:
        told = json.loads(path.read_text())
        wrong = judge(path.with_suffix(".step"), told, not options.no_tree)
        kinds.update(told["kinds"])
        seen += len(told["on"]) + len(told["void"])
        if wrong:
            bad += 1
            print(f"{path.stem}: {'; '.join(wrong)}", flush=True)
    print(f"{len(files)} solids, {bad} do not hold; {dict(kinds)} faces, {seen} places")
    return 1 if bad or len(files) < options.least else 0


if __name__ == "__main__":
    sys.exit(main())

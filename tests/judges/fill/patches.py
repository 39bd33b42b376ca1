"""Trimmed surfaces of holes, `--patches`, read by OpenCASCADE, their area held against that of the new triangles.

That of the triangles that were cut out stands beside it: how far the filling itself may be off is not judged here.
"""

import accuracy
import fillers
import meshes
import numpy as np
import surfaces
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

SIZES = (3, 10, 20, 30)
# How far an area may be off, per cent of the filling's.
AREA_PERCENT = 0.1
# OpenCASCADE's own error of an area.
PRECISION = 1e-6


def area(v, f):
    return 0.5 * np.linalg.norm(np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]]), axis=1).sum()


def cut_area(case, seed):
    """Of the triangles that the hole was cut out of."""
    rng = np.random.default_rng([seed, list(surfaces.ALL).index(case.name), case.size, case.ragged])
    hole = case.surface.hole(rng, case.size / 100, case.ragged)
    return area(*case.surface.whole(rng, hole, case.edge)) - area(case.v, case.f)


def read(path):
    """The faces of an IGES file, millimetres."""
    reader = IGESControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        return None
    reader.TransferRoots()
    faces = []
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_FACE)
    while explorer.More():
        faces.append(TopoDS.Face(explorer.Current()))
        explorer.Next()
    return faces


def face_area(face):
    """Of all that the trims leave; one that overlaps another counts twice."""
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties, PRECISION)
    return abs(properties.Mass())


def run(options, folder, missed):
    lines = ["| surface | hole, % | faces | valid | area, mm2 | triangles, mm2 | off, % | cut out, mm2 |", "| --- | ---: | ---: | --- |" + " ---: |" * 4]
    for name in surfaces.ALL:
        for size in SIZES[1:3] if options.short else SIZES:
            case = accuracy.Case(options.seed, name, size, False, False, folder)
            written = folder / f"{case.source.stem}.igs"
            written.unlink(missing_ok=True)
            target = folder / f"{case.source.stem}-patched.ply"
            done, told = fillers.ours(options.relief, case.source, target, "--patches", str(written))
            cells = judged(case, options.seed, done, told, (target, written), missed)
            lines.append("| " + " | ".join(map(str, [name, size, *cells])) + " |")
    return "\n".join(lines)


def judged(case, seed, done, told, results, missed):
    target, written = results
    where = f"patch of {case.label()}"
    if done.code != 0:
        missed.append(f"{where}: ended with {done.code}")
        return ["none", "", "", "", "", ""]
    if not written.exists():
        # No fault where it is said.
        is_told = any("no trimmed surface" in warning for warning in told["warnings"])
        if not is_told:
            missed.append(f"{where}: neither written nor told")
        return ["none, and told" if is_told else "none", "", "", "", "", f"{cut_area(case, seed):.2f}"]
    faces = read(written)
    if not faces:
        missed.append(f"{where}: no faces")
        return ["unread", "", "", "", "", ""]
    is_valid = all(BRepCheck_Analyzer(face).IsValid() for face in faces)
    v, f = meshes.read_ply(target)
    is_old, _ = meshes.split((case.v, case.f), (v, f))
    own, triangles = sum(face_area(face) for face in faces), area(v, f[~is_old])
    off = 100 * abs(own / triangles - 1)
    if not is_valid:
        missed.append(f"{where}: not valid")
    if off > AREA_PERCENT:
        missed.append(f"{where}: area {off:.2f} % off")
    return [len(faces), "yes" if is_valid else "no", f"{own:.4f}", f"{triangles:.4f}", f"{off:.3f}", f"{cut_area(case, seed):.4f}"]

#!/usr/bin/env python3
"""Judge IGES and STEP files with Gmsh, as someone does who wants to compute with the part.

Needs nothing but `pip install gmsh` (see README.md for the version). Prints one JSON document;
exit code 0 when every face is meshed without a complaint, 1 when not, 2 on wrong usage.
"""

import argparse
import json
import os
import signal
import sys
import tempfile

import gmsh

# Relative difference of all triangles from the area of the faces that chords explain; bumps
# finer than the mesh count, so that single faces may be off by more. OpenCASCADE's own integral,
# the only one to be had of Gmsh, is off by a third of rings whose patches have many knots: where
# the area is known otherwise, it is to be told.
AREA_TOLERANCE = 0.02


def judge(path, arguments):
    """Reads a file, meshes its faces, and holds the meshes against the faces' area."""
    problems, faces = [], []
    gmsh.clear()
    gmsh.logger.start()
    try:
        gmsh.model.occ.importShapes(path)
        gmsh.model.occ.synchronize()
        x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(-1, -1)
        size = max(x1 - x0, y1 - y0, z1 - z0) / arguments.elements
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.model.mesh.generate(2)
    except Exception as error:  # Gmsh raises nothing more exact.
        problems.append(str(error))
    said = gmsh.logger.get()
    gmsh.logger.stop()
    problems += [line for line in said if line.startswith(("Error", "Warning"))]
    for _, tag in gmsh.model.getEntities(2):
        area = gmsh.model.occ.getMass(2, tag)
        meshed, triangles = 0.0, 0
        for elements in gmsh.model.mesh.getElements(2, tag)[1]:
            # Of a triangle, its "volume" is its area.
            meshed += sum(gmsh.model.mesh.getElementQualities(elements, "volume"))
            triangles += len(elements)
        faces.append({"area_mm2": area, "meshed_mm2": meshed, "triangles": triangles})
        if triangles == 0:
            problems.append(f"face {tag} has no triangles")
    area, meshed = (sum(face[key] for face in faces) for key in ("area_mm2", "meshed_mm2"))
    area = arguments.area_mm2 or area
    if not abs(meshed - area) <= AREA_TOLERANCE * area:
        problems.append(f"triangles cover {meshed} of {area} mm2")
    if arguments.expect_faces is not None and len(faces) != arguments.expect_faces:
        problems.append(f"{len(faces)} faces instead of {arguments.expect_faces}")
    if not faces:
        problems.append("no faces")
    return {"file": path, "faces": faces, "problems": problems, "ok": not problems}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+")
    parser.add_argument("--expect-faces", type=int, metavar="N")
    parser.add_argument("--area-mm2", type=float, metavar="MM2", help="of all faces")
    parser.add_argument(
        "--elements", type=float, default=100, metavar="N", help="along the longest side"
    )
    parser.add_argument(
        "--within-s", type=int, metavar="S", help="of all files together, or end by SIGALRM"
    )
    arguments = parser.parse_args()
    if arguments.within_s is not None:
        # Not asked while Gmsh meshes, so that nothing but the signal's own effect would do.
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(arguments.within_s)
    # Gmsh leaves files of its own where it fails: not beside the caller's.
    files = [os.path.abspath(path) for path in arguments.files]
    os.chdir(tempfile.gettempdir())
    # OpenCASCADE within Gmsh talks on standard output, which is for the document.
    document = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    reports = [judge(path, arguments) for path in files]
    gmsh.finalize()
    json.dump(reports, document, indent=2)
    document.write("\n")
    document.close()
    return 0 if all(report["ok"] for report in reports) else 1


if __name__ == "__main__":
    sys.exit(main())

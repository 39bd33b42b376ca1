"""Our command, MeshLab's and MeshFix's filling of holes, each in a process of its own on the same file.

usage: fillers.py meshlab|meshfix IN.ply OUT.ply SETTINGS (JSON); seconds of the filling to standard output
"""

import dataclasses
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import meshes
import numpy as np

OWN = pathlib.Path(__file__)
MEASURED = OWN.with_name("measured.py")


@dataclasses.dataclass
class Run:
    """What a program made of a file, and what it cost."""

    code: int
    seconds: float
    processor_s: float
    peak_mib: float
    out: str
    told: str


def measured(words, timeout):
    """Runs a program; its wall clock, processor time and peak memory are its own alone."""
    with tempfile.NamedTemporaryFile() as told:
        words = [sys.executable, "-S", "-B", str(MEASURED), str(timeout), told.name, *words]
        done = subprocess.run(words, capture_output=True, stdin=subprocess.DEVNULL, check=True)
        cost = json.loads(told.read())
    out, err = (text.decode(errors="replace") for text in (done.stdout, done.stderr))
    return Run(**cost, out=out, told=err)


def ours(relief, source, target, *words, timeout=300):
    run = measured([relief, "fill", str(source), "-o", str(target), "--json", *words], timeout)
    told = json.loads(run.out) if run.code == 0 else None
    return run, told


def peer(name, source, target, timeout=120, **settings):
    pathlib.Path(target).unlink(missing_ok=True)
    words = [sys.executable, "-B", str(OWN), name, str(source), str(target), json.dumps(settings)]
    run = measured(words, timeout)
    if run.code == 0:
        run.seconds = float(run.out.split()[-1])
    return run


def meshlab(v, f, settings):
    """Close holes with refinement. Where `near` is told, only holes of triangles with a corner there."""
    import pymeshlab

    scalar = np.ones(len(f))
    if settings.get("near"):
        scalar = np.isin(f, np.load(settings["near"])).any(1).astype(float)
    own = pymeshlab.MeshSet(verbose=False)
    own.add_mesh(pymeshlab.Mesh(v, f.astype(np.int32), f_scalar_array=scalar))
    own.compute_selection_by_condition_per_face(condselect="fq > 0.5")
    own.meshing_close_holes(
        maxholesize=10**9,
        selected=bool(settings.get("near")),
        newfaceselected=True,
        selfintersection=settings["selfintersection"],
        refinehole=True,
        refineholeedgelen=pymeshlab.PureValue(settings["edge"]),
    )
    mesh = own.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64)


def meshfix(v, f, settings):
    """All holes, with refinement, and nothing else of its repairs."""
    from pymeshfix import PyTMesh

    own = PyTMesh()
    own.set_quiet(True)
    own.load_array(v, f.astype(np.int32))
    own.fill_small_boundaries(0, True)
    points, faces = own.return_arrays()
    return np.asarray(points, float), np.asarray(faces, np.int64)


def main():
    name, source, target, settings = sys.argv[1:]
    v, f = meshes.read_ply(source)
    fill = {"meshlab": meshlab, "meshfix": meshfix}[name]
    if name == "meshlab":
        # Its import and the loading of its filters are no part of the filling.
        import pymeshlab

        pymeshlab.MeshSet(verbose=False)
    else:
        import pymeshfix  # noqa: F401
    began = time.perf_counter()
    v, f = fill(v, f, json.loads(settings))
    took = time.perf_counter() - began
    meshes.write_ply(target, v, f)
    print(took)


if __name__ == "__main__":
    main()

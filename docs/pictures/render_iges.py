"""Draws the faces of an IGES file, each in its own colour, with its trimming loops.

    python render_iges.py FILE.igs OUT.png [--elevation DEG] [--azimuth DEG] [--title TEXT]

Needs the packages cadquery-ocp and matplotlib.
"""

import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.IGESControl import IGESControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

COLOURS = plt.get_cmap("tab20").colors
LIGHT = np.array([0.35, 0.45, 0.82])


def load(path):
    reader = IGESControl_Reader()
    if reader.ReadFile(path).name != "IFSelect_RetDone":
        raise SystemExit(f"{path}: not read by OpenCASCADE")
    reader.TransferRoots()
    return reader.OneShape()


def explore(shape, kind):
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def triangles(face):
    """The face's mesh as an array of triangles, (n, 3 corners, 3 coordinates)."""
    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(TopoDS.Face(face), location)
    if mesh is None:
        return np.empty((0, 3, 3))
    points = [mesh.Node(i + 1).Transformed(location.Transformation()) for i in range(mesh.NbNodes())]
    points = np.array([(p.X(), p.Y(), p.Z()) for p in points])
    corners = [mesh.Triangle(i + 1).Get() for i in range(mesh.NbTriangles())]
    return points[np.array(corners) - 1]


def edge_line(edge, steps=40):
    curve = BRepAdaptor_Curve(TopoDS.Edge(edge))
    parameters = np.linspace(curve.FirstParameter(), curve.LastParameter(), steps)
    points = [curve.Value(t) for t in parameters]
    return np.array([(p.X(), p.Y(), p.Z()) for p in points])


def turned(points):
    """Part frame (y up, z to the camera) to the plot's frame (z up)."""
    return points[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])


class LinesInFront(Line3DCollection):
    """Lines over all faces: collections are drawn in the order of their depths, and lines that bound
    a face have about that of the face."""

    def do_3d_projection(self):
        super().do_3d_projection()
        return -np.inf


def draw(axes, shape, labels=True, colours=COLOURS):
    """Faces shaded in colours of their own, edges in black, on axes in 3D."""
    BRepMesh_IncrementalMesh(shape, 0.05, False, 0.2, True)
    extent = []
    for number, face in enumerate(explore(shape, TopAbs_FACE)):
        mesh = turned(triangles(face))
        if not len(mesh):
            continue
        normals = np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(lengths > 0, lengths, 1)
        shade = 0.45 + 0.55 * np.abs(normals @ (LIGHT / np.linalg.norm(LIGHT)))
        colour = np.array(matplotlib.colors.to_rgb(colours[number % len(colours)]))
        faces = np.clip(shade[:, None] * colour, 0, 1)
        # Edges of the triangles' own colour, wide enough that no seam shines through.
        axes.add_collection3d(Poly3DCollection(mesh, facecolors=faces, edgecolors=faces, linewidths=0.8))
        extent.append(mesh.reshape(-1, 3))
    lines = [turned(edge_line(edge)) for edge in explore(shape, TopAbs_EDGE)]
    axes.add_collection3d(LinesInFront(lines, colors="black", linewidths=0.8))
    extent = np.concatenate(extent)
    low, high = extent.min(axis=0), extent.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    if labels:
        axes.set(xlabel="x (mm)", ylabel="-z (mm)", zlabel="y (mm)")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("iges")
    parser.add_argument("out")
    parser.add_argument("--elevation", type=float, default=25.0)
    parser.add_argument("--azimuth", type=float, default=-65.0)
    parser.add_argument("--title", default="")
    options = parser.parse_args()

    figure = plt.figure(figsize=(7, 6), dpi=110)
    axes = figure.add_subplot(projection="3d", proj_type="ortho")
    draw(axes, load(options.iges))
    axes.set(title=options.title)
    axes.view_init(elev=options.elevation, azim=options.azimuth)
    figure.savefig(options.out, bbox_inches="tight")


if __name__ == "__main__":
    main()

"""Whether a mesh is sound: trimesh, libigl, and CGAL's exact predicates by way of libigl."""

import igl
import igl.copyleft.cgal
import numpy as np
import trimesh


def faults(v, f, loops=0, spare=0):
    """What is wrong with a mesh that should have so many boundary loops; empty where nothing is.

    So many spare vertices, of no triangle, are none.
    """
    found = []
    if not np.isfinite(v).all():
        return ["places that are no numbers"]
    used, index = np.unique(f, return_inverse=True)
    if len(v) - len(used) > spare:
        found.append(f"{len(v) - len(used)} vertices that no triangle has")
    v, f = v[used], index.reshape(-1, 3)
    if len(np.unique(np.sort(f, 1), axis=0)) != len(f):
        found.append("a triangle twice")
    corners = v[f]
    if (np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) == 0).any():
        found.append("a triangle without area")
    # An edge of more than two triangles, and a vertex of more than one fan.
    if not igl.is_edge_manifold(f)[0]:
        found.append("edges of more than two triangles")
    elif not np.all(igl.is_vertex_manifold(f)):
        found.append("vertices where parts meet in nothing else")
    mesh = trimesh.Trimesh(v, f, process=False, validate=False)
    # Each edge once in each direction.
    if not mesh.is_winding_consistent:
        found.append("turned triangles")
    if loops == 0:
        if not mesh.is_watertight:
            found.append("open")
        elif mesh.volume <= 0:
            found.append("inside out")
    elif "edges of more than two triangles" not in found:
        there = boundary_loops(f)
        if there != loops:
            found.append(f"{there} boundary loops instead of {loops}")
    crossing = len(intersections(v, f))
    if crossing:
        found.append(f"{crossing} pairs of triangles that intersect")
    return found


def boundary_loops(f):
    """Boundary edges hang together in so many parts."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = igl.boundary_facets(f)[0]
    if len(edges) == 0:
        return 0
    used, index = np.unique(edges, return_inverse=True)
    a, b = index.reshape(-1, 2).T
    n = len(used)
    return connected_components(coo_matrix((np.ones(len(a)), (a, b)), (n, n)), False)[0]


def intersections(v, f):
    """Pairs of triangles that meet in more than an edge or corner of both."""
    return igl.copyleft.cgal.remesh_self_intersections(
        np.asfortranarray(v), np.asfortranarray(f), detect_only=True
    )[2]


def components(f):
    return int(trimesh.graph.connected_component_labels(trimesh.graph.face_adjacency(f), len(f)).max() + 1)

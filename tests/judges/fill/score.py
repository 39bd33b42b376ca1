"""Fillings held against the surface that the hole was cut from."""

import dataclasses

import numpy as np

# Places within a triangle, as weights of its corners, that speak for all of it.
WITHIN = np.array(
    [[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [0, 1, 1], [1, 0, 1], [1, 1, 0], [0, 2, 1], [2, 1, 0], [1, 0, 2]]
)
WITHIN = WITHIN / WITHIN.sum(1, keepdims=True)


@dataclasses.dataclass
class Score:
    """Distances in millimetres, angles in degrees. Nothing new: not closed."""

    vertices: int
    triangles: int
    vertex_rms: float
    vertex_most: float
    rms: float
    most: float
    # The largest angle of new triangles at the border to the surface; of the old ones there.
    border: float
    border_old: float
    # The largest angle between triangles across the border; between old ones next to it.
    bend: float
    bend_old: float
    # Mean edge of the filling to that of the triangles around.
    edge: float


def normals(v, f):
    n = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)


def degrees(cosine):
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).max()) if len(cosine) else 0.0


def neighbours(f):
    """Pairs of triangles that share an edge."""
    edges = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), 1)
    order = np.lexsort(edges.T)
    same = (edges[order][1:] == edges[order][:-1]).all(1)
    return order[:-1][same] % len(f), order[1:][same] % len(f)


def score(surface, v, f, is_old, in_hole=None):
    """`in_hole` says which new triangles are the filling; all of them if absent."""
    new = ~is_old if in_hole is None else in_hole
    if not new.any():
        return None
    fresh = np.setdiff1d(np.unique(f[new]), np.unique(f[is_old]))
    at_vertices = np.abs(surface.nearest(v[fresh])[0]) if len(fresh) else np.zeros(0)
    inside = np.einsum("kc,tcx->tkx", WITHIN, v[f[new]])
    offs = np.abs(surface.nearest(inside.reshape(-1, 3))[0]).reshape(-1, len(WITHIN))
    n = normals(v, f)
    area = np.linalg.norm(np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]]), axis=1)[new]
    weight = area / area.sum()
    a, b = neighbours(f)
    a, b = np.concatenate([a, b]), np.concatenate([b, a])
    border = new[a] & is_old[b]
    rim = np.unique(b[border])
    rim_vertices = np.unique(f[rim])
    near = is_old & np.isin(f, rim_vertices).any(1)
    both_old = near[a] & near[b]
    edges = lambda own: np.linalg.norm(v[f[own][:, [1, 2, 0]]] - v[f[own]], axis=2).mean()

    def lean(own):
        _, true = surface.nearest(v[f[own]].mean(1))
        return degrees((n[own] * true).sum(1))

    return Score(
        len(fresh),
        int(new.sum()),
        float(np.sqrt((at_vertices**2).mean())) if len(fresh) else 0.0,
        float(at_vertices.max()) if len(fresh) else 0.0,
        float(np.sqrt((weight * (offs**2).mean(1)).sum())),
        float(max(offs.max(), at_vertices.max() if len(fresh) else 0.0)),
        lean(np.unique(a[border])),
        lean(rim),
        degrees((n[a[border]] * n[b[border]]).sum(1)),
        degrees((n[a[both_old]] * n[b[both_old]]).sum(1)),
        float(edges(new) / edges(near)),
    )


def filling(f, is_old, rim):
    """New triangles that hang together with the hole's border vertices: no others' fillings."""
    new = np.flatnonzero(~is_old)
    if len(new) == 0:
        return ~is_old
    import trimesh

    # By corners that only new triangles have, or are of the border.
    label = trimesh.graph.connected_component_labels(vertex_pairs(f[new]), len(new))
    touched = np.unique(label[np.isin(f[new], rim).any(1)])
    own = np.zeros(len(f), bool)
    own[new[np.isin(label, touched)]] = True
    return own


def vertex_pairs(f):
    """Triangles that follow each other at a corner, so that those with a corner in common hang together."""
    corner, owner = f.T.ravel(), np.tile(np.arange(len(f)), 3)
    order = np.argsort(corner, kind="stable")
    same = corner[order][1:] == corner[order][:-1]
    return np.stack([owner[order[:-1][same]], owner[order[1:][same]]], 1)

"""Models of many holes: random ones, large ones, and one hole with a long border."""

import numpy as np
import score
import surfaces
from surfaces import Ball, Torus, unit

EDGE_MM = 3.0
MOST_HOLES = 12


class Blob(Ball):
    """A ball whose radius waves: star-shaped, so that its mesh does not meet itself."""

    def __init__(self, rng):
        super().__init__([40, 40, 40])
        self.terms = [(unit(rng.normal(size=3)), rng.uniform(1.5, 4), rng.uniform(0.02, 0.09)) for _ in range(4)]

    def whole(self, rng, _hole, edge):
        v, f = super().whole(rng, None, edge)
        u = unit(v)
        radius = 1 + sum(a * np.cos(k * np.pi * (u @ d)) for d, k, a in self.terms)
        v = v * radius[:, None]
        n = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
        inward = (n * v[f].mean(1)).sum(1) < 0
        f[inward] = f[inward][:, ::-1]
        return v, f


def random(seed):
    """A closed body with holes, some of which touch at a vertex or have an island. Also says what it has."""
    rng = np.random.default_rng(seed)
    kind = ("sphere", "torus", "blob")[rng.integers(3)]
    if kind == "blob":
        v, f = Blob(rng).whole(rng, None, EDGE_MM)
    else:
        v, f = {"sphere": Ball([40, 40, 40]), "torus": Torus()}[kind].mesh(rng, None, EDGE_MM)
    wanted = int(rng.integers(1, MOST_HOLES + 1))
    kept = np.ones(len(f), bool)
    islands = []
    for k in range(wanted):
        centre = v[rng.integers(len(v))]
        away = np.linalg.norm(v[f].mean(1) - centre, axis=1)
        # Every third may have an island.
        has_island = k % 3 == 0 and rng.random() < 0.6
        radius = EDGE_MM * (rng.uniform(4.5, 6) if has_island else rng.uniform(0.7, 4))
        gone = away < radius
        if has_island:
            middle = away < 0.4 * radius
            gone &= ~middle
            islands.append(np.flatnonzero(middle))
        kept &= ~gone
    touching = touch(rng, f, kept, int(rng.integers(0, 3)))
    # The body and the islands that were meant; what else came off goes.
    label = parts(f, kept)
    body = np.bincount(label[kept]).argmax()
    meant = {body}
    found = 0
    for island in islands:
        own = np.unique(label[island[kept[island]]])
        if len(own) == 1 and own[0] != body and own[0] not in meant:
            meant.add(own[0])
            found += 1
    kept &= np.isin(label, list(meant))
    v, f = surfaces.compact(v, f[kept])
    return v, f, {"kind": kind, "wanted": wanted, "touching": touching, "islands": found}


def parts(f, kept):
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    a, b = score.neighbours(f)
    both = kept[a] & kept[b]
    a, b = a[both], b[both]
    return connected_components(coo_matrix((np.ones(len(a)), (a, b)), (len(f), len(f))), False)[1]


def touch(rng, f, kept, wanted):
    """Takes triangles that meet a hole's border in one vertex alone."""
    made = 0
    for _ in range(wanted):
        a, b = score.neighbours(f)
        rim = np.intersect1d(np.unique(f[kept]), np.unique(f[~kept]))
        # A triangle with one corner on a border, all of whose neighbours stay.
        on = np.isin(f, rim)
        candidates = kept & (on.sum(1) == 1)
        lost = np.zeros(len(f), bool)
        for one, other in ((a, b), (b, a)):
            lost[one[~kept[other]]] = True
        candidates = np.flatnonzero(candidates & ~lost)
        if len(candidates) == 0:
            break
        kept[rng.choice(candidates)] = False
        made += 1
    return made


def cells(rows, columns, round_rows, round_columns):
    """Triangles of a grid, cut along either diagonal by turns."""
    i, j = np.meshgrid(np.arange(rows - (not round_rows)), np.arange(columns - (not round_columns)), indexing="ij")
    at = lambda di, dj: (((i + di) % rows) * columns + (j + dj) % columns).ravel()
    a, b, c, d = at(0, 0), at(1, 0), at(1, 1), at(0, 1)
    even = ((i + j) % 2 == 0).ravel()[:, None]
    one = np.where(even, np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    two = np.where(even, np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    return np.concatenate([one, two]), (np.concatenate([i.ravel()] * 2), np.concatenate([j.ravel()] * 2))


def torus_of_holes(rng, triangles, holes):
    """A torus of at least so many triangles, with so many holes of about 60."""
    torus = Torus()
    ratio = torus.extent[0] / torus.extent[1]
    m = int(np.ceil(np.sqrt((triangles + 100 * holes) / 2 / ratio)))
    n = int(np.ceil(m * ratio))
    f, (i, j) = cells(n, m, True, True)
    gone = np.zeros(len(f), bool)
    centres = []
    while len(centres) < holes:
        c = np.array([rng.uniform(0, n), rng.uniform(0, m)])
        if all(np.hypot(*around(c - o, n, m)) > 14 for o in centres):
            centres.append(c)
    from scipy.spatial import cKDTree

    shifts = [np.array([a * n, b * m]) for a in (-1, 0, 1) for b in (-1, 0, 1)]
    tree = cKDTree(np.concatenate([np.array(centres) + s for s in shifts]))
    gone = tree.query(np.stack([i + 0.5, j + 0.5], 1))[0] < 3.5
    t = np.stack(np.meshgrid(np.arange(n), np.arange(m), indexing="ij"), -1).reshape(-1, 2)
    t = (t + rng.uniform(-JITTER, JITTER, t.shape)) * [torus.extent[0] / n, torus.extent[1] / m]
    v, f = surfaces.compact(torus.point(t), f[~gone])
    return v, f


JITTER = 0.15


def around(d, n, m):
    return np.abs((d + [n / 2, m / 2]) % [n, m] - [n / 2, m / 2])


def slit(rng, cells_long):
    """A strip of the saddle z = xy / 60 with a slit 12 cells wide and so many long."""
    n, m = cells_long + 80, 92
    f, (i, j) = cells(n, m, False, False)
    gone = (np.abs(i + 0.5 - n / 2) < cells_long / 2) & (np.abs(j + 0.5 - m / 2) < 6)
    t = np.stack(np.meshgrid(np.arange(n), np.arange(m), indexing="ij"), -1).reshape(-1, 2).astype(float)
    t = (t - [n / 2, m / 2] + rng.uniform(-JITTER, JITTER, t.shape)) * (80.0 / cells_long)
    v = surfaces.Saddle().point(t + surfaces.SIZE_MM / 2)
    v, f = surfaces.compact(v, f[~gone])
    n = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    if n[:, 2].mean() < 0:
        f = f[:, ::-1]
    return v, np.ascontiguousarray(f)

"""Known surfaces, 100 mm across, as meshes with one hole, and where a point's nearest place on them is.

Meshes are irregular: jittered points, triangulated by Delaunay's rule, fine around the hole and coarser
away from it. All lengths in millimetres.
"""

import dataclasses

import numpy as np
from scipy.spatial import ConvexHull, Delaunay, cKDTree

SIZE_MM = 100.0
# Points leave their places in a grid of triangles by so much of its spacing, each way.
JITTER = 0.2
# Triangles are coarser by so much of the way from the hole.
GRADE = 0.15
# Rings of triangles around the hole that are as fine as those at its border.
RINGS = 6
FAR_MM = 4.0


@dataclasses.dataclass
class Hole:
    """Where a hole is: its centre, half its diameter, and how its outline waves (none: round)."""

    centre: np.ndarray
    axes: np.ndarray
    radius: float
    waves: list

    def outline(self, angle):
        return 1.0 + sum(a * np.sin(k * angle + phase) for k, a, phase in self.waves)


def unit(v):
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)


def across(normal):
    """Two unit vectors at right angles to a normal and to each other."""
    one = unit(np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))]))
    return np.array([one, np.cross(normal, one)])


class Surface:
    """A surface F = 0 with gradient and second derivatives; `nearest` by Newton's method on both."""

    closed = True
    loops = 0  # of a mesh without holes

    def nearest(self, p):
        """Signed distances of points, and the surface's normals where it is nearest."""
        q = p.copy()
        for _ in range(5):
            f, g, _ = self.implicit(q)
            q = q - (f / (g * g).sum(1))[:, None] * g
        f, g, _ = self.implicit(q)
        m = ((p - q) * g).sum(1) / (g * g).sum(1)
        for _ in range(12):
            f, g, h = self.implicit(q)
            k = np.zeros((len(p), 4, 4))
            k[:, :3, :3] = np.eye(3) + m[:, None, None] * h
            k[:, :3, 3] = g
            k[:, 3, :3] = g
            right = np.concatenate([p - q - m[:, None] * g, -f[:, None]], 1)
            step = np.linalg.solve(k, right[:, :, None])[:, :, 0]
            q, m = q + step[:, :3], m + step[:, 3]
        _, g, _ = self.implicit(q)
        n = unit(g)
        return ((p - q) * n).sum(1), n

    def hole_place(self, p, hole):
        """Where points lie as a hole sees them, in units of its radius: distance and angle."""
        away = p - hole.centre
        flat = away @ hole.axes.T
        return np.linalg.norm(away, axis=1) / hole.radius, np.arctan2(flat[:, 1], flat[:, 0])

    def clearance(self, p, hole):
        distance, _ = self.hole_place(p, hole)
        return (distance - 1.3 if hole.waves else distance - 1.0) * hole.radius

    def deep(self, hole, edge):
        """How far inside an outline points may matter to triangles at its border."""
        return 3 * edge + (0.6 * hole.radius if hole.waves else 0.0)

    def hole(self, rng, share, ragged):
        radius = share * SIZE_MM / 2
        waves = []
        if ragged:
            waves = [(k, rng.uniform(0.04, 0.1), rng.uniform(0, 2 * np.pi)) for k in (2, 3, 5)]
        centre, normal = self.place(rng, radius)
        return Hole(centre, across(normal), radius, waves)

    def mesh(self, rng, hole, edge):
        """Vertices and triangles with the hole cut out; the largest part alone."""
        v, f = self.whole(rng, hole, edge)
        n = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
        turned = (n * self.nearest(v[f].mean(1))[1]).sum(1) < 0
        f[turned] = f[turned][:, ::-1]
        if hole is None:
            return v, f
        distance, angle = self.hole_place(v, hole)
        inside = distance < hole.outline(angle)
        if hole.waves:
            # Rough: triangles go with two corners of three, some with one.
            count = inside[f].sum(1)
            gone = (count >= 2) | ((count == 1) & (rng.random(len(f)) < 0.5))
            # What no corner betrays: triangles across the hole.
            middle, at = self.hole_place(v[f].mean(1), hole)
            gone |= middle < hole.outline(at) - 2 * edge / hole.radius
        else:
            gone = inside[f].any(1)
        return compact(v, largest(f[~gone]))


def largest(f):
    """The triangles of the largest part that hangs together by edges."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), 1)
    order = np.lexsort(edges.T)
    same = (edges[order][1:] == edges[order][:-1]).all(1)
    a, b = order[:-1][same] % len(f), order[1:][same] % len(f)
    _, part = connected_components(coo_matrix((np.ones(len(a)), (a, b)), (len(f), len(f))), False)
    return f[part == np.bincount(part).argmax()]


def compact(v, f):
    used, index = np.unique(f, return_inverse=True)
    return v[used], index.reshape(-1, 3)


def grid(rng, low, high, spacing):
    """Jittered points in a rectangle."""
    rows = np.arange(low[1], high[1], spacing * 0.866)
    columns = np.arange(low[0], high[0] + spacing, spacing)
    x, y = np.meshgrid(columns, rows)
    x = x + (np.arange(len(rows)) % 2)[:, None] * spacing / 2
    points = np.stack([x.ravel(), y.ravel()], 1)
    return points + rng.uniform(-JITTER, JITTER, points.shape) * spacing


def graded(rng, low, high, edge, far, centre, clearance, deep):
    """Points of a chart, finer where the clearance (a function of chart points) is small; none deeper."""
    levels = int(np.ceil(np.log2(max(far / edge, 1.0))))
    parts = []
    for k in range(levels + 1):
        spacing = edge * 2.0**k
        near = lambda c: np.log2(1 + GRADE * np.maximum(c - RINGS * edge, 0) / edge)
        reach = np.inf
        if k < levels:
            reach = RINGS * edge + edge * (2.0 ** (k + 1) - 1) / GRADE
        a, b = np.maximum(low, centre - window(reach)), np.minimum(high, centre + window(reach))
        points = grid(rng, a, b, spacing)
        points = points[((points >= low) & (points < high)).all(1)]
        c = clearance(points)
        level = np.minimum(np.floor(near(c)), levels)
        points = points[(level == k) & (c > -deep)]
        if parts and len(points):
            away, _ = cKDTree(np.concatenate(parts)).query(points)
            points = points[away > 0.6 * spacing]
        parts.append(points)
    return np.concatenate(parts)


def window(reach):
    return np.full(2, reach + 2 * SIZE_MM if np.isinf(reach) else reach + 1.5 * SIZE_MM)


class Ball(Surface):
    """An ellipsoid by its half axes; all alike, a sphere."""

    def __init__(self, half):
        self.half = np.array(half, float)

    def implicit(self, q):
        s = self.half**2
        h = np.broadcast_to(np.diag(2 / s), (len(q), 3, 3))
        return (q * q / s).sum(1) - 1, 2 * q / s, h

    def nearest(self, p):
        if np.ptp(self.half) == 0:
            return np.linalg.norm(p, axis=1) - self.half[0], unit(p)
        return super().nearest(p)

    def place(self, rng, _radius):
        u = unit(rng.normal(size=3))
        return u * self.half, unit(u / self.half)

    def whole(self, rng, hole, edge):
        scale = np.sort(self.half)[1]
        stretch = self.half / scale
        if hole is None:
            u = fibonacci(rng, scale, edge)
        else:
            # Fine points on a plane rolled onto the sphere around the hole, coarse ones everywhere.
            top = unit(hole.centre / self.half)
            axes = across(top)

            def rolled(t):
                r = np.linalg.norm(t, axis=1)[:, None]
                along = unit(t) @ axes
                return np.cos(r / scale) * top + np.sin(r / scale) * along

            def clear(t):
                return self.clearance(rolled(t) * self.half, hole)

            reach = 0.9 * scale
            t = graded(rng, np.full(2, -reach), np.full(2, reach), edge, FAR_MM, np.zeros(2), clear, self.deep(hole, edge))
            t = t[np.linalg.norm(t, axis=1) < reach]
            far = fibonacci(rng, scale, FAR_MM / 1.5)
            far = far[np.arccos(np.clip(far @ top, -1, 1)) * scale > reach + 0.5 * FAR_MM]
            u = np.concatenate([rolled(t), far])
        v = u * scale * stretch
        return v, ConvexHull(v).simplices.astype(np.int64)


def fibonacci(rng, radius, spacing):
    n = int(4 * np.pi * radius**2 / (0.866 * spacing**2))
    k = np.arange(n) + 0.5
    z, angle = 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    s = np.sqrt(1 - z * z)
    u = np.stack([s * np.cos(angle), s * np.sin(angle), z], 1)
    return unit(u + rng.uniform(-JITTER, JITTER, u.shape) * spacing / radius)


class Chart(Surface):
    """A surface over a rectangle, round in the first direction, in both, or in none."""

    def whole(self, rng, hole, edge):
        (w, h), rounds = self.extent, self.rounds
        low = np.zeros(2)
        high = np.array([w, h])
        if hole is not None:
            # Round ways are cut open opposite of the hole, which so lies amid its points.
            shift = np.where(rounds, self.chart(hole.centre) - high / 2, 0)
            low, high = low + shift, high + shift
        if hole is None:
            t = grid(rng, low, high, edge)
            t = t[((t >= low) & (t < high)).all(1)]
            spacing = edge
        else:
            clear = lambda t: self.clearance(self.point(t), hole)
            t = graded(rng, low, high, edge, FAR_MM, self.chart(hole.centre), clear, self.deep(hole, edge))
            spacing = FAR_MM
        # Straight borders, with points of their own.
        for axis in (0, 1):
            if not rounds[axis]:
                keep = (t[:, axis] > 0.5 * spacing) & (t[:, axis] < high[axis] - 0.5 * spacing)
                t = t[keep]
        t = np.concatenate([t, self.border(spacing) + np.where(rounds, low, 0)])
        n = len(t)
        copies, index = [t], [np.arange(n)]
        for axis in (0, 1):
            if rounds[axis]:
                all_t, all_i = np.concatenate(copies), np.concatenate(index)
                turn = high[axis] - low[axis]
                for shift in (-turn, turn):
                    moved = all_t.copy()
                    moved[:, axis] += shift
                    near = (moved[:, axis] > low[axis] - turn / 4) & (moved[:, axis] < high[axis] + turn / 4)
                    copies.append(moved[near])
                    index.append(all_i[near])
                copies, index = [np.concatenate(copies)], [np.concatenate(index)]
        t, index = copies[0], index[0]
        f = Delaunay(t).simplices.astype(np.int64)
        middle = t[f].mean(1)
        own = np.ones(len(f), bool)
        for axis in (0, 1):
            if rounds[axis]:
                own &= (middle[:, axis] >= low[axis]) & (middle[:, axis] < high[axis])
        one, two = t[f[:, 1]] - t[f[:, 0]], t[f[:, 2]] - t[f[:, 0]]
        area = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
        return self.point(t[:n]), index[f[own & (area > 1e-9)]]

    def border(self, spacing):
        (w, h), rounds = self.extent, self.rounds
        parts = [np.zeros((0, 2))]
        along = lambda length, ends: np.linspace(0, length, round(length / spacing) + 1)[: None if ends else -1]
        if not rounds[1]:
            x = along(w, not rounds[0])
            parts += [np.stack([x, np.full_like(x, y)], 1) for y in (0, h)]
        if not rounds[0]:
            y = along(h, True)[1:-1]
            parts += [np.stack([np.full_like(y, x), y], 1) for x in (0, w)]
        return np.concatenate(parts)


class Torus(Chart):
    ring, tube = 35.0, 15.0
    rounds = (True, True)
    extent = (2 * np.pi * 35.0, 2 * np.pi * 15.0)

    def point(self, t):
        a, b = t[:, 0] / self.ring, t[:, 1] / self.tube
        r = self.ring + self.tube * np.cos(b)
        return np.stack([r * np.cos(a), r * np.sin(a), self.tube * np.sin(b)], 1)

    def chart(self, p):
        a = np.arctan2(p[1], p[0]) % (2 * np.pi)
        b = np.arctan2(p[2], np.hypot(p[0], p[1]) - self.ring) % (2 * np.pi)
        return np.array([a * self.ring, b * self.tube])

    def nearest(self, p):
        spine = np.zeros_like(p)
        spine[:, :2] = unit(p[:, :2]) * self.ring
        away = p - spine
        return np.linalg.norm(away, axis=1) - self.tube, unit(away)

    def place(self, rng, _radius):
        p = self.point(rng.uniform(0, 1, (1, 2)) * self.extent)
        return p[0], self.nearest(p)[1][0]


class Pipe(Chart):
    """Open at both ends; its window reaches `times` as far around as along."""

    closed, loops = False, 2
    radius, times = 25.0, 4.0
    rounds = (True, False)
    extent = (2 * np.pi * 25.0, SIZE_MM)

    def point(self, t):
        a = t[:, 0] / self.radius
        return np.stack([self.radius * np.cos(a), self.radius * np.sin(a), t[:, 1]], 1)

    def chart(self, p):
        return np.array([np.arctan2(p[1], p[0]) % (2 * np.pi) * self.radius, p[2]])

    def nearest(self, p):
        n = p.copy()
        n[:, 2] = 0
        return np.linalg.norm(n, axis=1) - self.radius, unit(n)

    def place(self, rng, radius):
        room = self.extent[1] / 2 - radius * 1.3 - 8
        a, z = rng.uniform(0, 2 * np.pi), self.extent[1] / 2 + rng.uniform(-1, 1) * max(room, 0)
        n = np.array([np.cos(a), np.sin(a), 0])
        return n * self.radius + [0, 0, z], n

    def hole_place(self, p, hole):
        turn = np.arctan2(p[:, 1], p[:, 0]) - np.arctan2(hole.centre[1], hole.centre[0])
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        x = turn * self.radius / (self.times * hole.radius)
        y = (p[:, 2] - hole.centre[2]) / hole.radius
        return np.hypot(x, y), np.arctan2(y, x)


class Sheet(Chart):
    """z over a square: its own height function, with first and second derivatives."""

    closed, loops = False, 1
    rounds = (False, False)
    extent = (SIZE_MM, SIZE_MM)

    def point(self, t):
        x, y = t[:, 0] - SIZE_MM / 2, t[:, 1] - SIZE_MM / 2
        return np.stack([x, y, self.height(x, y)[0]], 1)

    def chart(self, p):
        return p[:2] + SIZE_MM / 2

    def implicit(self, q):
        z, zx, zy, zxx, zxy, zyy = self.height(q[:, 0], q[:, 1])
        g = np.stack([-zx, -zy, np.ones(len(q))], 1)
        h = np.zeros((len(q), 3, 3))
        h[:, 0, 0], h[:, 1, 1] = -zxx, -zyy
        h[:, 0, 1] = h[:, 1, 0] = -zxy
        return q[:, 2] - z, g, h

    def place(self, rng, radius):
        room = SIZE_MM / 2 - 1.3 * radius - 8
        p = self.point(SIZE_MM / 2 + rng.uniform(-room, room, (1, 2)))
        return p[0], unit(self.implicit(p)[1])[0]


class Saddle(Sheet):
    def height(self, x, y):
        one = np.ones_like(x)
        return x * y / 60, y / 60, x / 60, 0 * one, one / 60, 0 * one


class Wavy(Sheet):
    """Waves of 60 mm, 4 mm high, aslant: half a wave is 30 mm, the largest hole."""

    def height(self, x, y):
        k, aslant = 2 * np.pi / 60, (np.cos(0.5), np.sin(0.5))
        s = k * (aslant[0] * x + aslant[1] * y)
        a, b = k * aslant[0], k * aslant[1]
        z, d, dd = 2 * np.sin(s), 2 * np.cos(s), -2 * np.sin(s)
        return z, d * a, d * b, dd * a * a, dd * a * b, dd * b * b


ALL = {
    "sphere": Ball([50, 50, 50]),
    "torus": Torus(),
    "saddle": Saddle(),
    "ellipsoid": Ball([50, 35, 25]),
    "wavy": Wavy(),
    "pipe": Pipe(),
}

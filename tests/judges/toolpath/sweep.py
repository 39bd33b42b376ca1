"""What a moving cutter leaves, and where a cutter stands, by formulas of their own; compiled by numba.

A cutter is `(radius, corner)`: corner 0 is a flat end, corner = radius a ball. Its end is `h(rho)`
above the tip at `rho` from the axis. A straight move leaves `min over t of z(t) + h(rho(t))` at a
place: convex in `t`, so that the least is where the derivative is nothing, or at an end. Upside
down the same finds the highest tip that touches an edge.
"""

import math

import numpy as np
from numba import njit

CELL_MM = 0.5
NOTHING = -1e9


@njit(cache=True, inline="always")
def profile(radius, corner, rho):
    out = rho - (radius - corner)
    if out <= 0.0:
        return 0.0
    return corner - math.sqrt(max(corner * corner - out * out, 0.0))


@njit(cache=True)
def least(radius, corner, a, b, x, y, best):
    """The least of z + h over a straight way from a to b at (x, y), and where on the way; anything
    above `best` where it is no less than that."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = math.sqrt(dx * dx + dy * dy)
    px, py = x - a[0], y - a[1]
    if length < 1e-12:
        rho = math.sqrt(px * px + py * py)
        if rho > radius:
            return 1e9, 0.0
        if a[2] < b[2]:
            return a[2] + profile(radius, corner, rho), 0.0
        return b[2] + profile(radius, corner, rho), 1.0
    foot = (px * dx + py * dy) / length
    square = max(px * px + py * py - foot * foot, 0.0)
    if square > radius * radius:
        return 1e9, 0.0
    reach = math.sqrt(radius * radius - square)
    low, high = max(0.0, foot - reach), min(length, foot + reach)
    if low > high:
        return 1e9, 0.0
    slope = (b[2] - a[2]) / length
    disc = radius - corner
    if corner == 0.0:
        t = low if slope > 0.0 else high
    elif disc == 0.0:
        t = min(max(foot - slope * reach / math.sqrt(1.0 + slope * slope), low), high)
    else:
        for _ in range(60):
            t = 0.5 * (low + high)
            off = t - foot
            rho = math.sqrt(square + off * off)
            out = rho - disc
            rise, z = slope, a[2] + slope * t
            if out > 0.0:
                root = math.sqrt(max(corner * corner - out * out, 1e-300))
                rise += out / root * off / rho
                z += corner - root
            # It lies above its tangent.
            bound = z + min(rise * (low - t), rise * (high - t))
            if bound >= best:
                return bound, 0.0
            if z - bound < 1e-10:
                break
            if rise < 0.0:
                low = t
            else:
                high = t
    off = t - foot
    return a[2] + slope * t + profile(radius, corner, math.sqrt(square + off * off)), t / length


def binned(low, high, origin, shape):
    """Indices of boxes by the cells that they touch: starts and items."""
    first = np.clip(((low - origin) / CELL_MM).astype(int), 0, shape - 1)
    last = np.clip(((high - origin) / CELL_MM).astype(int), 0, shape - 1)
    return _binned(first, last, shape)


@njit(cache=True)
def _binned(first, last, shape):
    counts = np.zeros(shape[0] * shape[1] + 1, np.int64)
    for k in range(len(first)):
        for i in range(first[k, 0], last[k, 0] + 1):
            for j in range(first[k, 1], last[k, 1] + 1):
                counts[i * shape[1] + j + 1] += 1
    starts = np.cumsum(counts)
    fill = starts.copy()
    items = np.empty(starts[-1], np.int64)
    for k in range(len(first)):
        for i in range(first[k, 0], last[k, 0] + 1):
            for j in range(first[k, 1], last[k, 1] + 1):
                cell = i * shape[1] + j
                items[fill[cell]] = k
                fill[cell] += 1
    return starts, items


@njit(cache=True)
def left_at(radius, corner, ways, grid, x, y, top):
    """Height that all ways leave at a place, `top` at most, and where the tip is that leaves it."""
    origin, shape, starts, items = grid
    best, u, v = top, math.nan, math.nan
    i0 = max(int((x - radius - origin[0]) / CELL_MM), 0)
    i1 = min(int((x + radius - origin[0]) / CELL_MM), shape[0] - 1)
    j0 = max(int((y - radius - origin[1]) / CELL_MM), 0)
    j1 = min(int((y + radius - origin[1]) / CELL_MM), shape[1] - 1)
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            cell = i * shape[1] + j
            for n in range(starts[cell], starts[cell + 1]):
                way = ways[items[n]]
                if min(way[0, 2], way[1, 2]) >= best:
                    continue
                dx = max(min(way[0, 0], way[1, 0]) - x, x - max(way[0, 0], way[1, 0]), 0.0)
                dy = max(min(way[0, 1], way[1, 1]) - y, y - max(way[0, 1], way[1, 1]), 0.0)
                square = dx * dx + dy * dy
                if square > radius * radius:
                    continue
                bound = profile(radius, corner, math.sqrt(square))
                if min(way[0, 2], way[1, 2]) + bound >= best:
                    continue
                z, share = least(radius, corner, way[0], way[1], x, y, best)
                if z < best:
                    best = z
                    u = way[0, 0] + share * (way[1, 0] - way[0, 0])
                    v = way[0, 1] + share * (way[1, 1] - way[0, 1])
    return best, u, v


@njit(cache=True)
def lefts(radius, corner, ways, grid, places, top):
    out = np.empty((len(places), 3))
    for k in range(len(places)):
        z, u, v = left_at(radius, corner, ways, grid, places[k, 0], places[k, 1], top)
        out[k, 0], out[k, 1], out[k, 2] = z, u, v
    return out


@njit(cache=True)
def inside(a, b, c, x, y):
    p = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
    q = (c[0] - b[0]) * (y - b[1]) - (c[1] - b[1]) * (x - b[0])
    r = (a[0] - c[0]) * (y - c[1]) - (a[1] - c[1]) * (x - c[0])
    return (p >= 0.0 and q >= 0.0 and r >= 0.0) or (p <= 0.0 and q <= 0.0 and r <= 0.0)


@njit(cache=True)
def gradient(a, b, c):
    d = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
    gx = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / d
    gy = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / d
    return gx, gy


@njit(cache=True)
def height_at(facets, grid, x, y):
    """Height of the surface, and z of its normal; nothing beside it."""
    origin, shape, starts, items = grid
    i, j = int((x - origin[0]) / CELL_MM), int((y - origin[1]) / CELL_MM)
    best, nz = NOTHING, 1.0
    if x < origin[0] or y < origin[1] or i >= shape[0] or j >= shape[1]:
        return best, nz
    cell = i * shape[1] + j
    for n in range(starts[cell], starts[cell + 1]):
        a, b, c = facets[items[n]]
        if inside(a, b, c, x, y):
            gx, gy = gradient(a, b, c)
            z = a[2] + gx * (x - a[0]) + gy * (y - a[1])
            if z > best:
                best, nz = z, 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
    return best, nz


@njit(cache=True)
def touch(radius, corner, facet, x, y, best):
    """The highest tip at which the cutter touches a triangle, if that is above `best`."""
    a, b, c = facet
    gx, gy = gradient(a, b, c)
    slope = math.sqrt(gx * gx + gy * gy)
    nz = 1.0 / math.sqrt(1.0 + slope * slope)
    out = corner * nz
    if slope > 0.0:
        out += (radius - corner) / slope
    cx, cy = x + gx * out, y + gy * out
    if inside(a, b, c, cx, cy):
        z = a[2] + gx * (cx - a[0]) + gy * (cy - a[1]) - corner + corner * nz
        return max(best, z)
    turned = np.empty((3, 3))
    for k in range(3):
        turned[k, 0], turned[k, 1], turned[k, 2] = facet[k, 0], facet[k, 1], -facet[k, 2]
    for k in range(3):
        z, _ = least(radius, corner, turned[k], turned[(k + 1) % 3], x, y, -best)
        best = max(best, -z)
    return best


@njit(cache=True)
def tip_at(radius, corner, facets, boxes, grid, x, y, hint):
    """Where the tip of a cutter stands that is lowered at a place, and which triangle it touches."""
    origin, shape, starts, items = grid
    best, at = NOTHING, hint
    if hint >= 0:
        best = touch(radius, corner, facets[hint], x, y, best)
    i0 = max(int((x - radius - origin[0]) / CELL_MM), 0)
    i1 = min(int((x + radius - origin[0]) / CELL_MM), shape[0] - 1)
    j0 = max(int((y - radius - origin[1]) / CELL_MM), 0)
    j1 = min(int((y + radius - origin[1]) / CELL_MM), shape[1] - 1)
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            cell = i * shape[1] + j
            for n in range(starts[cell], starts[cell + 1]):
                k = items[n]
                box = boxes[k]
                dx = max(box[0] - x, x - box[2], 0.0)
                dy = max(box[1] - y, y - box[3], 0.0)
                square = dx * dx + dy * dy
                if square > radius * radius:
                    continue
                if box[4] - profile(radius, corner, math.sqrt(square)) <= best:
                    continue
                z = touch(radius, corner, facets[k], x, y, best)
                if z > best:
                    best, at = z, k
    return best, at


@njit(cache=True)
def closing_at(radius, corner, facets, boxes, grid, x, y, u, v, step):
    """The least height that the cutter could leave at a place, sought around a tip at (u, v), and z
    of the normal that its end has there."""
    hint = -1
    z, hint = tip_at(radius, corner, facets, boxes, grid, u, v, hint)
    best = z + profile(radius, corner, math.hypot(x - u, y - v))
    while step > 1e-4:
        moved = False
        for k in range(8):
            angle = 0.25 * math.pi * k
            p, q = u + step * math.cos(angle), v + step * math.sin(angle)
            rho = math.hypot(x - p, y - q)
            if rho > radius:
                continue
            z, hint = tip_at(radius, corner, facets, boxes, grid, p, q, hint)
            z += profile(radius, corner, rho)
            if z < best:
                best, u, v, moved = z, p, q, True
                break
        if not moved:
            step *= 0.5
    out = max(math.hypot(x - u, y - v) - (radius - corner), 0.0)
    nz = 1.0
    if corner > 0.0:
        nz = math.sqrt(max(1.0 - (out / corner) ** 2, 0.0))
    return best, nz

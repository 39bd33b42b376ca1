"""A removal simulation of its own over NC files: gouges, and the height of cusps.

usage: removal.py DIR [--check] [--lines N]

DIR has a folder for each seed, as `judge_toolpath` (an example of geometry/toolpath) leaves them.
From each only the surface, the NC files and what was asked for are read. The file is read by a
reader of its own (`gcode.py`), the cutter swept by formulas of its own (`sweep.py`).
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import struct
import sys

import numpy as np
import opencamlib as ocl

import gcode
import sweep

# Arcs are chords within this: so much may be a gouge that is none.
CHORD_MM = 2e-5
LONGEST_MM = 1.0
# As far above all of the surface nothing is milled. A flat end runs level over its highest place, by
# rounding a little above it.
ALOFT_MM = 0.5
# Gouges beyond this fail; the surface is its triangles, so that tessellation adds nothing.
GOUGE_MM = 1e-3
# Cusps may be higher by this than what was asked for; for a flat end, whose steps depend on where on
# a facet they are, by more. The median of constant-scallop passes may be as much lower as well.
CUSP = 0.05
FLAT_CUSP = 0.1
# Cusps steeper than this, z of the normal, are told apart: 75 degrees.
STEEP = math.cos(math.radians(75))
# The cutter fits where it could leave no more than this share of the cusps.
FITS = 0.2
# Places that are looked at before the worst of them are looked at closely.
MOST_PLACES = 60_000
# Places along a line across the passes, before the cusps between them are found to a nanometre.
ALONG_MM = 0.01
# Another pass, where the tip that leaves the height jumps by so much across.
JUMP_MM = 0.02
# Cusps that are measured: drawn ones, and those that stand highest above the surface.
DRAWN = 300
HIGHEST = 300
# Our tips may differ by this from opencamlib's.
TIP_MM = 1e-5


class Part:
    """The surface, found by place."""

    def __init__(self, path, radius):
        data = path.read_bytes()
        (count,) = struct.unpack("<I", data[80:84])
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
        self.facets = np.frombuffer(data[84:], kind, count)["corners"].astype(float)
        low, high = self.facets.min(axis=1), self.facets.max(axis=1)
        self.low, self.high = low.min(axis=0), high.max(axis=0)
        self.origin = self.low[:2] - 2 * radius - 1
        cells = (self.high[:2] + 2 * radius + 1 - self.origin) / sweep.CELL_MM
        self.shape = np.ceil(cells).astype(np.int64)
        self.boxes = np.column_stack([low[:, :2], high[:, :2], high[:, 2]])
        self.grid = self.bins(low[:, :2], high[:, :2])
        normal = np.cross(
            self.facets[:, 1] - self.facets[:, 0], self.facets[:, 2] - self.facets[:, 0]
        )
        self.nz = np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1)

    def bins(self, low, high):
        starts, items = sweep.binned(low, high, self.origin, self.shape)
        return self.origin, self.shape, starts, items


def ways_of(path, part):
    """Straight ways of the tip that come down to the surface, none of them long."""
    moves = gcode.strokes(path.read_text(), CHORD_MM)
    ends = np.array([[a, b] for _, a, b in moves])
    ends = ends[ends[:, :, 2].min(axis=1) < part.high[2] + ALOFT_MM]
    # What comes from aloft goes straight down.
    ends[:, :, 2] = np.minimum(ends[:, :, 2], 1e3)
    lengths = np.hypot(*(ends[:, 1, :2] - ends[:, 0, :2]).T)
    counts = np.maximum(np.ceil(lengths / LONGEST_MM), 1).astype(int)
    which = np.repeat(np.arange(len(ends)), counts)
    nth = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    span = ends[which, 1] - ends[which, 0]
    from_ = ends[which, 0] + span * (nth / counts[which])[:, None]
    to = ends[which, 0] + span * ((nth + 1) / counts[which])[:, None]
    return np.stack([from_, to], axis=1)


def samples(part, draw):
    """Places on the surface with z of the normal: corners, middles of edges, one in each triangle.
    Where triangles meet, the flattest counts: that makes of a depth the most."""
    facets, nz = part.facets, part.nz
    shares = [np.eye(3)]
    shares.append(np.roll(np.eye(3), 1, axis=1) / 2 + np.eye(3) / 2)
    inner = draw.dirichlet([1, 1, 1], (len(facets), 1))
    weights = np.broadcast_to(np.concatenate(shares), (len(facets), 6, 3))
    weights = np.concatenate([weights, inner], axis=1)
    points = np.einsum("nkw,nwd->nkd", weights, facets).reshape(-1, 3)
    flat = np.repeat(nz, weights.shape[1])
    keys = np.round(points[:, :2], 6)
    order = np.lexsort((-flat, keys[:, 1], keys[:, 0]))
    points, flat, keys = points[order], flat[order], keys[order]
    first = np.ones(len(points), bool)
    first[1:] = (keys[1:] != keys[:-1]).any(axis=1)
    return points[first], flat[first]


def gouge(part, cutter, ways, grid, draw):
    """Deepest cut below the surface along its normal, and how many places were looked at."""
    points, nz = samples(part, draw)
    if len(points) > MOST_PLACES:
        some = draw.permutation(len(points))[:MOST_PLACES]
        points, nz = points[some], nz[some]
    top = part.high[2] + 1
    depth = (points[:, 2] - sweep.lefts(*cutter, ways, grid, points[:, :2], top)[:, 0]) * nz
    count = len(points)
    deepest = depth.max()
    # Around the worst places, closer and closer.
    worst = points[np.argsort(-depth)[:300], :2]
    step = 0.05
    while step > 1e-4:
        around = worst[:, None, :] + draw.normal(0, step, (len(worst), 12, 2))
        around = np.concatenate([worst[:, None, :], around], axis=1)
        flat = around.reshape(-1, 2)
        heights = np.array([sweep.height_at(part.facets, part.grid, x, y) for x, y in flat])
        lefts = sweep.lefts(*cutter, ways, grid, flat, top)[:, 0]
        depth = (heights[:, 0] - lefts) * heights[:, 1]
        count += len(flat)
        deepest = max(deepest, depth.max())
        best = depth.reshape(len(worst), -1).argmax(axis=1)
        worst = around[np.arange(len(worst)), best]
        step *= 0.6
    return deepest, count


def cusps(part, cutter, ways, grid, lines, draw):
    """Heights of cusps along the normal where lines across the passes meet them, with z of that: of
    some that are drawn, and of those that stand highest above the surface.

    A cusp is where the tip that leaves the height jumps from one pass to the next. It is counted from
    the least that this cutter could leave there, had it been everywhere.
    """
    radius, corner = cutter
    top = part.high[2] + 1
    inset = radius
    low, high = part.low[:2] + inset, part.high[:2] - inset
    ys = np.arange(low[1], high[1], ALONG_MM)
    found = []
    for x in draw.uniform(low[0], high[0], lines):
        places = np.column_stack([np.full(len(ys), x), ys])
        left = sweep.lefts(radius, corner, ways, grid, places, top)
        if np.isnan(left).any():
            raise ValueError(f"nothing is milled somewhere on x = {x}")
        for k in np.flatnonzero(np.abs(np.diff(left[:, 2])) > JUMP_MM):
            (p, q), (a, b) = ys[k : k + 2], left[k : k + 2]
            for _ in range(14):
                y = (p + q) / 2
                m = np.array(sweep.left_at(radius, corner, ways, grid, x, y, top))
                if abs(m[2] - a[2]) < abs(m[2] - b[2]):
                    p, a = y, m
                else:
                    q, b = y, m
            y, z = (p + q) / 2, max(a[0], b[0])
            height, nz = sweep.height_at(part.facets, part.grid, x, y)
            apart = math.hypot(*(a[1:] - b[1:]))
            found.append((x, y, z, *(a[1:] + b[1:]) / 2, apart, (z - height) * nz, nz))
    found = np.array(found)
    order = draw.permutation(len(found))
    highest = np.argsort(-found[:, 6])[:HIGHEST]
    drawn = found[order[:DRAWN]]
    return [
        np.array([measured(part, cutter, ridge) for ridge in ridges])
        for ridges in (drawn, found[highest])
    ]


def measured(part, cutter, ridge):
    """A cusp's height above the least that this cutter could leave there, along the normal; z of that;
    and how high that least is above the surface, more than nothing where the cutter does not fit."""
    x, y, z, u, v, apart, above, flat = ridge
    step = max(apart / 4, 0.01)
    at = (part.facets, part.boxes, part.grid, x, y, u, v, step)
    least, nz = sweep.closing_at(*cutter, *at)
    if cutter[1] == 0.0:
        nz = flat
    return (z - least) * nz, nz, above - (z - least) * flat


def referee(part, cutter, draw):
    """How far tips of this simulation are off opencamlib's."""
    radius, corner = cutter
    facets = ocl.STLSurf()
    for a, b, c in part.facets.tolist():
        facets.addTriangle(ocl.Triangle(ocl.Point(*a), ocl.Point(*b), ocl.Point(*c)))
    if corner == 0:
        tool = ocl.CylCutter(2 * radius, 100)
    elif corner == radius:
        tool = ocl.BallCutter(2 * radius, 100)
    else:
        tool = ocl.BullCutter(2 * radius, corner, 100)
    batch = ocl.BatchDropCutter()
    batch.setSTL(facets)
    batch.setCutter(tool)
    places = draw.uniform(part.low[:2], part.high[:2], (40, 2))
    for x, y in places.tolist():
        batch.appendPoint(ocl.CLPoint(x, y, -1e6))
    batch.run()
    off = 0.0
    for point in batch.getCLPoints():
        at = (part.facets, part.boxes, part.grid, point.x, point.y, -1)
        off = max(off, abs(sweep.tip_at(radius, corner, *at)[0] - point.z))
    return off


def judge(folder, lines):
    told = json.loads((folder / "told.json").read_text())
    cutter = told["radius_mm"], told["corner_mm"]
    draw = np.random.default_rng(int(folder.name))
    part = Part(folder / "surface.stl", cutter[0])
    tip = referee(part, cutter, draw)
    rows = []
    for path in sorted(folder.glob("*.nc")):
        ways = ways_of(path, part)
        grid = part.bins(ways[:, :, :2].min(axis=1), ways[:, :, :2].max(axis=1))
        deepest, places = gouge(part, cutter, ways, grid, draw)
        asked = told["scallop_mm"]
        drawn, highest = cusps(part, cutter, ways, grid, lines, draw)
        share = drawn[told_of(drawn, asked), 0] / asked
        both = np.concatenate([drawn, highest])
        is_told = told_of(both, asked)
        others = both[~is_told, 0]
        rows.append({
            "seed": folder.name,
            "program": path.stem,
            "cutter": told["cutter"],
            "triangles": len(part.facets),
            "places": places,
            "gouge, um": 1e3 * deepest,
            "asked for, um": 1e3 * asked,
            "5 %": np.quantile(share, 0.05),
            "median": np.median(share),
            "95 %": np.quantile(share, 0.95),
            "highest": both[is_told, 0].max() / asked,
            "elsewhere": others.max() / asked if len(others) else math.nan,
            "tip, um": 1e3 * tip,
        })
    return rows


def told_of(cusps, asked):
    """Those of which the height is told: no steeper than passes are drawn for, and where the cutter
    reaches the surface. In a crease it does not, however close passes are."""
    return (cusps[:, 1] >= STEEP) & (cusps[:, 2] <= FITS * asked)


def missed(row):
    name = f"{row['seed']} {row['program']}"
    if row["gouge, um"] > 1e3 * GOUGE_MM:
        yield f"{name}: a gouge of {row['gouge, um']:.3f} um"
    if row["tip, um"] > 1e3 * TIP_MM:
        yield f"{name}: tips {row['tip, um']:.4f} um off opencamlib's"
    most = FLAT_CUSP if row["cutter"].startswith("flat") else CUSP
    for kind in ("highest", "elsewhere"):
        if row[kind] > 1 + most:
            yield f"{name}: {kind}, a cusp is {row[kind]:.3f} of what was asked for"
    if row["program"] == "scallop" and abs(row["median"] - 1) > CUSP:
        yield f"{name}: cusps of {row['median']:.3f} of what was asked for"


def cell(value):
    if isinstance(value, float):
        return "-" if math.isnan(value) else f"{value:.3f}"
    return str(value)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--check", action="store_true", help="fail where a bar is missed")
    parser.add_argument("--lines", type=int, default=20, help="lines across the passes")
    options = parser.parse_args()
    rows = []
    folders = [folder for folder in sorted(options.folder.iterdir()) if folder.is_dir()]
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        for judged in pool.map(judge, folders, [options.lines] * len(folders)):
            for row in judged:
                rows.append(row)
                if len(rows) == 1:
                    print("| " + " | ".join(row) + " |")
                    print("|" + " --- |" * len(row))
                cells = [cell(value) for value in row.values()]
                print("| " + " | ".join(cells) + " |", flush=True)
    print(f"\nlargest gouge {max(row['gouge, um'] for row in rows):.3f} um")
    told = [line for row in rows for line in missed(row)]
    if told:
        print("missed:\n" + "\n".join(told))
    if options.check and told:
        sys.exit(1)


if __name__ == "__main__":
    main()

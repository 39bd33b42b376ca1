#!/usr/bin/env python3
"""Judge skinned surfaces: OpenCASCADE measures them, SciPy and geomdl are held against them.

    python check.py RELIEF [--out DIR] [--data DIR] [--short]

RELIEF is the program. Bodies are torsos by formula (torso.py: 9 and 21 sections, 10 and 7 mm, as in
Table 2 of Jo, Kwon & Han) and, where --data is given, recorded scans cut into rows. For each body,
tolerance and method: the control points, and the greatest distance of a data point from the surface
of the IGES file, as OpenCASCADE reads it. The peers are given what they are best at: SciPy's FITPACK
(splprep, closed where the sections are) fits each section by itself, with the largest smoothing that
holds the tolerance, and its coefficients are added up although they make no surface yet; geomdl
fits a surface to the sections resampled to equal numbers of points, with the fewest control points
around that hold it. Exits with 1 where a data point is off by more than the tolerance, where there are more than
85 % of the control points of the published method, or no fewer than a peer needs: of scans, whose
sections are unlike, FITPACK needs what the section that needs most does, times the sections.
"""

import argparse
import json
import os
import subprocess
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
sys.path.insert(0, os.path.join(HERE, ".."))

import occ_check
import torso
from geomdl import fitting
from OCP.BRep import BRep_Tool
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopoDS import TopoDS
from scipy.interpolate import BSpline, splev, splprep
from scipy.optimize import minimize
from scipy.spatial import cKDTree

PAGE = """# Skinned sections, measured

`cargo xtask peers skin` prints this page.

**Torsos** are made by formula (`tests/judges/skin/torso.py`; nothing is measured of a person): hip to
neck, 680 mm, 120 points a section at angles that are not even, normal noise of 0.5 mm, seeds 1 to 3.
**Recorded scans** are cut into rows 4 mm apart. Numbers of sections and tolerances of the torsos are
those of Jo, Kwon & Han's Table 2, who have 18 and 24 control points around 9 sections at 10 and 7 mm,
and 23 and 27 around 21 sections, of bodies that we do not have.

Control points are those of the written surface; "farthest" is the greatest distance of a data point
from it, as OpenCASCADE reads the file. FITPACK (`splprep`) fits each section by itself, closed where
these are, with the smoothing that takes fewest coefficients. "FITPACK, curves" adds these up, although
they are no surface yet; sections of a surface have their knots in common, so that each has at least as
many as the one that needs most ("FITPACK, surface"). geomdl (`approximate_surface`) has the fewest
control points around, up to 40, that hold the tolerance, of sections resampled to equal numbers; rows
are one fewer than sections, three quarters and half of them, and seven. It has no closed surfaces:
closed sections begin and end at one place.

Of torsos, Relief has to need fewer than either sum. Rows of the recorded scans are unlike each other
(some are straight, some have two dozen folds), and no surface with common knots comes near the sum of
curves that each have their own: there it is held against "FITPACK, surface".
"""

# More control points around than this are not asked of geomdl.
MOST_AROUND = 40
# Up to so many sections geomdl is asked for each number in turn, and above by halving.
MOST_ROWS_IN_TURN = 21
SHARE_OF_PUBLISHED = 0.85
# Feet are exact to a millionth of a millimetre, and places are written to 0.0001 mm.
SLACK_MM = 1e-4
# Places along each side of a face that feet are looked for from.
PLACES = 600


def farthest(path, points):
    """The greatest distance of a point from the surfaces of an IGES file."""
    reader = IGESControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone:
        raise SystemExit(f"{path}: not read")
    reader.TransferRoots()
    faces = list(occ_check.explore(reader.OneShape(), TopAbs_FACE, TopoDS.Face))
    if len(faces) != 1:
        raise SystemExit(f"{path}: {len(faces)} faces, 1 expected")
    surface = BRep_Tool.Surface_s(faces[0])
    first, last, low, high = surface.Bounds()

    def off(at, place):
        on = surface.Value(float(at[0]), float(at[1]))
        return np.linalg.norm([on.X() - place[0], on.Y() - place[1], on.Z() - place[2]])

    # Not OpenCASCADE's own projection: it knows only perpendiculars, and not all of those of a face
    # in folds. The nearest of places all over the face is never nearer than the face is, and from
    # there it is led on.
    grid = [(u, v) for u in np.linspace(first, last, PLACES) for v in np.linspace(low, high, PLACES)]
    places = [surface.Value(u, v) for u, v in grid]
    tree = cKDTree([[place.X(), place.Y(), place.Z()] for place in places])
    bounds, nearest = tree.query(points)
    most = 0.0
    for k in np.argsort(-bounds):
        if bounds[k] <= most:
            break
        led = minimize(
            off, grid[nearest[k]], args=(points[k],), bounds=[(first, last), (low, high)], method="Nelder-Mead",
            options={"xatol": 1e-9, "fatol": 1e-9},
        )
        most = max(most, min(led.fun, bounds[k]))
    return most


def skinned(relief, source, tolerance, method, out, more, rings):
    """Control points by `relief skin`, and the greatest deviation by OpenCASCADE."""
    igs, report = out + ".igs", out + ".json"
    command = [relief, "--json", "skin", source, "--tolerance-mm", str(tolerance)]
    command += ["--method", method, "-o", igs, "--report", report] + more
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{source}: {done.stderr.splitlines()[-1]}")
    with open(report, encoding="utf-8") as file:
        told = json.load(file)
    if rings is None:
        points = np.array([point["place_mm"] for point in told["data_points"]])
        of = np.array([point["section"] for point in told["data_points"]])
        rings = [points[of == k] for k in sorted(set(of))]
    else:
        # As they were written, and not as the program has it.
        rings = [np.array(ring) for ring in rings]
        count = sum(len(ring) for ring in rings)
        if len(told["data_points"]) != count:
            raise SystemExit(f"{source}: {len(told['data_points'])} data points of {count}")
    return told["counts"], farthest(igs, np.vstack(rings)), rings, told["closed"]


def distances(curve_points, points):
    """Of points from a polyline that is fine."""
    a, b = curve_points[:-1], curve_points[1:]
    along = b - a
    length = np.maximum((along**2).sum(1), 1e-300)
    t = (((points[:, None] - a) * along).sum(2) / length).clip(0, 1)
    return np.linalg.norm(points[:, None] - a - t[..., None] * along, axis=2).min(1)


def by_fitpack(section, closed, tolerance):
    """Fewest coefficients of splprep with which no data point is off by more."""
    points = np.vstack([section, section[:1]]) if closed else section
    best = None
    for power in np.linspace(-2.0, 2.0, 41):
        smoothing = len(points) * (tolerance * 10.0**power) ** 2
        try:
            (t, c, k), _ = splprep(points.T, s=smoothing, per=closed, quiet=2)
        except (ValueError, TypeError):
            continue
        fine = np.array(splev(np.linspace(0, 1, 2000), (t, c, k))).T
        if distances(fine, section).max() <= tolerance:
            count = len(c[0])
            best = count if best is None else min(best, count)
    return best if best is not None else len(section)


def resampled(section, closed, count):
    points = np.vstack([section, section[:1]]) if closed else section
    at = np.r_[0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    return np.array([np.interp(np.linspace(0, at[-1], count), at, points[:, d]) for d in range(3)]).T


def sampled(surface, count):
    """Places all over a surface of geomdl."""
    knots = [np.array(surface.knotvector_u), np.array(surface.knotvector_v)]
    net = np.array(surface.ctrlpts).reshape(surface.ctrlpts_size_u, surface.ctrlpts_size_v, 3)
    at = [np.linspace(0, 1, n) for n in count]
    basis = [BSpline.design_matrix(t, k, 3).toarray() for t, k in zip(at, knots)]
    return np.einsum("ai,bj,ijd->abd", basis[0], basis[1], net, optimize=True).reshape(-1, 3)


def by_geomdl(sections, closed, tolerance):
    """Fewest control points of approximate_surface with which no resampled point is off by more."""
    count = max(len(section) for section in sections) + closed
    grid = [resampled(section, closed, count) for section in sections]
    data = [tuple(point) for section in grid for point in section]
    rows, best = len(sections), None

    def holds(fewer, around):
        surface = fitting.approximate_surface(data, rows, count, 3, 3, ctrlpts_size_u=fewer, ctrlpts_size_v=around)
        # Nearest of places so dense that what lies between them makes it out hardly farther.
        fine = sampled(surface, (30 * rows, 1000))
        return cKDTree(fine).query(np.vstack(grid))[0].max() <= tolerance

    for fewer in sorted({rows - 1, 3 * rows // 4, rows // 2, 7}):
        least, most = 6, min(count - 1, MOST_AROUND + 1)
        if best:
            most = min(most, (best - 1) // fewer + 1)
        if fewer < 4 or most <= least:
            continue
        if rows <= MOST_ROWS_IN_TURN:
            around = next((around for around in range(least, most) if holds(fewer, around)), None)
        elif holds(fewer, most - 1):
            # One by one would take hours.
            around = most - 1
            while around > least:
                middle = (least + around) // 2
                least, around = (least, middle) if holds(fewer, middle) else (middle + 1, around)
        else:
            around = None
        if around:
            best = around * fewer
    return best


def bodies(options):
    """Name, file, tolerance, what else to say."""
    for count in (9, 21):
        for seed in (1,) if options.short else (1, 2, 3):
            path = os.path.join(options.out, f"torso{count}-{seed}.txt")
            rings = torso.sections(count, 120, 0.5, seed)
            torso.write(path, rings)
            for tolerance in (10.0, 7.0):
                yield f"torso, {count} sections, seed {seed}", path, tolerance, [], rings
    if options.data:
        for name in ("stanford_happy/happyStandRight_0", "stanford_dragon/dragonStandRight_24"):
            path = os.path.join(options.data, name + ".ply.gz")
            if os.path.exists(path):
                yield os.path.basename(name), path, 0.5, ["--every-mm", "4"], None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("relief")
    parser.add_argument("--out", default=".")
    parser.add_argument("--data")
    parser.add_argument("--short", action="store_true")
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    occ_check.silence()
    failures = []
    print(PAGE)
    print("| body | tolerance, mm | published method | farthest, mm | Relief | farthest, mm | share, % | FITPACK, curves | FITPACK, surface | geomdl |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, path, tolerance, more, rings in bodies(options):
        stem = os.path.join(options.out, "skin")
        jo, jo_off, sections, closed = skinned(options.relief, path, tolerance, "jo", stem, more, rings)
        own, own_off, sections, closed = skinned(options.relief, path, tolerance, "relief", stem, more, rings)
        alone = [by_fitpack(section, closed, tolerance) for section in sections]
        fitpack, common = sum(alone), max(alone) * len(alone)
        geomdl = by_geomdl(sections, closed, tolerance)
        share = own["points"] / jo["points"]
        print(
            f"| {name} | {tolerance:g} | {jo['points_around']} x {jo['points_across']} = {jo['points']} "
            f"| {jo_off:.3f} | {own['points_around']} x {own['points_across']} = {own['points']} "
            f"| {own_off:.3f} | {100 * share:.0f} | {fitpack} | {common} | {geomdl or 'holds it nowhere'} |",
            flush=True,
        )
        for off in (jo_off, own_off):
            if off > tolerance + SLACK_MM:
                failures.append(f"{name}, {tolerance} mm: a point is off by {off}")
        if share > SHARE_OF_PUBLISHED:
            failures.append(f"{name}, {tolerance} mm: {100 * share:.0f} % of the published method's")
        for peer, count in (("FITPACK", fitpack if rings else common), ("geomdl", geomdl)):
            if count and own["points"] >= count:
                failures.append(f"{name}, {tolerance} mm: {own['points']} control points, {peer} {count}")
    for failure in failures:
        print(failure, file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

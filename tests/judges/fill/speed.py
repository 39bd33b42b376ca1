"""What fillings cost: a large mesh of many holes, a hole with a long border, and the paper's dense solve."""

import os
import time

import checks
import fillers
import meshes
import models
import numpy as np
import surfaces

MANY_S, MANY_MIB, POINTS_S, POINTS = 15.0, 2048.0, 10.0, 20_000
# A bar on seconds is judged by the fastest of so many: what else the machine does only makes them slower.
ATTEMPTS = 3
PEER_S = 120
# Cells that the slit is long.
SLITS = (40, 80, 155, 310, 620)
DENSE = (500, 1000, 2000, 4000)
DENSE_S = 20.0


def fastest(options, source, target, bar, *words):
    best = None
    for _ in range(ATTEMPTS):
        run, told = fillers.ours(options.relief, source, target, *words)
        if run.code != 0:
            return run, told
        if best is None or run.seconds < best[0].seconds:
            best = (run, told)
        if run.seconds <= bar:
            break
    return best


def line(cells):
    return "| " + " | ".join(f"{c:.2f}" if isinstance(c, float) else str(c) for c in cells) + " |"


def many(options, folder, missed):
    """Growth over sizes, up to a million triangles with 500 holes."""
    sizes = ((50_000, 25), (200_000, 100)) if options.short else ((60_000, 30), (250_000, 125), (1_000_000, 500))
    lines = [
        "| triangles | holes | s | processor, s | MiB | sound | MeshLab, s | MiB | times | MeshFix, s | MiB | times |",
        "| ---: |" * 1 + " ---: |" * 4 + " --- |" + " ---: |" * 6,
    ]
    rng = np.random.default_rng(options.seed)
    for triangles, holes in sizes:
        v, f = models.torus_of_holes(rng, triangles, holes)
        source, target = folder / "many.ply", folder / "many-filled.ply"
        meshes.write_ply(source, v, f)
        run, told = fastest(options, source, target, MANY_S)
        if run.code != 0:
            missed.append(f"{len(f)} triangles: ended with {run.code}")
            continue
        found = checks.faults(*meshes.read_ply(target))
        if len(told["loops"]) != holes:
            found.append(f"{len(told['loops'])} loops")
        if run.seconds > MANY_S:
            found.append(f"{run.seconds:.1f} s")
        if run.peak_mib > MANY_MIB:
            found.append(f"{run.peak_mib:.0f} MiB")
        if found:
            missed.append(f"{len(f)} triangles with {holes} holes: " + ", ".join(found))
        cells = [len(f), holes, run.seconds, run.processor_s, round(run.peak_mib), ", ".join(found) or "yes"]
        edge = float(np.linalg.norm(v[f[:, 0]] - v[f[:, 1]], axis=1).mean())
        for name in ("meshlab", "meshfix"):
            cells += raced(name, source, folder, run, edge)
        lines.append(line(cells))
    return "\n".join(lines)


def raced(name, source, folder, run, edge):
    settings = {"edge": edge, "selfintersection": True} if name == "meshlab" else {}
    other = fillers.peer(name, source, folder / "raced.ply", timeout=PEER_S, **settings)
    if other.code == 124:
        return [f"> {PEER_S}", "", ""]
    if other.code != 0:
        return ["fails", "", ""]
    return [other.seconds, round(other.peak_mib), other.seconds / run.seconds]


def points(options, folder, missed):
    """Growth over the constraint points of one hole."""
    lines = [
        "| border edges | points | new triangles | s | processor, s | us a point | MiB | MeshLab, s | MeshFix, s |",
        "| ---: |" * 1 + " ---: |" * 8,
    ]
    rng = np.random.default_rng(options.seed)
    reached = False
    for long in SLITS[:3] if options.short else SLITS:
        v, f = models.slit(rng, long)
        source, target = folder / "slit.ply", folder / "slit-filled.ply"
        meshes.write_ply(source, v, f)
        run, told = fastest(options, source, target, POINTS_S)
        if run.code != 0:
            missed.append(f"slit of {long} cells: ended with {run.code}")
            continue
        hole = [own for own in told["loops"] if own["kind"] == "hole"]
        count = sum(own["filling"]["points"] for own in hole if "filling" in own)
        found = checks.faults(*meshes.read_ply(target), loops=1)
        if not reached and count >= POINTS:
            reached = True
            if run.seconds > POINTS_S:
                found.append(f"{run.seconds:.1f} s for {count} points")
        if found:
            missed.append(f"slit of {long} cells: " + ", ".join(found))
        edge = float(np.linalg.norm(v[f[:, 0]] - v[f[:, 1]], axis=1).mean())
        cells = [sum(own["edges"] for own in hole), count, told["new_triangles"], run.seconds, run.processor_s]
        cells += [1e6 * run.processor_s / max(count, 1), round(run.peak_mib)]
        cells += [raced(name, source, folder, run, edge)[0] for name in ("meshlab", "meshfix")]
        lines.append(line(cells))
    if not reached:
        missed.append(f"no hole had {POINTS} points")
    return "\n".join(lines)


def thin_plate(one, other):
    r2 = ((one[:, None] - other[None]) ** 2).sum(2)
    return 0.5 * r2 * np.log(np.maximum(r2, 1e-300))


def system(at, centres):
    return np.concatenate([thin_plate(at, centres), np.ones((len(at), 1)), at], 1)


def dense(options, folder, missed):
    """Equation (4) of the paper by LAPACK's solver with pivots, points nearest to a hole of a torus."""
    torus = surfaces.ALL["torus"]
    rng = np.random.default_rng(options.seed)
    hole = torus.hole(rng, 0.2, False)
    v, f = torus.mesh(rng, hole, 0.5)
    order = np.argsort(torus.clearance(v, hole))
    inside = torus.point(torus.chart(hole.centre) + rng.uniform(-14, 14, (2000, 2)))
    inside = inside[torus.clearance(inside, hole) < 0]
    source, target = folder / "dense.ply", folder / "dense-filled.ply"
    meshes.write_ply(source, v, f)
    run, told = fillers.ours(options.relief, source, target)
    if run.code != 0:
        missed.append(f"dense: ended with {run.code}")
        return ""
    nv, nf = meshes.read_ply(target)
    is_old, _ = meshes.split((v, f), (nv, nf))
    fresh = np.setdiff1d(nf[~is_old], nf[is_old])
    off = np.sqrt((torus.nearest(nv[fresh])[0] ** 2).mean())
    count = told["loops"][0]["filling"]["points"]
    lines = ["| solve | points | s | rms, um |", "| --- | ---: | ---: | ---: |"]
    for n in DENSE[:3] if options.short else DENSE:
        centre = v[order[:n]].mean(0)
        scale = 10.0
        # All on the surface but one, off it along the mean normal.
        normal = torus.nearest(hole.centre[None])[1][0]
        at = np.concatenate([v[order[:n]], [hole.centre + 2.0 * normal]])
        at = (at - centre) / scale
        value = np.zeros(len(at))
        value[-1] = 2.0 / scale
        began = time.perf_counter()
        a = np.zeros((n + 5, n + 5))
        a[: n + 1] = system(at, at)
        a[n + 1 :, : n + 1] = a[: n + 1, n + 1 :].T
        solved = np.linalg.solve(a, np.concatenate([value, np.zeros(4)]))
        took = time.perf_counter() - began
        lines.append(line(["paper's, at once", n, took, f"{1e3 * scale * rms(solved, at, (inside - centre) / scale):.3f}"]))
        if took > DENSE_S:
            break
    lines.append(line(["ours, the whole command", count, run.seconds, f"{1e3 * off:.3f}"]))
    return "\n".join(lines)


def rms(solved, centres, at):
    """First-order distances of true places to the surface f = 0."""
    f = lambda p: system(p, centres) @ solved
    step = 1e-5
    g = np.stack([(f(at + step * e) - f(at - step * e)) / (2 * step) for e in np.eye(3)], 1)
    return float(np.sqrt((f(at) ** 2 / (g * g).sum(1)).mean()))


def machine():
    return f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} when the tables were finished"

"""Holes cut from known surfaces, filled by our command, by the paper's way, by MeshLab and by MeshFix."""

import pathlib

import checks
import fillers
import igl
import meshes
import numpy as np
import score
import surfaces
from scipy.spatial import cKDTree

SIZES = (1, 3, 10, 20, 30)
NOISE_MM = 0.05
# Bars: per cent of the hole's diameter, degrees.
RMS_PERCENT, RMS_EXACT_PERCENT, EXACT = 1.0, 0.1, ("sphere", "torus")
BORDER_DEG = 3.0
# Mean edges of a filling against those around the hole.
EDGES = (0.6, 1.5)
# Peers round: what is so near is where it was. Some of them take the half of a double.
NEAR = 1e-5
# Settings of MeshLab's filter, whose best by the truth is told: edges to be aimed at, as a part of those
# around, and whether triangles are kept from meeting others, which changed nothing where it was tried.
MESHLAB = ((1.0, False), (0.5, True))


class Case:
    """A hole in a surface, as a file."""

    def __init__(self, seed, name, size, ragged, noise, folder):
        self.name, self.size, self.ragged, self.noise = name, size, ragged, noise
        self.surface = surfaces.ALL[name]
        self.across = size / 100 * surfaces.SIZE_MM
        least = 0.5 if noise else 0.1
        self.edge = float(np.clip(self.across / 20, least, 1.5))
        rng = np.random.default_rng([seed, list(surfaces.ALL).index(name), size, ragged])
        hole = self.surface.hole(rng, size / 100, ragged)
        v, f = self.surface.mesh(rng, hole, self.edge)
        if noise:
            v = v + self.surface.nearest(v)[1] * rng.normal(0, NOISE_MM, (len(v), 1))
        self.v, self.f = v, f
        border = np.unique(igl.boundary_facets(f)[0])
        self.rim = border[self.surface.hole_place(v[border], hole)[0] < 1.7]
        self.folder = pathlib.Path(folder)
        self.source = self.folder / f"{name}-{size}-{('round', 'ragged')[ragged]}{'-noisy' * noise}.ply"
        meshes.write_ply(self.source, v, f)

    def label(self):
        return f"{self.name}, {self.size} %, {('round', 'ragged')[self.ragged]}"

    def scored(self, target, tolerance):
        v, f = meshes.read_ply(target)
        old = (self.v, self.f)
        if tolerance:
            is_old, gone = meshes.split_near(old, (v, f), tolerance)
        else:
            is_old, gone = meshes.split(old, (v, f))
        used = np.unique(f)
        rim = used[cKDTree(v[used]).query(self.v[self.rim])[1]]
        own = score.score(self.surface, v, f, is_old, score.filling(f, is_old, rim))
        # Where a peer closes ends that should stay open, too, that is no fault of its filling.
        loops = self.surface.loops
        if tolerance and loops:
            loops = checks.boundary_loops(f)
        return own, gone, checks.faults(v, f, loops)


def by_relief(relief, case, method):
    target = case.folder / f"{case.source.stem}-{method}.ply"
    run, told = fillers.ours(relief, case.source, target, "--method", method)
    row = {"seconds": run.seconds, "score": None, "faults": [], "gone": 0, "told": told}
    if run.code != 0:
        row["faults"] = [f"ended with {run.code}: {run.told.strip().splitlines()[-1:]}"]
        return row
    row["score"], row["gone"], row["faults"] = case.scored(target, 0)
    row["nets"] = sum("fair net" in warning for warning in told["warnings"])
    return row


def by_peer(case, name):
    """The best by the truth of all settings."""
    target = case.folder / f"{case.source.stem}-{name}.ply"
    best = {"seconds": 0.0, "score": None, "faults": ["nothing closed"], "gone": 0}
    several = [{}]
    if name == "meshlab":
        near = case.folder / "near.npy"
        np.save(near, case.rim)
        several = [
            {"edge": part * case.edge, "selfintersection": kept, "near": str(near)} for part, kept in MESHLAB
        ]
    for settings in several:
        run = fillers.peer(name, case.source, target, **settings)
        if run.code != 0:
            continue
        own, gone, faults = case.scored(target, NEAR)
        if own and (best["score"] is None or own.rms < best["score"].rms):
            best = {"seconds": run.seconds, "score": own, "faults": faults, "gone": gone}
    return best


def run(options, folder, missed):
    """All cases; their rows, and what misses a bar."""
    sizes = (1, 10, 30) if options.short else SIZES
    rows = []
    for noise in (False, True):
        for name in surfaces.ALL:
            for size in sizes:
                for ragged in (False, True):
                    # One outline of each size will do.
                    if (options.short or noise) and ragged != (size in (3, 10)):
                        continue
                    case = Case(options.seed, name, size, ragged, noise, folder)
                    rows.append(judged(options.relief, case, missed))
                    print(".", end="", flush=True)
    print()
    return rows


def judged(relief, case, missed):
    row = {"case": case, "relief": by_relief(relief, case, "relief")}
    if not case.noise:
        row["yoo"] = by_relief(relief, case, "yoo")
    for name in ("meshlab", "meshfix"):
        row[name] = by_peer(case, name)
    where = case.label() + (", noisy" if case.noise else "")
    own = row["relief"]
    if own["faults"]:
        missed.append(f"{where}: " + ", ".join(own["faults"]))
    if own["gone"]:
        missed.append(f"{where}: {own['gone']} triangles are not where they were")
    if own["score"] is None:
        missed.append(f"{where}: not closed")
        return row
    for what in bars(case, own["score"]):
        missed.append(f"{where}: {what}")
    for name in () if case.noise else ("meshlab", "meshfix"):
        other = row[name]["score"]
        if other and other.rms <= own["score"].rms:
            missed.append(f"{where}: {name} is nearer, {other.rms:.5f} mm to {own['score'].rms:.5f}")
    return row


def bars(case, own):
    """Which bars a filling misses."""
    found = []
    if case.noise:
        for what, rms in (("vertices", own.vertex_rms), ("triangles", own.rms)):
            if rms > NOISE_MM:
                found.append(f"{what} {rms:.4f} mm off, noise {NOISE_MM}")
        return found
    bar = RMS_EXACT_PERCENT if case.name in EXACT else RMS_PERCENT
    for what, rms in (("vertices", own.vertex_rms), ("triangles", own.rms)):
        if 100 * rms / case.across > bar:
            found.append(f"{what} {100 * rms / case.across:.3f} % off, bar {bar}")
    if own.border > BORDER_DEG:
        found.append(f"{own.border:.2f} degrees at the border, old ones there {own.border_old:.2f}")
    if own.triangles > 20 and not EDGES[0] <= own.edge <= EDGES[1]:
        found.append(f"edges {own.edge:.2f} of those around")
    return found


def percent(case, value):
    return f"{100 * value / case.across:.5f}"


def table(rows):
    """Without noise: beside the paper's way and the peers."""
    lines = [
        "| surface | hole, % | outline | vertices, % | triangles, % | largest, % | border, deg | of the old | bend, deg"
        " | of the old | edges | paper, % | MeshLab, % | border | MeshFix, % | border | sound |",
        "| --- | ---: | --- |" + " ---: |" * 13 + " --- |",
    ]
    for row in rows:
        case, own = row["case"], row["relief"]["score"]
        if case.noise:
            continue
        cells = [case.name, case.size, ("round", "ragged")[case.ragged]]
        if own:
            cells += [percent(case, x) for x in (own.vertex_rms, own.rms, own.most)]
            cells += [f"{x:.2f}" for x in (own.border, own.border_old, own.bend, own.bend_old, own.edge)]
        else:
            cells += ["open"] * 8
        yoo = row["yoo"]["score"]
        cells.append(percent(case, yoo.rms) if yoo else "open")
        for name in ("meshlab", "meshfix"):
            other = row[name]["score"]
            cells += [percent(case, other.rms), f"{other.border:.2f}"] if other else ["open", ""]
        cells.append("yes" if not row["relief"]["faults"] and not row["relief"]["gone"] else "no")
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def noise_table(rows):
    lines = [
        "| surface | hole, % | outline | vertices, mm | triangles, mm | largest, mm | told, mm | MeshLab, mm |"
        " MeshFix, mm | sound |",
        "| --- | ---: | --- |" + " ---: |" * 6 + " --- |",
    ]
    for row in rows:
        case, own = row["case"], row["relief"]["score"]
        if not case.noise:
            continue
        cells = [case.name, case.size, ("round", "ragged")[case.ragged]]
        cells += [f"{x:.4f}" for x in (own.vertex_rms, own.rms, own.most)] if own else ["open"] * 3
        fillings = [one["filling"] for one in row["relief"]["told"]["loops"] if "filling" in one]
        cells.append(f"{max(one['noise_mm'] for one in fillings):.4f}" if fillings else "")
        for name in ("meshlab", "meshfix"):
            cells.append(f"{row[name]['score'].rms:.4f}" if row[name]["score"] else "open")
        cells.append("yes" if not row["relief"]["faults"] and not row["relief"]["gone"] else "no")
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def verdict(rows):
    """How many holes each peer fills as well, and how many times further off it is at the median."""
    nets = sum(row["relief"].get("nets", 0) for row in rows)
    lines = [f"{len(rows)} holes; {nets} closed by a fair net alone, where no implicit surface did.\n"]
    for name, title in (("meshlab", "MeshLab"), ("meshfix", "MeshFix")):
        both = [row for row in rows if row["relief"]["score"]]
        better, border, times, clean = 0, 0, [], 0
        for row in both:
            other, own = row[name]["score"], row["relief"]["score"]
            better += other is None or own.rms < other.rms
            border += other is None or own.border < other.border
            clean += not row[name]["faults"]
            if other:
                times.append(other.rms / own.rms)
        lines.append(
            f"Ours is nearer than {title} on {better} of {len(rows)} holes, {np.median(times):.1f} times at the median,"
            f" {min(times):.1f} times at least, and leans less at the border on {border}; {title}'s mesh is sound on"
            f" {clean}."
        )
    return "\n".join(lines)

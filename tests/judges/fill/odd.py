"""Input that is no good, or odd: clear answers, and no output where there is nothing to write."""

import checks
import fillers
import meshes
import numpy as np
import surfaces


def refused(options, folder, missed, name, source, expected, *more):
    """Ends with an error that has these words, without a panic and without an output file."""
    target = folder / "odd-out.ply"
    target.unlink(missing_ok=True)
    run = fillers.measured([options.relief, "fill", str(source), "-o", str(target), *more], 60)
    found = []
    if run.code not in (1, 2):
        found.append(f"ended with {run.code}")
    if "panicked" in run.told:
        found.append("a panic")
    if not any(word in run.told.lower() for word in expected):
        found.append("says " + repr(run.told.strip()[-120:]))
    if target.exists():
        found.append("wrote a file")
    answer = next((one for one in run.told.splitlines() if one.startswith("relief: ")), "")
    if found:
        missed.append(f"{name}: " + ", ".join(found))
    return f"| {name} | {run.code} | {answer.removeprefix('relief: ').replace(str(folder), 'DIR').replace('DIR/', '')} | {held(found)} |"


def held(found):
    return "no: " + ", ".join(found) if found else "yes"


def run(options, folder, missed):
    rng = np.random.default_rng(options.seed)
    ball, sheet = surfaces.ALL["sphere"], surfaces.ALL["saddle"]
    hole = ball.hole(rng, 0.2, False)
    v, f = ball.mesh(rng, hole, 1.5)
    good = folder / "good.ply"
    meshes.write_ply(good, v, f)
    lines = ["| input | exit code | answer | as it should be |", "| --- | ---: | --- | --- |"]
    files = {
        "not a mesh": (b"hello, world\n" * 40, "words.stl", ["no mesh"]),
        "an empty file": (b"", "empty.stl", ["empty", "no mesh", "no triangle"]),
        "an STL of no triangles": (bytes(84), "none.stl", ["no triangle", "empty"]),
        "a PLY cut short": (good.read_bytes()[:-1000], "short.ply", ["short", "end", "trunc", "bytes"]),
        "a PLY of no triangles": (ply_of(np.zeros((0, 3)), np.zeros((0, 3), int), folder), "bare.ply", ["no triangle", "empty"]),
        "a place that is no number": (ply_of(np.where(v == v[5], np.nan, v), f, folder), "nan.ply", ["finite", "number", "nan"]),
        "a corner that is no vertex": (ply_of(v, np.where(f == 7, 10**7, f), folder), "corner.ply", ["vertex", "vertices", "corner"]),
    }
    for name, (data, file, expected) in files.items():
        source = folder / file
        source.write_bytes(data)
        lines.append(refused(options, folder, missed, name, source, expected))
    lines.append(refused(options, folder, missed, "no file", folder / "nowhere.ply", ["nowhere.ply"]))
    lines.append(refused(options, folder, missed, "a folder", folder, ["directory", "folder"]))
    lines.append(refused(options, folder, missed, "an unknown loop", good, ["loop 99"], "--keep", "99"))
    lines.append(refused(options, folder, missed, "loop 0", good, ["loop 0", "0"], "--keep", "0"))
    for name, source, loops, words, test in accepted(rng, folder, v, f, ball, sheet):
        lines.append(taken(options, folder, missed, name, source, loops, words, test))
    return "\n".join(lines)


def ply_of(v, f, folder):
    meshes.write_ply(folder / "made.ply", v, f)
    return (folder / "made.ply").read_bytes()


def taken(options, folder, missed, name, source, loops, words, test):
    """Filled as it should be, so many loops left."""
    target = folder / "odd-out.ply"
    run, told = fillers.ours(options.relief, source, target, *words)
    found = [f"ended with {run.code}: {run.told.strip()[-120:]}"]
    if run.code == 0:
        v, f = meshes.read_ply(target)
        found = checks.faults(v, f, loops, spare=1) + test(told, v, f)
    if found:
        missed.append(f"{name}: " + ", ".join(found))
    notes = "; ".join(told["warnings"]) if told else ""
    return f"| {name} | {run.code} | {notes or 'filled'} | {held(found)} |"


def accepted(rng, folder, v, f, ball, sheet):
    """Odd meshes that can be filled: name, file, loops that stay, options, and what else must hold."""

    def file(name, v, f, kind="<f8"):
        meshes.write_ply(folder / name, v, f, kind)
        return folder / name

    def stays(told, nv, nf):
        same = meshes.split((v, f), (nv, nf))[1] == 0 and len(nf) == len(f)
        kinds = [own["outcome"] for own in told["loops"]]
        return [] if same and kinds == ["kept"] else [f"outcomes {kinds}"]

    good = file("good.ply", v, f)
    yield "all holes excluded", good, 1, ("--keep", "1"), stays
    yield "a closed mesh", file("closed.ply", *ball.mesh(rng, None, 4.0)), 0, (), lambda told, *_: (
        [] if told["loops"] == [] and told["new_triangles"] == 0 else ["something new"]
    )
    whole = sheet.mesh(rng, None, 4.0)
    yield "an open sheet", file("sheet.ply", *whole), 1, (), lambda told, *_: (
        [] if told["new_triangles"] == 0 else ["its border is closed"]
    )
    hole = sheet.hole(rng, 0.3, True)
    holed = sheet.mesh(rng, hole, 1.5)
    yield "an open sheet with a hole", file("holed.ply", *holed), 1, (), lambda told, *_: (
        [] if told["new_triangles"] > 0 else ["its hole is open"]
    )
    last = len(v)
    worse = np.concatenate([f, [[3, 3, 9], [5, 5, 5], f[0], f[1], [f[9, 0], f[9, 1], last]]])
    worse[20] = worse[20][::-1]
    more = np.concatenate([v, [(v[f[9, 0]] + v[f[9, 1]]) / 2]])
    yield "triangles without area, twice, turned", file("worse.ply", more, worse), 0, (), lambda told, *_: (
        [] if told["mended"]["degenerate_triangles"] >= 2 and told["mended"]["duplicate_triangles"] >= 2
        and told["mended"]["turned_triangles"] == 1 else [f"mended {told['mended']}"]
    )
    soup = (v[f].reshape(-1, 3), np.arange(3 * len(f)).reshape(-1, 3))
    yield "each triangle with vertices of its own", file("soup.ply", *soup), 0, (), lambda told, *_: []

    def near(shift, bar):
        def test(told, nv, nf):
            is_old = np.isin(nf, np.unique(nf[: len(f)])).all(1)
            off = np.abs(ball.nearest(nv[np.unique(nf[~is_old])] - shift)[0]) if (~is_old).any() else np.zeros(1)
            return [] if 0 < off.max() < bar else [f"{off.max():.5f} mm off"]

        return test

    far = np.array([1e6, -1e6, 1e6])
    yield "coordinates at 10^6, 64 bits", file("far.ply", v + far, f), 0, (), near(far, 1e-3)
    # 32 bits hold them to 0.06 mm there.
    yield "coordinates at 10^6, 32 bits", file("far32.ply", v + far, f, "<f4"), 0, (), near(far, 0.5)

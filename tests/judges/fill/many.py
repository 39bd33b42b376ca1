"""Models of many holes, recorded meshes and every file format: sound after filling, and nothing moved."""

import collections
import gzip

import checks
import fillers
import meshes
import models
import numpy as np
import surfaces

RECORDED = ("bun_zipper_res2", "bun_zipper_res3")


def random(options, folder, missed):
    """Random models, and how many have what."""
    count = 20 if options.short else 100
    have, bad, failed = collections.Counter(), [], collections.Counter()
    seconds = []
    for seed in range(options.seed, options.seed + count):
        v, f, what = models.random(seed)
        source, target = folder / "random.ply", folder / "random-filled.ply"
        meshes.write_ply(source, v, f)
        run, told = fillers.ours(options.relief, source, target)
        seconds.append(run.seconds)
        have["loops"] += len(told["loops"]) if told else 0
        have["of which touch"] += what["touching"]
        have["islands"] += what["islands"]
        have[what["kind"]] += 1
        found = [f"ended with {run.code}"]
        if run.code == 0:
            found = against(target, v, f)
            have["nets"] += sum("fair net" in warning for warning in told["warnings"])
        for name in ("meshlab", "meshfix"):
            failed[name] += not peer_sound(name, folder, source)
        if found:
            bad.append(seed)
            missed.append(f"random model {seed} ({what['kind']}, {what['islands']} islands): " + ", ".join(found))
    print(f"random models: {count - len(bad)} of {count} sound")
    return (
        f"{count} models, seeds {options.seed} to {options.seed + count - 1}: {have['sphere']} spheres,"
        f" {have['torus']} tori, {have['blob']} blobs of 1 to {models.MOST_HOLES} holes, {have['loops']} loops in all;"
        f" {have['of which touch']} holes that touch another at a vertex, {have['islands']} islands."
        f" {count - len(bad)} of {count} are sound after filling, of one part, and nothing has moved."
        f" {have['nets']} holes were closed by a fair net alone. Mean {np.mean(seconds):.2f} s."
        f" MeshLab's mesh is sound on {count - failed['meshlab']}, MeshFix's on {count - failed['meshfix']}."
    )


def against(target, v, f, parts=1):
    nv, nf = meshes.read_ply(target)
    found = checks.faults(nv, nf)
    _, gone = meshes.split((v, f), (nv, nf))
    if gone:
        found.append(f"{gone} triangles are not where they were")
    if parts and checks.components(nf) != parts:
        found.append(f"{checks.components(nf)} parts")
    return found


def peer_sound(name, folder, source):
    target = folder / f"random-{name}.ply"
    settings = {"edge": models.EDGE_MM, "selfintersection": True} if name == "meshlab" else {}
    if fillers.peer(name, source, target, **settings).code != 0:
        return False
    v, f = meshes.read_ply(target)
    used, _ = surfaces.compact(v, f)
    return len(used) == len(v) and not checks.faults(v, f) and checks.components(f) == 1


def recorded(options, folder, missed):
    """Meshes of a real object, as they come."""
    lines = [
        "| mesh | triangles | loops | left out before | new | not where they were | s | sound |"
        " MeshLab's | MeshFix's |",
        "| --- |" + " ---: |" * 6 + " --- | --- | --- |",
    ]
    there = 0
    for name in RECORDED:
        packed = options.data / f"stanford_bunny/{name}.ply.gz"
        if not packed.exists():
            continue
        there += 1
        source, target = folder / f"{name}.ply", folder / f"{name}-filled.ply"
        source.write_bytes(gzip.decompress(packed.read_bytes()))
        v, f = meshes.read_text_ply(source)
        run, told = fillers.ours(options.relief, source, target)
        if run.code != 0:
            missed.append(f"{name}: ended with {run.code}")
            continue
        nv, nf = meshes.read_ply(target)
        found = checks.faults(nv, nf)
        is_old, gone = meshes.split((v, f), (nv, nf))
        # Triangles that ran through each other as they came are not the filling's fault.
        crossing = checks.intersections(nv, nf)
        own = int(is_old[crossing].all(1).sum())
        if own == len(crossing):
            found = [fault for fault in found if "intersect" not in fault]
        mended = told["mended"]
        out = sum(mended[key] for key in LEFT_OUT)
        # What is told as left out is gone, and so is what was turned; nothing else.
        if gone > out + mended["turned_triangles"]:
            found.append(f"{gone} triangles are gone, {out} told as left out")
        # Some fill the place of one that was left out, just as it was.
        if (~is_old).sum() > told["new_triangles"] + mended["turned_triangles"]:
            found.append(f"{(~is_old).sum()} new triangles, {told['new_triangles']} told")
        if found:
            missed.append(f"{name}: " + ", ".join(found))
        cells = [name, len(f), len(told["loops"]), out, told["new_triangles"], gone, f"{run.seconds:.2f}"]
        remark = f"yes, but for {own} pairs of triangles that intersected as they came" if own else "yes"
        cells.append(", ".join(found) or remark)
        binary = folder / f"{name}-binary.ply"
        meshes.write_ply(binary, v, f)
        cells += [peer_faults(peer, folder, binary, v, f) for peer in ("meshlab", "meshfix")]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    if not there:
        return "No recorded meshes beside the repository."
    return "\n".join(lines)


# What the command says it leaves out of a mesh.
LEFT_OUT = ("degenerate_triangles", "slivers", "duplicate_triangles", "triangles_left_out", "triangles_cleared")


def peer_faults(name, folder, source, v, f):
    target = folder / f"recorded-{name}.ply"
    edge = float(np.linalg.norm(v[f[:, 0]] - v[f[:, 1]], axis=1).mean())
    settings = {"edge": edge, "selfintersection": True} if name == "meshlab" else {}
    run = fillers.peer(name, source, target, **settings)
    if run.code != 0:
        return "fails: " + (run.told.strip().splitlines() or ["killed"])[-1][-60:].replace("|", "/")
    return ", ".join(checks.faults(*surfaces.compact(*meshes.read_ply(target)))) or "sound"


def formats(options, folder, missed):
    """The same holes in every format, in and out: what was there is there bit for bit."""
    v, f, _ = models.random(options.seed)
    single = v.astype(np.float32).astype(float)
    writers = {
        "a.ply": (lambda p: meshes.write_ply(p, v, f), v),
        "single.ply": (lambda p: meshes.write_ply(p, v, f, "<f4"), single),
        "a.obj": (lambda p: meshes.write_obj(p, v, f), v),
        "a.stl": (lambda p: meshes.write_stl(p, v, f), single),
        "text.stl": (lambda p: meshes.write_stl(p, v, f, text=True), single),
    }
    readers = {".ply": meshes.read_ply, ".obj": meshes.read_obj, ".stl": meshes.read_stl}
    held, tried = 0, 0
    for name, (write, places) in writers.items():
        write(folder / name)
        for ending, read in readers.items():
            tried += 1
            target = folder / f"out{ending}"
            run, _ = fillers.ours(options.relief, folder / name, target)
            if run.code != 0:
                missed.append(f"{name} to {ending}: ended with {run.code}")
                continue
            nv, nf = read(target)
            if ending == ".stl":
                old = (places.astype(np.float32).astype(float), f)
            else:
                old = (places, f)
            found = checks.faults(nv, nf)
            _, gone = meshes.split(old, (nv, nf))
            if gone:
                found.append(f"{gone} triangles are not where they were")
            if found:
                missed.append(f"{name} to {ending}: " + ", ".join(found))
            held += not found
    return (
        f"PLY with 64 and 32 bits, OBJ, STL binary and text, each to PLY, OBJ and STL: {held} of {tried} sound, and"
        " what was there is there bit for bit (of 32 bits where the output is STL)."
    )

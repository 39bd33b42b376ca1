"""The judge itself, held against meshes whose faults are known."""

import types

import accuracy
import checks
import meshes
import numpy as np
import score
import surfaces


def expect(what, is_so):
    if not is_so:
        raise SystemExit(f"the judge is wrong about {what}")


def run():
    rng = np.random.default_rng(1)
    ball = surfaces.ALL["sphere"]
    v, f = ball.mesh(rng, None, 4.0)
    expect("a sound mesh", checks.faults(v, f) == [])
    says = lambda v, f, word: any(word in own for own in checks.faults(v, f))
    flipped = f.copy()
    flipped[7] = flipped[7][::-1]
    expect("a turned triangle", says(v, flipped, "turned"))
    expect("a mesh inside out", says(v, f[:, ::-1], "inside out"))
    expect("a hole", says(v, f[1:], "open"))
    expect("a hole where one loop should be", checks.faults(v, f[1:], 1) == [])
    expect("two loops where one should be", checks.faults(v, np.delete(f, [0, far(v, f)], 0), 1) != [])
    expect("a triangle twice", says(v, np.concatenate([f, f[:1]]), "twice"))
    expect("a vertex too many", says(np.concatenate([v, v[:1]]), f, "vertices that no triangle has"))
    expect("a triangle without area", says(np.where(np.arange(len(v))[:, None] == f[0, 0], v[f[0, 1]], v), f, "area"))
    spare = np.concatenate([v, v[:1]])
    expect("a vertex that may be too many", checks.faults(spare, f, spare=1) == [])
    # A vertex pushed out through the other side.
    through = v.copy()
    through[0] = -1.5 * v[0]
    expect("triangles that intersect", says(through, f, "intersect"))
    # A patch that lies folded on another.
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0.9, 0.1, 0]], float)
    expect("a fold", len(checks.intersections(square, np.array([[0, 1, 2], [0, 2, 3]]))) > 0)
    # Two bodies that are one at a vertex.
    other = -v + 2 * v[0]
    pair = np.concatenate([f, np.where(f == 0, 0, f + len(v))[:, ::-1]])
    both, index = surfaces.compact(np.concatenate([v, other]), pair)
    expect("bodies that meet in a vertex", says(both, index, "in nothing else"))
    fin = np.concatenate([f, [[f[0, 0], f[0, 1], len(v)]]])
    expect("a fin", says(np.concatenate([v, 1.1 * v[:1]]), fin, "more than two"))
    moved_vertices(v, f)
    distances(rng)
    print("the judge finds each planted fault")


def far(v, f):
    return int(np.argmin(v[f].mean(1) @ v[f[0]].mean(0)))


def moved_vertices(v, f):
    """One place moved by the last bit; corners in another order are none."""
    nudged = v.copy()
    nudged[3, 0] = np.nextafter(v[3, 0], np.inf)
    is_old, gone = meshes.split((v, f), (nudged, f))
    users = (f == 3).any(1)
    expect("a vertex moved by a bit", gone == users.sum() and (is_old == ~users).all())
    is_old, gone = meshes.split((v, f), (v[::-1], (len(v) - 1 - f)[:, [1, 2, 0]]))
    expect("the same mesh in another order", gone == 0 and is_old.all())
    is_old, gone = meshes.split((v, f), (v, f[:, ::-1]))
    expect("triangles turned around", gone == len(f) and not is_old.any())


def distances(rng):
    """Fillings whose distances and angles are known."""
    for name, surface in surfaces.ALL.items():
        hole = surface.hole(rng, 0.2, False)
        v, _ = surface.mesh(rng, hole, 1.5)
        away = np.where(rng.random(len(v)) < 0.5, 0.3, -0.3)
        d, n = surface.nearest(v)
        there = v + away[:, None] * n
        got, same = surface.nearest(there)
        expect(f"distances to the {name}", np.abs(d).max() < 1e-9 and np.abs(got - away).max() < 1e-9)
        expect(f"normals of the {name}", np.abs((n * same).sum(1) - 1).max() < 1e-12)
    ball = surfaces.ALL["sphere"]
    v, f = ball.mesh(rng, None, 2.0)
    near = (v[f] @ [0, 0, 1] > 48).all(1)
    flat = v.copy()
    own = np.setdiff1d(f[near], f[~near])
    flat[own] *= 0.999
    told = score.score(ball, flat, f, ~near)
    expect("a filling 0.05 mm deep", abs(told.vertex_rms - 0.05) < 1e-9 and told.vertices == len(own))
    expect("a lean at the border", told.border > told.border_old + 0.5 and told.bend > told.bend_old)
    expect("edges", 0.8 < told.edge < 1.2)
    expect("a hole left", score.score(ball, v, f, np.ones(len(f), bool)) is None)
    # Bars are bars.
    case = types.SimpleNamespace(noise=False, name="sphere", across=20.0)
    good = score.score(ball, v, f, ~near)
    expect("a filling that holds", accuracy.bars(case, good) == [])
    expect("a bar of distance", any("% off" in own for own in accuracy.bars(case, told)))
    expect("a bar of angle", any("border" in own for own in accuracy.bars(case, score_of(good, border=3.1))))
    noisy = types.SimpleNamespace(noise=True, name="sphere", across=20.0)
    expect("a bar of noise", any("noise" in own for own in accuracy.bars(noisy, score_of(good, rms=0.051))))


def score_of(own, **changed):
    import dataclasses

    return dataclasses.replace(own, **changed)

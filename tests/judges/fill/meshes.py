"""Triangle meshes in files, and which of their triangles were there before."""

import pathlib

import numpy as np

FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_ply(path, v, f, kind="<f8"):
    name = {"<f8": "double", "<f4": "float"}[kind]
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(v)}\n"
        + "".join(f"property {name} {axis}\n" for axis in "xyz")
        + f"element face {len(f)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(f), FACE)
    faces["count"], faces["corners"] = 3, f
    pathlib.Path(path).write_bytes(head.encode() + v.astype(kind).tobytes() + faces.tobytes())


def read_ply(path):
    """Vertices and triangles of a binary PLY of triangles, as they are in the file."""
    data = pathlib.Path(path).read_bytes()
    head, rest = data.split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    if "format binary_little_endian 1.0" not in lines:
        raise ValueError(f"{path}: not binary")
    wide = any(line == "property double x" for line in lines)
    places = [line.split()[2] for line in lines if line.startswith("property") and "list" not in line]
    if places != ["x", "y", "z"]:
        raise ValueError(f"{path}: vertices of {places}")
    n = counts["vertex"]
    v = np.frombuffer(rest, "<f8" if wide else "<f4", 3 * n).reshape(n, 3).astype(float)
    faces = np.frombuffer(rest, FACE, counts["face"], 3 * n * (8 if wide else 4))
    if not (faces["count"] == 3).all():
        raise ValueError(f"{path}: faces that are no triangles")
    return v, faces["corners"].astype(np.int64)


def read_text_ply(path):
    """Vertices (as 32 bits hold them) and triangles of a text PLY whose vertices begin with x, y, z."""
    head, rest = pathlib.Path(path).read_text().split("end_header\n", 1)
    counts = [int(line.split()[2]) for line in head.splitlines() if line.startswith("element")]
    lines = rest.splitlines()
    v = np.array([line.split()[:3] for line in lines[: counts[0]]], float)
    f = np.array([line.split()[1:4] for line in lines[counts[0] : sum(counts)]], np.int64)
    return v.astype(np.float32).astype(float), f


def write_obj(path, v, f):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in v.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in f.tolist()]
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def read_obj(path):
    v, f = [], []
    for line in pathlib.Path(path).read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            v.append(words[1:4])
        elif words[:1] == ["f"]:
            f.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    return np.array(v, float), np.array(f, np.int64)


STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])


def write_stl(path, v, f, text=False):
    corners = v.astype(np.float32)[f]
    if text:
        lines = ["solid hole"]
        for t in corners.tolist():
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(repr(np.float32(c).item()) for c in p) for p in t]
            lines += ["endloop", "endfacet"]
        pathlib.Path(path).write_text("\n".join([*lines, "endsolid hole"]) + "\n")
        return
    rows = np.zeros(len(f), STL)
    rows["corners"] = corners
    pathlib.Path(path).write_bytes(bytes(80) + np.uint32(len(f)).tobytes() + rows.tobytes())


def read_stl(path):
    """Vertices at one place are one vertex."""
    data = pathlib.Path(path).read_bytes()
    rows = np.frombuffer(data, STL, int.from_bytes(data[80:84], "little"), 84)
    v, f = np.unique(rows["corners"].reshape(-1, 3).astype(float), axis=0, return_inverse=True)
    return v, f.reshape(-1, 3)


def turned(v, f):
    """Numbers of the places of each triangle's corners, the lowest first; its sense stays."""
    _, place = np.unique(np.ascontiguousarray(v).view("V24").ravel(), return_inverse=True)
    corners = place[f]
    first = corners.argmin(1)[:, None]
    return np.take_along_axis(corners, (first + np.arange(3)) % 3, 1)


def split(old, new):
    """Which triangles of `new` are in `old` bit for bit, and how many of `old` are not in `new`.

    Both meshes are pairs of vertices and triangles.
    """
    (ov, of), (nv, nf) = old, new
    # Minus zero is zero.
    both = turned(np.concatenate([ov, nv]) + 0.0, np.concatenate([of, nf + len(ov)]))
    _, number = np.unique(both, axis=0, return_inverse=True)
    number = number.ravel()
    a, b = number[: len(of)], number[len(of) :]
    return np.isin(b, a), int((~np.isin(a, b)).sum())


def split_near(old, new, tolerance):
    """The same for programs that round: places within a tolerance are one."""
    from scipy.spatial import cKDTree

    (ov, of), (nv, nf) = old, new
    away, at = cKDTree(ov).query(nv)
    snapped = np.where((away <= tolerance)[:, None], ov[at], nv)
    return split(old, (snapped, nf))

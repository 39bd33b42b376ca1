"""Planes by Open3D's planar patches on the nodes of range images.

open3d_planar_patches.py NEIGHBOURS NORMAL_VARIANCE_DEG COPLANARITY_DEG WITHIN_MM (IMAGE LABELS)...

Patches are oriented boxes. A node belongs to the patch whose plane is nearest, if it lies
within its box, not farther than WITHIN_MM from the plane (with 0: half the box's thickness).
"""

import sys
import time

import numpy as np
import open3d as o3d


def labels_of(points, neighbours, variance_deg, coplanarity_deg, within_mm):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(neighbours))
    cloud.orient_normals_to_align_with_direction([0.0, 0.0, 1.0])
    boxes = cloud.detect_planar_patches(
        normal_variance_threshold_deg=variance_deg,
        coplanarity_deg=coplanarity_deg,
        outlier_ratio=0.75,
        min_plane_edge_length=0.0,
        min_num_points=0,
        search_param=o3d.geometry.KDTreeSearchParamKNN(neighbours),
    )
    normals = np.asarray(cloud.normals)
    best = np.full(len(points), np.inf)
    labels = np.zeros(len(points), dtype=np.uint16)
    for number, box in enumerate(boxes, start=1):
        local = (points - box.center) @ box.R
        half = np.asarray(box.extent) / 2
        across = np.abs(local[:, 2])
        limit = within_mm if within_mm > 0 else half[2]
        inside = (
            (np.abs(local[:, 0]) <= half[0])
            & (np.abs(local[:, 1]) <= half[1])
            & (across <= limit)
            & (np.abs(normals @ box.R[:, 2]) >= 0.5)
            & (across < best)
        )
        best[inside] = across[inside]
        labels[inside] = number
    return labels


def main():
    neighbours, variance, coplanarity, within = sys.argv[1:5]
    files = sys.argv[5:]
    for source, target in zip(files[::2], files[1::2]):
        raw = np.fromfile(source, dtype=np.int64, count=2)
        xyz = np.fromfile(source, dtype=np.float64, offset=16).reshape(-1, 3)
        if len(xyz) != raw[0] * raw[1]:
            sys.exit(f"{source} is damaged")
        valued = ~np.isnan(xyz[:, 2])
        labels = np.zeros(len(xyz), dtype=np.uint16)
        started = time.perf_counter()
        labels[valued] = labels_of(
            xyz[valued], int(neighbours), float(variance), float(coplanarity), float(within)
        )
        taken = time.perf_counter() - started
        labels.tofile(target)
        print(source, f"{taken:.6f}", flush=True)


main()

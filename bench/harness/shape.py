"""Measures cells: how near to equilateral they are, and their least angle. Independent of atomesh.

usage: shape.py MESH 2|3

MESH.points (f64) and MESH.cells (u32) as the drivers write them, or MESH with an ending that meshio reads.
Quality q = D r_in / R_circ, 1 where equilateral; angles between facets, in degrees: interior angles of
triangles, dihedral angles of tetrahedra. Prints JSON. Runs where NumPy and meshio are.
"""

import json
import sys

import numpy as np

BLOCK = 1 << 18  # cells at a time, so that ten million need no gigabytes


def read(path, dimension):
    if "." in path.rsplit("/", 1)[-1]:
        import meshio

        mesh = meshio.read(path)
        kind = "triangle" if dimension == 2 else "tetra"
        return mesh.points[:, :dimension], mesh.cells_dict[kind]
    points = np.fromfile(path + ".points", "<f8").reshape(-1, dimension)
    return points, np.fromfile(path + ".cells", "<u4").reshape(-1, dimension + 1)


def measure(corners):
    """Signed measure, q, least angle and mean edge of cells given as (n, D + 1, D)."""
    dimension = corners.shape[2]
    edges = corners[:, 1:] - corners[:, :1]
    across = perpendicular(edges)
    determinant = dot(edges[:, 0], across[:, 0])
    with np.errstate(all="ignore"):
        # gradients of barycentric coordinates: inward normals over heights
        gradients = across / determinant[:, None, None]
        gradients = np.concatenate([-gradients.sum(1, keepdims=True), gradients], 1)
        length = np.sqrt(dot(gradients, gradients))
        centre = 0.5 * np.einsum("nk,nkd->nd", dot(edges, edges), gradients[:, 1:])
        quality = dimension / (length.sum(1) * np.sqrt(dot(centre, centre)))
        normals = gradients / length[..., None]
        pairs = [(i, j) for i in range(dimension + 1) for j in range(i)]
        cosine = np.max([-dot(normals[:, i], normals[:, j]) for i, j in pairs], 0)
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    edge = sum(np.sqrt(((corners[:, i] - corners[:, j]) ** 2).sum(1)) for i, j in pairs) / len(pairs)
    return determinant / (2 if dimension == 2 else 6), np.nan_to_num(quality), np.nan_to_num(angle), edge


def perpendicular(edges):
    """For each edge a vector across the others: rows of the adjugate."""
    if edges.shape[2] == 2:
        a, b = edges[:, 0], edges[:, 1]
        return np.stack([np.stack([b[:, 1], -b[:, 0]], 1), np.stack([-a[:, 1], a[:, 0]], 1)], 1)
    return np.stack([np.cross(edges[:, (k + 1) % 3], edges[:, (k + 2) % 3]) for k in range(3)], 1)


def dot(a, b):
    return np.einsum("...d,...d->...", a, b)


def shape(points, cells):
    parts = [measure(points[cells[i : i + BLOCK]]) for i in range(0, len(cells), BLOCK)]
    size, quality, angle, edge = (np.concatenate(part) for part in zip(*parts))
    flat = np.abs(size) <= 1e-9 * np.median(np.abs(size))
    quality[flat], angle[flat] = 0, 0
    return {"points": len(np.unique(cells)), "cells": len(cells), "flat": int(flat.sum()),
            "volume": float(np.abs(size).sum()), "q_mean": float(quality.mean()),
            "q_p1": float(np.percentile(quality, 1)), "q_min": float(quality.min()),
            "angle_min": float(angle.min()), "edge_mean": float(edge.mean())}


if __name__ == "__main__":
    print(json.dumps(shape(*read(sys.argv[1], int(sys.argv[2])))))

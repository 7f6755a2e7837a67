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
    size = np.linalg.det(edges) / (2 if dimension == 2 else 6)
    with np.errstate(all="ignore"):
        # rows of the inverse's transpose are gradients of barycentric coordinates: inward normals / heights
        flat = size == 0
        edges = np.where(flat[:, None, None], np.eye(dimension), edges)
        gradients = np.linalg.inv(edges).transpose(0, 2, 1)
        gradients = np.concatenate([-gradients.sum(1, keepdims=True), gradients], 1)
        length = np.linalg.norm(gradients, axis=2)
        inradius = 1 / length.sum(1)
        centre = 0.5 * np.einsum("nk,nkd->nd", (edges**2).sum(2), gradients[:, 1:])
        quality = dimension * inradius / np.linalg.norm(centre, axis=1)
        normals = gradients / length[..., None]
    pairs = [(i, j) for i in range(dimension + 1) for j in range(i)]
    cosines = np.max([-np.einsum("nd,nd->n", normals[:, i], normals[:, j]) for i, j in pairs], 0)
    angle = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    edge = np.mean([np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i, j in pairs], 0)
    return size, np.where(flat, 0, np.nan_to_num(quality)), np.where(flat, 0, np.nan_to_num(angle)), edge


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

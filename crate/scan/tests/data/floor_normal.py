"""The floor's normal in a ground truth mesh, for tests/real_scans.rs: the largest plane by RANSAC, then least squares.

    python floor_normal.py ../shared/scans/hololens/gt.ply 0 1 0
    python floor_normal.py ../shared/scans/livingroom/gt.ply 0 -1 0

The last three numbers are a rough up direction. Needs NumPy.
"""

import sys

import numpy as np

TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}


def vertices(path):
    """Vertex positions of a little-endian binary PLY."""
    with open(path, "rb") as file:
        fields, count, element = [], 0, None
        while (line := file.readline().decode().split()) != ["end_header"]:
            if line[0] == "element":
                element = line[1]
                count = int(line[2]) if element == "vertex" else count
            elif line[0] == "property" and element == "vertex":
                fields.append((line[2], TYPES[line[1]]))
        data = np.frombuffer(file.read(np.dtype(fields).itemsize * count), dtype=fields)
    return np.stack([data["x"], data["y"], data["z"]], axis=1).astype(float)


def floor_normal(points, up, random):
    best, most = None, 0
    for _ in range(3000):
        a, b, c = points[random.integers(len(points), size=3)]
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal)
        if length < 1e-3 or abs(normal @ up) < 0.7 * length:
            continue
        normal /= length
        near = np.sum(np.abs(points[::7] @ normal - normal @ a) < 0.02)
        if near > most:
            best, most = (normal, normal @ a), near
    normal, height = best
    for _ in range(10):
        near = points[np.abs(points @ normal - height) < 0.03]
        centre = near.mean(axis=0)
        normal = np.linalg.eigh((near - centre).T @ (near - centre))[1][:, 0]
        normal *= np.sign(normal @ up)
        height = normal @ centre
    return normal


if __name__ == "__main__":
    up = np.array([float(value) for value in sys.argv[2:5]])
    print(floor_normal(vertices(sys.argv[1]), up, np.random.default_rng(0)))

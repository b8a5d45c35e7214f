"""Golden numbers for marching cubes: small scalar fields and what scikit-image makes of them.

Writes ../golden/marching_cubes.json. Only facts that every correct marching cubes shares are stored. Triangle lists are
not: how a polygon is cut into triangles is a free choice.

Fields. `values` are integers in C order (index = (x * ny + y) * nz + z); the field is value / `values_per_unit`, exact
in f32. Grid spacing 1, first sample at (0, 0, 0), level 0, negative inside, no sample is exactly 0.

Facts. `vertices`: where the surface crosses the grid edges, deduplicated and sorted, rounded to 1e-5. `area`: surface
area; `volume`: what the surface encloses, positive when triangles wind counter-clockwise seen from the positive side
(null where the surface is open); both move a little with how polygons are cut, and `area_by_lewiner` and
`volume_by_lewiner` tell by how much. `euler`: V - E + F. `open_edges`: edges with one triangle. `ambiguous_faces`: grid
faces whose diagonal corners agree; where there are any, two right answers differ in `euler` and `open_edges`, and
`lorensen`'s own table may even leave holes there.
"""

import json
import pathlib

import numpy as np
from scipy import ndimage
from skimage.measure import marching_cubes

VALUES_PER_UNIT = 1024


def grid(dims):
    return np.meshgrid(*[np.arange(n, dtype=np.float64) for n in dims], indexing="ij")


def sphere(dims, centre, radius):
    x, y, z = grid(dims)
    return np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2) - radius


def torus(dims, centre, major, minor):
    x, y, z = grid(dims)
    ring = np.hypot(x - centre[0], y - centre[1]) - major
    return np.hypot(ring, z - centre[2]) - minor


def gyroid(dims, period):
    x, y, z = (2 * np.pi / period * axis for axis in grid(dims))
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x) + 0.13


def smooth_noise(dims, sigma, seed):
    noise = np.random.default_rng(seed).standard_normal(dims)
    noise = ndimage.gaussian_filter(noise, sigma, mode="nearest")
    return noise / noise.std()


def closed(field):
    """Puts the outside all around, so that the surface has no border."""
    return np.pad(field[1:-1, 1:-1, 1:-1], 1, constant_values=0.5)


def fields():
    pair = (17, 13, 11)
    touching = np.minimum(sphere(pair, (4.9, 6.1, 5.2), 3.6), sphere(pair, (11.1, 6.1, 5.2), 3.1))
    return {
        "sphere": sphere(pair, (8.2, 6.3, 5.1), 4.3),
        "two_touching_spheres": touching,
        "torus": torus((16, 16, 9), (7.6, 7.4, 4.1), 4.6, 1.9),
        "gyroid": gyroid((14, 13, 11), 9.7),
        "closed_smooth_noise": closed(smooth_noise((13, 11, 12), 1.6, seed=5)),
        "rough_noise": smooth_noise((9, 8, 7), 0.6, seed=6),
    }


def quantise(field):
    values = np.rint(field * VALUES_PER_UNIT).astype(int)
    values[values == 0] = 1
    return values


def ambiguous_faces(values):
    inside, count = values < 0, 0
    for axis in range(3):
        plane = np.moveaxis(inside, axis, 0)
        a, b, c, d = plane[:, :-1, :-1], plane[:, 1:, :-1], plane[:, :-1, 1:], plane[:, 1:, 1:]
        count += int(((a == d) & (b == c) & (a != b)).sum())
    return count


def crossings(values):
    """Every sign change along a grid edge, by linear interpolation: a check of scikit-image, not of us."""
    points, field = [], values / VALUES_PER_UNIT
    for axis in range(3):
        low = np.moveaxis(field, axis, 0)[:-1]
        high = np.moveaxis(field, axis, 0)[1:]
        at = np.argwhere((low < 0) != (high < 0))
        low, high = low[tuple(at.T)], high[tuple(at.T)]
        offset = low / (low - high)
        at = np.insert(at[:, 1:].astype(float), axis, at[:, 0] + offset, axis=1)
        points.append(at)
    return np.concatenate(points)


def unique_rows(points):
    return np.unique(np.round(points, 5) + 0.0, axis=0)


def surface(values, method):
    field = (values / VALUES_PER_UNIT).astype(np.float32)
    vertices, faces, _, _ = marching_cubes(
        field, level=0.0, method=method, gradient_direction="descent", allow_degenerate=False
    )
    return vertices.astype(np.float64), faces


def facts(vertices, faces):
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    open_edges = int((uses == 1).sum())
    return {
        "area": float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2),
        "volume": float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6) if open_edges == 0 else None,
        "euler": len(np.unique(faces)) - len(edges) + len(faces),
        "open_edges": open_edges,
    }


def main():
    cases = []
    for name, field in fields().items():
        values = quantise(field)
        vertices, faces = surface(values, "lorensen")
        lewiner = facts(*surface(values, "lewiner"))
        unique = unique_rows(crossings(values))
        seen = unique_rows(vertices)
        assert len(seen) == len(unique) and np.abs(seen - unique).max() < 3e-5, name
        case = {"name": name, "dims": list(values.shape), "values": values.ravel().tolist()}
        case |= facts(vertices, faces)
        case |= {"area_by_lewiner": lewiner["area"], "volume_by_lewiner": lewiner["volume"]}
        case |= {"ambiguous_faces": ambiguous_faces(values), "vertices": unique.tolist()}
        cases.append(case)
        print({key: value for key, value in case.items() if key not in ("values", "vertices")}, len(unique))
    for case in cases:
        case["vertices"] = [[int(v) if v == int(v) else v for v in row] for row in case["vertices"]]
    path = pathlib.Path(__file__).parent.parent / "golden" / "marching_cubes.json"
    text = json.dumps({"values_per_unit": VALUES_PER_UNIT, "fields": cases}, separators=(",", ":"))
    path.write_text(text + "\n")


if __name__ == "__main__":
    main()

"""Golden numbers for sampling, rendering, metrics and protocols, from NumPy and SciPy alone.

Writes ../golden/metrics.json: two small made-up meshes, two views of them, and what the evaluation makes of these. The
sampling is the documented algorithm (SplitMix64, running areas), written here a second time and vectorised, so that
figures of sampled surfaces can be compared to all digits. Depth is by ray casting, not by rasterising.
"""

import json
import pathlib
import statistics

import numpy as np
from scipy.spatial import cKDTree

THRESHOLD_M = 0.05

# ---- meshes and views ----


def relief(side=9, spacing=0.12):
    """A wavy square of about one metre, front up."""
    i, j = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    x, y = i * spacing - 0.5, j * spacing - 0.45
    z = 0.08 * np.sin(5 * x) * np.cos(4 * y) + 0.02 * (i % 2)
    positions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    lower = np.stack([corner, corner + side, corner + side + 1], axis=1)
    upper = np.stack([corner, corner + side + 1, corner + 1], axis=1)
    return positions, np.concatenate([lower, upper])


def damaged(positions, triangles, seed):
    """A worse copy: noise, a hole, and an island that is not there."""
    rng = np.random.default_rng(seed)
    positions = positions + rng.normal(0, 0.03, positions.shape)
    triangles = triangles[np.arange(len(triangles)) % 11 != 0]
    island = np.array([[1.7, 1.6, 0.1], [2.0, 1.6, 0.1], [1.7, 1.9, 0.3]])
    triangles = np.concatenate([triangles, [[len(positions) + k for k in range(3)]]])
    return np.concatenate([positions, island]), triangles


def stored(positions, triangles):
    return np.round(positions, 4).astype(np.float32).astype(np.float64), triangles


def view(eye, target, focal):
    """World to camera, 3x4: x right, y down, z forward, world Z up."""
    eye, forward = np.array(eye), np.array(target) - np.array(eye)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    pose = np.round(np.column_stack([rotation, -rotation @ eye]), 6)
    camera = {"width": 28, "height": 21, "fx": focal, "fy": focal, "cx": 13.5, "cy": 10.0}
    return {"camera": camera, "camera_from_world": pose.tolist()}


# ---- what is measured ----


def uniforms(seed, count):
    """SplitMix64, top 53 bits. Its state is a plain counter, so all numbers come at once."""
    with np.errstate(over="ignore"):
        z = np.uint64(seed) + np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return ((z ^ (z >> np.uint64(31))) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def sample(mesh, count, seed):
    positions, triangles = mesh
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    running = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)
    u, v, w = uniforms(seed, 3 * count).reshape(-1, 3).T
    chosen = np.searchsorted(running, u * running[-1], side="right")
    root = np.sqrt(v)[:, None]
    w = w[:, None]
    return a[chosen] * (1 - root) + b[chosen] * root * (1 - w) + c[chosen] * root * w


def one_way(points, to, clip):
    distance = cKDTree(to).query(points)[0]
    return np.minimum(distance, clip).mean(), (distance <= THRESHOLD_M).mean()


def compare(pred, gt, clip=np.inf, pred_for_recall=None):
    accuracy, precision = one_way(pred, gt, clip)
    completeness, recall = one_way(gt, pred if pred_for_recall is None else pred_for_recall, clip)
    return {
        "accuracy_m": accuracy,
        "completeness_m": completeness,
        "chamfer_m": (accuracy + completeness) / 2,
        "precision": precision,
        "recall": recall,
        "f_score": 2 * precision * recall / (precision + recall),
        "predicted_points": len(pred),
        "ground_truth_points": len(gt),
    }


def downsample(points, voxel):
    cube = np.floor((points - (points.min(axis=0) - voxel / 2)) / voxel).astype(int)
    _, group = np.unique(cube, axis=0, return_inverse=True)
    group = group.reshape(-1)
    count = np.bincount(group)
    return np.stack([np.bincount(group, points[:, k]) / count for k in range(3)], axis=1)


def cast(mesh, view, cull):
    """z-depth by intersecting every pixel's ray with every triangle."""
    pose, k = np.array(view["camera_from_world"]), view["camera"]
    points = mesh[0] @ pose[:, :3].T + pose[:, 3]
    a, b, c = (points[mesh[1][:, i]] for i in range(3))
    v, u = np.mgrid[0 : k["height"], 0 : k["width"]]
    rays = np.stack([(u - k["cx"]) / k["fx"], (v - k["cy"]) / k["fy"], np.ones(u.shape)], axis=-1)
    rays = rays.reshape(-1, 1, 3)
    e1, e2 = b - a, c - a
    p = np.cross(rays, e2)
    det = (e1 * p).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = -(a * p).sum(-1) / det
        q = np.cross(-a, e1)
        t = (rays * q).sum(-1) / det
        z = (e2 * q).sum(-1) / det
    hit = (s >= 0) & (t >= 0) & (s + t <= 1) & (z > 0.05)
    if cull:
        hit &= (np.cross(e1, e2) * rays).sum(-1) < 0
    z = np.where(hit, z, np.inf).min(axis=1)
    return np.where(np.isfinite(z), z, 0).reshape(u.shape)


def visibility(views, depths, low, high, voxel, behind):
    """Observed lattice points of a box, and the trilinear test at any point."""
    low, high = np.array(low), np.array(high)
    size = np.ceil((high - low) / voxel).astype(int) + 1
    lattice = low + voxel * np.stack(np.meshgrid(*[np.arange(n) for n in size], indexing="ij"), axis=-1)
    observed = np.zeros(size, bool)
    for view, depth in zip(views, depths):
        pose, k = np.array(view["camera_from_world"]), view["camera"]
        p = lattice @ pose[:, :3].T + pose[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.round(k["fx"] * p[..., 0] / p[..., 2] + k["cx"])
            v = np.round(k["fy"] * p[..., 1] / p[..., 2] + k["cy"])
        inside = (p[..., 2] > 0) & (u >= 0) & (v >= 0) & (u < k["width"]) & (v < k["height"])
        measured = depth[np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)]
        observed |= inside & (measured > 0) & (p[..., 2] <= measured + behind)

    def visible(points):
        at = (points - low) / voxel
        ok = ((at >= 0) & (at <= size - 1)).all(axis=1)
        at = np.where(ok[:, None], at, 0)
        cell = np.minimum(np.floor(at), size - 2).astype(int)
        part, total = at - cell, np.zeros(len(points))
        for step in np.ndindex(2, 2, 2):
            weight = np.where(np.array(step) == 1, part, 1 - part).prod(axis=1)
            total += weight * observed[tuple((cell + step).T)]
        return ok & (total >= 1 - 1e-5)

    return observed, visible


def depth_figures(pred, gt):
    pred, gt = np.array(pred), np.array(gt)
    valid = (pred > 0) & (gt > 0) & (gt < 10)
    p, g = pred[valid], gt[valid]
    if not valid.any():
        return {name: None for name in DEPTH_NAMES} | {"completeness": (pred > 0).mean()}
    ratio = np.maximum(p / g, g / p)
    figures = [
        np.mean(np.abs(p - g) / g),
        np.mean(np.abs(p - g)),
        np.mean((p - g) ** 2 / g),
        np.sqrt(np.mean((p - g) ** 2)),
        np.sqrt(np.mean((np.log(p) - np.log(g)) ** 2)),
        *[np.mean(ratio < 1.25**k) for k in (1, 2, 3)],
        (pred > 0).mean(),
    ]
    return dict(zip(DEPTH_NAMES, figures))


DEPTH_NAMES = "abs_rel abs_diff sq_rel rmse log_rmse delta_1 delta_2 delta_3 completeness".split()

# Precision, recall and F-score at 60, 80 and 100 views, as the paper's Table 5 prints them.
TABLE_5 = {
    "VoRTX": [[0.752, 0.763, 0.767], [0.631, 0.639, 0.651], [0.685, 0.694, 0.703]],
    "IOAR": [[0.782, 0.791, 0.794], [0.641, 0.649, 0.657], [0.704, 0.712, 0.719]],
    "SDFUtrans": [[0.758, 0.761, 0.767], [0.656, 0.659, 0.671], [0.703, 0.706, 0.714]],
    "IPDRecon": [[0.795, 0.797, 0.797], [0.659, 0.662, 0.660], [0.719, 0.723, 0.722]],
}


def robustness(rows):
    precision, recall, f = rows
    index = 1.0
    for row in rows:
        index *= 1 - (max(row) - min(row)) / max(row)
    return {
        "precision": precision,
        "recall": recall,
        "f_score": f,
        "cv_sample": statistics.stdev(f) / statistics.mean(f),
        "cv_population": statistics.pstdev(f) / statistics.mean(f),
        "retention_f": f[0] / f[2],
        "mean_retention": statistics.mean(row[0] / row[2] for row in rows),
        "max_drop": (f[2] - f[0]) / f[2],
        "stability_index": index,
    }


def main():
    gt = stored(*relief())
    pred = stored(*damaged(*gt, seed=3))
    views = [view((1.1, 0.9, 1.0), (0.0, 0.0, 0.0), 24.0), view((-0.3, -0.2, 0.9), (0.1, 0.05, 0.0), 20.0)]
    depths = [np.round(cast(gt, v, cull=True), 4) for v in views]
    box = {"min": [-0.6, -0.6, -0.3], "max": [0.62, 0.53, 0.43], "voxel_m": 0.05, "behind_m": 0.06}
    observed, visible = visibility(views, depths, box["min"], box["max"], box["voxel_m"], box["behind_m"])
    probes = np.round(np.random.default_rng(8).uniform([-0.7, -0.7, -0.4], [0.7, 0.6, 0.5], (120, 3)), 3)

    seed = 7
    drawn = sample(pred, 200_000, seed)
    seen = drawn[visible(drawn)]
    few = [sample(pred, 2000, seed), sample(gt, 2000, seed + 1)]
    rng = np.random.default_rng(9)
    truth = np.round(rng.uniform(0.5, 11, 60) * (rng.random(60) > 0.15), 3)
    maps = [
        (np.round(truth * rng.uniform(0.5, 1.7, 60) * (rng.random(60) > 0.2), 3).tolist(), truth.tolist()),
        ((truth * 1.1).round(3).tolist(), truth.tolist()),
        (truth.tolist(), [0.0] * 60),
    ]
    frames = [depth_figures(*pair) for pair in maps]
    mean = {n: np.nanmean(np.array([f[n] for f in frames], dtype=float)) for n in DEPTH_NAMES}

    golden = {
        "gt": {"positions": gt[0].round(4).tolist(), "triangles": gt[1].tolist()},
        "pred": {"positions": pred[0].round(4).tolist(), "triangles": pred[1].tolist()},
        "seed": seed,
        "uniforms": uniforms(seed, 4).tolist(),
        "samples": few[0][:5].tolist(),
        "vertices_clipped": compare(pred[0], gt[0], 1.0),
        "plain_2000": compare(*few),
        "transformer_fusion": compare(drawn, gt[0], 1.0),
        "transformer_fusion_visible": compare(seen, gt[0], 1.0, pred_for_recall=drawn),
        "vortx": compare(downsample(few[0], 0.02), downsample(few[1], 0.02)),
        "views": [v | {"depth_m": d.ravel().tolist()} for v, d in zip(views, depths)],
        "pred_depth_both_sides_m": cast(pred, views[0], cull=False).round(4).ravel().tolist(),
        "visibility": box
        | {
            "observed_points": int(observed.sum()),
            "probes": probes.tolist(),
            "visible": visible(probes).astype(int).tolist(),
        },
        "depth_maps": [{"pred": p, "gt": g, "expected": f} for (p, g), f in zip(maps, frames)],
        "depth_mean": mean,
        "robustness": {name: robustness(rows) for name, rows in TABLE_5.items()},
    }
    path = pathlib.Path(__file__).parent.parent / "golden" / "metrics.json"
    path.write_text(json.dumps(golden, separators=(",", ":")) + "\n")
    for name in ("plain_2000", "transformer_fusion", "transformer_fusion_visible", "vortx"):
        print(name, {key: round(float(value), 5) for key, value in golden[name].items()})
    print("observed", observed.sum(), "of", observed.size, "probes visible", visible(probes).sum(), "of", len(probes))
    for name, row in golden["robustness"].items():
        print(name, {k: round(100 * v, 3) for k, v in row.items() if isinstance(v, float)})


if __name__ == "__main__":
    main()

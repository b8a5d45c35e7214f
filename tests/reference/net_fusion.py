"""Planes to voxels a second time, densely and from the definition, in float64: writes ../golden/net_fusion.json.

As VoRTX writes it: every view of a voxel is a token, an attention mask forbids views that do not see the voxel (the
diagonal stays allowed, so that a row has something), and views that do not see it get -9e3 before the softmax of the
pooling. Gradients are central differences of a weighted sum of what comes out.
"""

import json
import pathlib

import numpy as np

from made_numbers import numbers, weight

WIDTH, HEIGHT, FOCAL, CX, CY = 160, 120, 140.0, 79.5, 59.5
STRIDE, PLANE_W, PLANE_H = 8, 20, 15
VOXEL_M, CHANNELS, VIEWS, HEADS, GROUPS = 0.3, 16, 6, 2, 8
NEAR_M = 0.24
LENGTHS = [3, 0, 1, 7, 2, 12, 0, 5, 1, 4]


def unit(vector):
    return vector / np.linalg.norm(vector)


def views(count):
    """World-to-camera rotation and translation of each view."""
    found = []
    for i in range(count):
        angle = i * 1.3
        position = np.array([2 * np.cos(angle) + 0.3, 2 * np.sin(angle) + 0.3, 1 + 0.1 * i])
        away = -1.0 if i + 1 == count else 1.0
        forward = unit(away * (np.array([0.3 * i, 0.2, 0.4]) - position))
        right = unit(np.cross(forward, [0, 0, 1]))
        rotation = np.stack([right, np.cross(forward, right), forward])
        found.append((rotation, -rotation @ position))
    return found


def sites():
    """A box, and one voxel that nobody sees."""
    box = [[i % 6, i // 6 % 6, i // 36] for i in range(216)]
    return np.array(box[:100] + [[0, 0, 1000]] + box[100:], dtype=np.float64)


def project():
    """u, v, z [N, V] in the plane and what is visible."""
    world = sites() * VOXEL_M + np.array([-0.4, -0.2, 0.1])
    u, v, z = [], [], []
    for rotation, translation in views(VIEWS):
        x = world @ rotation.T + translation
        z.append(x[:, 2])
        u.append((FOCAL * x[:, 0] / x[:, 2] + CX) / STRIDE)
        v.append((FOCAL * x[:, 1] / x[:, 2] + CY) / STRIDE)
    u, v, z = (np.stack(a, 1) for a in (u, v, z))
    seen = (u >= 0) & (u <= PLANE_W - 1) & (v >= 0) & (v <= PLANE_H - 1) & (z > 0)
    return u, v, z, seen


def bilinear(plane, u, v):
    """Of a plane [C, h, w] at points of it: [.., C]."""
    height, width = plane.shape[1:]
    x, y = (np.minimum(np.floor(p).astype(int), size - 2) for p, size in ((u, width), (v, height)))
    fx, fy = (u - x)[:, None], (v - y)[:, None]
    at = lambda dx, dy: plane[:, y + dy, x + dx].T
    top = (1 - fx) * at(0, 0) + fx * at(1, 0)
    return (1 - fy) * top + fy * ((1 - fx) * at(0, 1) + fx * at(1, 1))


def sampled(planes, u, v, seen):
    """[N, V, C]; zeros where not seen."""
    out = np.zeros((*u.shape, planes.shape[1]))
    for i in range(planes.shape[0]):
        out[seen[:, i], i] = bilinear(planes[i], u[seen[:, i], i], v[seen[:, i], i])
    return out


def softmax(x, axis):
    e = np.exp(x - x.max(axis, keepdims=True))
    return e / e.sum(axis, keepdims=True)


def attend(q, k, v, seen, heads):
    """[N, V, d] each; seen [N, V]."""
    n, views_, d = q.shape
    q, k, v = (t.reshape(n, views_, heads, d // heads).transpose(0, 2, 1, 3) for t in (q, k, v))
    allowed = seen[:, None, :] | np.eye(views_, dtype=bool)[None]
    score = q @ k.transpose(0, 1, 3, 2) / np.sqrt(d // heads)
    p = softmax(np.where(allowed[:, None], score, -np.inf), -1)
    return (p @ v).transpose(0, 2, 1, 3).reshape(n, views_, d)


def pooled(tokens, logits, seen, mean):
    """[N, C] from [N, V, C] and [N, V]."""
    if mean:
        w = seen / np.maximum(seen.sum(1, keepdims=True), 1)
    else:
        null = np.zeros((len(logits), 1))
        w = softmax(np.concatenate([np.where(seen, logits, -9e3), null], 1), 1)[:, :-1] * seen
    return (w[..., None] * tokens).sum(1)


def layer_norm(x, p, path):
    centred = x - x.mean(-1, keepdims=True)
    scaled = centred / np.sqrt((centred**2).mean(-1, keepdims=True) + 1e-5)
    return scaled * p[f"{path}.gamma"] + p[f"{path}.beta"]


def linear(x, p, path):
    return x @ p[f"{path}.weight"] + p[f"{path}.bias"]


def likeness(x, seen):
    """Cosine of each view's group of features with the mean of the others', [N, V, G]."""
    n, views_, c = x.shape
    out = np.zeros((n, views_, GROUPS))
    for voxel in range(n):
        for view in np.flatnonzero(seen[voxel]):
            rest = [j for j in np.flatnonzero(seen[voxel]) if j != view]
            if not rest:
                continue
            a = x[voxel, view].reshape(GROUPS, -1)
            b = x[voxel, rest].mean(0).reshape(GROUPS, -1)
            length = np.sqrt((a**2).sum(1) * (b**2).sum(1) + 1e-12)
            out[voxel, view] = (a * b).sum(1) / length
    return out


def parameters(matching, lift):
    c = CHANNELS
    shapes = {}
    if lift:
        shapes |= {"lift.linear.weight": (c, c), "lift.linear.bias": (c,)}
    wide = c + 1 + (GROUPS if matching else 0)
    shapes |= {"embed.weight": (wide, c), "embed.bias": (c,)}
    for i in range(2):
        for norm in ("norm_attention", "norm_mlp"):
            shapes |= {f"layers.{i}.{norm}.gamma": (c,), f"layers.{i}.{norm}.beta": (c,)}
        sizes = {"query_key_value": (c, 3 * c), "output": (c, c), "mlp_in": (c, 2 * c), "mlp_out": (2 * c, c)}
        for name, (rows, columns) in sizes.items():
            shapes |= {f"layers.{i}.{name}.weight": (rows, columns), f"layers.{i}.{name}.bias": (columns,)}
    shapes |= {"occupancy.weight": (c, 1), "occupancy.bias": (1,), "norm.gamma": (c,), "norm.beta": (c,)}
    return {path: weight(path, shape) for path, shape in shapes.items()}


def fuse(p, base, hidden, geometry, matching, mean):
    """Features [N, C] and logits [N, V]."""
    u, v, z, seen = geometry
    plain = sampled(base, u, v, seen)
    x = plain
    if hidden is not None:
        h = sampled(hidden, u, v, seen)
        x = x + linear(h / (1 + np.exp(-h)), p, "lift.linear")
    inputs = [x, ((z - 1.85) / 0.85)[..., None]]
    if matching:
        inputs.append(likeness(plain, seen))
    x = linear(np.concatenate(inputs, -1), p, "embed")
    for i in range(2):
        at = f"layers.{i}"
        q, k, w = np.split(linear(layer_norm(x, p, f"{at}.norm_attention"), p, f"{at}.query_key_value"), 3, -1)
        x = x + linear(attend(q, k, w, seen, HEADS), p, f"{at}.output")
        inner = np.maximum(linear(layer_norm(x, p, f"{at}.norm_mlp"), p, f"{at}.mlp_in"), 0)
        x = x + linear(inner, p, f"{at}.mlp_out")
    logits = linear(x, p, "occupancy")[..., 0]
    return layer_norm(pooled(x, logits, seen, mean), p, "norm"), logits


def slope(loss, array, index, step=3e-7):
    """Central difference of `loss()` along one element of an array."""
    kept = array.flat[index]
    array.flat[index] = kept + step
    up = loss()
    array.flat[index] = kept - step
    down = loss()
    array.flat[index] = kept
    return (up - down) / (2 * step)


def every(values, step):
    """Each `step`-th number, and the sum of all, which no number escapes."""
    values = np.asarray(values, dtype=np.float64).ravel()
    return {"step": step, "sum": float(values.sum()), "size": float(np.abs(values).sum()),
            "values": [float(f"{x:.8g}") for x in values[::step]]}


def some(count, most=24):
    """Indices spread over `count`."""
    return list(range(0, count, max(1, count // most)))


def slopes(loss, arrays):
    """Of up to 24 elements of each array; of planes, whose pixels are not all sampled, those that matter."""
    found = {}
    for name, array in arrays.items():
        planes = array.ndim == 4
        at = {i: slope(loss, array, i) for i in some(array.size, 100 if planes else 24)}
        if planes:
            at = {i: value for i, value in at.items() if value != 0.0}
        found[name] = {"at": list(at), "values": [float(f"{value:.8g}") for value in at.values()]}
    return found


def segments():
    """A dense stand-in for segments of LENGTHS: where row r of all is [segment, position]."""
    longest = max(LENGTHS)
    seen = np.zeros((len(LENGTHS), longest), dtype=bool)
    for row, length in enumerate(LENGTHS):
        seen[row, :length] = True
    return seen


def dense(rows, seen):
    out = np.zeros((*seen.shape, rows.shape[-1]))
    out[seen] = rows
    return out


def golden_attention():
    seen, d = segments(), 24
    count = int(seen.sum())
    tables = {name: numbers(name, (count, d), np.float32(2.0)) for name in ("query", "key", "value")}
    by = numbers("attention", (count, d), np.float32(1.0))
    run = lambda: attend(*(dense(t, seen) for t in tables.values()), seen, 2)[seen]
    return {"channels": d, "lengths": LENGTHS, "out": every(run(), 3),
            "slopes": slopes(lambda: float((run() * by).sum()), tables)}


def golden_pool():
    seen, c = segments(), 8
    count = int(seen.sum())
    tables = {"tokens": numbers("tokens", (count, c), np.float32(1.0)),
              "logits": numbers("logits", (count, 1), np.float32(3.0))}
    by = numbers("pool", (len(LENGTHS), c), np.float32(1.0))
    found = {"channels": c}
    for mean in (False, True):
        def run(mean=mean):
            return pooled(dense(tables["tokens"], seen), dense(tables["logits"], seen)[..., 0], seen, mean)
        found["mean" if mean else "softmax"] = {
            "out": every(run(), 1), "slopes": slopes(lambda run=run: float((run() * by).sum()), tables)}
    return found


def golden():
    geometry = project()
    u, v, z, seen = geometry
    edge = [np.abs(u - 0), np.abs(u - PLANE_W + 1), np.abs(v), np.abs(v - PLANE_H + 1)]
    assert min(e[np.isfinite(e)].min() for e in edge) > 1e-4, "no point may lie on the edge of a plane"
    shape = (VIEWS, CHANNELS, PLANE_H, PLANE_W)
    base, hidden = (numbers(name, shape, np.float32(1.0)) for name in ("base", "hidden"))
    depth = 2.0 + numbers("depth", (VIEWS, HEIGHT, WIDTH), np.float32(2.4))
    depth[depth < 0] = 0
    x, y = (np.rint(p * STRIDE).astype(int) for p in (u, v))
    measured = np.zeros(seen.shape)
    for i in range(VIEWS):
        measured[seen[:, i], i] = depth[i][y[seen[:, i], i], x[seen[:, i], i]]
    known = seen & (measured > 0)
    near = known & (np.abs(z - measured) < NEAR_M)

    by = numbers("sampled", (int(seen.sum()), CHANNELS), np.float32(1.0))
    loss = lambda: float((sampled(base, u, v, seen)[seen] * by).sum())
    found = {
        "pairs": {"count": int(seen.sum()), "by_view": seen.sum(0).tolist(), "voxels_unseen": int((~seen.any(1)).sum()),
                  "u": every(u[seen], 11), "v": every(v[seen], 11), "z": every(z[seen], 11)},
        "truth": {"known": int(known.sum()), "near": int(near.sum()),
                  "checksum": int((np.flatnonzero(known[seen]) * (1 + near[known])).sum())},
        "sample": {"out": every(sampled(base, u, v, seen)[seen], 31), "slopes": slopes(loss, {"base": base})},
        "attention": golden_attention(),
        "pool": golden_pool(),
        "fusion": {},
    }
    cases = {"full": (True, True, False), "plain": (False, False, False), "mean": (False, True, True)}
    by_features = numbers("features", (len(u), CHANNELS), np.float32(1.0))
    by_logits = numbers("occupancies", (int(seen.sum()),), np.float32(0.3))
    for name, (matching, lift, mean) in cases.items():
        p = parameters(matching, lift)
        planes = {"base": base, "hidden": hidden} if lift else {"base": base}
        run = lambda: fuse(p, base, planes.get("hidden"), geometry, matching, mean)
        features, logits = run()

        def loss():
            features, logits = run()
            return float((features * by_features).sum() + (logits[seen] * by_logits).sum())

        found["fusion"][name] = {
            "features": every(features, 29), "occupancy": every(logits[seen], 7),
            "slopes": slopes(loss, p | planes) if name != "mean" else {},
        }
    path = pathlib.Path(__file__).parent.parent / "golden" / "net_fusion.json"
    path.write_text(json.dumps(found, indent=None, separators=(",", ":")) + "\n")
    print(path, path.stat().st_size, "bytes;", found["pairs"]["count"], "pairs", found["pairs"]["by_view"],
          found["pairs"]["voxels_unseen"], "unseen", found["truth"])


if __name__ == "__main__":
    golden()

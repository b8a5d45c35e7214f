"""The whole network a second time, from the references of its parts: planes, then at each level fusion and decoding.

`net_model.py` writes ../golden/net_model.json. Sites go down by a fixed rule instead of the sign of the logits, which
rounding might turn. Weights are made by made_numbers.py from the paths of the whole, alike in crate/net/tests/net_model.rs.
"""

import json
import pathlib

import net_decode
import net_fusion
import net_planes
import numpy as np
from made_numbers import numbers, weight

PLANES = [24, 16, 8]
UNET = [4, 3, 2]
VOXEL_M = [0.16, 0.08, 0.04]
ORIGIN_M = np.array([-0.7, -0.5, 0.9])
BOX = (7, 6, 5)


def planes(images):
    net_planes.PLANES = PLANES
    w = net_planes.Weights() / "planes"
    x = (images - net_planes.MEAN[None, :, None, None]) / net_planes.DEVIATION[None, :, None, None]
    features = net_planes.pyramid(w / "pyramid", *net_planes.backbone(w / "backbone", x))
    on = [True, True, True]
    return [net_planes.level(w / "levels" / i, f, net_planes.STRIDES[i], *on) for i, f in enumerate(features)]


def project(sites, level, height, width):
    """u, v, z and whether it is seen, [N, V]."""
    world = np.array(sites) * VOXEL_M[level] + ORIGIN_M
    stride, k = net_planes.STRIDES[level], net_planes.CAMERA
    found = []
    for turn in net_planes.TURNS:
        x = (world - np.array(turn)) @ net_planes.rotation(*turn)
        found.append(((k["fx"] * x[:, 0] / x[:, 2] + k["cx"]) / stride, (k["fy"] * x[:, 1] / x[:, 2] + k["cy"]) / stride, x[:, 2]))
    u, v, z = (np.stack(a, 1) for a in zip(*found))
    seen = (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1) & (z > 0)
    return u, v, z, seen


def fused(level, base, hidden, geometry):
    net_fusion.CHANNELS = PLANES[level]
    p = {path: weight(f"fusion.{level}.{path}", w.shape) for path, w in net_fusion.parameters(True, True).items()}
    return net_fusion.fuse(p, base, hidden, geometry, True, False)


def decoded(level, x, sites):
    net_decode.BASE = UNET[level]
    net_decode.weight = lambda path, shape: weight(f"decoders.{level}.{path}", shape)
    return net_decode.Net(batch=False).decoder(x, sites)


def children(sites):
    """Of the sites that the rule keeps; and the rows of their parents."""
    kept = [row for row, (x, y, z) in enumerate(sites) if (x + 2 * y + 3 * z) % 4 == 0]
    found = [(2 * sites[r][0] + i % 2, 2 * sites[r][1] + i // 2 % 2, 2 * sites[r][2] + i // 4) for r in kept for i in range(8)]
    return found, [r for r in kept for _ in range(8)]


def golden():
    shape = (net_planes.VIEWS, 3, net_planes.HEIGHT, net_planes.WIDTH)
    images = numbers("images", shape, np.float32(127.0)) + 127.5
    sites = [(x, y, z) for z in range(BOX[2]) for y in range(BOX[1]) for x in range(BOX[0])]
    above, found = None, {}
    for level, (base, hidden, _) in enumerate(planes(images)):
        geometry = project(sites, level, *base.shape[2:])
        features, occupancy = fused(level, base, hidden, geometry)
        guide = numbers(f"guide.{level}", (len(sites), 2), np.float32(1.0))
        parts = [features, guide]
        if above is not None:
            parts = [above[0][parent], features, above[1][parent, None], guide]
        above = decoded(level, np.concatenate(parts, axis=1), sites)
        seen = geometry[3]
        assert seen.any(1).sum() > 20 and (~seen).any(), "some are seen, some are not"
        for name, y in [("fused", features), ("occupancy", occupancy[seen]), ("features", above[0]), ("logit", above[1])]:
            found[f"{name}.{level}"] = net_decode.digest(y)
        sites, parent = children(sites)
    return found


if __name__ == "__main__":
    path = pathlib.Path(__file__).parents[1] / "golden" / "net_model.json"
    lines = (f"{json.dumps(name)}: {json.dumps(entry)}" for name, entry in golden().items())
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n")

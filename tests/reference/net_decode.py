"""The sparse 3D network of a level a second time, from the definitions, in NumPy and 64 bits: a dictionary of sites and
loops over them.

`net_decode.py` writes ../golden/net_decode.json. Sites, inputs and weights are made by made_numbers.py, alike in
crate/net/tests/net_decode.rs.
"""

import itertools
import json
import pathlib

import numpy as np
from made_numbers import numbers, weight

BOX = (11, 9, 7)
CORNER = (-5, -4, -3)
INPUTS, BASE = 5, 3
EPSILON = 1e-5


def sites():
    """Half of a box, in no order, and a few far from it."""
    chosen = numbers("sites", (np.prod(BOX),), np.float32(1.0))
    found = []
    for i in np.argsort(chosen, kind="stable"):
        if chosen[i] < 0.1:
            x, y, z = i % BOX[0], i // BOX[0] % BOX[1], i // (BOX[0] * BOX[1])
            found.append((int(x) + CORNER[0], int(y) + CORNER[1], int(z) + CORNER[2]))
    return found + [(-41, 26, -17), (-41, 26, -16), (100, -100, 3)]


def halved(sites):
    """floor(site / 2), each once, by z, y, x."""
    halves = {(x // 2, y // 2, z // 2) for x, y, z in sites}
    return sorted(halves, key=lambda site: site[::-1])


def rows_of(sites):
    return {site: row for row, site in enumerate(sites)}


def same(features, w, sites):
    """Submanifold: tap (dx + 1) + 3 (dy + 1) + 9 (dz + 1) takes the site at that offset."""
    row = rows_of(sites)
    y = np.zeros((len(sites), w.shape[2]))
    for n, (x0, y0, z0) in enumerate(sites):
        for tap, (dz, dy, dx) in enumerate(itertools.product((-1, 0, 1), repeat=3)):
            m = row.get((x0 + dx, y0 + dy, z0 + dz))
            if m is not None:
                y[n] += features[m] @ w[tap]
    return y


def child_tap(site):
    return site[0] % 2 + 2 * (site[1] % 2) + 4 * (site[2] % 2)


def down(features, w, sites):
    """Stride 2: a half takes its up to eight sites."""
    halves = halved(sites)
    row = rows_of(halves)
    y = np.zeros((len(halves), w.shape[2]))
    for m, site in enumerate(sites):
        y[row[tuple(c // 2 for c in site)]] += features[m] @ w[child_tap(site)]
    return y


def up(features, w, sites):
    """Transposed: a site takes its half."""
    row = rows_of(halved(sites))
    y = np.zeros((len(sites), w.shape[2]))
    for m, site in enumerate(sites):
        y[m] = features[row[tuple(c // 2 for c in site)]] @ w[child_tap(site)]
    return y


def relu(x):
    return np.maximum(x, 0.0)


class Net:
    """Blocks by the path of their tensors. `batch` normalises by the rows' own statistics, as training does."""

    def __init__(self, batch):
        self.batch = batch

    def norm(self, path, x):
        width = x.shape[1]
        mean, variance = x.mean(axis=0), x.var(axis=0)
        if not self.batch:
            mean, variance = weight(f"{path}.running_mean", (width,)), weight(f"{path}.running_var", (width,))
        gain, bias = weight(f"{path}.gamma", (width,)), weight(f"{path}.beta", (width,))
        return (x - mean) / np.sqrt(variance + EPSILON) * gain + bias

    def step(self, path, x, taps, outputs, conv, sites):
        w = weight(f"{path}.conv.weight", (taps, x.shape[1], outputs))
        return relu(self.norm(f"{path}.norm", conv(x, w, sites)))

    def residual(self, path, x, outputs, sites):
        dot = f"{path}." if path else ""
        inner = self.step(f"{dot}first", x, 27, outputs, same, sites)
        w = weight(f"{dot}second.weight", (27, outputs, outputs))
        inner = self.norm(f"{dot}norm", same(inner, w, sites))
        if x.shape[1] != outputs:
            w = weight(f"{dot}around.linear.weight", (x.shape[1], outputs))
            x = self.norm(f"{dot}around.norm", x @ w)
        return relu(inner + x)

    def blocks(self, path, x, outputs, sites):
        x = self.residual(f"{path}.first", x, outputs, sites)
        return self.residual(f"{path}.second", x, outputs, sites)

    def decoder(self, x, full):
        half = halved(full)
        quarter = halved(half)
        b = BASE
        stem = self.step("unet.stem", x, 27, b, same, full)
        first = self.step("unet.down1.change", stem, 8, b, down, full)
        first = self.blocks("unet.down1", first, 2 * b, half)
        second = self.step("unet.down2.change", first, 8, 2 * b, down, half)
        second = self.blocks("unet.down2", second, 4 * b, quarter)
        back = self.step("unet.up1.change", second, 8, 3 * b, up, half)
        back = self.blocks("unet.up1", np.concatenate([back, first], axis=1), 3 * b, half)
        back = self.step("unet.up2.change", back, 8, 3 * b, up, full)
        back = self.blocks("unet.up2", np.concatenate([back, stem], axis=1), 3 * b, full)
        logit = back @ weight("head.weight", (3 * b, 1)) + weight("head.bias", (1,))
        return back, logit[:, 0]


def digest(x, count=120):
    """Shape, sum, sum of magnitudes, and every k-th number."""
    flat = x.reshape(-1)
    every = max(1, -(-flat.size // count))
    # Not the same column each time.
    every += every % x.shape[-1] == 0
    return {
        "shape": list(x.shape),
        "sum": float(flat.sum()),
        "magnitude": float(np.abs(flat).sum()),
        "every": every,
        "values": [float(f"{v:.7g}") for v in flat[::every]],
    }


def made(name, *shape):
    return numbers(name, shape, np.float32(1.0))


def golden():
    full = sites()
    half = halved(full)
    features, halves = made("features", len(full), INPUTS), made("halves", len(half), INPUTS)
    found = {
        "sites": np.array(full),
        "halved": np.array(half),
        "same": same(features, weight("same", (27, INPUTS, 4)), full),
        "down": down(features, weight("down", (8, INPUTS, 4)), full),
        "up": up(halves, weight("up", (8, INPUTS, 4)), full),
    }
    for name, batch in [("running", False), ("batch", True)]:
        net = Net(batch)
        found[f"residual.wider.{name}"] = net.residual("", features, 7, full)
        found[f"residual.same.{name}"] = net.residual("", features, INPUTS, full)
        found[f"features.{name}"], found[f"logit.{name}"] = net.decoder(features, full)
    return {name: digest(y) for name, y in found.items()}


if __name__ == "__main__":
    path = pathlib.Path(__file__).parents[1] / "golden" / "net_decode.json"
    lines = (f"{json.dumps(name)}: {json.dumps(entry)}" for name, entry in golden().items())
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n")

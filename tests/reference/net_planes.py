"""Pictures to feature planes a second time, from the equations, in NumPy and 64 bits.

`net_planes.py` writes ../golden/net_planes.json: the recurrence, each block on made features, and the whole for all eight
settings of the switches. Inputs and weights are made by made_numbers.py, alike in crate/net/tests/net_planes.rs.
"""

import itertools
import json
import pathlib

import numpy as np
from made_numbers import numbers, weight

WIDTH, HEIGHT, VIEWS = 72, 56, 2
BACKBONE = [8, 6, 10, 12, 20]
PYRAMID = 20
PLANES = [20, 12, 8]
STRIDES = [16, 8, 4]
MEAN = np.array([127.71, 114.66, 99.32])
DEVIATION = np.array([75.31, 73.53, 71.66])
CAMERA = {"fx": 64.0, "fy": 66.0, "cx": 35.0, "cy": 28.5}
# Yaw, pitch, roll: turns about z, then y, then x of the turned axes.
TURNS = [(0.3, 0.2, -0.1), (-1.1, 0.4, 0.7)]


def sigmoid(x):
    return 1.0 / (1.0 + np.exp(-x))


def relu(x):
    return np.maximum(x, 0.0)


def conv(x, w, bias=None, stride=1):
    """Output pixel i is centred on input pixel stride * i; zeros outside. Depthwise if w has one input channel and x more."""
    views, channels, height, width = x.shape
    out, per_group, kernel, _ = w.shape
    pad = kernel // 2
    padded = np.pad(x, ((0, 0), (0, 0), (pad, pad), (pad, pad)))
    rows, columns = -(-height // stride), -(-width // stride)
    y = np.zeros((views, out, rows, columns))
    for dy, dx in itertools.product(range(kernel), repeat=2):
        seen = padded[:, :, dy : dy + height : stride, dx : dx + width : stride]
        if per_group == channels:
            y += np.einsum("oc,vchw->vohw", w[:, :, dy, dx], seen)
        else:
            assert per_group == 1 and out == channels
            y += w[None, :, 0, dy, dx, None, None] * seen
    return y if bias is None else y + bias[None, :, None, None]


class Weights:
    """Tensors of a module, by path below it."""

    def __init__(self, path=""):
        self.path = path

    def __truediv__(self, name):
        return Weights(f"{self.path}.{name}" if self.path else str(name))

    def __call__(self, name, *shape):
        return weight((self / name).path, shape)


def batch_norm(w, x):
    c = x.shape[1]
    each = lambda name: w(name, c)[None, :, None, None]
    return each("gamma") * (x - each("running_mean")) / np.sqrt(each("running_var") + 1e-5) + each("beta")


def channel_norm(w, x):
    c = x.shape[1]
    each = lambda name: w(name, c)[None, :, None, None]
    mean = x.mean(axis=1, keepdims=True)
    variance = ((x - mean) ** 2).mean(axis=1, keepdims=True)
    return each("gamma") * (x - mean) / np.sqrt(variance + 1e-5) + each("beta")


def pointwise(w, x, out, bias=True):
    return conv(x, w("weight", out, x.shape[1], 1, 1), w("bias", out) if bias else None)


def conv_norm(w, x, out, kernel, stride, activate, depthwise=False):
    shape = (out, 1 if depthwise else x.shape[1], kernel, kernel)
    y = batch_norm(w / "norm", conv(x, (w / "conv")("weight", *shape), stride=stride))
    return relu(y) if activate else y


def backbone(w, x):
    stem, projected, *stages = BACKBONE
    x = conv_norm(w / "stem" / "first", x, stem, 3, 2, True)
    x = conv_norm(w / "stem" / "depth", x, stem, 3, 1, True, depthwise=True)
    x = conv_norm(w / "stem" / "project", x, projected, 1, 1, False)
    found = []
    for s, (out, kernel, expand) in enumerate(zip(stages, [3, 5, 5], [3, 3, 6])):
        for b in range(3):
            at = w / "stages" / s / "blocks" / b
            wide = expand * x.shape[1]
            y = conv_norm(at / "expand", x, wide, 1, 1, True)
            y = conv_norm(at / "depth", y, wide, kernel, 2 if b == 0 else 1, True, depthwise=True)
            y = conv_norm(at / "project", y, out, 1, 1, False)
            x = y if b == 0 else y + x
        found.append(x)
    return found[::-1]


def enlarge(x, height, width):
    """Bilinear, half-pixel centres, the edge repeated; the first `height` rows and `width` columns of twice the size."""

    def along(x, axis, size):
        at = np.clip((np.arange(size) + 0.5) / 2.0 - 0.5, 0.0, x.shape[axis] - 1.0)
        low = np.floor(at).astype(int)
        high = np.minimum(low + 1, x.shape[axis] - 1)
        shape = [1] * x.ndim
        shape[axis] = size
        part = (at - low).reshape(shape)
        return np.take(x, low, axis) * (1 - part) + np.take(x, high, axis) * part

    return along(along(x, 2, height), 3, width)


def pyramid(w, sixteenth, eighth, quarter):
    def norm_conv(w, x, out, kernel):
        x = relu(batch_norm(w / "norm", x))
        return conv(x, (w / "conv")("weight", out, x.shape[1], kernel, kernel))

    x8 = norm_conv(w / "lateral" / 0, eighth, PYRAMID, 1)
    x8 = x8 + enlarge(sixteenth, *x8.shape[2:])
    x4 = norm_conv(w / "lateral" / 1, quarter, PYRAMID, 1)
    x4 = x4 + enlarge(x8, *x4.shape[2:])
    return [
        norm_conv(w / "out" / 0, sixteenth, PLANES[0], 1),
        norm_conv(w / "out" / 1, x8, PLANES[1], 3),
        norm_conv(w / "out" / 2, x4, PLANES[2], 3),
    ]


def rotation(yaw, pitch, roll):
    c, s = np.cos, np.sin
    z = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    y = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    x = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    return z @ y @ x


def encoded_rays(height, width, stride):
    """[V, 27, height, width]."""
    v, u = np.mgrid[0:height, 0:width] * float(stride)
    ray = np.stack([(u - CAMERA["cx"]) / CAMERA["fx"], (v - CAMERA["cy"]) / CAMERA["fy"], np.ones_like(u)])
    found = []
    for turn in TURNS:
        d = np.einsum("ij,jhw->ihw", rotation(*turn), ray)
        d /= np.linalg.norm(d, axis=0)
        octaves = [f(2.0**l * np.pi * d) for l in range(4) for f in (np.sin, np.cos)]
        found.append(np.concatenate([d, *octaves]))
    return np.stack(found)


def rays(w, x, stride):
    x = np.concatenate([x, encoded_rays(*x.shape[2:], stride)], axis=1)
    return pointwise(w / "mix", x, x.shape[1] - 27, bias=False)


def linrec(a, x, reverse):
    """s_t = a_t s_{t-1} + x_t along the last axis."""
    s = np.zeros_like(x)
    state = np.zeros(x.shape[:-1])
    order = range(x.shape[-1])
    for t in reversed(order) if reverse else order:
        state = a[..., t] * state + x[..., t]
        s[..., t] = state
    return s


def scan(w, x, features):
    """Rows, then columns, both ways. A state's own input counts once."""
    states = x.shape[1]
    rank = -(-states // 16)

    def exponent_and_rate(w):
        low = pointwise(w / "reduce", features, rank, bias=False)
        step = np.log1p(np.exp(pointwise(w / "expand", low, states)))
        rate = -np.exp(w("log_rate", states))[None, :, None, None]
        return step * rate, rate

    def both(a, x):
        return linrec(a, x, False) + linrec(a, x, True) - x

    du, u = exponent_and_rate(w / "rows")
    rows = both(np.exp(du), np.expm1(du) / u * x)
    du, u = exponent_and_rate(w / "columns")
    turned = lambda x: x.swapaxes(2, 3)
    return turned(both(turned(np.exp(du)), turned(-np.expm1(du) * rows)))


def confidence_encoding(w, f):
    c = f.shape[1]
    states = scan(w / "scan", pointwise(w / "drive", f, c, bias=False), f)
    wide = pointwise(w / "widen", channel_norm(w / "norm", states), 2 * c)
    read = pointwise(w / "readout", wide * sigmoid(wide), c + 1)
    confidence = sigmoid(read[:, c:])
    return confidence * (f + read[:, :c]), confidence


def affine_compensation(w, r):
    views, c, height, width = r.shape
    head = w / "map"
    maps = r.mean(axis=(2, 3)) @ head("weight", c, 6) + head("bias", 6)
    maps = maps.reshape(views, 2, 3) + np.array([[1.0, 0, 0], [0, 1.0, 0]])
    # Normalised coordinates of pixel centres, made isotropic.
    y, x = np.mgrid[0:height, 0:width]
    x = ((2 * x + 1) / width - 1) * (width / height)
    y = (2 * y + 1) / height - 1
    found = np.zeros_like(r)
    for v in range(views):
        xs, ys = np.einsum("ij,jhw->ihw", maps[v], np.stack([x, y, np.ones_like(x)]))
        column = np.clip(((xs * (height / width) + 1) * width - 1) / 2, 0, width - 1)
        row = np.clip(((ys + 1) * height - 1) / 2, 0, height - 1)
        left, top = np.floor(column).astype(int), np.floor(row).astype(int)
        right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
        p, q = column - left, row - top
        found[v] = (
            r[v][:, top, left] * (1 - p) * (1 - q)
            + r[v][:, top, right] * p * (1 - q)
            + r[v][:, bottom, left] * (1 - p) * q
            + r[v][:, bottom, right] * p * q
        )
    return found * sigmoid(w("gain", c))[None, :, None, None]


def spatial_decoding(w, cr, f):
    """S and Q."""
    views, c2, c = cr.shape[0], cr.shape[1], f.shape[1]
    head = w / "shift"
    shift = cr.mean(axis=(2, 3)) @ head("weight", c2, c) + head("bias", c)
    x = pointwise(w / "project", channel_norm(w / "norm", cr), c)
    s = pointwise(w / "out", scan(w / "scan", x, cr) + shift[:, :, None, None], c)
    return s, pointwise(w / "lift", np.concatenate([s, f], axis=1), c)


def level(w, f, stride, pce, acm, ipsd):
    f = rays(w / "rays", f, stride)
    r, confidence = confidence_encoding(w / "pce", f) if pce else (f, None)
    cr = np.concatenate([r, affine_compensation(w / "acm", r)], axis=1) if acm else r
    if ipsd:
        return f, spatial_decoding(w / "ipsd", cr, f)[1], confidence
    return (pointwise(w / "merge", cr, f.shape[1]) if acm else r), None, confidence


def whole(images, pce, acm, ipsd):
    w = Weights()
    x = (images - MEAN[None, :, None, None]) / DEVIATION[None, :, None, None]
    planes = pyramid(w / "pyramid", *backbone(w / "backbone", x))
    return [level(w / "levels" / i, f, STRIDES[i], pce, acm, ipsd) for i, f in enumerate(planes)]


def digest(x, count=100):
    """Shape, sum, sum of magnitudes, and every k-th number."""
    flat = x.reshape(-1)
    every = max(1, -(-flat.size // count)) | 1
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
    images = numbers("images", (VIEWS, 3, HEIGHT, WIDTH), np.float32(127.0)) + 127.5
    found = {}
    x = (images - MEAN[None, :, None, None]) / DEVIATION[None, :, None, None]
    for name, y in zip(["sixteenth", "eighth", "quarter"], backbone(Weights(), x)):
        found[f"backbone.{name}"] = y
    inputs = [made("sixteenth", 2, 20, 4, 5), made("eighth", 2, 12, 7, 9), made("quarter", 2, 10, 14, 18)]
    for name, y in zip(["coarse", "medium", "fine"], pyramid(Weights(), *inputs)):
        found[f"pyramid.{name}"] = y
    a, x = made("factors", 1, 2, 3, 161) / 2 + 0.5, made("inputs", 1, 2, 3, 161)
    found["linrec.forward"], found["linrec.backward"] = linrec(a, x, False), linrec(a, x, True)
    features = made("features", 2, 20, 9, 13)
    found["rays.encoded"] = encoded_rays(9, 13, 8)
    found["rays.features"] = rays(Weights(), features, 8)
    found["confidence.features"], found["confidence.map"] = confidence_encoding(Weights(), features)
    found["affine.planes"] = affine_compensation(Weights(), features)
    wide = made("compensated", 2, 40, 9, 13)
    found["decoding.spatial"], found["decoding.hidden"] = spatial_decoding(Weights(), wide, features)
    for on in itertools.product([False, True], repeat=3):
        setting = "+".join(name for name, on in zip(["pce", "acm", "ipsd"], on) if on) or "baseline"
        for name, parts in zip(["coarse", "medium", "fine"], whole(images, *on)):
            for part, y in zip(["base", "hidden", "confidence"], parts):
                if y is not None:
                    found[f"{setting}.{name}.{part}"] = y
    return {name: digest(y) for name, y in found.items()}


if __name__ == "__main__":
    path = pathlib.Path(__file__).parents[1] / "golden" / "net_planes.json"
    lines = (f"{json.dumps(name)}: {json.dumps(entry)}" for name, entry in golden().items())
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n")

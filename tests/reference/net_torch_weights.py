"""Weights for the PyTorch version of the network: by path, from anything that gives arrays, and the modules they fill.

Batch normalisation is folded into the convolution before it wherever there is one: that is what PyTorch's users do before
they measure inference, and it makes PyTorch faster.
"""

import json
import math
import pathlib

import numpy as np
import torch
from torch import nn

EPSILON = 1e-5


class Weights:
    """Tensors of a module, by path below it. `source(path, shape)` gives an array of that shape."""

    def __init__(self, source, path=""):
        self.source, self.path = source, path

    def __truediv__(self, name):
        return Weights(self.source, f"{self.path}.{name}" if self.path else str(name))

    def __call__(self, name, *shape):
        return torch.tensor(self.source((self / name).path, shape), dtype=torch.float32)


def read(file):
    """The configuration in a safetensors file of ours, and the source of its tensors."""
    data = pathlib.Path(file).read_bytes()
    start = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:start])
    config = json.loads(header.pop("__metadata__")["ipdrecon.config"])

    def source(path, shape):
        entry = header[path]
        assert entry["shape"] == list(shape), f"{path}: expected {list(shape)}, found {entry['shape']}"
        kind = {"F16": "<f2", "F32": "<f4"}[entry["dtype"]]
        offset = start + entry["data_offsets"][0]
        return np.frombuffer(data, kind, math.prod(shape), offset).reshape(shape)

    return config, source


def scale_and_shift(w, width):
    """Batch normalisation by the running statistics, as one multiplication and one addition."""
    scale = w("gamma", width) / torch.sqrt(w("running_var", width) + EPSILON)
    return scale, w("beta", width) - scale * w("running_mean", width)


def convolution(weight, bias=None, stride=1, groups=1):
    """Output pixel i is centred on input pixel stride * i."""
    outputs, per_group, kernel, _ = weight.shape
    inputs, padding = groups * per_group, kernel // 2
    conv = nn.Conv2d(inputs, outputs, kernel, stride, padding, groups=groups, bias=bias is not None)
    conv.weight.data = weight.contiguous(memory_format=torch.channels_last)
    if bias is not None:
        conv.bias.data = bias
    return conv


def pointwise(w, inputs, outputs, bias=True):
    return convolution(w("weight", outputs, inputs, 1, 1), w("bias", outputs) if bias else None)


class Linear(nn.Module):
    """[.., inputs] to [.., outputs] as a 1x1 convolution of one column of pixels.

    With two threads or more that is oneDNN's, which took half of the time of torch.nn.Linear, MKL's matrix product, for
    rows as short as ours. With one thread PyTorch takes MKL's for both.
    """

    def __init__(self, weight, bias=None):
        super().__init__()
        self.conv = convolution(weight.T[:, :, None, None], bias)

    def forward(self, x):
        y = self.conv(x.reshape(1, -1, 1, x.shape[-1]).permute(0, 3, 1, 2))
        return y.permute(0, 2, 3, 1).reshape(*x.shape[:-1], -1)


def linear(w, inputs, outputs):
    return Linear(w("weight", inputs, outputs), w("bias", outputs))


def layer_norm(w, width):
    norm = nn.LayerNorm(width, EPSILON)
    norm.weight.data, norm.bias.data = w("gamma", width), w("beta", width)
    return norm

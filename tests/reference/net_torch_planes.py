"""Pictures to feature planes in PyTorch: net_planes.py once more, with its names, in 32 bits and for speed.

Tensors are [V, C, H, W] in the memory format channels_last, in which oneDNN's convolutions take half the time.
"""

import math

import torch
import torch.nn.functional as F
from net_torch_weights import convolution, layer_norm, linear, pointwise, scale_and_shift
from torch import nn

MEAN = (127.71, 114.66, 99.32)
DEVIATION = (75.31, 73.53, 71.66)
OCTAVES = 4
RAY_CHANNELS = 3 + 2 * 3 * OCTAVES


def conv_norm(w, inputs, outputs, kernel=1, stride=1, activate=True, depthwise=False):
    weight = (w / "conv")("weight", outputs, 1 if depthwise else inputs, kernel, kernel)
    scale, shift = scale_and_shift(w / "norm", outputs)
    groups = inputs if depthwise else 1
    conv = convolution(weight * scale[:, None, None, None], shift, stride, groups)
    return nn.Sequential(conv, nn.ReLU(inplace=True)) if activate else conv


class Block(nn.Module):
    """MnasNet's inverted residual; the first of a stage halves the picture."""

    def __init__(self, w, inputs, outputs, kernel, expand, first):
        super().__init__()
        wide = expand * inputs
        self.first = first
        self.inner = nn.Sequential(
            conv_norm(w / "expand", inputs, wide),
            conv_norm(w / "depth", wide, wide, kernel, 2 if first else 1, depthwise=True),
            conv_norm(w / "project", wide, outputs, activate=False),
        )

    def forward(self, x):
        return self.inner(x) if self.first else self.inner(x).add_(x)


class Backbone(nn.Module):
    """Features at strides 16, 8 and 4."""

    def __init__(self, w, widths):
        super().__init__()
        stem, width, *stages = widths
        self.stem = nn.Sequential(
            conv_norm(w / "stem" / "first", 3, stem, 3, 2),
            conv_norm(w / "stem" / "depth", stem, stem, 3, depthwise=True),
            conv_norm(w / "stem" / "project", stem, width, activate=False),
        )
        self.stages = nn.ModuleList()
        for s, (outputs, kernel, expand) in enumerate(zip(stages, [3, 5, 5], [3, 3, 6])):
            blocks = []
            for b in range(3):
                blocks.append(Block(w / "stages" / s / "blocks" / b, width, outputs, kernel, expand, b == 0))
                width = outputs
            self.stages.append(nn.Sequential(*blocks))

    def forward(self, x):
        quarter = self.stages[0](self.stem(x))
        eighth = self.stages[1](quarter)
        return self.stages[2](eighth), eighth, quarter


class NormConv(nn.Module):
    """Normalised first, which cannot be folded because of the ReLU between."""

    def __init__(self, w, inputs, outputs, kernel):
        super().__init__()
        scale, shift = scale_and_shift(w / "norm", inputs)
        self.scale, self.shift = nn.Buffer(scale[:, None, None]), nn.Buffer(shift[:, None, None])
        self.conv = convolution((w / "conv")("weight", outputs, inputs, kernel, kernel))

    def forward(self, x):
        return self.conv(torch.addcmul(self.shift, x, self.scale).relu_())


def enlarged(x, like):
    """Twice as large, cut to the size of `like`."""
    height, width = like.shape[2:]
    return F.interpolate(x, scale_factor=2, mode="bilinear")[:, :, :height, :width]


class Pyramid(nn.Module):
    def __init__(self, w, config):
        super().__init__()
        _, _, quarter, eighth, _ = config.backbone
        inner = config.pyramid
        widths = zip([eighth, quarter], [inner, inner])
        self.lateral = nn.ModuleList(NormConv(w / "lateral" / i, a, b, 1) for i, (a, b) in enumerate(widths))
        sizes = zip(config.planes, [1, 3, 3])
        self.out = nn.ModuleList(NormConv(w / "out" / i, inner, width, k) for i, (width, k) in enumerate(sizes))

    def forward(self, sixteenth, eighth, quarter):
        x8 = self.lateral[0](eighth)
        x8 += enlarged(sixteenth, x8)
        x4 = self.lateral[1](quarter)
        x4 += enlarged(x8, x4)
        return [out(x) for out, x in zip(self.out, (sixteenth, x8, x4))]


def encoded_rays(cameras, height, width, stride):
    """Unit rays in world coordinates with sines and cosines of their octaves, [V, 27, height, width]."""
    fx, fy, cx, cy = cameras.intrinsics.float()[:, :, None, None].unbind(1)
    v, u = torch.meshgrid(torch.arange(height) * stride, torch.arange(width) * stride, indexing="ij")
    x, y = torch.broadcast_tensors((u - cx) / fx, (v - cy) / fy)
    ray = cameras.rotation.float() @ torch.stack([x, y, torch.ones_like(x)], 1).flatten(2)
    ray = F.normalize(ray, dim=1).unflatten(2, (height, width))
    angle = ray[:, None] * (math.pi * 2.0 ** torch.arange(OCTAVES))[:, None, None, None]
    octaves = torch.stack([angle.sin(), angle.cos()], 2).flatten(1, 3)
    return torch.cat([ray, octaves], 1).contiguous(memory_format=torch.channels_last)


def both_ways(keep, drive):
    """Sum of s_t = keep_t s_{t-1} + drive_t along the first axis and of the same from its end, with each drive once.

    A loop over time whose steps are one fused operation for both directions: a plane's lines are so short, and a step so
    small, that log2(T) passes over everything (Hillis and Steele) took three times as long with one thread, pairs of pairs
    (Blelloch) 1.7 times, and chunks by matrices of decays 35 times.
    """
    states = torch.stack([drive, drive.flip(0)], 1)
    steps, keeps = states.unbind(), torch.stack([keep, keep.flip(0)], 1).unbind()
    for t in range(1, len(steps)):
        steps[t].addcmul_(keeps[t], steps[t - 1])
    return states[:, 0] + states[:, 1].flip(0) - drive


class Decay(nn.Module):
    """What the states along one axis lose at each step, exp(d u) - 1, and the rates u; channels last."""

    def __init__(self, w, inputs, states):
        super().__init__()
        rank = -(-states // 16)
        self.reduce = pointwise(w / "reduce", inputs, rank, bias=False)
        self.expand = pointwise(w / "expand", rank, states)
        self.rate = nn.Buffer(-torch.exp(w("log_rate", states)))

    def forward(self, features):
        step = F.softplus(self.expand(self.reduce(features))).permute(0, 2, 3, 1)
        return torch.expm1(step * self.rate)


class Scan(nn.Module):
    """Rows, then columns, both ways."""

    def __init__(self, w, inputs, states):
        super().__init__()
        self.rows = Decay(w / "rows", inputs, states)
        self.columns = Decay(w / "columns", inputs, states)

    def forward(self, x, features):
        across, down = self.rows(features), self.columns(features)
        drive = across / self.rows.rate * x.permute(0, 2, 3, 1)
        rows = both_ways((across + 1).transpose(0, 2), drive.transpose(0, 2)).transpose(0, 2)
        columns = both_ways((down + 1).transpose(0, 1), (-down * rows).transpose(0, 1))
        return columns.permute(1, 3, 0, 2)


class ChannelNorm(nn.Module):
    def __init__(self, w, width):
        super().__init__()
        self.norm = layer_norm(w, width)

    def forward(self, x):
        return self.norm(x.permute(0, 2, 3, 1)).permute(0, 3, 1, 2)


class ConfidenceEncoding(nn.Module):
    def __init__(self, w, width):
        super().__init__()
        self.width = width
        self.drive = pointwise(w / "drive", width, width, bias=False)
        self.scan = Scan(w / "scan", width, width)
        self.readout = nn.Sequential(
            ChannelNorm(w / "norm", width),
            pointwise(w / "widen", width, 2 * width),
            nn.SiLU(inplace=True),
            pointwise(w / "readout", 2 * width, width + 1),
        )

    def forward(self, f):
        correction, confidence = self.readout(self.scan(self.drive(f), f)).split([self.width, 1], 1)
        confidence = confidence.sigmoid()
        return confidence * (f + correction), confidence


class AffineCompensation(nn.Module):
    def __init__(self, w, width):
        super().__init__()
        self.map = linear(w / "map", width, 6)
        self.gain = nn.Buffer(torch.sigmoid(w("gain", width))[:, None, None])
        self.identity = nn.Buffer(torch.eye(2, 3))

    def forward(self, r):
        height, width = r.shape[2:]
        maps = self.map(r.mean((2, 3))).unflatten(1, (2, 3)) + self.identity
        # The maps are of isotropic coordinates, the grid's are from -1 to 1 along both axes.
        aspect = width / height
        maps = maps * torch.tensor([[1, 1 / aspect, 1 / aspect], [aspect, 1, 1]])
        grid = F.affine_grid(maps, r.shape, align_corners=False)
        return F.grid_sample(r, grid, padding_mode="border", align_corners=False) * self.gain


class SpatialDecoding(nn.Module):
    def __init__(self, w, inputs, width):
        super().__init__()
        self.shift = linear(w / "shift", inputs, width)
        self.project = nn.Sequential(ChannelNorm(w / "norm", inputs), pointwise(w / "project", inputs, width))
        self.scan = Scan(w / "scan", inputs, width)
        self.out = pointwise(w / "out", width, width)
        self.lift = pointwise(w / "lift", 2 * width, width)

    def forward(self, cr, f):
        shift = self.shift(cr.mean((2, 3)))[:, :, None, None]
        s = self.out(self.scan(self.project(cr), cr) + shift)
        return self.lift(torch.cat([s, f], 1))


class LevelPlanes(nn.Module):
    def __init__(self, w, width, stride, config):
        super().__init__()
        self.stride = stride
        self.mix = pointwise(w / "rays" / "mix", width + RAY_CHANNELS, width, bias=False)
        wide = 2 * width if config.acm else width
        self.pce = ConfidenceEncoding(w / "pce", width) if config.pce else None
        self.acm = AffineCompensation(w / "acm", width) if config.acm else None
        self.ipsd = SpatialDecoding(w / "ipsd", wide, width) if config.ipsd else None
        self.merge = pointwise(w / "merge", wide, width) if config.acm and not config.ipsd else None

    def forward(self, f, cameras):
        """Base, hidden and confidence, each where it is."""
        f = self.mix(torch.cat([f, encoded_rays(cameras, *f.shape[2:], self.stride)], 1))
        r, confidence = self.pce(f) if self.pce else (f, None)
        cr = torch.cat([r, self.acm(r)], 1) if self.acm else r
        if self.ipsd:
            return f, self.ipsd(cr, f), confidence
        return self.merge(cr) if self.merge else cr, None, confidence


class PlaneNet(nn.Module):
    def __init__(self, w, config, strides):
        super().__init__()
        self.backbone = Backbone(w / "backbone", config.backbone)
        self.pyramid = Pyramid(w / "pyramid", config)
        each = zip(config.planes, strides)
        self.levels = nn.ModuleList(
            LevelPlanes(w / "levels" / i, width, stride, config) for i, (width, stride) in enumerate(each)
        )
        self.mean = nn.Buffer(torch.tensor(MEAN)[:, None, None])
        self.deviation = nn.Buffer(torch.tensor(DEVIATION)[:, None, None])

    def forward(self, images, cameras):
        images = (images - self.mean) / self.deviation
        features = self.pyramid(*self.backbone(images.contiguous(memory_format=torch.channels_last)))
        return [level(f, cameras) for level, f in zip(self.levels, features)]

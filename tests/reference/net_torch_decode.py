"""The sparse 3D network of a level in PyTorch: net_decode.py once more, with its names, in 32 bits and for speed.

Who is whose neighbour is looked up in the sites' bounding box. A convolution gathers the neighbours of a block of rows and
multiplies once by the matrices of all taps. That took half of the time of a product and `index_add_` for each tap, a quarter
of that of gathering all rows at once, and less than products first and `embedding_bag` over them wherever it matters. Batch
normalisation is folded.
"""

import torch
import torch.nn.functional as F
from net_torch_weights import Linear, linear, scale_and_shift
from torch import nn

# Rows that are gathered at a time, so that they stay in cache.
BLOCK = 2048


class Box:
    """The bounding box of sites [N, 3] with a border, as an array of their rows; N where there is none."""

    def __init__(self, sites):
        self.sites, self.corner = sites, sites.amin(0) - 1
        size = sites.amax(0) + 2 - self.corner
        self.steps = torch.stack([torch.ones_like(size[0]), size[0], size[0] * size[1]])
        self.rows = torch.full((int(size.prod()),), len(sites))
        self.rows[self.place(sites)] = torch.arange(len(sites))

    def place(self, sites):
        return ((sites - self.corner) * self.steps).sum(-1)

    def halved(self):
        """floor(site / 2), each once, by z, y, x."""
        halves = self.sites >> 1
        low = halves.amin(0)
        x, y, z = (halves - low).unbind(1)
        there = torch.zeros((halves.amax(0) - low + 1).flip(0).tolist(), dtype=torch.bool)
        there[z, y, x] = True
        return there.nonzero().flip(1) + low


def same(box):
    """Rows [N, 27] under tap (dx + 1) + 3 (dy + 1) + 9 (dz + 1)."""
    step = torch.arange(3) - 1
    taps = torch.cartesian_prod(step, step, step).flip(1)
    return box.rows[box.place(box.sites)[:, None] + (taps * box.steps).sum(1)]


def children(box, half):
    """8 m + tap [N] of each site: the row m of its half and the tap that it is of it."""
    taps = (box.sites & 1) @ torch.tensor([1, 2, 4])
    return 8 * half.rows[half.place(box.sites >> 1)] + taps


def down(children, halves):
    """Rows [M, 8] of each half's sites under their taps."""
    rows = torch.full((8 * halves,), len(children))
    rows[children] = torch.arange(len(children))
    return rows.view(halves, 8)


class Maps:
    """Who is whose neighbour at full, half and quarter resolution, and between them."""

    def __init__(self, sites):
        full = Box(sites)
        half = Box(full.halved())
        quarter = Box(half.halved())
        self.same = [same(box) for box in (full, half, quarter)]
        self.up = [children(full, half), children(half, quarter)]
        self.down = [down(self.up[0], len(half.sites)), down(self.up[1], len(quarter.sites))]


class Convolution(nn.Module):
    """Sparse, with its normalisation; without ReLU."""

    def __init__(self, weight, norm):
        super().__init__()
        scale, shift = norm
        self.product = Linear((weight * scale).flatten(0, 1), shift)

    def forward(self, x, rows):
        # A row of zeros for sites that are not there.
        x = F.pad(x, (0, 0, 0, 1))
        blocks = (x.index_select(0, block.flatten()).view(len(block), -1) for block in rows.split(BLOCK))
        return torch.cat([self.product(block) for block in blocks])


class Step(nn.Module):
    """A convolution, normalised, then ReLU."""

    def __init__(self, w, taps, inputs, outputs):
        super().__init__()
        self.conv = Convolution((w / "conv")("weight", taps, inputs, outputs), scale_and_shift(w / "norm", outputs))

    def forward(self, x, rows):
        return self.conv(x, rows).relu_()


class Up(nn.Module):
    """Transposed: a half times all eight matrices, of which each of its sites takes one; normalised, then ReLU."""

    def __init__(self, w, inputs, outputs):
        super().__init__()
        self.outputs = outputs
        scale, shift = scale_and_shift(w / "norm", outputs)
        weight = (w / "conv")("weight", 8, inputs, outputs) * scale
        self.product = Linear(weight.transpose(0, 1).flatten(1), shift.repeat(8))

    def forward(self, x, children):
        return self.product(x).view(-1, self.outputs).index_select(0, children).relu_()


class Residual(nn.Module):
    """Two submanifold convolutions and a way around them."""

    def __init__(self, w, inputs, outputs):
        super().__init__()
        self.first = Step(w / "first", 27, inputs, outputs)
        self.second = Convolution((w / "second")("weight", 27, outputs, outputs), scale_and_shift(w / "norm", outputs))
        self.around = nn.Identity()
        if inputs != outputs:
            scale, shift = scale_and_shift(w / "around" / "norm", outputs)
            self.around = Linear((w / "around" / "linear")("weight", inputs, outputs) * scale, shift)

    def forward(self, x, rows):
        return self.second(self.first(x, rows), rows).add_(self.around(x)).relu_()


class Blocks(nn.Module):
    def __init__(self, w, inputs, outputs):
        super().__init__()
        self.first = Residual(w / "first", inputs, outputs)
        self.second = Residual(w / "second", outputs, outputs)

    def forward(self, x, rows):
        return self.second(self.first(x, rows), rows)


class Decoder(nn.Module):
    """The U-Net and its head."""

    def __init__(self, w, inputs, base):
        super().__init__()
        b, b2, b3, b4 = base, 2 * base, 3 * base, 4 * base
        unet = w / "unet"
        self.stem = Step(unet / "stem", 27, inputs, b)
        self.change1 = Step(unet / "down1" / "change", 8, b, b)
        self.down1 = Blocks(unet / "down1", b, b2)
        self.change2 = Step(unet / "down2" / "change", 8, b2, b2)
        self.down2 = Blocks(unet / "down2", b2, b4)
        self.back1 = Up(unet / "up1" / "change", b4, b3)
        self.up1 = Blocks(unet / "up1", b3 + b2, b3)
        self.back2 = Up(unet / "up2" / "change", b3, b3)
        self.up2 = Blocks(unet / "up2", b3 + b, b3)
        self.head = linear(w / "head", b3, 1)

    def forward(self, x, sites):
        """Features [N, 3b] and logits [N]."""
        maps = Maps(sites)
        full, half, quarter = maps.same
        stem = self.stem(x, full)
        first = self.down1(self.change1(stem, maps.down[0]), half)
        second = self.down2(self.change2(first, maps.down[1]), quarter)
        first = self.up1(torch.cat([self.back1(second, maps.up[1]), first], 1), half)
        features = self.up2(torch.cat([self.back2(first, maps.up[0]), stem], 1), full)
        return features, self.head(features)[:, 0]

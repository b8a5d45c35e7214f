"""The whole network in PyTorch, as fast on a processor as PyTorch goes without a compiler: what speed.py compares ours with.

The same weights give the same numbers as the references net_*.py to 32 bits; test_net_torch.py says so. Names and the order
of arguments are theirs.
"""

import dataclasses

import torch
from net_torch_decode import Decoder
from net_torch_fusion import Fusion, project
from net_torch_planes import PlaneNet
from net_torch_weights import Weights, read
from torch import nn

STRIDES = [16, 8, 4]
VOXEL_M = [0.16, 0.08, 0.04]
GUIDE_CHANNELS = 2


@dataclasses.dataclass
class NetConfig:
    """Widths and switches, as in crate/net/src/config.rs."""

    backbone: list[int]
    pyramid: int
    planes: list[int]
    unet: list[int]
    pce: bool
    acm: bool
    ipsd: bool
    matching: bool
    guide: bool


@dataclasses.dataclass
class Cameras:
    """Of V views, in 64 bits: fx, fy, cx, cy [V, 4]; world from camera as rotations [V, 3, 3] and positions [V, 3]."""

    intrinsics: torch.Tensor
    rotation: torch.Tensor
    position: torch.Tensor


class Ipdrecon(nn.Module):
    def __init__(self, config, source):
        """`source(path, shape)` gives the arrays of the weights."""
        super().__init__()
        w = Weights(source)
        self.config = config
        self.planes = PlaneNet(w / "planes", config, STRIDES)
        self.fusion = nn.ModuleList(Fusion(w / "fusion" / i, width, config) for i, width in enumerate(config.planes))
        self.decoders = nn.ModuleList(
            Decoder(w / "decoders" / i, self.inputs(i), width) for i, width in enumerate(config.unet)
        )
        self.eval()

    @classmethod
    def load(cls, file):
        """With the weights of a safetensors file."""
        config, source = read(file)
        return cls(NetConfig(**config), source)

    def inputs(self, level):
        """Channels that a level's 3D network is given."""
        above = 3 * self.config.unet[level - 1] + 1 if level else 0
        return above + self.config.planes[level] + (GUIDE_CHANNELS if self.config.guide else 0)

    def fuse(self, level, plane, cameras, sites, origin_m):
        """Features [N, C], logits [N, V] and which of these are seen."""
        base, hidden, _ = plane
        points_m = sites * VOXEL_M[level] + origin_m
        geometry = project(cameras, points_m, STRIDES[level], *base.shape[2:])
        return *self.fusion[level](base, hidden, geometry), geometry[3]

    def decode(self, level, fused, sites, above=None, parent=None, guide=None):
        """Features [N, 3b] and logits [N]. `above` is what the level above gave, `parent` each site's row there."""
        parts = [fused]
        if above is not None:
            features, logit = above
            parts = [features[parent], fused, logit[parent, None]]
        if self.config.guide:
            parts.append(torch.zeros(len(sites), GUIDE_CHANNELS) if guide is None else guide)
        return self.decoders[level](torch.cat(parts, 1), sites)

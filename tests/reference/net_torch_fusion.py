"""Planes to voxels in PyTorch: net_fusion.py once more, with its names, in 32 bits and for speed.

Dense, as VoRTX is: every view of a voxel is a token, [N, V, C], and a mask says which views see it. Voxels go through in
blocks whose tokens stay in cache.
"""

import math

import torch
import torch.nn.functional as F
from net_torch_weights import Linear, layer_norm, linear
from torch import nn

HEADS, GROUPS, LAYERS = 2, 8, 2
DEPTH_MEAN_M, DEPTH_STEP_M = 1.85, 0.85
# Tokens that go through the encoder at a time.
BLOCK = 40960
# A sequence with fewer tokens costs PyTorch's attention as much as one with these.
SEQUENCE = 20


def project(cameras, points_m, stride, height, width):
    """u, v, z [N, V] in planes of that size, and what is seen."""
    fx, fy, cx, cy = (cameras.intrinsics / stride).unbind(1)
    zero, one = torch.zeros_like(fx), torch.ones_like(fx)
    plane_from_camera = torch.stack([fx, zero, cx, zero, fy, cy, zero, zero, one], 1).view(-1, 3, 3)
    plane_from_world = plane_from_camera @ cameras.rotation.mT
    offset = plane_from_world @ cameras.position[:, :, None]
    at = plane_from_world.float() @ points_m.T - offset.float()
    x, y, z = at.permute(1, 2, 0).contiguous()
    u, v = x / z, y / z
    seen = (z > 0) & (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1)
    return u, v, z, seen


class Places:
    """Where planes [V, C, h, w] are sampled: four rows of their pixels [N * V, 4], and the parts that these have."""

    def __init__(self, u, v, seen, height, width):
        self.shape = u.shape
        u, v = u.where(seen, 0), v.where(seen, 0)
        x, y = u.floor().clamp_(max=width - 2), v.floor().clamp_(max=height - 2)
        corner = (x + width * y).int() + height * width * torch.arange(u.shape[1], dtype=torch.int32)
        self.rows = torch.stack([corner, corner + 1, corner + width, corner + width + 1], -1).view(-1, 4)
        right, down = u - x, v - y
        left, up = 1 - right, 1 - down
        parts = torch.stack([left * up, right * up, left * down, right * down], -1) * seen[..., None]
        self.parts = parts.view(-1, 4)

    def sample(self, pixels):
        """[N, V, C] from the planes' pixels [V * h * w, C]; zeros where not seen.

        `embedding_bag` took a sixth of the time of `grid_sample`, which gathers every channel by itself and leaves the
        views outermost.
        """
        return F.embedding_bag(self.rows, pixels, mode="sum", per_sample_weights=self.parts).view(*self.shape, -1)


class Likeness(nn.Module):
    """Cosine of each view's group of features with the mean of the others', [N, V, G]."""

    def __init__(self, width):
        super().__init__()
        self.sum = Linear(torch.eye(GROUPS).repeat_interleave(width // GROUPS, 0))

    def forward(self, x, seen):
        """x is 0 where not seen."""
        others = (seen.sum(1, keepdim=True) - 1)[..., None]
        # What is left of a sum of one is rounding, whose direction means nothing.
        share = (others > 0) / others.clamp(min=1)
        rest = (x.sum(1, keepdim=True) - x) * share
        return self.sum(x * rest) / torch.sqrt(self.sum(x * x) * self.sum(rest * rest) + 1e-12)


def attention_bias(seen):
    """What is added to the scores, [N / together, 1, 1 or T, T]: several voxels share a sequence of T tokens."""
    voxels, views = seen.shape
    together = math.gcd(voxels, max(1, SEQUENCE // views))
    # A voxel that nobody sees needs something to attend to; pooling drops it.
    allowed = seen | ~seen.any(1, keepdim=True)
    bias = torch.zeros(allowed.shape).masked_fill_(~allowed, -math.inf).view(-1, 1, 1, together * views)
    if together == 1:
        return bias
    same = torch.eye(together).bool().repeat_interleave(views, 0).repeat_interleave(views, 1)
    return bias + torch.zeros(same.shape).masked_fill_(~same, -math.inf)


class EncoderLayer(nn.Module):
    def __init__(self, w, width):
        super().__init__()
        self.norm_attention = layer_norm(w / "norm_attention", width)
        self.query_key_value = linear(w / "query_key_value", width, 3 * width)
        self.output = linear(w / "output", width, width)
        self.norm_mlp = layer_norm(w / "norm_mlp", width)
        self.mlp_in = linear(w / "mlp_in", width, 2 * width)
        self.mlp_out = linear(w / "mlp_out", 2 * width, width)

    def forward(self, x, bias):
        """Tokens [N, V, C]."""
        qkv = self.query_key_value(self.norm_attention(x)).view(len(bias), -1, 3, HEADS, x.shape[2] // HEADS)
        q, k, v = qkv.permute(2, 0, 3, 1, 4)
        y = F.scaled_dot_product_attention(q, k, v, attn_mask=bias).transpose(1, 2).reshape(x.shape)
        x = self.output(y).add_(x)
        return self.mlp_out(self.mlp_in(self.norm_mlp(x)).relu_()).add_(x)


class Fusion(nn.Module):
    """The fusion of a level's views, pooled by softmax."""

    def __init__(self, w, width, config):
        super().__init__()
        self.lift = linear(w / "lift" / "linear", width, width) if config.ipsd else None
        self.likeness = Likeness(width) if config.matching else None
        self.embed = linear(w / "embed", width + 1 + (GROUPS if config.matching else 0), width)
        self.layers = nn.ModuleList(EncoderLayer(w / "layers" / i, width) for i in range(LAYERS))
        self.occupancy = linear(w / "occupancy", width, 1)
        self.norm = layer_norm(w / "norm", width)

    def tokens(self, base, hidden, places, z, seen):
        """[N, V, C] from the planes' pixels."""
        plain = places.sample(base)
        x = plain + self.lift(F.silu(places.sample(hidden), inplace=True)) if self.lift else plain
        parts = [x, ((z - DEPTH_MEAN_M) / DEPTH_STEP_M)[..., None]]
        if self.likeness:
            parts.append(self.likeness(plain, seen))
        x = self.embed(torch.cat(parts, 2))
        bias = attention_bias(seen)
        for layer in self.layers:
            x = layer(x, bias)
        return x

    def pooled(self, x, seen):
        """Features and logits; the logit of seeing nothing is 0."""
        logits = self.occupancy(x)[..., 0]
        weights = F.pad(logits.masked_fill(~seen, -math.inf), (0, 1)).softmax(1)[:, None, :-1]
        return self.norm((weights @ x)[:, 0]), logits

    def forward(self, base, hidden, geometry):
        """Features [N, C] and logits [N, V], these where seen."""
        views, channels, *size = base.shape
        base = base.permute(0, 2, 3, 1).reshape(-1, channels)
        if self.lift:
            hidden = hidden.permute(0, 2, 3, 1).reshape(-1, channels)
        found = []
        for u, v, z, seen in zip(*(part.split(max(1, BLOCK // views)) for part in geometry)):
            x = self.tokens(base, hidden, Places(u, v, seen, *size), z, seen)
            found.append(self.pooled(x, seen))
        features, logits = zip(*found)
        return torch.cat(features), torch.cat(logits)

"""Plane-sweep stereo a second time, from its definition: golden numbers, and the peer that speed is measured against.

`stereo.py golden` writes ../golden/stereo.json: a slanted plane and a box, seen from four poses under four exposures,
and what comes of them step by step. There the sweep is NumPy and everything is f64.

`stereo.py time SCAN --size 320x240 --keyframes N --threads T` prints seconds a keyframe on a 7-Scenes folder as JSON:
both sweeps, f32, after decoding and compiling. `--sweep numba` (the default, and the faster) compiles the sweep too;
`--sweep numpy` has a NumPy sweep in a pool of threads. Smoothing and planes are numba's in both.

Pictures are grey (luma of 0 to 255) with pixel centres at integers. A pixel p of the reference at inverse depth rho
lies at K_s (R K_r^-1 (x, y, 1) + rho t) in a source, where R and t lead from the reference camera to the source's.
"""

import argparse
import dataclasses
import json
import os
import pathlib
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit, prange

# What crate/stereo goes by; the golden file carries them along.
SETTINGS = {
    "near_m": 0.4,
    "far_m": 6.0,
    "planes": 128,
    "sources": 12,
    "sweep": {"radius": 2, "noise_var": 0.1, "best": 0.5},
    "smooth": {"p1": 0.1, "p2": 1.0, "edge": 10.0},
    "local_planes": {"radius": 8, "stride": 2, "gray": 10.0, "relative": 0.03, "ridge": 1.0},
    "fine_reach": 8,
    "fine_step": 0.25,
    "fine_sweep": {"radius": 2, "noise_var": 0.1, "best": 0.5},
    "fine_smooth": {"p1": 0.07, "p2": 0.45, "edge": 10.0},
}
LEAST_RHO = 1e-3
# Sums may be taken in any order; NaN and infinity stay what they are.
FAST = {"contract", "reassoc", "nsz", "arcp"}


@dataclasses.dataclass
class View:
    """`pose`: camera to world, 4x4, x right, y down, z forward."""

    camera: dict
    pose: np.ndarray
    gray: np.ndarray

    def matrix(self):
        k = self.camera
        return np.array([[k["fx"], 0, k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1.0]])


def warp(reference, source):
    """A (3x3) and b (3): homogeneous pixel of the source = A (x, y, 1) + b rho."""
    to_source = np.linalg.inv(source.pose) @ reference.pose
    k = source.matrix()
    return k @ to_source[:3, :3] @ np.linalg.inv(reference.matrix()), k @ to_source[:3, 3]


# ---- the sweep ----


def hypotheses(base, offset):
    return offset if base is None else np.maximum(base + base.dtype.type(offset), LEAST_RHO)


def sample(gray, at_infinity, b, rho):
    """Grey values of a source where the hypotheses fall, and which of them it sees."""
    height, width = gray.shape
    last_u, last_v = gray.dtype.type(width - 1.001), gray.dtype.type(height - 1.001)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = at_infinity[2] + b[2] * rho
        inverse = 1 / z
        u, v = (at_infinity[0] + b[0] * rho) * inverse, (at_infinity[1] + b[1] * rho) * inverse
        seen = (z > 1e-6) & (u >= 0) & (v >= 0) & (u <= last_u) & (v <= last_v)
        # What is not a number becomes 0.
        u, v = np.fmin(np.fmax(u, 0), last_u), np.fmin(np.fmax(v, 0), last_v)
    left, top = u.astype(np.int64), v.astype(np.int64)
    at = top * width + left
    u -= left.astype(gray.dtype)
    v -= top.astype(gray.dtype)
    flat = gray.ravel()
    upper, lower = flat.take(at), flat.take(at + width)
    upper += (flat.take(at + 1) - upper) * u
    lower += (flat.take(at + width + 1) - lower) * u
    upper += (lower - upper) * v
    return upper, seen


def box(image, radius):
    """Sums over the window, as much of it as lies in the picture."""
    height, width = image.shape
    padded = np.pad(image, radius)
    along = padded[:, :width].copy()
    for k in range(1, 2 * radius + 1):
        along += padded[:, k : k + width]
    out = along[:height].copy()
    for k in range(1, 2 * radius + 1):
        out += along[k : k + height]
    return out


def sweep_numpy(reference, sources, base, offsets, config, threads=1):
    """Cost [height, width, planes]: 1 - the mean of the best share of the correlations; 1 where no source sees. Samples are whole steps of a grey
    level."""
    steps = 64 if config["radius"] <= 2 else 32
    gray, radius = reference.gray, config["radius"]
    kind = gray.dtype.type
    rows, columns = np.mgrid[: gray.shape[0], : gray.shape[1]]
    pixels = np.stack([columns, rows, np.ones_like(rows)]).astype(gray.dtype)
    count = box(np.ones_like(gray), radius)
    mean = box(gray, radius) / count
    noise = count * kind(config["noise_var"])
    deviation = np.maximum(box(gray * gray, radius) - count * mean * mean, 0) + noise
    warps = [tuple(m.astype(gray.dtype) for m in warp(reference, s)) for s in sources]
    warps = [(np.tensordot(a, pixels, 1), b) for a, b in warps]
    cost = np.empty(gray.shape + (len(offsets),), gray.dtype)

    def plane(d):
        rho = hypotheses(base, kind(offsets[d]))
        scores = np.empty((len(sources),) + gray.shape, gray.dtype)
        for k, (source, (at_infinity, b)) in enumerate(zip(sources, warps)):
            other, seen = sample(source.gray, at_infinity, b, rho)
            other = np.round(other * steps) / steps
            total = box(other, radius)
            covariance = box(gray * other, radius) - mean * total
            spread = np.maximum(box(other * other, radius) - total * total / count, 0) + noise
            scores[k] = np.where(seen, covariance / np.sqrt(deviation * spread), -2)
        scores = -np.sort(-scores, axis=0)
        used = np.ceil((scores > -1.5).sum(axis=0) * config["best"])
        rank = np.arange(len(sources))[:, None, None]
        best = np.where(rank < used, scores, 0).sum(axis=0)
        cost[:, :, d] = np.where(used > 0, 1 - best / np.maximum(used, 1), 1)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(plane, range(len(offsets))))
    return cost


@njit(fastmath=FAST, nogil=True)
def row_of_samples(gray, at, a, b, rho, y, out, seen):
    """One row of samples; `at`: pictures of all sources lie one after the other in `gray`, each [height, width]."""
    start, height, width = at
    last_u, last_v = np.float32(width - 1.001), np.float32(height - 1.001)
    zero, one = np.float32(0), np.float32(1)
    y = np.float32(y)
    u0, v0, z0 = a[0, 1] * y + a[0, 2], a[1, 1] * y + a[1, 2], a[2, 1] * y + a[2, 2]
    for x in range(out.size):
        fx = np.float32(x)
        z = a[2, 0] * fx + z0 + b[2] * rho[x]
        inverse = one / z
        u = (a[0, 0] * fx + u0 + b[0] * rho[x]) * inverse
        v = (a[1, 0] * fx + v0 + b[1] * rho[x]) * inverse
        inside = (z > np.float32(1e-6)) & (u >= zero) & (v >= zero) & (u <= last_u) & (v <= last_v)
        seen[x] = one if inside else zero
        u = min(max(zero, u), last_u)
        v = min(max(zero, v), last_v)
        left, top = np.int32(u), np.int32(v)
        u -= np.float32(left)
        v -= np.float32(top)
        i = start + top * width + left
        upper = gray[i] + (gray[i + 1] - gray[i]) * u
        lower = gray[i + width] + (gray[i + width + 1] - gray[i + width]) * u
        out[x] = upper + (lower - upper) * v


@njit(fastmath=FAST, nogil=True)
def sum_windows(image, row, radius, column, out):
    """Window sums of one row of `image`, zeros beyond the picture; `column` has a margin of `radius` zeros."""
    height, width = image.shape
    first, last = max(row - radius, 0), min(row + radius + 1, height)
    middle = column[radius : radius + width]
    middle[:] = image[first]
    for r in range(first + 1, last):
        line = image[r]
        for x in range(width):
            middle[x] += line[x]
    out[:] = column[:width]
    for k in range(1, 2 * radius + 1):
        part = column[k : k + width]
        for x in range(width):
            out[x] += part[x]


@njit(fastmath=FAST, nogil=True)
def score_row(total, squares, products, mean, scale, size, noise_var, seen, out):
    for x in range(out.size):
        covariance = products[x] - mean[x] * total[x]
        spread = max(squares[x] - total[x] * total[x] / size[x], np.float32(0)) + noise_var * size[x]
        correlation = covariance * scale[x] / np.sqrt(spread)
        out[x] = correlation if seen[x] > 0 else np.float32(-2)


BAND = 20


@njit(parallel=True, fastmath=FAST)
def sweep_bands(gray, means, scales, sizes, others, places, a, b, base, offsets, radius, noise_var, best):
    """Costs [planes, height, width], a band of rows of a plane at a time."""
    height, width = gray.shape
    sources, planes = len(places), len(offsets)
    kept = max(1, int(np.ceil(sources * best)))
    noise_var, share = np.float32(noise_var), np.float32(best)
    cost = np.empty((planes, height, width), np.float32)
    bands = (height + BAND - 1) // BAND
    for job in prange(bands * planes):
        d, first = job % planes, job // planes * BAND
        last = min(first + BAND, height)
        above, below = max(first - radius, 0), min(last + radius, height)
        warped = np.empty((3, below - above, width), np.float32)
        seen = np.empty((below - above, width), np.float32)
        sums = np.empty((3, width), np.float32)
        column = np.zeros(width + 2 * radius, np.float32)
        rho = np.empty((below - above, width), np.float32)
        ranked = np.full((kept, last - first, width), np.float32(-2))
        count = np.zeros((last - first, width), np.float32)
        score = np.empty(width, np.float32)
        for y in range(above, below):
            if base.size:
                rho[y - above] = np.maximum(base[y] + offsets[d], np.float32(LEAST_RHO))
            else:
                rho[y - above] = offsets[d]
        for k in range(sources):
            for y in range(above, below):
                line, squares, products = warped[0, y - above], warped[1, y - above], warped[2, y - above]
                row_of_samples(others, places[k], a[k], b[k], rho[y - above], y, line, seen[y - above])
                mine = gray[y]
                for x in range(width):
                    squares[x] = line[x] * line[x]
                    products[x] = line[x] * mine[x]
            for y in range(first, last):
                for image in range(3):
                    sum_windows(warped[image], y - above, radius, column, sums[image])
                visible = seen[y - above]
                score_row(sums[0], sums[1], sums[2], means[y], scales[y], sizes[y], noise_var, visible, score)
                counted = count[y - first]
                for x in range(width):
                    counted[x] += visible[x]
                # The better one stays, the lesser one is offered to the next rank.
                for rank in range(kept):
                    held = ranked[rank, y - first]
                    for x in range(width):
                        high, low = max(held[x], score[x]), min(held[x], score[x])
                        held[x] = high
                        score[x] = low
        for y in range(first, last):
            total, out = np.zeros(width, np.float32), cost[d, y]
            counted = count[y - first]
            for rank in range(kept):
                held = ranked[rank, y - first]
                for x in range(width):
                    total[x] += held[x] if rank < counted[x] * share else np.float32(0)
            for x in range(width):
                used = np.ceil(counted[x] * share)
                out[x] = np.float32(1) - total[x] / used if used > 0 else np.float32(1)
    return cost


@njit(parallel=True)
def planes_inside(cost):
    """[planes, height, width] to [height, width, planes]."""
    planes, height, width = cost.shape
    out = np.empty((height, width, planes), cost.dtype)
    for y in prange(height):
        for x in range(width):
            for d in range(planes):
                out[y, x, d] = cost[d, y, x]
    return out


def sweep_numba(reference, sources, base, offsets, config, threads=1):
    """As `sweep_numpy`, in f32."""
    gray, radius = reference.gray, config["radius"]
    sizes = box(np.ones_like(gray), radius)
    means = box(gray, radius) / sizes
    noise = np.float32(config["noise_var"])
    spread = np.maximum(box(gray * gray, radius) - sizes * means * means, 0) + noise * sizes
    warps = [warp(reference, s) for s in sources]
    starts = np.cumsum([0] + [s.gray.size for s in sources[:-1]])
    places = np.array([(start,) + s.gray.shape for start, s in zip(starts, sources)], np.int32)
    cost = sweep_bands(
        gray,
        means,
        1 / np.sqrt(spread),
        sizes,
        np.concatenate([s.gray.ravel() for s in sources]),
        places,
        np.array([a for a, _ in warps], np.float32),
        np.array([b for _, b in warps], np.float32),
        np.empty((0, 0), np.float32) if base is None else base,
        offsets,
        radius,
        config["noise_var"],
        config["best"],
    )
    return planes_inside(cost)


# ---- smoothing and winners ----


def line_starts(height, width, dx, dy):
    """Pixels whose predecessor along (dx, dy) lies outside the picture."""
    y, x = np.mgrid[:height, :width]
    inside = (x - dx >= 0) & (x - dx < width) & (y - dy >= 0) & (y - dy < height)
    return np.argwhere(~inside)


@njit(parallel=True, fastmath=FAST)
def add_paths(cost, gray, starts, dx, dy, p1, p2, edge, total):
    height, width, planes = cost.shape
    kind = cost.dtype.type
    p1, p2, edge, one = kind(p1), kind(p2), kind(edge), kind(1)
    for line in prange(len(starts)):
        y, x = starts[line]
        # One plane more at both ends, never the best.
        path, following = np.full(planes + 2, kind(1e9)), np.full(planes + 2, kind(1e9))
        path[1 : planes + 1] = cost[y, x]
        total[y, x] += cost[y, x]
        least = cost[y, x].min()
        while True:
            before = gray[y, x]
            y, x = y + dy, x + dx
            if y < 0 or y >= height or x < 0 or x >= width:
                break
            jump = least + max(p1, p2 / (one + abs(gray[y, x] - before) / edge))
            here, sums, now = cost[y, x], total[y, x], following[1 : planes + 1]
            same, lower, upper = path[1 : planes + 1], path[:planes], path[2 : planes + 2]
            for d in range(planes):
                step = min(lower[d], upper[d]) + p1
                value = here[d] + min(min(same[d], jump), step) - least
                now[d] = value
                sums[d] += value
            least = now[0]
            for d in range(planes):
                least = min(least, now[d])
            path, following = following, path


def smooth(cost, gray, config):
    """Semi-global: sums over paths from eight directions (Hirschmueller 2008)."""
    total = np.zeros_like(cost)
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)):
        starts = line_starts(*gray.shape, dx, dy)
        add_paths(cost, gray, starts, dx, dy, config["p1"], config["p2"], config["edge"], total)
    return total


@njit(parallel=True)
def choose_planes(cost, total, first, step):
    height, width, planes = cost.shape
    rho = np.empty((height, width), cost.dtype)
    zncc, unique = np.empty_like(rho), np.empty_like(rho)
    for y in prange(height):
        for x in range(width):
            sums = total[y, x]
            best = np.argmin(sums)
            shift = 0.0
            if 0 < best < planes - 1:
                before, after = sums[best - 1], sums[best + 1]
                curvature = before + after - 2 * sums[best]
                if curvature > 1e-6:
                    shift = min(max((before - after) / (2 * curvature), -0.5), 0.5)
            second = np.inf
            for d in range(planes):
                if abs(d - best) > 2:
                    second = min(second, sums[d])
            rho[y, x] = first + (best + shift) * step
            zncc[y, x] = 1 - cost[y, x, best]
            unique[y, x] = (second - sums[best]) / 8
    return rho, zncc, unique


# ---- local planes, and the way through both sweeps ----


@njit(parallel=True, fastmath=FAST)
def local_planes(rho, weight, gray, radius, stride, gray_scale, relative, ridge):
    """At each pixel the value of v(dx, dy) = c + a dx + b dy, the weighted least squares fit to its neighbours.

    The slopes are pulled to zero by `ridge` times the sum of weights; the pixel itself weighs 1e-6 more.
    """
    height, width = rho.shape
    out = np.empty_like(rho)
    for y in prange(height):
        for x in range(width):
            own, shade = rho[y, x], gray[y, x]
            s = sx = sy = sxx = sxy = syy = sv = sxv = syv = 0.0
            for dy in range(-radius, radius + 1, stride):
                if y + dy < 0 or y + dy >= height:
                    continue
                for dx in range(-radius, radius + 1, stride):
                    if x + dx < 0 or x + dx >= width:
                        continue
                    v = rho[y + dy, x + dx] - own
                    of_gray = (gray[y + dy, x + dx] - shade) / gray_scale
                    of_rho = v / (relative * own)
                    k = weight[y + dy, x + dx] / ((1 + of_gray * of_gray) * (1 + of_rho * of_rho))
                    s += k
                    sx += k * dx
                    sy += k * dy
                    sxx += k * dx * dx
                    sxy += k * dx * dy
                    syy += k * dy * dy
                    sv += k * v
                    sxv += k * dx * v
                    syv += k * dy * v
            s += 1e-6
            # Normal equations, solved for c by Cramer's rule.
            sxx += ridge * s
            syy += ridge * s
            of_s, of_x, of_y = sxx * syy - sxy * sxy, sx * syy - sy * sxy, sx * sxy - sy * sxx
            determinant = s * of_s - sx * of_x + sy * of_y
            c = (sv * of_s - sxv * of_x + syv * of_y) / determinant
            out[y, x] = max(own + c, LEAST_RHO)
    return out


def spaced(settings):
    return np.linspace(1 / settings["far_m"], 1 / settings["near_m"], settings["planes"])


def match_coarse(reference, sources, settings, sweep, threads=1):
    kind = reference.gray.dtype
    offsets = spaced(settings).astype(kind)
    cost = sweep(reference, sources, None, offsets, settings["sweep"], threads)
    total = smooth(cost, reference.gray, settings["smooth"])
    step = (offsets[-1] - offsets[0]) / (len(offsets) - 1)
    return cost, total, choose_planes(cost, total, offsets[0], step)


def match_fine(reference, sources, rho, zncc, settings, sweep, threads=1):
    """The second sweep: around local planes."""
    weight = np.clip(zncc - zncc.dtype.type(0.05), 0.01, 1)
    p = settings["local_planes"]
    base = local_planes(
        rho, weight, reference.gray, p["radius"], p["stride"], p["gray"], p["relative"], p["ridge"]
    )
    inverse = spaced(settings)
    step = (inverse[1] - inverse[0]) * settings["fine_step"]
    reach = settings["fine_reach"]
    offsets = (np.arange(-reach, reach + 1) * step).astype(rho.dtype)
    cost = sweep(reference, sources, base, offsets, settings["fine_sweep"], threads)
    total = smooth(cost, reference.gray, settings["fine_smooth"])
    rho, zncc, unique = choose_planes(cost, total, offsets[0], rho.dtype.type(step))
    return base, cost, total, (base + rho, zncc, unique)


# ---- consistency ----


def judge(reference, rho, others):
    """How many sources the point of each pixel is visible in, agree with its depth, and do so closely; [3, h, w]."""
    height, width = rho.shape
    y, x = np.mgrid[:height, :width].astype(float)
    counts = np.zeros((3, height, width), int)
    for source, there in others:
        a, b = warp(reference, source)
        at = np.stack([x, y, np.ones_like(x)])
        u, v, z = np.tensordot(a, at, 1) + b[:, None, None] * rho
        u, v = np.floor(u / z + 0.5), np.floor(v / z + 0.5)
        inside = (z > 1e-6) & (u >= 0) & (v >= 0) & (u < there.shape[1]) & (v < there.shape[0])
        u, v = np.where(inside, u, 0), np.where(inside, v, 0)
        found = there[v.astype(int), u.astype(int)]
        a, b = warp(source, reference)
        p = np.tensordot(a, np.stack([u, v, np.ones_like(u)]), 1) + b[:, None, None] * found
        off_px = np.hypot(p[0] / p[2] - x, p[1] / p[2] - y)
        # The point's depth in the reference is p[2] / found.
        off = np.abs(rho * p[2] / found - 1)
        agree = inside & (p[2] > 1e-6) & (off_px <= 2) & (off <= 0.05)
        counts += [inside, agree, agree & (off_px <= 1) & (off <= 0.02)]
    return counts


def confidence(counts, unique):
    visible, agree, close = counts
    n = visible + 1
    score = -2.4 + 2.8 * agree / n + 3.1 * close / n + 1.5 * np.minimum(unique, 0.3) / 0.3
    return np.where(agree > 0, 1 / (1 + np.exp(-score)), 0)


# ---- golden numbers ----


def shade(x, y, seed):
    """Waves down to 0.2 m, and a flat patch."""
    rng = np.random.default_rng(seed)
    waves = rng.uniform(-30, 30, (9, 2))
    value = sum(14 * np.sin(p * x + q * y + i) for i, (p, q) in enumerate(waves))
    return np.where(np.hypot(x - 0.45, y + 0.1) < 0.12, 110.0, 128 + value)


def draw(camera, pose):
    """A slanted wall z = 1.9 + 0.3 x + 0.15 y with a box in front: grey values and true depth."""
    v, u = np.mgrid[: camera["height"], : camera["width"]].astype(float)
    rays = np.stack([(u - camera["cx"]) / camera["fx"], (v - camera["cy"]) / camera["fy"], np.ones_like(u)], axis=-1)
    rays, eye = rays @ pose[:3, :3].T, pose[:3, 3]
    normal = np.array([-0.3, -0.15, 1.0])
    depth = (1.9 - eye @ normal) / (rays @ normal)
    point = eye + depth[..., None] * rays
    gray = shade(point[..., 0], point[..., 1], 1)
    low, high = np.array([-0.42, -0.15, 1.25]), np.array([-0.1, 0.22, 1.55])
    near, far = (low - eye) / rays, (high - eye) / rays
    enter, leave = np.minimum(near, far), np.maximum(near, far).min(axis=-1)
    face, enter = enter.argmax(axis=-1), enter.max(axis=-1)
    point = eye + enter[..., None] * rays
    # The two coordinates along the face that is hit.
    p = np.where(face == 0, point[..., 2], point[..., 0])
    q = np.where(face == 1, point[..., 2], point[..., 1])
    hit = (enter < leave) & (enter < depth)
    return np.where(hit, shade(p + 5, q, 2), gray), np.where(hit, enter, depth)


def look(x, y, z, turn, gain, lift, size=(48, 36)):
    camera = {"width": size[0], "height": size[1], "fx": 44.0, "fy": 44.5}
    camera |= {"cx": size[0] / 2 - 0.8, "cy": size[1] / 2 - 0.3}
    pose = np.eye(4)
    c, s = np.cos(turn), np.sin(turn)
    pose[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    pose[:3, 3] = x, y, z
    pose = np.round(pose, 9)
    gray, depth = draw(camera, pose)
    gray = np.round(np.clip(gray * gain + lift, 0, 255) * 16) / 16
    return View(camera, pose, gray), depth


def numbers(array, digits):
    return np.round(array, digits).ravel().tolist()


def golden():
    settings = SETTINGS | {"near_m": 0.9, "far_m": 4.0, "planes": 28}
    looks = [
        (0.0, 0.0, 0.0, 0.0, 1.0, 0.0),
        (0.18, 0.02, 0.03, -0.05, 0.8, 10.0),
        (-0.16, 0.05, -0.04, 0.06, 1.1, -15.0),
        (0.04, -0.15, 0.05, 0.02, 0.6, 40.0, (44, 40)),
    ]
    views, depths = zip(*(look(*args) for args in looks))
    coarse, fine = [], []
    for view in views:
        others = [v for v in views if v is not view]
        coarse.append(match_coarse(view, others, settings, sweep_numpy))
        rho, zncc, _ = coarse[-1][2]
        fine.append(match_fine(view, others, rho, zncc, settings, sweep_numpy))
        check_compiled(view, others, settings, coarse[-1][0], fine[-1])
    (cost, total, (rho, zncc, unique)), (base, fine_cost, fine_total, last) = coarse[0], fine[0]
    counts = judge(views[0], last[0], [(v, f[3][0]) for v, f in zip(views[1:], fine[1:])])
    sure = confidence(counts, last[2])
    some = np.arange(0, rho.size, 13)

    def rows(values, digits):
        return [numbers(row, digits) for row in values.reshape(-1, values.shape[-1])[some]]

    text = json.dumps(
        {
            "settings": settings,
            "views": [
                {"camera": v.camera, "pose": v.pose[:3].tolist(), "gray": numbers(v.gray, 4)} for v in views
            ],
            "pixels": some.tolist(),
            "coarse": {
                "cost": rows(cost, 5),
                "sum": rows(total, 4),
                "rho": numbers(rho, 6),
                "zncc": numbers(zncc, 5),
                "unique": numbers(unique, 5),
            },
            "base": numbers(base, 6),
            "fine": {
                "cost": rows(fine_cost, 5),
                "sum": rows(fine_total, 4),
                "rho": numbers(last[0], 6),
                "zncc": numbers(last[1], 5),
                "unique": numbers(last[2], 5),
            },
            # Inverse depth of the other views, which the first one's is judged by.
            "others_rho": [numbers(f[3][0], 6) for f in fine[1:]],
            "visible": counts[0].ravel().tolist(),
            "agree": counts[1].ravel().tolist(),
            "close": counts[2].ravel().tolist(),
            "confidence": numbers(sure, 5),
        },
        separators=(",", ":"),
    )
    path = pathlib.Path(__file__).parent.parent / "golden" / "stereo.json"
    path.write_text(text + "\n")
    for name, found in (("first sweep", rho), ("planes", base), ("second sweep", last[0])):
        off = np.abs(found * depths[0] - 1)
        print(f"{name}: median error {np.median(off):.4f}, within 3 % {np.mean(off < 0.03):.3f} of the pixels")
    kept = counts[1] >= 2
    print(f"two agree: {kept.mean():.3f}; of those within 3 % {np.mean(off[kept] < 0.03):.3f}")
    print(f"confidence {sure.min():.3f} to {sure.max():.3f}; {len(text) / 1e3:.0f} kB")


def check_compiled(view, others, settings, cost, fine):
    """The compiled sweep is the NumPy sweep, to the precision of f32."""
    single = [dataclasses.replace(v, gray=v.gray.astype(np.float32)) for v in (view, *others)]
    offsets = spaced(settings).astype(np.float32)
    found = sweep_numba(single[0], single[1:], None, offsets, settings["sweep"])
    off = np.abs(found - cost)
    # A sample at the very border of a source may be seen in one and not in the other.
    assert np.mean(off < 1e-3) > 0.9995, off.max()


# ---- speed ----


def averaging(count, to):
    """[to, count]: the part of each new pixel that each old one fills."""
    old, new = np.arange(count), np.arange(to)[:, None] * count / to
    covered = np.minimum(old + 1, new + count / to) - np.maximum(old, new)
    return np.maximum(covered, 0) * to / count


def read_scan(folder, size):
    """Views of a 7-Scenes folder at the working size."""
    from PIL import Image

    folder = pathlib.Path(folder)
    k = np.loadtxt(folder / "camera-intrinsics.txt")
    views = []
    for pose_file in sorted(folder.glob("frame-*.pose.txt")):
        pose = np.loadtxt(pose_file)
        picture = next(folder.glob(pose_file.name.replace(".pose.txt", ".color.*")))
        luma = np.asarray(Image.open(picture).convert("RGB")) @ np.array([0.299, 0.587, 0.114])
        scale = min(size[0] / luma.shape[1], size[1] / luma.shape[0], 1)
        height, width = (round(side * scale) for side in luma.shape)
        sy, sx = height / luma.shape[0], width / luma.shape[1]
        camera = {"width": width, "height": height, "fx": k[0, 0] * sx, "fy": k[1, 1] * sy}
        camera |= {"cx": (k[0, 2] + 0.5) * sx - 0.5, "cy": (k[1, 2] + 0.5) * sy - 0.5}
        gray = averaging(luma.shape[0], height) @ luma @ averaging(luma.shape[1], width).T
        views.append(View(camera, pose, gray.astype(np.float32)))
    return views


def choose_sources(views, index, count):
    """The best by overlap (points at 1.5 m and 3 m) and by how near the baseline is to 0.25 m."""
    reference, scored = views[index], []
    c = reference.camera
    x, y = ((np.arange(5) + 0.5) / 5 * side for side in (c["width"], c["height"]))
    x, y = np.meshgrid(x, y)
    for k, source in enumerate(views):
        baseline = np.linalg.norm(source.pose[:3, 3] - reference.pose[:3, 3])
        if k == index or not 0.03 <= baseline <= 2:
            continue
        a, b = warp(reference, source)
        seen = []
        for z in (1.5, 3.0):
            p = np.tensordot(a, np.stack([x, y, np.ones_like(x)]), 1) + b[:, None, None] / z
            u, v = p[:2] / p[2]
            size = source.camera
            seen.append((p[2] > 0) & (u >= 0) & (v >= 0) & (u < size["width"]) & (v < size["height"]))
        overlap = np.mean(seen)
        if overlap >= 0.25:
            scored.append((-overlap * np.exp(-0.5 * (np.log(baseline / 0.25) / 0.6) ** 2), k))
    return [views[k] for _, k in sorted(scored)[:count]]


def match(reference, sources, settings, sweep, threads):
    _, _, (rho, zncc, _) = match_coarse(reference, sources, settings, sweep, threads)
    return match_fine(reference, sources, rho, zncc, settings, sweep, threads)[3]


def spread(count, n):
    """`n` of `count` indices, evenly, first and last among them."""
    return [round(i * (count - 1) / max(n - 1, 1)) for i in range(n)]


def time_scan(args):
    sweep = {"numba": sweep_numba, "numpy": sweep_numpy}[args.sweep]
    views = read_scan(args.scan, tuple(int(n) for n in args.size.split("x")))
    jobs = [(views[i], choose_sources(views, i, SETTINGS["sources"])) for i in spread(len(views), args.keyframes)]
    # Compiles, and is not counted; with NumPy's sweep a few planes are enough for that.
    few = SETTINGS | ({"planes": 16} if args.sweep == "numpy" else {})
    match(*jobs[0], few, sweep, args.threads)
    runs = []
    for job in jobs:
        if args.paced:
            print("ready", flush=True)
            input()
        wall, cpu = time.perf_counter(), time.process_time()
        _, zncc, _ = match(*job, SETTINGS, sweep, args.threads)
        runs.append((time.perf_counter() - wall, time.process_time() - cpu, float(zncc.mean())))
        if args.paced:
            print(json.dumps(runs[-1]), flush=True)
    wall, cpu, _ = np.median(runs, axis=0)
    found = {"seconds": wall, "cpu_seconds": cpu, "keyframes": len(jobs), "threads": args.threads}
    # Of each keyframe: seconds, seconds of all processors, mean correlation.
    print(json.dumps(found | {"sweep": args.sweep, "runs": runs}))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    commands.add_parser("golden").set_defaults(run=lambda _: golden())
    timing = commands.add_parser("time")
    timing.add_argument("scan")
    timing.add_argument("--size", default="320x240")
    timing.add_argument("--keyframes", type=int, default=5)
    timing.add_argument("--threads", type=int, default=os.cpu_count())
    timing.add_argument("--sweep", choices=("numba", "numpy"), default="numba")
    timing.add_argument("--paced", action="store_true", help="each keyframe waits for a line and answers with one")
    timing.set_defaults(run=time_scan)
    args = parser.parse_args()
    if hasattr(args, "threads"):
        import numba

        numba.set_num_threads(args.threads)
    args.run(args)


if __name__ == "__main__":
    main()

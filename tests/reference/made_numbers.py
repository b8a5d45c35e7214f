"""Numbers that the Rust tests and the references make alike, so that golden files hold results only."""

import numpy as np

_MASK = (1 << 64) - 1


def numbers(name, shape, scale):
    """An array of `shape` in [-scale, scale) that `name` decides: FNV-1a of the name, then SplitMix64."""
    seed = 0xCBF29CE484222325
    for byte in name.encode():
        seed = ((seed ^ byte) * 0x100000001B3) & _MASK
    count = int(np.prod(shape))
    with np.errstate(over="ignore"):
        z = np.uint64(seed) + np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    unit = (z >> np.uint64(40)).astype(np.float64) / float(1 << 24)
    return np.float32(scale * (2.0 * unit - 1.0)).reshape(shape).astype(np.float64)


def weight(path, shape):
    """The tensor at `path` of a module that the tests filled: see `filled` in crate/net/tests/common."""
    if len(shape) == 1:
        values = numbers(path, shape, np.float32(0.5))
        return values + 1.0 if path.endswith("running_var") else values
    fan_in = shape[0] if len(shape) == 2 else int(np.prod(shape)) // shape[0]
    return numbers(path, shape, np.sqrt(np.float32(3.0) / np.float32(fan_in)))

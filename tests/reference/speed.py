"""How fast the network is beside PyTorch: both on this processor, with as many threads and the same weights, in turns.

`speed.py --binary target/release/ipdrecon --weights FILE --threads 4 --views 10,20 --size 640x480` prints a table. What
is measured, and how often, is that of `ipdrecon table efficiency`: the planes of a picture; and a piece of 1.6 m with
everything occupied, seen by cameras around it, through finding who sees what, fusion and the 3D networks of all levels.
PyTorch's side is net_torch.py, without torch.compile. Every round runs the program, then PyTorch; medians are over the
rounds, the ratio's of each round's own. Ratios above 1 say that ours is faster.
"""

import argparse
import importlib.util
import json
import math
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time

if importlib.util.find_spec("torch") is None:
    sys.exit("expected PyTorch, found none; install it: pip install torch")

import torch
from net_torch import VOXEL_M, Cameras, Ipdrecon

REPOSITORY = pathlib.Path(__file__).parents[2]
# From here on as in crate/bench/src.
EDGE = 40
WARM_UP, RUNS = 2, 9


def median_ms(run):
    for _ in range(WARM_UP):
        run()
    times = []
    for _ in range(RUNS):
        started = time.perf_counter()
        run()
        times.append(1e3 * (time.perf_counter() - started))
    return statistics.median(times)


def around(width, height, count):
    """Cameras on a circle around the piece that look at its middle."""
    middle = 0.5 * EDGE * VOXEL_M[2]
    angle = math.tau * torch.arange(count, dtype=torch.float64) / count
    zero = torch.zeros_like(angle)
    ahead = torch.stack([angle.cos(), angle.sin(), zero], 1)
    right = torch.stack([angle.sin(), -angle.cos(), zero], 1)
    down = torch.stack([zero, zero, zero - 1], 1)
    intrinsics = torch.tensor([0.9 * width, 0.9 * width, 0.5 * (width - 1), 0.5 * (height - 1)], dtype=torch.float64)
    return Cameras(intrinsics.repeat(count, 1), torch.stack([right, down, ahead], 2), middle - 2.5 * ahead)


def images(width, height):
    return (torch.arange(3 * width * height) * 7919 % 251).float().view(1, 3, height, width)


def picture_ms(network, width, height):
    pictures, cameras = images(width, height), around(width, height, 1)
    return median_ms(lambda: network.planes(pictures, cameras))


def piece_ms(network, width, height, count):
    one = network.planes(images(width, height), around(width, height, 1))
    many = lambda plane: plane if plane is None else torch.cat([plane] * count)
    planes = [tuple(map(many, parts)) for parts in one]
    cameras = around(width, height, count)

    def run():
        above = parent = None
        for level, plane in enumerate(planes):
            edge = EDGE >> (2 - level)
            i = torch.arange(edge**3)
            sites = torch.stack([i % edge, i // edge % edge, i // edge**2], 1)
            if level > 0:
                parent = (sites >> 1) @ torch.tensor([1, edge // 2, (edge // 2) ** 2])
            fused, _, _ = network.fuse(level, plane, cameras, sites, torch.zeros(3))
            above = network.decode(level, fused, sites, above, parent)

    return median_ms(run)


@torch.inference_mode()
def theirs(network, options):
    """Milliseconds of a picture, and of the piece with each number of views."""
    found = [picture_ms(network, *options.size)]
    return found + [piece_ms(network, *options.size, count) for count in options.views]


def ours(options):
    """The same of the program."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "efficiency.json"
        views, size = ",".join(map(str, options.views)), "x".join(map(str, options.size))
        command = [options.binary, "table", "efficiency", "--weights", options.weights, "--views", views, "--size", size]
        environment = os.environ | {"RAYON_NUM_THREADS": str(options.threads)}
        subprocess.run([*command, "--json", file], env=environment, stdout=subprocess.DEVNULL, check=True)
        cells = json.loads(file.read_text())["cells"]
    cells = {cell["views"]: cell for cell in cells if cell["method"] == "ours"}
    return [cells[options.views[0]]["picture_ms"]] + [cells[count]["piece_ms"] for count in options.views]


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    numbers = lambda separator: lambda text: [int(number) for number in text.split(separator)]
    parser.add_argument("--binary", type=pathlib.Path, default=REPOSITORY / "target" / "release" / "ipdrecon")
    parser.add_argument("--weights", type=pathlib.Path, default=REPOSITORY / "weights" / "ipdrecon.safetensors")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--views", type=numbers(","), default=[10, 20])
    parser.add_argument("--size", type=numbers("x"), default=[640, 480], metavar="WIDTHxHEIGHT")
    parser.add_argument("--rounds", type=int, default=5)
    return parser.parse_args()


def main():
    options = arguments()
    torch.set_num_threads(options.threads)
    network = Ipdrecon.load(options.weights)
    rounds = [(ours(options), theirs(network, options)) for _ in range(options.rounds)]
    width, height = options.size
    parts = [f"picture of {width}x{height}"] + [f"piece of 1.6 m, {count} views" for count in options.views]
    print("| | ours (ms) | PyTorch (ms) | PyTorch / ours |\n|---|---|---|---|")
    for row, part in enumerate(parts):
        pairs = [(a[row], b[row]) for a, b in rounds]
        a, b = (statistics.median(times) for times in zip(*pairs))
        ratio = statistics.median(b / a for a, b in pairs)
        print(f"| {part} | {a:.1f} | {b:.1f} | {ratio:.2f} |")
    print(
        f"\nmedians of {options.rounds} rounds, each the median of {RUNS} runs after {WARM_UP}; "
        f"threads: {options.threads} each; PyTorch {torch.__version__}; {processor()}"
    )


if __name__ == "__main__":
    main()

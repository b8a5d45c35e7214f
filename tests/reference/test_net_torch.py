"""The PyTorch version of the network gives what the references gave: the planes for all settings of the switches, fusion
with and without its parts, and the whole. So speed.py compares the same computation.
"""

import importlib.util
import itertools
import json
import pathlib
import types
import unittest

import made_numbers
import net_fusion
import net_model
import net_planes
import numpy as np

TORCH = importlib.util.find_spec("torch") is not None
if TORCH:
    import torch
    from net_torch import STRIDES, Cameras, Ipdrecon, NetConfig
    from net_torch_fusion import Fusion, project
    from net_torch_planes import PlaneNet
    from net_torch_weights import Weights

REPOSITORY = pathlib.Path(__file__).parents[2]
LEVELS = ["coarse", "medium", "fine"]
# Of the largest number; 32 bits leave a hundredth of it.
TOLERANCE = 1e-4


def golden(name):
    return json.loads((REPOSITORY / "tests" / "golden" / name).read_text())


def tensor(array):
    return torch.tensor(np.array(array), dtype=torch.float32)


def made_images():
    shape = (net_planes.VIEWS, 3, net_planes.HEIGHT, net_planes.WIDTH)
    return tensor(made_numbers.numbers("images", shape, np.float32(127.0)) + 127.5)


def made_cameras():
    """As in net_planes.py and net_model.py, where the turns are the positions, too."""
    intrinsics = np.array([list(net_planes.CAMERA.values())] * net_planes.VIEWS)
    rotations = np.stack([net_planes.rotation(*turn) for turn in net_planes.TURNS])
    return Cameras(*(torch.from_numpy(array) for array in (intrinsics, rotations, np.array(net_planes.TURNS))))


@unittest.skipUnless(
    TORCH,
    "skipped: PyTorch is not installed (pip install torch), so the PyTorch version of the network is not compared",
)
class NetTorch(unittest.TestCase):
    def setUp(self):
        mode = torch.inference_mode()
        mode.__enter__()
        self.addCleanup(mode.__exit__, None, None, None)

    def assert_like(self, found, entry, name):
        """`entry` is a digest: every k-th number and two sums."""
        found = found.contiguous().flatten().double().numpy()
        every, magnitude = entry.get("every", entry.get("step")), entry.get("magnitude", entry.get("size"))
        expected = np.array(entry["values"])
        with self.subTest(name):
            self.assertEqual(len(found[::every]), len(expected))
            self.assertLess(np.abs(found[::every] - expected).max() / np.abs(expected).max(), TOLERANCE)
            self.assertLess(abs(found.sum() - entry["sum"]) / magnitude, TOLERANCE)

    def test_planes_for_all_switches(self):
        entries = golden("net_planes.json")
        images, cameras = made_images(), made_cameras()
        for on in itertools.product([False, True], repeat=3):
            switches = dict(zip(["pce", "acm", "ipsd"], on))
            setting = "+".join(name for name, on in switches.items() if on) or "baseline"
            config = types.SimpleNamespace(
                backbone=net_planes.BACKBONE, pyramid=net_planes.PYRAMID, planes=[20, 12, 8], **switches
            )
            planes = PlaneNet(Weights(made_numbers.weight), config, STRIDES).eval()
            for level, parts in zip(LEVELS, planes(images, cameras)):
                for part, found in zip(["base", "hidden", "confidence"], parts):
                    name = f"{setting}.{level}.{part}"
                    self.assertEqual(found is None, name not in entries, name)
                    if found is not None:
                        self.assert_like(found, entries[name], name)

    def test_fusion_with_and_without_its_parts(self):
        """Here a view looks away and nobody sees one of the voxels."""
        entries = golden("net_fusion.json")
        rotations, translations = (torch.from_numpy(np.stack(a)) for a in zip(*net_fusion.views(net_fusion.VIEWS)))
        camera = [net_fusion.FOCAL, net_fusion.FOCAL, net_fusion.CX, net_fusion.CY]
        cameras = Cameras(
            torch.tensor([camera] * net_fusion.VIEWS, dtype=torch.float64),
            rotations.mT,
            -(rotations.mT @ translations[..., None])[..., 0],
        )
        points_m = tensor(net_fusion.sites() * net_fusion.VOXEL_M + np.array([-0.4, -0.2, 0.1]))
        geometry = project(cameras, points_m, net_fusion.STRIDE, net_fusion.PLANE_H, net_fusion.PLANE_W)
        seen = geometry[3]
        for name, found in zip("uvz", geometry):
            self.assert_like(found[seen], entries["pairs"][name], name)
        shape = (net_fusion.VIEWS, net_fusion.CHANNELS, net_fusion.PLANE_H, net_fusion.PLANE_W)
        base, hidden = (tensor(made_numbers.numbers(name, shape, np.float32(1.0))) for name in ("base", "hidden"))
        for name, on in {"full": True, "plain": False}.items():
            config = types.SimpleNamespace(ipsd=on, matching=on)
            fusion = Fusion(Weights(made_numbers.weight), net_fusion.CHANNELS, config)
            features, occupancy = fusion(base, hidden if on else None, geometry)
            self.assert_like(features, entries["fusion"][name]["features"], f"{name}.features")
            self.assert_like(occupancy[seen], entries["fusion"][name]["occupancy"], f"{name}.occupancy")

    def test_whole(self):
        """Inputs and the rule for children are those of net_model.py."""
        entries = golden("net_model.json")
        widths = (net_planes.BACKBONE, net_planes.PYRAMID, net_model.PLANES, net_model.UNET)
        network = Ipdrecon(NetConfig(*widths, pce=True, acm=True, ipsd=True, matching=True, guide=True), made_numbers.weight)
        cameras = made_cameras()
        nx, ny, nz = net_model.BOX
        sites = [(x, y, z) for z in range(nz) for y in range(ny) for x in range(nx)]
        above = parent = None
        for level, plane in enumerate(network.planes(made_images(), cameras)):
            rows = torch.tensor(sites)
            fused, occupancy, seen = network.fuse(level, plane, cameras, rows, tensor(net_model.ORIGIN_M))
            guide = tensor(made_numbers.numbers(f"guide.{level}", (len(sites), 2), np.float32(1.0)))
            above = network.decode(level, fused, rows, above, parent, guide)
            found = {"fused": fused, "occupancy": occupancy[seen], "features": above[0], "logit": above[1]}
            for name, found in found.items():
                self.assert_like(found, entries[f"{name}.{level}"], f"{name}.{level}")
            sites, parent = net_model.children(sites)

    def test_released_weights_are_read(self):
        network = Ipdrecon.load(REPOSITORY / "weights" / "ipdrecon.safetensors")
        planes = network.planes(made_images(), made_cameras())
        self.assertEqual([base.shape[1] for base, _, _ in planes], network.config.planes)
        self.assertTrue(all(torch.isfinite(part).all() for parts in planes for part in parts))


if __name__ == "__main__":
    unittest.main()

"""Opens what the library writes with trimesh: same counts, places, normals and colours in PLY, OBJ and GLB.

The files come from the folder IPDRECON_EXPORTS, or are written here by `cargo run -p mesh --example write_exports`.
"""

import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
import trimesh

REPOSITORY = pathlib.Path(__file__).parents[2]
RINGS, SEGMENTS = 24, 48


def torus():
    """The mesh of the example, by the rule stated there."""
    around = 2 * np.pi * np.arange(SEGMENTS).repeat(RINGS) / SEGMENTS
    across = 2 * np.pi * np.tile(np.arange(RINGS), SEGMENTS) / RINGS
    outward = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    normals = outward * np.cos(across)[:, None] + up * np.sin(across)[:, None]
    segment, ring = np.arange(SEGMENTS).repeat(RINGS), np.tile(np.arange(RINGS), SEGMENTS)
    colors = np.stack([segment * 5, ring * 10, 0 * ring + 77], axis=1)
    return outward + 0.25 * normals, normals, colors


def linear(srgb):
    value = srgb / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


class OpenExports(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = os.environ.get("IPDRECON_EXPORTS")
        if folder is None:
            temporary = tempfile.TemporaryDirectory()
            cls.addClassCleanup(temporary.cleanup)
            folder = temporary.name
            command = "cargo run --quiet --release -p mesh --example write_exports --".split()
            subprocess.run([*command, folder], cwd=REPOSITORY, check=True)
        cls.folder = pathlib.Path(folder)
        cls.positions, cls.normals, cls.colors = torus()

    def open(self, name):
        # `process` would merge vertices and turn normals to its own taste.
        return trimesh.load(self.folder / name, process=False)

    def assert_is_torus(self, mesh):
        self.assertEqual(mesh.faces.shape, (2 * RINGS * SEGMENTS, 3))
        np.testing.assert_allclose(mesh.vertices, self.positions, atol=1e-6)
        self.assertTrue(mesh.is_watertight)
        self.assertTrue(mesh.is_winding_consistent)
        # pi^2 * 2 * R * r^2, a little less for its flat facets; negative were it inside out.
        self.assertAlmostEqual(mesh.volume, 2 * np.pi**2 * 0.25**2, delta=0.03)
        self.assertIn("vertex_normals", mesh._cache, "normals come from the file")
        np.testing.assert_allclose(mesh.vertex_normals, self.normals, atol=1e-5)

    def test_ply(self):
        mesh = self.open("torus.ply")
        self.assert_is_torus(mesh)
        np.testing.assert_array_equal(mesh.visual.vertex_colors[:, :3], self.colors)

    def test_obj(self):
        mesh = self.open("torus.obj")
        self.assert_is_torus(mesh)
        np.testing.assert_array_equal(mesh.visual.vertex_colors[:, :3], self.colors)

    def test_glb(self):
        scene = self.open("torus.glb")
        (mesh,) = scene.geometry.values()
        self.assert_is_torus(mesh)
        # Beside a material, trimesh keeps the colours as they are stored: linear, 16 bits.
        stored = mesh.visual.vertex_attributes["color"]
        self.assertEqual(stored.dtype, np.uint16)
        np.testing.assert_allclose(stored[:, :3], 65535 * linear(self.colors), atol=0.51)

    def test_glb_stands_upright(self):
        for name, up in (("torus.glb", (0, 0, 1)), ("tilted.glb", (0.2, -0.9, 0.4))):
            scene = self.open(name)
            (node,) = scene.graph.nodes_geometry
            matrix, _ = scene.graph[node]
            turned = matrix[:3, :3] @ (np.array(up) / np.linalg.norm(up))
            np.testing.assert_allclose(turned, (0, 1, 0), atol=1e-6)

    def test_glb_with_more_vertices_than_16_bits_count(self):
        (mesh,) = self.open("many-vertices.glb").geometry.values()
        self.assertEqual(mesh.vertices.shape, (66_000, 3))
        self.assertEqual(mesh.faces.max(), 65_999)
        self.assertAlmostEqual(mesh.area, 32.999, places=2)

    def test_point_clouds(self):
        cloud = self.open("points.ply")
        self.assertIsInstance(cloud, trimesh.PointCloud)
        np.testing.assert_allclose(cloud.vertices, self.positions, atol=1e-6)
        np.testing.assert_array_equal(cloud.colors[:, :3], self.colors)
        (cloud,) = self.open("points.glb").geometry.values()
        np.testing.assert_allclose(cloud.vertices, self.positions, atol=1e-6)

    def test_a_mesh_of_nothing_still_opens(self):
        self.assertEqual(len(self.open("empty.glb").geometry), 0)


if __name__ == "__main__":
    unittest.main()

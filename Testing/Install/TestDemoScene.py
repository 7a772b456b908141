# SPDX-License-Identifier: BSD-3-Clause
"""The demo's cloud: closed shapes with outward normals of length 1, about a million points."""

import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

EXAMPLES = os.path.join(os.environ["SOURCE"], "Examples")
sys.dont_write_bytecode = True
sys.path.insert(0, EXAMPLES)


class TestDemoScene(unittest.TestCase):
    def test_scene(self):
        from surfelsplatting import vtkPointCloudReader
        from surfelsplatting.views.cameras import read_view

        with tempfile.TemporaryDirectory() as folder:
            cloud, camera = (os.path.join(folder, name) for name in ("s.ply", "c.json"))
            script = os.path.join(EXAMPLES, "demo_scene.py")
            made = subprocess.run([sys.executable, "-s", "-B", script, cloud, camera], check=True,
                                  capture_output=True)
            self.assertEqual(made.stdout + made.stderr, b"")
            self.assertGreater(read_view(camera).focal_disk, 0)
            reader = vtkPointCloudReader()
            reader.SetFileName(cloud)
            reader.Update()
        data = reader.GetOutput()
        self.assertTrue(500_000 < data.GetNumberOfPoints() < 2_000_000)
        self.assertTrue(np.isfinite(vtk_to_numpy(data.GetPoints().GetData())).all())
        length = np.linalg.norm(vtk_to_numpy(data.GetPointData().GetNormals()), axis=1)
        np.testing.assert_allclose(length, 1, atol=1e-4)
        self.assertEqual(data.GetPointData().GetScalars().GetName(), "RGB")

    def check_outward(self, cloud, center=0):
        outward = ((cloud.points - center) * cloud.normals).sum(axis=1)
        self.assertGreater((outward > 0).mean(), 0.97)

    def test_shapes_are_right_side_out(self):
        import demo_shapes as shapes

        rng = np.random.default_rng(1)
        ball = np.linspace(0, np.pi, 60)
        turned, _ = shapes.lathe(np.column_stack([np.sin(ball), np.cos(ball)]), 2000)
        self.check_outward(turned)
        np.testing.assert_allclose(turned.normals, turned.points, atol=0.06)
        self.check_outward(shapes.ellipsoids(rng, np.zeros((3, 3)), np.ones(3), np.eye(3), 0.6, 0.1,
                                             500))
        blade, along = shapes.blades(rng, np.zeros((1, 2)), np.ones(1), 0.02, 4000)
        for low in np.linspace(0, 0.9, 10):
            part = blade.where((along >= low) & (along < low + 0.02))
            self.check_outward(part, part.points.mean(axis=0))

    def test_normals_are_those_of_the_surface(self):
        import demo_shapes as shapes

        rng = np.random.default_rng(2)
        stone = shapes.ellipsoids(rng, np.zeros((1, 3)), np.ones(1), np.eye(3)[:1], 0.6, 0.12,
                                  20000)
        # The nearest other points lie in the tangent plane.
        for i in range(0, 20000, 997):
            offset = stone.points - stone.points[i]
            near = np.argsort((offset ** 2).sum(axis=1))[1:8]
            tilt = np.abs(offset[near] @ stone.normals[i]) / np.linalg.norm(offset[near], axis=1)
            self.assertLess(tilt.max(), 0.12)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""Depth images that were saved as a list of points, and clouds that look like them."""

import unittest

import numpy as np

from surfelsplatting.clouds.depthimages import image_axes
from surfelsplatting.clouds.polydata import polydata_of
from toolcase import SMALL, ToolCase, read_json, write_data, write_ply

FOCAL = 90.0  # pixels
AXES = {"OpenCV": np.eye(3), "OpenGL": np.diag([1.0, -1, -1]),
        "robot, forward x": np.array([[0, -1.0, 0], [0, 0, -1], [1, 0, 0]]),
        "robot, forward y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])}


def image(columns=slice(0, 80), rows=slice(0, 60)):
    """[n, 3]: a wavy wall with some holes, by an image of 80 x 60 pixels or a part of it; x to the
    right, y down, z forward"""
    u, v = np.meshgrid(np.arange(80)[columns] - 39.5, np.arange(60)[rows] - 29.5)
    z = 2 + 0.3 * np.sin(u / 9) * np.cos(v / 7)
    points = np.stack([u * z / FOCAL, v * z / FOCAL, z], axis=-1).reshape(-1, 3)
    return points[np.arange(len(points)) % 37 > 0].astype(np.float32)


class TestImageAxes(unittest.TestCase):
    def test_axes_of_sensors(self):
        for name, axes in AXES.items():
            with self.subTest(name):
                forward, up = image_axes(image() @ axes)
                np.testing.assert_array_equal(forward, axes[2])
                np.testing.assert_array_equal(up, -axes[1])

    def test_without_some_points(self):
        points = image()
        points[::5] = 0  # as some sensors write what they have not seen
        points[1::5] = np.nan
        self.assertIsNotNone(image_axes(points))
        self.assertIsNotNone(image_axes(np.random.default_rng(2).permutation(image())[:1500]))

    def test_other_clouds(self):
        points, generator = image(), np.random.default_rng(2)
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        x, y = np.meshgrid(np.linspace(-1, 1, 80), np.linspace(-1, 1, 60))
        grid = np.column_stack([x.ravel(), y.ravel(), np.full(4800, 2.0)])
        others = {"turned": points @ turn + (0, 0, 3), "moved": points + (0.1, 0, 0.2),
                  "two": np.vstack([points, points + (0.01, 0.02, 0.03)]),
                  "thinned by cells": np.round(points, 2), "a grid on a plane": grid,
                  "heights": grid + np.column_stack([0 * x.ravel(), 0 * x.ravel(),
                                                     np.sin(5 * x * y).ravel() / 3]),
                  "at random": generator.uniform((-1, -1, 2), (1, 1, 3), (4800, 3)),
                  "few": points[:900], "around": points - (0, 0, 2)}
        for name, cloud in others.items():
            with self.subTest(name):
                self.assertIsNone(image_axes(cloud))


class TestDepthImages(ToolCase):
    def view_of(self, path):
        self.render(path, *SMALL, "-o", "out.png", "--save-camera", "view.json")
        return read_json("view.json")

    def test_seen_from_its_sensor(self):
        write_ply("image.ply", image())
        self.assertIn("a depth image that is not in rows", self.info("image.ply"))
        view = self.view_of("image.ply")
        self.assertEqual(view["position"], [0, 0, 0])
        np.testing.assert_allclose(view["viewUp"], [0, -1, 0], atol=1e-3)
        self.assertGreater((self.read_png("out.png")[..., :3].max(axis=-1) > 80).mean(), 0.7)

    def test_file_of_vtk(self):
        write_data("image.vtp", polydata_of(image(), {}))
        self.assertEqual(self.view_of("image.vtp")["position"], [0, 0, 0])

    def test_part_of_an_image(self):
        """It fills the picture."""
        np.savetxt("part.xyz", image(slice(45, 80), slice(0, 40)) @ AXES["OpenGL"])
        view = self.view_of("part.xyz")
        self.assertEqual(view["position"], [0, 0, 0])
        looks = np.array(view["focalPoint"]) / -view["focalPoint"][2]
        np.testing.assert_allclose(looks, [22.5 / FOCAL, 10 / FOCAL, -1], atol=0.01)
        self.assertLess(view["viewAngle"], 30)


if __name__ == "__main__":
    unittest.main()

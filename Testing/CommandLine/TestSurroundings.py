# SPDX-License-Identifier: BSD-3-Clause
"""Captures that surround their subject are seen from inside, things from outside."""

import math
import unittest

import numpy as np

from captures import Gaussians, furry_ball, joined, of_surface, torus, write_ply
from surfelsplatting.clouds.cloud import Cloud
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.shapes.samples import Samples
from surfelsplatting.views.cameras import View
from surfelsplatting.views.framing import complete_view, home_in
from surfelsplatting.views.surroundings import scene_view
from surfelsplatting.vtkarrays import named_array
from toolcase import ToolCase, sphere

# Turns about x, degrees: z is up, or -y as in the axes of COLMAP, or the camera was tilted.
TURNS = (0, 90, 20, 110, 68)


def surface(points, normals, radius):
    return of_surface(points, normals, np.full((len(points), 3), 0.5), radius).of_degree(0)


def ball(count, radius, center=(0.0, 0.0, 0.0)):
    points = sphere(count)[0]
    return surface(radius * points + center, points, 3 * radius / math.sqrt(count))


def ground(count, reach, height):
    rng = np.random.default_rng(6)
    away, angle = reach * rng.random(count), 2 * math.pi * rng.random(count)
    points = np.column_stack([away * np.cos(angle), away * np.sin(angle), np.full(count, height)])
    flat = surface(points, np.tile((0.0, 0.0, 1.0), (count, 1)), 1.0)
    flat.scales *= (0.03 + 0.05 * away)[:, None]
    return flat


def garden(background=4000):
    """A ball on the ground, and what is around it from the ground to high above"""
    around = ball(2 * background, 20.0)
    around = around[around.positions[:, 2] > -1]
    return joined(ball(8000, 0.5), ground(8000, 10, -0.5), around)


def box(count, low, high):
    rng = np.random.default_rng(8)
    low, high = np.array(low), np.array(high)
    axis, end = rng.integers(0, 3, count), rng.integers(0, 2, count)
    points = low + (high - low) * rng.random((count, 3))
    rows = np.arange(count)
    points[rows, axis] = np.where(end, high[axis], low[axis])
    normals = np.zeros((count, 3))
    normals[rows, axis] = 0.6 + 0.4 * end
    return surface(points, normals / np.linalg.norm(normals, axis=1, keepdims=True), 0.05)


def room():
    return joined(box(20_000, (-2.5, -2, 0), (2.5, 2, 2.6)), box(3000, (-0.5, -0.4, 0.9), (0.5, 0.4, 1)),
                  ball(4000, 0.2, (0, 0, 1.2)))


def turned(gaussians, degrees):
    """-> the Gaussians after a turn about x, and where z is then"""
    half = math.radians(degrees / 2)
    a, b = math.cos(half), math.sin(half)
    c, d = math.cos(2 * half), math.sin(2 * half)
    x, y, z = gaussians.positions.T
    positions = np.column_stack([x, c * y - d * z, d * y + c * z])
    w, x, y, z = gaussians.rotations.T
    rotations = np.column_stack([a * w - b * x, a * x + b * w, a * y - b * z, a * z + b * y])
    return (Gaussians(positions, gaussians.scales, rotations, gaussians.opacities,
                      gaussians.harmonics), np.array([0.0, -d, c]))


def cloud_of(gaussians):
    data = polydata_of(gaussians.positions, {})
    covariances = gaussians.covariances().reshape(-1, 9)[:, (0, 4, 8, 1, 5, 2)]
    for name, values in (("GaussianCovariance", covariances),
                         ("GaussianOpacity", gaussians.opacities)):
        data.GetPointData().AddArray(named_array(name, values, np.float32))
    return Cloud(data)


def view_of(gaussians, **wishes):
    cloud = cloud_of(gaussians)
    return complete_view(View(**wishes), cloud, cloud.data)


class TestScenes(ToolCase):
    def test_garden(self):
        """The ball is seen from near, from above the ground, upright whatever the axes."""
        for degrees in TURNS:
            scene, up = turned(garden(), degrees)
            view = view_of(scene)
            self.assertLess(np.linalg.norm(view.focal_point), 0.3)
            self.assertTrue(1 < np.linalg.norm(view.position) < 5, view.position)
            self.assertGreater(up @ view.position, 0)
            self.assertGreater(np.dot(view.view_up, up), 0.999)

    def test_room(self):
        """From between the walls, at what is on the table."""
        for degrees in TURNS:
            scene, up = turned(room(), degrees)
            view = view_of(scene)
            x, y, z = view.position @ np.stack([(1, 0, 0), np.cross(up, (1, 0, 0)), up], axis=1)
            self.assertTrue(abs(x) < 2.5 and abs(y) < 2 and 0 < z < 2.6, (degrees, x, y, z))
            self.assertGreater(view.view_angle, 40)

    def test_turns(self):
        """All around where no wall is in the way."""
        for scene, turn in ((garden(), 360), (room(), 40)):
            cloud = cloud_of(scene)
            self.assertEqual(home_in(cloud, cloud.data).turn, turn)

    def test_things(self):
        """From outside, even with a ground or stray Gaussians around."""
        rng = np.random.default_rng(9)
        stray = ball(1500, 1.0)
        stray.positions *= rng.uniform(1, 12, (1500, 1))
        stray.opacities = rng.uniform(0.02, 0.5, 1500)
        shell = ball(20_000, 1.0)
        for name, thing in (("ball", ball(5000, 0.5)), ("shell", shell),
                            ("furry ball", furry_ball(5000)), ("torus", torus(5000)),
                            ("on a ground", joined(ball(8000, 0.5), ground(4000, 1.5, -0.5))),
                            ("stray", joined(ball(6000, 0.5), stray)),
                            ("few", ball(50, 1.0)), ("one", ball(50, 1.0)[:1])):
            cloud = cloud_of(thing)
            self.assertIsNone(home_in(cloud, cloud.data), name)

    def test_odd_values(self):
        """Infinite sizes, and all at one place."""
        cloud = cloud_of(garden())
        covariances = cloud.data.GetPointData().GetArray("GaussianCovariance")
        covariances.SetComponent(0, 0, math.inf)
        covariances.SetComponent(1, 2, math.nan)
        self.assertIsNotNone(scene_view(Samples(cloud.data)))
        same = ball(500, 0.5)
        same.positions[:] = 7
        self.assertIsNone(scene_view(Samples(cloud_of(same).data)))

    def test_tool(self):
        """The picture is full, and info says from where it is."""
        write_ply("garden.ply", garden())
        self.assertEqual(self.tool("render", "garden.ply", "--size", "90", "60", "-o", "a.exr"), "")
        self.assertGreater(self.read_rgba("a.exr")[..., 3].min(), 0.5)
        self.assertIn("from inside", self.info("garden.ply"))


if __name__ == "__main__":
    unittest.main()

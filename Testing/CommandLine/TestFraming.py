# SPDX-License-Identifier: BSD-3-Clause
"""What of a cloud the default view shows: what is dense, and what goes on from there."""

import math
import unittest

import numpy as np

from surfelsplatting.clouds.cloud import Cloud
from surfelsplatting.views.cameras import View
from surfelsplatting.views.framing import complete_view
from toolcase import sphere
from viewclouds import on_screen, surfels_of


def street(reach=90.0):
    """-> points and area vectors of a road, up to `reach` m, below a scanner that turns in 1.7 m."""
    dips = np.radians(np.linspace(1, 24, 60))
    turns = np.radians(np.arange(0, 360, 0.5))
    dip, turn = (values.ravel() for values in np.meshgrid(dips, turns))
    distance = 1.7 / np.tan(dip)
    points = np.stack([distance * np.cos(turn), distance * np.sin(turn), 0 * turn], axis=1)
    apart = np.radians(0.5) * distance, (dips[1] - dips[0]) * distance**2 / 1.7
    areas = np.outer(apart[0] * apart[1], (0, 0, 1))
    near = np.abs(points).max(axis=1) < reach
    return points[near], areas[near]


def tree(trunk=400, foot=-16.0):
    """-> of a crown of leaves with a radius of 3 m about (0, 0, 0), with a thin trunk that few points
    are on."""
    random = np.random.default_rng(2)
    crown = random.normal(size=(20000, 3))
    crown *= 3 * random.uniform(0.3, 1, (len(crown), 1)) / np.linalg.norm(crown, axis=1)[:, None]
    turn = random.uniform(0, 2 * math.pi, trunk)
    stem = np.stack([0.1 * np.cos(turn), 0.1 * np.sin(turn), np.linspace(foot, -3, trunk)], axis=1)
    normals = np.vstack([crown, stem * (1, 1, 0)])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return np.vstack([crown, stem]), normals * np.repeat((0.01, 0.03), (len(crown), trunk))[:, None]


def view_of(points, areas, two_sided=False):
    view = View(view_up=(0, 0, 1))
    return complete_view(view, Cloud(surfels_of(points, areas)),
                         surfels_of(points, areas, two_sided=two_sided))


def in_picture(view, points):
    """Which points are in a picture of the view."""
    screen, depth = on_screen(view, points)
    return (depth > 0) & (np.abs(screen) < 1).all(axis=1)


def slope(view):
    """Degrees by which the camera looks down."""
    arm = np.subtract(view.position, view.focal_point)
    return math.degrees(math.asin(arm[2] / np.linalg.norm(arm)))


class TestFraming(unittest.TestCase):
    def test_street(self):
        points, areas = street()
        view = view_of(points, areas, two_sided=True)
        distance = np.linalg.norm(np.subtract(view.position, view.focal_point))
        self.assertLess(distance, 150)  # 300 to see all
        self.assertTrue(in_picture(view, points[np.linalg.norm(points, axis=1) < 15]).all())
        self.assertGreater(slope(view), 45)

    def test_ground_of_even_density_stays_whole(self):
        x, y = np.meshgrid(np.linspace(-50, 50, 200), np.linspace(-50, 50, 200))
        points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
        view = view_of(points, np.tile([0, 0, 0.25], (len(points), 1)), two_sided=True)
        self.assertTrue(in_picture(view, points).all())

    def test_height_of_the_camera(self):
        """Flat things are seen from higher up, slender ones from their side. Walls are neither."""
        ball, areas = sphere(5000)[0], np.full((5000, 3), 1e-3)
        for size, least, most in (((5, 4, 0.2), 49, 51), ((5, 4, 0.9), 30, 45), ((1, 1, 1), 21.9, 22.1),
                                  ((0.3, 0.4, 3), 4.9, 5.1), ((0.5, 1, 2.1), 4.9, 5.1),
                                  ((0.5, 1, 1.75), 10, 20),
                                  ((5, 0.2, 4), 21.9, 22.1), ((5, 0.2, 1), 21.9, 22.1)):
            found = slope(view_of(ball * size, areas, two_sided=True))
            self.assertTrue(least < found < most, (size, found))

    def test_trunk(self):
        view = view_of(*tree(), two_sided=True)
        self.assertTrue(in_picture(view, [(0, 0, -16), (0, 0, 3), (3, 0, 0)]).all())

    def test_stray_clump(self):
        points, areas = tree(foot=-6)
        clump = np.random.default_rng(3).normal(size=(30, 3)) + (0, 0, 40)
        view = view_of(np.vstack([points, clump]), np.vstack([areas, np.full((30, 3), 0.01)]),
                       two_sided=True)
        self.assertFalse(in_picture(view, clump).any())
        self.assertTrue(in_picture(view, points).all())

    def test_image_whose_sensor_would_be_in_its_plane(self):
        """It was made of a photograph, at z = 0, and no viewpoint was written."""
        column, row = np.meshgrid(np.arange(40.0), np.arange(30.0))
        for height, is_from_there in ((0, False), (60, True)):
            points = np.stack([column.ravel(), row.ravel(), np.full(1200, float(height))], axis=1)
            cloud = Cloud(surfels_of(points, np.tile([0, 0, 1.0], (1200, 1))), (0, 0, 0), 40)
            view = complete_view(View(), cloud, cloud.data)
            self.assertEqual(view.position == (0, 0, 0), is_from_there)
            self.assertEqual(slope(view) > 45, not is_from_there)

    def test_order_of_the_points(self):
        """A hierarchy has them in another order than the file, and blurred pictures are of one."""
        points = np.random.default_rng(3).normal(size=(250000, 3)) * (3, 2, 1)
        areas = points * 1e-4
        order = np.random.default_rng(4).permutation(len(points))
        view, other = view_of(points, areas), view_of(points[order], areas[order])
        np.testing.assert_allclose(other.position, view.position, rtol=1e-12)
        np.testing.assert_allclose(other.focal_point, view.focal_point, rtol=0, atol=1e-12)

    def test_few_points(self):
        points = np.array([(x, x % 3, x % 2) for x in (*range(10), 25)], float)
        view = view_of(points, np.tile([0, 0, 1.0], (len(points), 1)))
        self.assertTrue(in_picture(view, points).all())

    def test_walls_far_behind_a_thing(self):
        points, areas = tree(foot=-6)
        x, z = np.meshgrid(np.linspace(-3, 3, 10), np.linspace(-3, 3, 10))
        wall = np.stack([x.ravel(), np.full(100, 12.0), z.ravel()], axis=1)
        view = view_of(np.vstack([points, wall]), np.vstack([areas, np.tile([0, -0.4, 0], (100, 1))]),
                       two_sided=True)
        self.assertLess(np.linalg.norm(np.subtract(view.focal_point, (0, 0, -1.5))), 2)
        self.assertLess(slope(view), 30)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""What a plotter shows of the first cloud as long as nobody has set a camera."""

import os
import tempfile
import unittest
import warnings

import numpy as np
import pyvista as pv

from plottercase import PlotterCase
from TestAccessor import write_pcd

SIZE = (240, 180)


def upside_down():
    """A column on a floor, which is at the larger y."""
    rng = np.random.default_rng(3)
    x, z = rng.uniform(-2, 2, (2, 20000))
    angle, y = rng.uniform(0, 2 * np.pi, 20000), rng.uniform(-3, 0, 20000)
    floor = np.stack([x, np.zeros_like(x), z], axis=1)
    return pv.PolyData(np.concatenate([floor, np.stack([0.3 * np.cos(angle), y, 0.3 * np.sin(angle)], axis=1)]))


class TestFirstView(PlotterCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "wall.pcd")
            write_pcd(path)
            cls.wall = pv.read(path)

    def fresh(self):
        pl = pv.Plotter(window_size=SIZE)
        self.addCleanup(pl.close)
        return pl

    def seen(self, *added):
        pl = self.fresh()
        for cloud in added:
            pl.surfels.add(cloud, show_scalar_bar=False)
        return self.picture(pl)

    def test_as_in_plot(self):
        """Of a depth image what its sensor saw, with red to the left; other clouds stand."""
        for cloud in (self.wall, upside_down()):
            expected = cloud.surfels.plot(screenshot=True, return_img=True, window_size=SIZE)
            np.testing.assert_array_equal(self.seen(cloud), expected)
            np.testing.assert_array_equal(self.seen(cloud.surfels.estimate()), expected)
        picture = self.seen(self.wall)
        np.testing.assert_array_equal(picture[90, 60] > 100, [True, False, False])
        standing = self.seen(upside_down()).max(axis=2) > 0
        self.assertGreater(standing[120:].sum(), 2 * standing[:60].sum())

    def test_moved_surfels_forget_the_sensor(self):
        pl = self.fresh()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pl.surfels.add(self.wall.surfels.estimate(cleaning="off").translate((5, 0, 0)))
        self.assertGreater(np.linalg.norm(np.array(pl.camera.position) - (5, 0, 0)), 0.1)
        self.assertGreater(np.linalg.norm(pl.camera.position), 0.1)

    def test_meshes_in_the_picture_leave_it(self):
        pl = self.fresh()
        pl.add_mesh(pv.Sphere(radius=0.1, center=(0.3, 0, 1.8)), color="lime")
        pl.surfels.add(self.wall)
        self.assertGreater((self.picture(pl)[..., 1] > 60).sum(), 50)
        np.testing.assert_array_equal(pl.camera.position, (0, 0, 0))

    def test_meshes_in_the_picture_are_whole(self):
        """The camera's clipping range is that of the wall before the ball is added."""
        pl = self.fresh()
        pl.surfels.add(self.wall)
        pl.add_mesh(pv.Sphere(radius=0.2, center=(0, 0, 2)), color="lime")
        self.assertGreater(self.picture(pl)[90, 120, 1], 60)

    def test_meshes_at_the_edge_need_few_steps_back(self):
        """The whole scene in the middle would be half as large."""
        pl = self.fresh()
        pl.surfels.add(self.wall)
        pl.add_mesh(pv.Sphere(radius=0.1, center=(0, 0.85, 2)), color="lime")
        green = self.picture(pl)[..., 1] > 60
        self.assertFalse(green[[0, -1]].any())
        self.assertGreater(green.sum(), 50)
        self.assertTrue(-0.5 < pl.camera.position[2] < 0, pl.camera.position)

    def test_meshes_outside_are_shown_too(self):
        for is_first in (False, True):
            pl = self.fresh()
            steps = [lambda: pl.surfels.add(self.wall), lambda: pl.add_mesh(
                pv.Sphere(radius=0.3, center=(3, 0, 2)), color="lime")]
            for step in reversed(steps) if is_first else steps:
                step()
            picture = self.picture(pl)
            self.assertGreater((picture[..., 1] > 60).sum(), 50)
            self.assertGreater((picture[..., 0] > 60).sum(), 200)
            self.assertGreater(pl.camera.direction[2], 0.99)  # the direction stays
            place = pl.camera.position
            pl.add_mesh(pv.Sphere(radius=0.3, center=(-30, 0, 2)))
            self.picture(pl)
            self.assertEqual(pl.camera.position, place)  # later frames leave the camera alone

    def test_two_clouds(self):
        far = self.wall.translate((4, 0, 0))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            picture = self.seen(self.wall, far).astype(int)
        is_red = picture[90, :, 0] > picture[90, :, 2] + 60
        self.assertEqual(np.count_nonzero(np.diff(is_red.astype(int)) == 1), 2)

    def test_cameras_of_the_user_stay(self):
        for place in (lambda pl: setattr(pl, "camera_position", [(1, 2, -3), (0, 0, 2), (0, 1, 0)]),
                      lambda pl: pl.view_xz()):
            for is_first in (False, True):
                pl = self.fresh()
                if is_first:
                    place(pl)
                pl.surfels.add(self.wall)
                if not is_first:
                    place(pl)
                set_to = pl.camera.position
                pl.add_mesh(pv.Sphere(radius=0.3, center=(9, 0, 2)))
                self.picture(pl)
                self.assertEqual(pl.camera.position, set_to)

    def test_moved_actors(self):
        """As PyVista shows them."""
        pl = self.fresh()
        pl.surfels.add(self.surfels, user_matrix=np.diag([1, 1, 3, 1]))
        self.picture(pl)
        np.testing.assert_allclose(pl.camera.direction, np.full(3, -3 ** -0.5), atol=1e-6)


if __name__ == "__main__":
    unittest.main()

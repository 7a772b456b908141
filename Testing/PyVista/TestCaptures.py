# SPDX-License-Identifier: BSD-3-Clause
"""Captures of 3D Gaussian splatting in PyVista: read, plotted, coloured."""

import os
import sys
import tempfile
import unittest
import zipfile

import numpy as np
import pyvista as pv

from plottercase import SOURCE, PlotterCase

sys.path.insert(0, os.path.join(SOURCE, "Testing", "Shared"))
from captures import of_surface, write_ply, write_splat, write_spz  # noqa: E402
from sogcaptures import write_sog  # noqa: E402
from surfelsplatting.pyvista.readers import read_capture  # noqa: E402

RED, BLUE = (204, 51, 26), (26, 77, 230)


def write_ball(folder):
    """Gaussians on the unit sphere, red for x > 0, otherwise blue."""
    points = np.random.default_rng(1).normal(size=(8000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    colors = np.where(points[:, :1] > 0, RED, BLUE) / 255
    gaussians = of_surface(points, points, colors, 0.05).of_degree(0)
    paths = [os.path.join(folder, name) for name in ("ball.ply", "ball.splat", "ball.spz", "ball.sog")]
    for write, path in zip((write_ply, write_splat, write_spz, write_sog), paths):
        write(path, gaussians)
    return paths


class TestCaptures(PlotterCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.ply, self.splat, self.spz, self.sog = write_ball(folder.name)

    def drawn(self, *args, **options):
        pl = self.plotter()
        pl.surfels.add(*args, show_scalar_bar=False, **options)
        return self.picture(pl)

    def check(self, picture):
        for column, color in ((90, BLUE), (150, RED)):
            # A sheen of up to 0.05 is added, and gaps between the Gaussians darken.
            np.testing.assert_allclose(picture[90, column], color, atol=20)

    def test_files(self):
        self.check(self.drawn(self.ply))
        self.check(self.drawn(self.splat))
        self.check(self.drawn(self.spz))
        self.check(self.drawn(self.sog))
        for path in (self.spz, self.sog):
            self.assertIn("GaussianHarmonics", pv.read(path).point_data)
        capture = pv.read(self.splat)
        self.assertIsInstance(capture, pv.PolyData)
        self.assertFalse(capture.surfels.are_estimated)
        prepared = capture.surfels.estimate()
        self.assertTrue(prepared.surfels.are_estimated)
        self.assertEqual(prepared.n_points, 8000)
        self.check(self.drawn(prepared))

    def test_folder(self):
        """A .sog capture need not be one file."""
        folder = os.path.join(self.folder, "ball")
        with zipfile.ZipFile(self.sog) as file:
            file.extractall(folder)
        for path in (folder, os.path.join(folder, "meta.json")):
            np.testing.assert_array_equal(read_capture(path).points, pv.read(self.sog).points)
        os.remove(os.path.join(folder, "quats.webp"))
        with self.assertRaisesRegex(ValueError, "its quats.webp is missing"):
            read_capture(folder)

    def test_color_and_scalars_win(self):
        lime = self.drawn(self.ply, color="lime")
        np.testing.assert_allclose(lime[90, 120], (0, 255, 0), atol=20)
        gray = self.drawn(self.ply, "GaussianOpacity", cmap="gray")
        self.assertEqual(np.ptp(gray[90, 150].astype(int)), 0)

    def test_plot(self):
        picture = pv.read(self.splat).surfels.plot(
            coc=6, off_screen=True, window_size=(240, 180), return_img=True, screenshot=True,
            cpos=[(0, 0, 6), (0, 0, 0), (0, 1, 0)])
        image = picture[1] if isinstance(picture, tuple) else picture
        self.check(image)


if __name__ == "__main__":
    unittest.main()

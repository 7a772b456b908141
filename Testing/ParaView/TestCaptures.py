# SPDX-License-Identifier: BSD-3-Clause
"""Captures of 3D Gaussian splatting in a render view: read, drawn as they are, selected."""

import numpy as np
from paraview import simple
from paraview.numpy_support import vtk_to_numpy

from captures import of_surface, write_ply, write_splat, write_spz
from plugincase import SIZE, PluginCase, screenshot, sphere

RED, BLUE = (0.8, 0.2, 0.1), (0.1, 0.3, 0.9)


def ball():
    """Gaussians on the unit sphere, red for x > 0, otherwise blue, from every side."""
    points = sphere(20000, (0, 0, 0))
    colors = np.where(points[:, :1] > 0, RED, BLUE)
    return of_surface(points, points, colors, 0.03).of_degree(0)


class Captures(PluginCase):
    def check(self, seen):
        """The colours as they are, without lighting, whatever the sheen adds."""
        middle = SIZE // 2
        for column, color in ((middle + 60, RED), (middle - 60, BLUE)):
            # of_surface adds a sheen of up to 0.05; opacities are 0.7 to 1, and some 5 overlap.
            np.testing.assert_allclose(seen[middle, column] / 255, color, atol=0.08)

    def test_harmonics(self):
        write_ply("ball.ply", ball())
        source = simple.GaussianSplatReader(FileName="ball.ply")
        display = self.show(source)
        self.check(screenshot(self.view))
        display.SurfelLensMode = "Camera"
        self.view.CameraFocalDisk = 0.3
        self.view.CameraFocalDistance = 4.0
        self.check(screenshot(self.view))
        simple.SelectSurfacePoints(Rectangle=[130, 140, 170, 175], View=self.view)
        ids = np.asarray(source.GetSelectionInput(0).Input[0].IDs)[1::2]
        points = vtk_to_numpy(simple.servermanager.Fetch(source).GetPoints().GetData())[ids]
        self.assertGreater(len(ids), 10)
        self.assertGreater(points[:, 2].min(), 0.2)  # the near side
        self.assertEqual(self.view.SMProxy.Pick(SIZE // 2, SIZE // 2), display.SMProxy)

    def test_colors_of_a_splat_file(self):
        write_splat("ball.splat", ball())
        source = simple.OpenDataFile("ball.splat")
        self.assertEqual(simple.Show(source, self.view).Representation, "Surfel Splats")
        display = self.show(source)
        simple.ColorBy(display, ("POINTS", "RGB"))
        self.check(screenshot(self.view))

    def test_spz_file(self):
        write_spz("ball.spz", ball())
        self.show(simple.OpenDataFile("ball.spz"))
        self.check(screenshot(self.view))

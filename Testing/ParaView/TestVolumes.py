# SPDX-License-Identifier: BSD-3-Clause
"""Images that are coloured by scalars are drawn as volumes, as their colour map says."""

import numpy as np
from paraview import simple

from plugincase import PluginCase, screenshot

SOFT = [34, 0, 0.5, 0, 160, 0, 0.5, 0, 286, 0.3, 0.5, 0]
SHELL = [34, 0, 0.5, 0, 140, 0, 0.5, 0, 150, 0.4, 0.5, 0, 160, 0, 0.5, 0, 286, 0, 0.5, 0]


class Volumes(PluginCase):
    def setUp(self):
        super().setUp()
        self.view.CameraPosition = [20, 20, 60]
        self.source = simple.Wavelet()
        simple.UpdatePipeline()
        self.display = simple.Show(self.source, self.view)
        self.opacity = simple.GetOpacityTransferFunction("RTData")
        self.colors = simple.GetColorTransferFunction("RTData")

    def picture(self, representation):
        self.display.Representation = representation
        simple.ColorBy(self.display, ("POINTS", "RTData"))
        self.display.SetScalarBarVisibility(self.view, False)
        self.colors.RGBPoints = [34, 0.1, 0.2, 0.9, 160, 0.9, 0.9, 0.8, 286, 0.8, 0.1, 0.1]
        return screenshot(self.view)

    def test_colour_map(self):
        """As ParaView's own volumes draw it, in the mean within levels of 8 bits: measured 0.6, and 2.4
        of a shell that is thinner than the cells, of which there are 20 along each axis."""
        for points, most in ((SOFT, 1), (SHELL, 3.5)):
            self.opacity.Points = points
            seen, expected = self.picture("Surfel Splats"), self.picture("Volume")
            self.assertGreater(expected.mean(), 20)
            self.assertLess(np.abs(seen - expected).mean(), most)

    def test_changes_show(self):
        self.opacity.Points = SOFT
        first = self.picture("Surfel Splats")
        self.opacity.Points = SHELL
        second = screenshot(self.view)
        self.colors.RGBPoints = [34, 0, 1, 0, 286, 0, 1, 0]
        green = screenshot(self.view)
        self.assertGreater(np.abs(first - second).mean(), 10)
        self.assertEqual((green[..., 0].max(), green[..., 1].max() > 200), (0, True))

    def test_shade(self):
        """Light changes the colours of a shell; without it they are as before."""
        self.opacity.Points = SHELL
        plain = self.picture("Surfel Splats")
        self.display.SurfelShade = 1
        self.assertGreater(np.abs(screenshot(self.view) - plain).mean(), 2)
        self.display.SurfelShade = 0
        np.testing.assert_array_equal(screenshot(self.view), plain)

    def test_without_scalars(self):
        """In one colour the image is the surface of its points, which is opaque."""
        self.opacity.Points = SOFT
        corner = self.picture("Surfel Splats")[90, 90]
        simple.ColorBy(self.display, None)
        self.assertLess(corner.max(), 60)
        self.assertGreater(screenshot(self.view)[90, 90].min(), 60)
        simple.ColorBy(self.display, ("POINTS", "RTData"))
        np.testing.assert_array_equal(screenshot(self.view)[90, 90], corner)

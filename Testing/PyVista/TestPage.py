# SPDX-License-Identifier: BSD-3-Clause
"""Runs what Documentation/PyVista.md shows."""

import os
import re
import tempfile
import unittest

import numpy as np
import pyvista as pv

from plottercase import SOURCE, PlotterCase
from TestAccessor import write_pcd

with open(os.path.join(SOURCE, "Documentation", "PyVista.md"), encoding="utf-8") as page:
    SCENE, CLICK, WIDGET, ARRAYS = re.findall(r"```python\n(.*?)```", page.read(), re.S)


class TestPage(PlotterCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def test_scene(self):
        write_pcd("scan.pcd")
        names = {}
        exec(compile(SCENE, "PyVista.md", "exec"), names)
        exec(compile(CLICK, "PyVista.md", "exec"), names)
        pl = names["pl"]
        pl.show(auto_close=False)
        middle = [side // 2 for side in pl.window_size]
        pl.iren._mouse_left_button_press(*middle)
        pl.iren._mouse_left_button_release(*middle)
        focus = pl.surfels.splatter.GetFocusPoint()  # on the ball
        self.assertAlmostEqual(np.linalg.norm(np.subtract(focus, names["scan"].center)), 0.2, delta=0.01)
        exec(compile(WIDGET, "PyVista.md", "exec"), names)
        self.assertIn("half", names["pl"].actors)
        names["pl"].close()
        one, scene = (pv.read(name) for name in ("scan.png", "scene.png"))
        for picture in (one, scene):
            colors = np.unique(picture["PNGImage"], axis=0)
            self.assertGreater(len(colors), 100)

    def test_arrays(self):
        names = {}
        exec(compile(ARRAYS, "PyVista.md", "exec"), names)
        self.assertEqual(names["picture"].shape, (300, 400, 3))
        self.assertGreater(names["picture"][150, 200, 2], 150)
        self.assertEqual(pv.read("sphere.png").dimensions, (400, 300, 1))


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""What the tests with PyVista share: no display, a coloured sphere, and comparisons of pictures."""

import os
import sys
import unittest

for name in ("DISPLAY", "WAYLAND_DISPLAY"):
    os.environ.pop(name, None)

import numpy as np  # noqa: E402
import pyvista as pv  # noqa: E402

pv.OFF_SCREEN = True
pv.global_theme.background = "black"
SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FRONT = [(0, 0, 6), (0, 0, 0), (0, 1, 0)]


def sphere_cloud(count=10000):
    """A sphere of radius 1 with height, colours and stripes."""
    points = np.random.default_rng(1).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    cloud = pv.PolyData(points)
    cloud["height"] = points[:, 1]
    cloud["RGB"] = np.where(points[:, :1] > 0, (230, 60, 30), (30, 60, 230)).astype(np.uint8)
    cloud["stripes"] = np.sin(60 * points[:, 0])
    cloud.set_active_scalars(None)
    return cloud


def detail(picture):
    """Mean difference of neighbouring pixels."""
    return np.abs(np.diff(picture.astype(int), axis=1)).mean()


def run_notebook(notebook):
    """Executes it in a kernel of this interpreter."""
    import nbclient

    client = nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3")
    manager = client.create_kernel_manager()
    manager.kernel_spec.argv[0] = sys.executable
    client.execute()
    return notebook


class PlotterCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cloud = sphere_cloud()
        cls.surfels = cls.cloud.surfels.estimate()

    def plotter(self, **options):
        pl = pv.Plotter(**{"window_size": (240, 180), **options})
        self.addCleanup(pl.close)
        pl.camera_position = FRONT
        return pl

    def picture(self, pl):
        pl.render()  # what has changed; nothing before the first screenshot
        return pl.screenshot(return_img=True).copy()

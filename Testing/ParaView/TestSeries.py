# SPDX-License-Identifier: BSD-3-Clause
"""Numbered files are the steps of a time series."""

import numpy as np
from paraview import simple

from captures import write_splat
from plugincase import SIZE, PluginCase, screenshot, sphere
from TestCaptures import ball

RADII = (0.4, 0.8, 1.2)


def write_pcd(path, points):
    with open(path, "w") as file:
        file.write("VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
                   f"WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA ascii\n")
        np.savetxt(file, points, "%.9g")


class Series(PluginCase):
    def check(self, files):
        """The wider the sphere, the more pixels are covered, also after a state was loaded."""
        source = simple.OpenDataFile(files)
        self.assertEqual(list(source.TimestepValues), [0, 1, 2])
        self.show(source)
        simple.GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
        covered = self.covered_at_times()
        self.assertEqual(covered, sorted(covered))
        self.assertGreater(covered[2], 6 * covered[0])
        simple.SaveState("series.pvsm")
        simple.ResetSession()
        simple.LoadState("series.pvsm")
        [self.view] = simple.GetViews()
        self.view.ViewSize = [SIZE, SIZE]
        np.testing.assert_allclose(self.covered_at_times(), covered, rtol=0.05)

    def covered_at_times(self):
        scene = simple.GetAnimationScene()
        covered = []
        for time in (0, 1, 2):
            scene.AnimationTime = time
            covered.append(int((screenshot(self.view).max(2) > 40).sum()))
        return covered

    def test_pcd_files(self):
        files = [f"step{i}.pcd" for i in range(3)]
        for file, radius in zip(files, RADII):
            write_pcd(file, sphere(5000, (0, 0, 0), radius))
        self.check(files)

    def test_splat_files(self):
        files = [f"step{i}.splat" for i in range(3)]
        for file, radius in zip(files, RADII):
            capture = ball()
            capture.positions *= radius
            capture.scales *= radius
            write_splat(file, capture)
        self.check(files)

# SPDX-License-Identifier: BSD-3-Clause
"""Runs the example of a user's script and looks for each of its props in the picture."""

import os
import subprocess
import sys
import tempfile
import unittest

from TestInstall import read_png

SKIPPED = 77


class TestPythonExample(unittest.TestCase):
    def test_scene(self):
        script = os.path.join(os.environ["SOURCE"], "Examples", "Python", "scene.py")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "scene.png")
            subprocess.run([sys.executable, "-s", script, path], check=True)
            picture = read_png(path).astype(int)
        red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
        found = {
            "surfels": (abs(red - green) < 8) & (abs(red - blue) < 8) & (red > 120),
            "cone": (red > green + 60) & (green > blue + 30),
            "x axis": (red > 150) & (green < 40) & (blue < 40),
            "y axis": (green > 150) & (red < 40) & (blue < 40),
        }
        least = {"surfels": 15000, "cone": 3000, "x axis": 50, "y axis": 50}
        for name, mask in found.items():
            self.assertGreater(mask.sum(), least[name], name)
        # The text's bottom line, white; rows count from below.
        self.assertGreater((picture[:40].min(axis=2) > 200).sum(), 300)


if __name__ == "__main__":
    if not os.environ.get("DISPLAY"):
        print("skipped: a render window needs DISPLAY (see xvfb-run)")
        sys.exit(SKIPPED)
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""Files of lidars on cars, and of COLMAP, of which nothing but their names tells what they hold."""

import struct
import unittest

import numpy as np

from surfelsplatting.formats.colmap import is_colmap, read_colmap_cloud
from surfelsplatting.formats.sweeps import read_sweep
from surfelsplatting.problems import UserProblem
from toolcase import SMALL, ToolCase, arrays_of, places_of, sphere, write


def sweep():
    """[n, 6] x y z intensity ring time of a lidar above a ground, ring by ring"""
    azimuth = np.radians(np.arange(0, 360, 0.5))
    rows = []
    for ring, slope in enumerate(np.linspace(0.1, 0.5, 16)):
        away = np.full(len(azimuth), 1.8 / slope)
        rows.append(np.column_stack([away * np.cos(azimuth), away * np.sin(azimuth),
                                     np.full(len(azimuth), -1.8), 0.5 + 0.4 * np.sin(azimuth),
                                     np.full(len(azimuth), ring), azimuth / 60]))
    return np.concatenate(rows).astype("<f4")


class TestSweeps(ToolCase):
    def test_columns_are_found(self):
        """Also where the number of values would allow for others."""
        rows = sweep()[:11_520 // 60 * 60]
        for count, names in ((4, ["intensity"]), (5, ["intensity", "ring"]),
                             (6, ["intensity", "ring", "time"])):
            self.assertEqual(rows[:, :count].size % 60, 0)
            cloud, how = read_sweep(write("a.bin", rows[:, :count].tobytes()))
            np.testing.assert_array_equal(places_of(cloud), rows[:, :3])
            self.assertEqual(list(arrays_of(cloud)), names)
            np.testing.assert_array_equal(arrays_of(cloud)["intensity"], rows[:, 3])
            self.assertIn(", ".join(names), how)

    def test_tool(self):
        write("a.bin", sweep()[:, :4].tobytes())
        self.render("a.bin", *SMALL, "--scalars", "intensity", "-o", "a.png")
        self.assertRegex(self.info("a.bin"), r"up +0 0 1\n")

    def test_other_files(self):
        rng = np.random.default_rng(1)
        for content in (rng.bytes(160), b"12345", rng.bytes(161), b"x y z\n1 2 3\n"):
            with self.assertRaisesRegex(UserProblem, "does not hold rows"):
                read_sweep(write("a.bin", content))


class TestColmap(ToolCase):
    def setUp(self):
        super().setUp()
        points, colors = sphere(50)
        self.points, self.colors = points + (1e6 + 0.125, 0, 0), colors
        images = [(i % 4 + 1) * [(7, 9)] for i in range(50)]
        lines = ["# 3D point list with one line of data per point:",
                 "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"]
        self.content = struct.pack("<Q", 50)
        for number, (point, color, seen) in enumerate(zip(self.points, colors, images)):
            flat = [value for image in seen for value in image]
            lines.append(" ".join(map(str, [number, *point.tolist(), *color.tolist(), 0.5, *flat])))
            self.content += struct.pack("<Q3d3BdQ", number, *point, *color, 0.5, len(seen))
            self.content += struct.pack(f"<{len(flat)}I", *flat)
        self.text = "\n".join(lines) + "\n"

    def check(self, path):
        self.assertTrue(is_colmap(path))
        cloud = read_colmap_cloud(path)
        np.testing.assert_array_equal(places_of(cloud), self.points)
        np.testing.assert_array_equal(arrays_of(cloud)["RGB"], self.colors)
        self.assertIn("the points of COLMAP", self.info(path))

    def test_points(self):
        self.check(write("points3D.bin", self.content))
        self.check(write("points3D.txt", self.text))
        self.assertFalse(is_colmap(write("points.txt", self.text)))
        np.savetxt("points3d.txt", self.points)
        self.assertFalse(is_colmap("points3d.txt"))

    def test_damaged(self):
        cases = (("points3D.bin", self.content[:-20], "50 points, and holds 49"),
                 ("points3D.txt", self.text + "1 2 3\n", "do not all have"),
                 ("points3D.txt", self.text + "1 2 3 x 5 6 7 8\n", "not numbers"))
        for path, content, says in cases:
            self.refuse("info", write(path, content), says=[path, says])
        self.refuse("info", write("points3D.bin", bytes(8)), says="holds no points")
        self.refuse("info", write("points3D.txt", self.text.split("0 ")[0]), says="holds no points")


if __name__ == "__main__":
    unittest.main()

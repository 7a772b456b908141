# SPDX-License-Identifier: BSD-3-Clause
"""Text clouds: columns, delimiters and headers."""

import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from surfelsplatting.commandline.problems import UserProblem
from surfelsplatting.commandline.textclouds import read_text_cloud
from toolcase import ToolCase, arrays_of


class TestTextClouds(ToolCase):
    def read(self, text):
        with open("cloud.xyz", "w") as file:
            file.write(text)
        cloud = read_text_cloud("cloud.xyz")
        return vtk_to_numpy(cloud.GetPoints().GetData()), arrays_of(cloud)

    def check_points(self, text, expected=((1, 2, 3), (4, 5, 6))):
        points, arrays = self.read(text)
        np.testing.assert_array_equal(points, expected)
        return arrays

    def test_delimiters_comments_and_headers(self):
        for text in ("1 2 3\n4 5 6\n", "1,2,3\n4,5,6\n", "1, 2, 3\n4, 5, 6", "1;2;3\n4;5;6\n",
                     "  1\t2  3\n\n4 5 6\n", "# made by hand\n1 2 3 # first\n4 5 6\n",
                     "//X Y Z\n1 2 3\n4 5 6\n", "2\n1 2 3\n4 5 6\n", "# n\n2\n\n1 2 3\n4 5 6\n",
                     "x,y,z\n1,2,3\n4,5,6\n", "1 2 3\r\n4 5 6\r\n"):
            self.assertEqual(self.check_points(text), {}, repr(text))

    def test_utm_coordinates_keep_their_detail(self):
        points, _ = self.read("691000.00015 5334000.12345 512.5\n691000.0003 5334000.1235 512\n")
        np.testing.assert_array_equal(points, [[691000.00015, 5334000.12345, 512.5],
                                               [691000.0003, 5334000.1235, 512]])

    def test_intensity(self):
        arrays = self.check_points("1 2 3 0.5\n4 5 6 17\n")
        np.testing.assert_array_equal(arrays["intensity"], [0.5, 17])

    def test_colors(self):
        arrays = self.check_points("1 2 3 255 128 0\n4 5 6 0 0 1\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 128, 0], [0, 0, 1]])
        arrays = self.check_points("1 2 3 1.0 0.5 0\n4 5 6 0.2 0 0\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 128, 0], [51, 0, 0]])

    def test_whole_colors_within_one_are_fractions(self):
        arrays = self.check_points("1 2 3 1 1 1\n4 5 6 0 0 1\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 255, 255], [0, 0, 255]])

    def test_normals(self):
        arrays = self.check_points("1 2 3 0 0 -1\n4 5 6 0.6 0.8 0\n")
        np.testing.assert_allclose(arrays["Normals"], [[0, 0, -1], [0.6, 0.8, 0]], rtol=1e-6)
        # Whole numbers, but of length 1: a floor, not nearly black colours.
        arrays = self.check_points("1 2 3 0 0 1\n4 5 6 0 0 1\n")
        np.testing.assert_array_equal(arrays["Normals"], [[0, 0, 1], [0, 0, 1]])

    def test_seven_and_nine_columns(self):
        arrays = self.check_points("1 2 3 900 10 20 30\n4 5 6 -5 40 50 60\n")
        np.testing.assert_array_equal(arrays["intensity"], [900, -5])
        np.testing.assert_array_equal(arrays["RGB"], [[10, 20, 30], [40, 50, 60]])
        arrays = self.check_points("1 2 3 10 20 30 900\n4 5 6 40 50 60 -5\n")
        np.testing.assert_array_equal(arrays["intensity"], [900, -5])
        for order in ("{n} {c}", "{c} {n}"):
            row = order.format(n="0 0 -1", c="9 8 7")
            arrays = self.check_points(f"1 2 3 {row}\n4 5 6 {row}\n")
            np.testing.assert_array_equal(arrays["RGB"], [[9, 8, 7]] * 2)
            np.testing.assert_array_equal(arrays["Normals"], [[0, 0, -1]] * 2)

    def test_missing_values(self):
        points, _ = self.read("nan nan nan 0 0 0\n4 5 6 10 20 30\n")
        np.testing.assert_array_equal(np.isnan(points[:, 0]), [True, False])

    def test_unknown_layouts(self):
        for text in ("1 2\n", "1 2 3 4 5\n", "1 2 3 4 5 6 7 8 9 10\n"):
            with self.assertRaises(UserProblem, msg=text):
                self.read(text)


if __name__ == "__main__":
    unittest.main()

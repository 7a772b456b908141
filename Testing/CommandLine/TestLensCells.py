# SPDX-License-Identifier: BSD-3-Clause
"""The lens in cells and in points, from the command line."""

import unittest

import numpy as np

from toolcase import CAMERA, ToolCase, read_json, sphere, write_ply

LENS = ["--circle-of-confusion", "25", "--focal-distance", "3"]


def distance(a, b):
    return np.sqrt(np.mean((a - b) ** 2))


class TestLensCells(ToolCase):
    def setUp(self):
        super().setUp()
        near, near_colors = sphere(9000, radius=0.35)
        far, far_colors = sphere(15000)
        points = np.concatenate([near + (0.5, 0.1, 1.2), far])
        write_ply("balls.ply", points, np.concatenate([255 - near_colors, far_colors]))

    def run_with(self, *options, warning=""):
        """-> picture, statistics"""
        said = self.tool("render", "balls.ply", *CAMERA, "--size", "96", "72", "--unlit",
                         *options, "-o", "out.exr", "--stats", "stats.json")
        self.assertEqual(self.code, 0, said)
        self.assertRegex(said, rf"\A{warning}\Z")
        return self.read_rgba("out.exr"), read_json("stats.json")

    def test_cells_approach_the_reference(self):
        reference, statistics = self.run_with(*LENS, "--reference", "200")
        self.assertEqual(statistics["lens"], {"cells": 200, "pinholes": True})
        self.assertEqual(statistics["blurred"], 0)
        errors = []
        for cells in ("1", "7", "19"):
            picture, statistics = self.run_with(*LENS, "--lens-cells", cells)
            self.assertEqual(statistics["lens"], {"cells": int(cells), "pinholes": False})
            self.assertGreater(statistics["blurred"], 0)
            errors.append(distance(picture, reference))
        self.assertLess(errors[1], 0.6 * errors[0])
        self.assertLess(errors[2], 0.6 * errors[1])
        self.assertLess(errors[2], 0.02)  # colours change from point to point
        few, more = (distance(self.run_with(*LENS, "--reference", points)[0], reference)
                     for points in ("4", "37"))
        self.assertLess(3 * more, few)

    def test_seven_unless_the_picture_is_deep(self):
        picture, statistics = self.run_with(*LENS)
        self.assertEqual(statistics["lens"]["cells"], 7)
        np.testing.assert_array_equal(picture, self.run_with(*LENS, "--lens-cells", "7")[0])
        self.render("balls.ply", *CAMERA, *LENS, "--size", "96", "72", "--deep", "-o", "deep.exr",
                    "--stats", "stats.json")
        self.assertEqual(read_json("stats.json")["lens"]["cells"], 1)

    def test_a_pinhole_has_one_cell(self):
        one, once = self.run_with("--blur", "0")
        seven, statistics = self.run_with(
            "--blur", "0", "--lens-cells", "7",
            warning="surfelsplat: warning: --lens-cells has no effect without a lens; .*\n")
        np.testing.assert_array_equal(one, seven)
        self.assertEqual(once["splats"], statistics["splats"])

    def test_what_is_refused(self):
        for options, words in (
                (("--lens-cells", "0"), "'0' is not a whole number of at least 1"),
                (("--reference", "70000"), "70000 is more than 65536"),
                (("--lens-cells", "2", "--reference", "3"), "not allowed with")):
            self.refuse("render", "balls.ply", *options, "-o", "out.exr", says=words)


if __name__ == "__main__":
    unittest.main()

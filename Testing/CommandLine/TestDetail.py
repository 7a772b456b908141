# SPDX-License-Identifier: BSD-3-Clause
"""Level of detail from the command line."""

import unittest

import numpy as np

from toolcase import CAMERA, ToolCase, read_json, sphere, write_ply

LENS = ["--circle-of-confusion", "30", "--focal-distance", "3"]


class TestDetail(ToolCase):
    def setUp(self):
        super().setUp()
        points, colors = sphere(20000)
        write_ply("ball.ply", points, colors)

    def run_with(self, *options, cloud="ball.ply"):
        """-> picture, statistics"""
        self.render(cloud, *CAMERA, "--size", "96", "72", "--unlit", *options, "-o", "out.exr",
                    "--stats", "stats.json")
        return self.read_rgba("out.exr"), read_json("stats.json")

    def test_fewer_splats_for_the_same_picture(self):
        every, plain = self.run_with(*LENS, "--no-lod")
        some, detail = self.run_with(*LENS)
        finer, fine = self.run_with(*LENS, "--lod-error", "0.5")
        self.assertLess(10 * detail["splats"], plain["splats"])
        self.assertLess(detail["splats"], fine["splats"])
        # Siblings that merge keep the moments of their coverage, not its outline: 2.03e-3.
        self.assertLess(np.abs(every - some).mean(), 2.2e-3)
        self.assertLess(np.abs(every - finer).mean(), 2e-3)
        self.assertEqual(plain["detail"]["visited"], 0)
        self.assertGreater(detail["skipped"]["facing_away"], 5000)
        self.assertEqual(detail["blurred"], detail["splats"])
        self.assertEqual(self.run_with()[1]["blurred"], 0)
        self.assertEqual((plain["surfels"], detail["surfels"]), (20000, 20000))
        self.assertIn("hierarchy", detail["milliseconds"])
        self.assertNotIn("hierarchy", plain["milliseconds"])

    def test_one_sharp_picture_needs_no_hierarchy(self):
        sharp, statistics = self.run_with()
        self.assertNotIn("hierarchy", statistics["milliseconds"])
        for options in (["--lod-error", "1"], ["--channels", "level"], ["--blur", "1"],
                        ["--hierarchy", "nodes.vtp"]):
            picture, statistics = self.run_with(*options)
            self.assertIn("hierarchy", statistics["milliseconds"], options)
            if options[0] != "--blur":
                difference = np.abs(picture - sharp)  # at outlines
                self.assertLess(difference.mean(), 6e-4, options)  # 4.3e-4
                self.assertLess(difference.max(), 0.04, options)  # 0.025

    def test_cloud_in_parts(self):
        points, colors = sphere(20000)
        write_ply("ball.ply", points, colors, points)  # parts cannot tell what is outside
        whole, _ = self.run_with()
        parts, statistics = self.run_with("--points-per-part", "3000")
        self.assertEqual(statistics["surfels"], 20000)
        self.assertLess(np.abs(whole - parts).mean(), 2e-3)
        self.assertLess(np.abs(whole - parts).max(), 0.05)
        self.refuse("render", "ball.ply", "--points-per-part", "10", "-o", "out.png",
                    says="between 1000 and")

    def test_saved_hierarchy_is_drawn_as_it_is(self):
        first, _ = self.run_with(*LENS, "--hierarchy", "nodes.vtp")
        again, statistics = self.run_with(*LENS, cloud="nodes.vtp")
        np.testing.assert_array_equal(first, again)
        self.assertEqual(statistics["surfels"], 20000)
        for stage in ("surfels", "hierarchy"):
            self.assertNotIn(stage, statistics["milliseconds"])
        self.assertEqual(self.read_vtp("nodes.vtp").GetFieldData().GetArray("SurfelLeaves")
                         .GetNumberOfValues(), 2)

    def test_contradictions(self):
        for options in (["--lod-error", "1"], ["--hierarchy", "nodes.vtp"]):
            self.refuse("render", "ball.ply", "--no-lod", *options, "-o", "out.png",
                        says="--no-lod and " + options[0])


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""Which side of the surfels is outside, from the command line."""

import unittest

from toolcase import CAMERA, SMALL, ToolCase, arrays_of, sphere, write_ply


class TestSides(ToolCase):
    def surfels(self, cloud, *options):
        """-> area vectors, two-sided flags"""
        self.render(cloud, *CAMERA, *SMALL, *options, "-o", "out.png", "--surfels", "out.vtp")
        arrays = arrays_of(self.read_vtp("out.vtp"))
        return arrays["SurfelAreaVector"], arrays["SurfelTwoSided"] > 0

    def test_auto_decides(self):
        points, colors = sphere()
        write_ply("ball.ply", points, colors)
        for options in ((), ("--sides", "auto")):
            areas, two_sided = self.surfels("ball.ply", *options)
            self.assertFalse(two_sided.any())
            self.assertTrue(((areas * points).sum(axis=1) > 0).all())

    def test_two(self):
        points, colors = sphere()
        write_ply("ball.ply", points, colors)
        write_ply("given.ply", points, colors, points)
        for cloud in ("ball.ply", "given.ply"):
            self.assertTrue(self.surfels(cloud, "--sides", "two")[1].all())
        self.assertTrue(self.surfels("ball.ply", "--sides", "two", "--points-per-part", "1000")[1]
                        .all())

    def test_given_without_normals(self):
        points, colors = sphere()
        write_ply("ball.ply", points, colors)
        self.refuse("render", "ball.ply", "--sides", "given", "-o", "out.png",
                    says=("ball.ply has no normals", "--sides auto"))
        self.refuse("render", "ball.ply", "--sides", "three", "-o", "out.png", says="two")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""Colours of scalars."""

import unittest

import numpy as np

from surfelsplatting.colormaps import COLORMAPS, colors_of, lookup_table, scalar_names
from surfelsplatting.problems import UserProblem
from toolcase import CAMERA, SMALL, ToolCase, content_of, sphere, write, write_ply

FRAME = [*CAMERA, *SMALL, "--unlit"]

# Colours 38, 128 and 203 of 256, as matplotlib has them.
PUBLISHED = {
    "viridis": "463480 21918c 77d153", "plasma": "5601a4 cc4778 fca537",
    "inferno": "2b0b57 bc3754 fca309", "magma": "251255 b73779 fe9d6c",
    "cividis": "243c6e 7d7c78 c7b767", "turbo": "477bf2 a4fc3c f15d13",
    "coolwarm": "6a8bef dddcdc ee8669"}


class TestScalars(ToolCase):
    def setUp(self):
        super().setUp()
        points, colors = sphere(6000)
        self.write("ball.xyz", points, 100 * points[:, 1:2] + 50, colors)

    def write(self, path, points, intensity, colors):
        table = np.hstack([points, intensity, colors])
        np.savetxt(path, table, fmt="%.12g", header="//x y z intensity red green blue", comments="")

    def picture(self, *options, cloud="ball.xyz"):
        self.render(cloud, *FRAME, *options, "-o", "out.png")
        return self.read_png("out.png").astype(float)

    def test_tables(self):
        for name, text in COLORMAPS.items():
            colors = np.round(colors_of(name) * 255)
            for index, word in ((0, text.split()[0]), (255, text.split()[-1])):
                self.assertEqual("".join(f"{int(c):02x}" for c in colors[index]), word)
        np.testing.assert_allclose(colors_of("gray")[100], 100 / 255)
        for name, words in PUBLISHED.items():
            for index, word in zip((38, 128, 203), words.split()):
                np.testing.assert_allclose(255 * colors_of(name)[index], list(bytes.fromhex(word)),
                                           atol=7, err_msg=name)
        # Their lightness grows: that is what they are for.
        for name in ("viridis", "plasma", "inferno", "magma", "cividis", "gray"):
            lightness = colors_of(name) @ (0.2126, 0.7152, 0.0722)
            self.assertTrue((np.diff(lightness) > 0).all(), name)
        first, last = lookup_table("gray", 3, 1), lookup_table("gray", 1, 3)
        self.assertEqual(first.GetTableValue(0), (1, 1, 1, 1))
        self.assertEqual(first.GetRange(), last.GetRange())

    def test_unknown_colormaps(self):
        with self.assertRaisesRegex(UserProblem, "'nonsense'"):
            colors_of("nonsense")
        np.testing.assert_array_equal(colors_of("Viridis"), colors_of("viridis"))

    def test_height(self):
        """y of the ball goes up in the picture: from -1 to 1, black to white."""
        picture = self.picture("--scalars", "y", "--colormap", "gray", "--range", "-1", "1")
        for row in (12, 18, 24, 30, 36):
            expected = 127.5 + 127.5 * (23.5 - row) / 24 * 6 * np.tan(np.radians(15)) * 0.85
            self.assertAlmostEqual(picture[row, 32, 0], expected, delta=12)
        self.assertTrue((picture[..., 0] == picture[..., 2])[picture[..., 0] > 60].all())
        # The intensity is 100 y + 50, and by default the range is that of the cloud.
        np.testing.assert_allclose(
            self.picture("--scalars", "intensity", "--colormap", "gray"), picture, atol=2)
        reversed_ = self.picture("--scalars", "y", "--colormap", "gray", "--range", "1", "-1")
        self.assertAlmostEqual(reversed_[14, 32, 0], 255 - picture[14, 32, 0], delta=2)

    def test_large_coordinates(self):
        near = self.picture("--scalars", "y")
        points, colors = sphere(6000)
        far = points + (691000.0, 5334000.0, 500.0)
        self.write("far.xyz", far, points[:, :1], colors)
        moved = ["--position", 691000, 5334000, 506, "--focal-point", 691000, 5334000, 500]
        self.render("far.xyz", *FRAME, *moved, "--scalars", "y", "-o", "out.png")
        np.testing.assert_allclose(self.read_png("out.png"), near, atol=3)

    def test_hierarchy_keeps_the_scalars(self):
        expected = self.picture("--scalars", "intensity", "--hierarchy", "ball.vtp")
        self.assertLessEqual({"intensity", "x", "y", "z"},
                             set(scalar_names(self.read_vtp("ball.vtp"))))
        np.testing.assert_array_equal(
            self.picture("--scalars", "intensity", cloud="ball.vtp"), expected)
        # The colours of the cloud are still there.
        by_detail = "--lod-error", "1"
        np.testing.assert_array_equal(self.picture(cloud="ball.vtp"), self.picture(*by_detail))
        np.testing.assert_array_equal(self.picture("--scalars", "z", cloud="ball.vtp"),
                                      self.picture("--scalars", "z", *by_detail))

    def test_scalars_without_a_range(self):
        points, colors = sphere(3000)
        self.write("same.xyz", points, np.full((3000, 1), 7.0), colors)
        self.check_one_colour(self.picture("--scalars", "intensity", cloud="same.xyz"))

    def check_one_colour(self, picture):
        middle = picture[20:28, 28:36].reshape(-1, 3)
        self.assertLess(np.ptp(middle, axis=0).max(), 3)

    def test_intensity_without_colours(self):
        """Is told of, unless it is shown or the same everywhere."""
        points, _ = sphere(3000)
        for intensity, options, says in ((points[:, :1], (), "--scalars intensity shows it"),
                                         (points[:, :1], ("--scalars", "intensity"), ""),
                                         (0 * points[:, :1], (), "")):
            np.savetxt("grey.xyz", np.hstack([points, intensity]), header="x y z intensity", comments="//")
            said = self.tool("render", "grey.xyz", *CAMERA, *SMALL, *options, "-o", "out.png")
            self.assertEqual((self.code, bool(said)), (0, bool(says)), said)
            self.assertIn(says, said)
        write_ply("named.ply", points, normals=points)
        named = content_of("named.ply").replace(b"float nx", b"float Scalar_Intensity").replace(b"float ny", b"float b")
        said = self.tool("render", write("named.ply", named), *CAMERA, *SMALL, "-o", "out.png")
        self.assertIn("--scalars Scalar_Intensity shows it", said)
        self.assertIn("--scalars Scalar_Intensity", self.info("named.ply"))

    def test_scalars_without_a_number(self):
        points, _ = sphere(3000)
        np.savetxt("none.xyz", np.column_stack([points, np.full(3000, np.nan)]), header="x y z time", comments="//")
        said = self.tool("render", "none.xyz", *FRAME, "--scalars", "time", "-o", "out.png")
        self.assertEqual((self.code, said.count("scalars time are NaN everywhere")), (0, 1), said)
        self.check_one_colour(self.read_png("out.png").astype(float))

    def test_outliers_that_take_the_colours(self):
        """As of reflectors in a laser scan: a range without them is named, unless one is given."""
        points, colors = sphere(3000)
        values = 50 + 50 * points[:, :1]
        self.write("even.xyz", points, values, colors)
        values[::300] = 60000
        self.write("far.xyz", points, values, colors)
        for name, options, is_said in (("even.xyz", (), False), ("far.xyz", (), True),
                                       ("far.xyz", ("--range", "0", "100"), False)):
            said = self.tool("render", name, *CAMERA, *SMALL, "--scalars", "intensity", *options, "-o",
                             "out.png")
            self.assertEqual("--range" in said, is_said, said)
        np.savetxt("grey.xyz", np.hstack([points, values]), header="x y z intensity", comments="//")
        self.assertRegex(self.info("grey.xyz"), r"--scalars intensity --range \S+ \S+ ")

    def test_what_is_refused(self):
        for options, says in ((("--scalars", "height"), "'height'; there are intensity, x, y, z"),
                              (("--scalars", "RGB"), "there are no scalars 'RGB'"),
                              (("--scalars", "x", "--range", "2", "2"), "--range is from 2 to 2"),
                              (("--scalars", "x", "--colormap", "none such"), "'none such'")):
            self.refuse("render", "ball.xyz", *FRAME, *options, "-o", "out.png", says=says)
        # At once, not after the minutes that a large cloud takes
        self.refuse("render", "missing.ply", "--scalars", "x", "--colormap", "none such", says="'none such'")


if __name__ == "__main__":
    unittest.main()

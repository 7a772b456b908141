# SPDX-License-Identifier: BSD-3-Clause
"""What the tool writes: .exr, .png, surfels and statistics."""

import json
import math
import os
import stat
import subprocess
import unittest

import numpy as np
from vtkmodules.vtkIOImage import vtkJPEGReader

from toolcase import (CAMERA, SMALL, ToolCase, arrays_of, content_of, read_json, sphere, write,
                      write_ply)


class TestPictures(ToolCase):
    def setUp(self):
        super().setUp()
        points, colors = sphere(6000)
        write_ply("ball.ply", points, colors)

    def picture(self, *options, cloud="ball.ply"):
        self.render(cloud, *options, "-o", "out.exr")
        return self.read_rgba("out.exr")

    def test_coverage_and_place_of_a_ball(self):
        alpha = self.picture(*CAMERA, "--size", "160", "120", "--unlit")[..., 3]
        # Silhouette of the unit ball seen from 6: sin = 1/6.
        radius = 60 / math.tan(math.radians(15)) * math.tan(math.asin(1 / 6))
        self.assertAlmostEqual(alpha.sum() / (math.pi * radius ** 2), 1, delta=0.03)
        rows, columns = np.indices(alpha.shape) + 0.5
        self.assertAlmostEqual((alpha * rows).sum() / alpha.sum(), 60, delta=0.3)
        self.assertAlmostEqual((alpha * columns).sum() / alpha.sum(), 80, delta=0.3)
        self.assertGreater(alpha[60, 80], 0.97)
        self.assertEqual(alpha[0, 0], 0)

    def test_colors_are_where_they_belong(self):
        picture = self.picture(*CAMERA, *SMALL, "--unlit")
        # +x is right and red, +y is up and green.
        for row, column, expected in ((14, 40, (230, 200, 90)), (34, 40, (230, 20, 90)),
                                      (14, 24, (40, 200, 90)), (34, 24, (40, 20, 90))):
            color = picture[row, column]
            np.testing.assert_allclose(255 * color[:3] / color[3], expected, atol=3)

    def test_values_are_premultiplied(self):
        picture = self.picture(*CAMERA, *SMALL, "--unlit", "--focal-disk", "0.8",
                               "--focal-distance", "3")
        self.assertGreater(((picture[..., 3] > 0.1) & (picture[..., 3] < 0.9)).sum(), 300)
        self.assertTrue((picture[..., 0] <= picture[..., 3] + 1e-5).all())
        # Blue is the same everywhere; red and green have edges, which colours may overshoot.
        np.testing.assert_allclose(picture[..., 2], picture[..., 3] * 90 / 255, atol=1e-5)

    def test_depth_channel(self):
        self.picture(*CAMERA, *SMALL)
        depth = self.read_exr("out.exr")["Z"]
        self.assertAlmostEqual(depth[24, 32], 5.0, delta=0.05)
        self.assertEqual(depth[0, 0], 0)

    def test_light_from_above(self):
        """A ball is brightest at the upper left, and a floor that is seen from the side is not black."""
        picture = self.picture(*CAMERA, *SMALL, "--lit")
        unlit = self.picture(*CAMERA, *SMALL, "--unlit")
        np.testing.assert_array_equal(picture[..., 3], unlit[..., 3])
        inside = unlit[..., 3] > 0.99
        brightness = np.where(inside, picture[..., 2] / np.maximum(unlit[..., 2], 0.1), 0)
        row, column = np.unravel_index(brightness.argmax(), brightness.shape)
        # 0.75 of a light 35 degrees above and 40 to the left, 0.25 at the camera, and 0.21 at 110
        # degrees to the left add up to (-0.592, 0.430, 0.649), of length 0.978. The ball has a
        # radius of 15.1 px.
        self.assertAlmostEqual(row, 23.5 - 15.1 * 0.430 / 0.978, delta=2)
        self.assertAlmostEqual(column, 31.5 - 15.1 * 0.592 / 0.978, delta=2)
        self.assertAlmostEqual(brightness.max(), 0.978, delta=0.02)
        x, y = (values.ravel() for values in np.meshgrid(*2 * [np.linspace(-1, 1, 80)]))
        write_ply("floor.ply", np.column_stack([x, y, np.zeros_like(x)]),
                  normals=np.tile((0.0, 0.0, 1.0), (len(x), 1)))
        low = ("--position", 0, -4, 0.4, "--focal-point", 0, 0, 0, "--view-up", 0, 0, 1)
        floor = self.picture(*low, *SMALL, cloud="floor.ply")
        # Its normal is (0, 0.995, 0.0995), and the cloud's grey 0.8.
        self.assertAlmostEqual(floor[24, 32, 0] / floor[24, 32, 3], 0.8 * (0.475 + 0.025), delta=0.01)

    def test_background_is_composited(self):
        plain = self.picture(*CAMERA, *SMALL)
        opaque = self.picture(*CAMERA, *SMALL, "--background", "0.2", "0.4", "1")
        np.testing.assert_array_equal(opaque[..., 3], 1)
        expected = plain[..., :3] + (1 - plain[..., 3:]) * [0.2, 0.4, 1]
        np.testing.assert_allclose(opaque[..., :3], expected, atol=1e-5)
        for words in (["--background", "#3366ff"], ["--background=#3366FF"]):
            self.render(*words, "ball.ply", *CAMERA, *SMALL, "-o", "hex.exr")
            np.testing.assert_allclose(self.read_rgba("hex.exr"), opaque, atol=1e-5)

    def test_background_has_names(self):
        for name, color in (("white", (1, 1, 1)), ("Light Grey", (211 / 255,) * 3),
                            ("black", (0, 0, 0))):
            picture = self.picture(*CAMERA, *SMALL, "--background", name)
            np.testing.assert_allclose(picture[0, 0], (*color, 1), atol=1e-6)

    def test_png_is_the_same_picture_in_bytes(self):
        for options, background in (([], (0.16, 0.17, 0.19)), (["--unlit"], (0, 0, 0)),
                                    (["--background", "0.5", "0", "0.25"], (0.5, 0, 0.25))):
            exr = self.picture(*CAMERA, *SMALL, *options[:1 if "--unlit" in options else 0])
            self.render("ball.ply", *CAMERA, *SMALL, *options, "-o", "out.png")
            expected = exr[..., :3] + (1 - exr[..., 3:]) * np.array(background)
            png = self.read_png("out.png")
            self.assertEqual(png.shape, (48, 64, 3))
            np.testing.assert_allclose(png, 255 * expected, atol=0.51)

    def test_transparent_png(self):
        """Over any background it is the picture before that, also of light."""
        for options in ([], ["--linear-light"]):
            exr = self.picture(*CAMERA, *SMALL, "--unlit", *options)
            self.render("ball.ply", *CAMERA, *SMALL, "--unlit", *options, "--transparent", "-o", "out.png")
            png = self.read_png("out.png") / 255
            self.assertEqual(png.shape, (48, 64, 4))
            np.testing.assert_allclose(png[..., 3], exr[..., 3], atol=0.002)
            colors = png[..., :3]
            if options:
                colors = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
            np.testing.assert_allclose(colors * png[..., 3:], exr[..., :3], atol=0.01)
            self.assertEqual(len(np.unique(png[0, 0])), 1)  # nothing
        for words, says in ((["-o", "out.exr"], "--transparent needs an OUT.png"),
                            (["-o", "out.png", "--background", "white"], "--transparent and --background")):
            self.refuse("render", "ball.ply", "--transparent", *words, says=says)

    def test_jpeg(self):
        """As the .png file, but for losses."""
        self.render("ball.ply", *CAMERA, *SMALL, "-o", "out.png")
        for name in ("out.jpg", "out.JPEG"):
            self.render("ball.ply", *CAMERA, *SMALL, "-o", name)
            jpeg = self.read_png(name, vtkJPEGReader())
            self.assertLess(np.abs(jpeg.astype(float) - self.read_png("out.png")).mean(), 5)
        self.refuse("render", "ball.ply", "--transparent", "-o", "out.jpg", says="needs an OUT.png")

    def test_linear_light(self):
        words = (*CAMERA, *SMALL, "--unlit", "--background", 0.5, 0.2, 0)
        codes, light = self.picture(*words), self.picture(*words, "--linear-light")
        # sRGB of what is of one colour: in the quarters of the ball, away from its edge, and the background.
        for row, column in ((17, 38), (31, 38), (17, 26), (31, 26), (1, 1)):
            code = codes[row, column, :3]
            np.testing.assert_allclose(
                light[row, column, :3],
                np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4), atol=0.01)
        # Shown again they are the same, and only edges differ.
        self.render("ball.ply", *words, "-o", "codes.png")
        self.render("ball.ply", *words, "--linear-light", "-o", "light.png")
        difference = np.abs(self.read_png("codes.png").astype(int) - self.read_png("light.png"))
        self.assertLessEqual(np.median(difference), 1)
        self.assertGreater(difference.max(), 20)

    def test_photographs_are_not_lit_again(self):
        points, labels = sphere(6000)  # of four colours, which surfels mix at the borders
        random = np.random.default_rng(3)
        write_ply("photograph.ply", points, labels + random.integers(0, 9, (6000, 3)))
        write_ply("grey.ply", points, np.repeat(random.integers(60, 200, (6000, 1)), 3, axis=1))
        for cloud, same, other in (("photograph.ply", "--unlit", "--lit"),
                                   ("grey.ply", "--unlit", "--lit"),
                                   ("ball.ply", "--lit", "--unlit")):
            default = self.picture(*CAMERA, *SMALL, cloud=cloud)
            np.testing.assert_array_equal(default, self.picture(*CAMERA, *SMALL, same, cloud=cloud))
            changed = self.picture(*CAMERA, *SMALL, other, cloud=cloud)
            self.assertGreater(np.abs(default - changed).max(), 0.1)
        # A colour map is no photograph.
        scalars = [*CAMERA, *SMALL, "--scalars", "z"]
        np.testing.assert_array_equal(self.picture(*scalars, cloud="photograph.ply"),
                                      self.picture(*scalars, "--lit", cloud="photograph.ply"))
        said = self.tool("render", "ball.ply", "--lit", "--unlit", "-o", "out.exr")
        self.assertIn("not allowed with", said)

    def test_lens_options(self):
        sharp = self.picture(*CAMERA, *SMALL)
        lens = ["--focal-disk", "1.8", "--focal-distance", "9"]
        blurred = self.picture(*CAMERA, *SMALL, *lens)
        self.assertGreater(np.abs(blurred - sharp).max(), 0.2)
        # The same lens by its blur at infinity: f R / z_f px.
        blur = 24 / math.tan(math.radians(15)) * 0.9 / 9
        by_blur = self.picture(*CAMERA, *SMALL, "--focal-distance", "9", "--circle-of-confusion",
                               str(blur))
        np.testing.assert_allclose(by_blur, blurred, atol=1e-3)
        with open("camera.json", "w") as file:
            json.dump({"position": [0, 0, 6], "focalPoint": [0, 0, 0], "viewUp": [0, 1, 0],
                       "viewAngle": 30, "size": [64, 48], "focalDisk": 1.8, "focalDistance": 9},
                      file)
        np.testing.assert_array_equal(self.picture("--camera", "camera.json"), blurred)
        np.testing.assert_array_equal(self.picture("--camera", "camera.json", "--blur", "0"), sharp)

    def test_camera_over_ground_leaves_the_sky_empty(self):
        # Surfels beside the lens have no affine footprint; once they covered the whole screen.
        x, y = (c.ravel() for c in np.meshgrid(*2 * [np.linspace(-5, 5, 120)]))
        ground = np.column_stack([x, y, 0 * x])
        write_ply("ground.ply", ground, normals=np.tile([0.0, 0.0, 1.0], (len(x), 1)))
        alpha = self.picture("--position", "0", "-3", "0.5", "--focal-point", "0", "3", "0.5",
                             "--view-up", "0", "0", "1", "--view-angle", "60", *SMALL,
                             cloud="ground.ply")[..., 3]
        self.assertLess(alpha[:16].max(), 0.01)
        self.assertGreater(alpha[-16:].min(), 0.9)

    def test_inputs_are_not_written_over(self):
        before = content_of("ball.ply")
        self.refuse("render", "ball.ply", "-o", "out.exr", "--stats", "./ball.ply",
                    says="also an input")
        self.assertEqual(content_of("ball.ply"), before)

    def test_single_point_fills_its_picture(self):
        for place in ("1 2 3", "500000.1 5400000.2 300.3"):
            write("one.xyz", place + "\n")
            self.render("one.xyz", *SMALL, "-o", "one.exr")
            alpha = self.read_rgba("one.exr")[..., 3]
            self.assertGreater(alpha[24, 32], 0.4)  # the peak of one kernel
            self.assertLess(alpha[[0, 0, -1, -1], [0, -1, 0, -1]].max(), 0.05)

    def test_links_and_devices_stay_what_they_are(self):
        for extension in (".png", ".exr"):
            os.symlink("real" + extension, "link" + extension)
            self.render("ball.ply", *SMALL, "-o", "link" + extension)
            self.assertTrue(os.path.islink("link" + extension))
            self.assertGreater(os.path.getsize("real" + extension), 0)
        result = self.run_tool("render", "ball.ply", *SMALL, "-o", "out.png", "--stats", "/dev/stdout")
        self.assertEqual(result.returncode, 0)
        self.assertEqual(json.loads(result.stdout)["points"], 6000)

    def test_pipe(self):
        os.mkfifo("pipe.exr")
        with subprocess.Popen(["cat", "pipe.exr"], stdout=subprocess.PIPE) as reader:
            self.render("ball.ply", *SMALL, "-o", "pipe.exr")
            content = reader.stdout.read()
        self.assertTrue(stat.S_ISFIFO(os.stat("pipe.exr").st_mode))
        self.render("ball.ply", *SMALL, "-o", "out.exr")
        self.assertEqual(content_of("out.exr"), content)

    def test_kernel_reaches_the_splatter(self):
        blur = (*CAMERA, *SMALL, "--circle-of-confusion", "8")
        pictures = [self.picture(*blur, *kernel) for kernel in
                    ((), ("--kernel", "pearson"), ("--kernel", "gaussian"))]
        np.testing.assert_array_equal(pictures[0], pictures[1])
        self.assertGreater(np.abs(pictures[0] - pictures[2]).max(), 0.01)

    def test_threads_do_not_change_the_picture(self):
        lens = ["--focal-disk", "0.3", "--focal-distance", "4"]
        one = self.picture(*CAMERA, *SMALL, *lens, "--threads", "1")
        np.testing.assert_array_equal(
            self.picture(*CAMERA, *SMALL, *lens, "--threads", "2"), one)
        # More than there are cores: as many as there are.
        np.testing.assert_array_equal(
            self.picture(*CAMERA, *SMALL, *lens, "--threads", "999"), one)

    def test_surfels_are_drawn_as_they_are(self):
        first = self.picture(*CAMERA, *SMALL, "--surfels", "surfels.vtp")
        again = self.picture(*CAMERA, *SMALL, "--surfels", "again.vtp", cloud="surfels.vtp")
        np.testing.assert_array_equal(again, first)
        before, after = (self.read_vtp(name) for name in ("surfels.vtp", "again.vtp"))
        self.assertEqual(before.GetNumberOfPoints(), 6000)
        old, new = arrays_of(before), arrays_of(after)
        self.assertLessEqual({"SurfelCovariance", "SurfelAreaVector", "RGB"}, set(old))
        self.assertEqual(list(old), list(new))
        for name, values in old.items():
            np.testing.assert_array_equal(new[name], values, err_msg=name)

    def test_statistics(self):
        self.render("ball.ply", *CAMERA, *SMALL, "-o", "out.png", "--stats", "stats.json",
                    "--threads", "2")
        stats = read_json("stats.json")
        self.assertEqual(stats["points"], 6000)
        self.assertEqual(stats["surfels"], 6000)
        self.assertEqual(stats["invalid"], {"points": 0, "surfels": 0})
        self.assertEqual(stats["threads"], 2)
        self.assertTrue(300 < stats["splats"] <= 6000)
        self.assertGreater(stats["fragments"], stats["splats"])
        self.assertTrue(20 < stats["peak_memory_mib"] < 20000)
        times = stats["milliseconds"]
        once = {"read", "surfels", "write"}
        for stage in once:
            self.assertGreater(times[stage], 0)
        frame_stages = set(times) - once - {"frame"}
        self.assertGreaterEqual(len(frame_stages), 3)
        self.assertLess(sum(times[stage] for stage in frame_stages), 2 * times["frame"])

    def test_cleaning(self):
        points, colors = sphere(20000)
        stray = np.random.default_rng(1).uniform(-2, 2, (200, 3))
        write_ply("ball.ply", points, colors)
        write_ply("dusty.ply", np.concatenate([points, stray]), np.resize(colors, (20200, 3)))
        noise = np.random.default_rng(2).normal(size=points.shape) * 0.025  # one spacing
        write_ply("noisy.ply", points + noise, colors)

        def run(cloud, *options):
            self.render(cloud, *CAMERA, *SMALL, *options, "-o", "out.exr", "--stats", "stats.json")
            return self.read_rgba("out.exr"), read_json("stats.json")

        clean, stats = run("ball.ply")
        self.assertEqual(set(stats["cleaned"].values()), {0})
        np.testing.assert_array_equal(clean, run("ball.ply", "--cleaning", "off")[0])
        dusty, stats = run("dusty.ply")
        self.assertGreater(stats["cleaned"]["stray"], 180)
        self.assertEqual(stats["cleaned"]["moved"], 0)
        error = np.abs(dusty - clean).mean()
        self.assertLess(4 * error, np.abs(run("dusty.ply", "--cleaning", "off")[0] - clean).mean())
        smooth, stats = run("noisy.ply")
        self.assertGreater(stats["cleaned"]["moved"], 19000)
        rough, stats = run("noisy.ply", "--cleaning", "outliers")
        self.assertEqual(stats["cleaned"]["moved"], 0)
        self.assertLess(2 * np.abs(smooth - clean).mean(), np.abs(rough - clean).mean())

    def test_invalid_points_are_counted(self):
        points, colors = sphere(1000)
        points[::100] = np.nan
        write_ply("holes.ply", points, colors)
        self.render("holes.ply", *SMALL, "-o", "out.png", "--stats", "stats.json")
        stats = read_json("stats.json")
        self.assertEqual(stats["invalid"]["points"], 10)
        self.assertEqual((stats["points"], stats["surfels"]), (1000, 990))

    def test_verbose_speaks_on_stderr_only(self):
        said = self.tool("render", "ball.ply", *SMALL, "-o", "out.png", "-v")
        self.assertEqual((self.code, self.printed), (0, ""))
        self.assertIn("6000 points", said)
        self.assertIn("out.png", said)

    def test_camera_that_looks_away_is_told(self):
        said = self.tool("render", "ball.ply", *SMALL, "--position", "0", "0", "9",
                         "--focal-point", "0", "0", "99", "-o", "out.png")
        self.assertEqual(self.code, 0)
        self.assertRegex(said,
                         r"\Asurfelsplat: warning: the camera sees nothing[^\n]+\n\Z")
        self.assertTrue(os.path.exists("out.png"))

    def test_nothing_but_the_outputs_is_left(self):
        self.render("ball.ply", *SMALL, "-o", "out.exr", "--surfels", "s.vtp", "--stats", "s.json")
        self.render("ball.ply", *SMALL, "-o", "out.png")
        self.assertEqual(sorted(os.listdir(".")),
                         ["ball.ply", "out.exr", "out.png", "s.json", "s.vtp"])


if __name__ == "__main__":
    unittest.main()

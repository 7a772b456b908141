# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat info: what is in a point cloud, as text and as JSON."""

import subprocess
import unittest
from unittest import mock

import numpy as np

from surfelsplatting.commandline import info
from TestFormats import pcd_columns
from TestReader import write_pcd
from toolcase import SMALL, TOOL, ToolCase, read_json, sphere, write, write_ply

UTM = np.array([691000.125, 5334000.5, 512.75])


class TestInfo(ToolCase):
    def test_cloud(self):
        points, colors = sphere()
        points = np.concatenate([points, [[9, 9, 9], points[0], [np.nan] * 3]])
        colors = np.concatenate([colors, colors[:3]])
        write_ply("ball.ply", points + UTM, colors, kind="double")
        report = self.report("ball.ply")
        self.assertEqual((report["points"], report["holds"]), (3003, "points"))
        found = report["points_found"]
        self.assertEqual((found["stray"], found["duplicate"], found["not_finite"]), (1, 1, 1))
        self.assertEqual(found["noisy"], 0)
        self.assertEqual(report["bounds"]["x"][1], 9 + UTM[0])
        self.assertAlmostEqual(report["bounds_without_stray"]["x"][1], 1 + UTM[0], delta=0.05)
        # Each of the points has its part of the sphere.
        self.assertAlmostEqual(report["spacing"], np.sqrt(4 * np.pi / 3000), delta=0.005)
        self.assertEqual([field["meaning"] for field in report["fields"]], ["colours"])
        text = self.info("ball.ply")
        self.assertIn("3003 points", text)
        self.assertIn("1 stray point, 1 duplicate (at the place of another point), 1 point without finite "
                      "coordinates", text)
        self.assertRegex(text, r"bounds .* y 5333999.50\d* to 5334009.5, z .*\n +x .* z .*, without stray points\n")

    def test_normals(self):
        """It says which of them are none, or not of length 1, as some programs write them."""
        points, _ = sphere()
        for scale, known, length, says in (
                (1, 1, 1, r"3 values a point\n"), (127, 1, 127, "; 127 long, of which only the direction counts"),
                (0, 0, 0, r"; all points have none \(zero, or no number\)"),
                (np.arange(3000)[:, None] % 4 > 0, 0.75, 1, "; 25 % of the points have none .* from the shape"),
                (np.where(np.arange(3000)[:, None] % 4 > 0, 1, np.nan), 0.75, 1, "; 25 % of the points ")):
            write_ply("ball.ply", points, normals=scale * points)
            [field] = self.report("ball.ply")["fields"]
            self.assertEqual((field["meaning"], field["known"]), ("normals", known))
            self.assertAlmostEqual(field["length"], length, places=4)
            self.assertRegex(self.info("ball.ply"), "Normals: normals, float, 3 values a point" + says.replace(
                "3 values a point", ""))

    def test_normals_of_other_points(self):
        """As where a program has turned the points alone, or sorted them; not where they are a little noisy."""
        points, _ = sphere()
        random = np.random.default_rng(4)
        for normals, wrong in ((points, False), (points + 0.1 * random.normal(size=points.shape), False),
                               (random.permutation(points), True), (points[:, [2, 0, 1]], True)):
            write_ply("ball.ply", points, normals=normals)
            self.assertEqual("the normals are not those of the surface" in self.tool("info", "ball.ply"), wrong)
            self.assertEqual(self.code, 0)

    def test_surfels_with_an_origin(self):
        """Their bounds are those of the world."""
        write_ply("ball.ply", sphere()[0] + UTM, kind="double")
        self.render("ball.ply", *SMALL, "--hierarchy", "ball.surfels", "-o", "out.png")
        bounds = self.report("ball.surfels")["bounds"]
        for i, axis in enumerate("xyz"):
            np.testing.assert_allclose(bounds[axis], [UTM[i] - 1, UTM[i] + 1], rtol=0, atol=0.05)

    def test_noise(self):
        """Of some spacings, along the normals and in all directions; only without it is a scan clean."""
        points, _ = sphere(20000)
        random = np.random.default_rng(5)
        for spacings in (0, 0.3, 1, 4):
            deviation = spacings * np.sqrt(4 * np.pi / 20000)
            for noise in (points * random.normal(size=(20000, 1)), random.normal(size=(20000, 3))):
                write_ply("noisy.ply", points + deviation * noise)
                report = self.report("noisy.ply")
                found = report["points_found"]
                what = "noisy" if spacings < 2 else "thick"
                self.assertGreaterEqual(found[what], 0.98 * 20000 * (spacings > 0), spacings)
                self.assertEqual(found["noisy"] + found["thick"] > 0, spacings > 0)
                if 0 < spacings < 2:
                    self.assertAlmostEqual(found["noise"], deviation, delta=0.2 * deviation)
                options = [suggestion["options"] for suggestion in report["suggestions"]]
                self.assertEqual("--cleaning off" in options, spacings == 0)
        self.assertRegex(self.info("noisy.ply"), r"noise +\d+ points \((99\S+|100) %\) fill space: ")

    def test_bounds_of_noise(self):
        """Those without stray points are no larger than those with them."""
        random = np.random.default_rng(3)
        write_ply("noisy.ply", np.column_stack([random.uniform(-1, 1, (8000, 2)),
                                                0.03 * random.normal(size=8000)]))
        report = self.report("noisy.ply")
        for axis, (low, high) in report["bounds"].items():
            smallest, largest = report["bounds_without_stray"][axis]
            self.assertLessEqual(low, smallest)
            self.assertLessEqual(largest, high)

    def test_two_scans(self):
        """One beside the other, and a scan that is there twice."""
        points, _ = sphere(20000)
        scans = np.concatenate([points, points + [0.02, 0.03, 0.04]])
        write_ply("two.ply", scans)
        found = self.report("two.ply")["points_found"]
        self.assertEqual(found["duplicate"], 0)
        self.assertEqual(found["twin"] + found["joined"], 20000)
        self.assertGreater(found["twin"], 19900)
        text = self.info("two.ply")
        self.assertIn("\nscans    two: the last 20000 points are a second scan", text)
        self.assertRegex(text, r"\nleft out nothing\n")
        write_ply("twice.ply", np.concatenate([points, points]))
        found = self.report("twice.ply")["points_found"]
        self.assertEqual((found["duplicate"], found["twin"], found["joined"]), (20000, 0, 0))
        self.assertIn("20000 duplicates (at the place of another point)", self.info("twice.ply"))

    def test_scalars_and_suggestions(self):
        points, _ = sphere(2000)
        np.savetxt("cloud.csv", np.column_stack([points, np.arange(2000), points[:, 0]]),
                   delimiter=",", header="x,y,z,intensity,age", comments="")
        report = self.report("cloud.csv")
        ranges = {field["name"]: field["range"] for field in report["fields"]}
        self.assertEqual(ranges["intensity"], [0, 1999])
        self.assertIn("columns x, y, z, intensity, age, by their names", report["read_as"])
        options = [suggestion["options"] for suggestion in report["suggestions"]]
        self.assertIn("--scalars intensity", options)
        self.assertIn("--cleaning off", options)
        self.assertIn("--scalars intensity", self.info("cloud.csv"))

    def test_suggestions_for_large_clouds(self):
        write_ply("ball.ply", *sphere(3000))
        with mock.patch.multiple(info, LONG=2999, QUICK=1000):
            report = self.report("ball.ply")
        options = [suggestion["options"] for suggestion in report["suggestions"]]
        self.assertIn("--hierarchy OUT.surfels", options)
        self.assertIn("--every 3", options)

    def test_depth_image(self):
        u, v = np.meshgrid(np.arange(80) - 39.5, np.arange(60) - 29.5)
        z = 2 + 0.2 * np.sin(u / 9)
        points = np.stack([u * z / 70, v * z / 70, z], axis=-1).reshape(-1, 3)
        colors = np.zeros((len(points), 3), np.uint8)
        write_pcd("depth.pcd", pcd_columns(points, colors), "binary", 80, 60)
        report = self.report("depth.pcd")
        self.assertEqual((report["sensor"], report["depth_image"]), ([0, 0, 0], [80, 60]))
        self.assertIn("a depth image of 80 x 60 pixels", self.info("depth.pcd"))
        # What is up is what it is for a picture, not what the wall's shape would say.
        self.assertRegex(self.info("depth.pcd"), r"\nup +0 -1 0\n")
        self.render("depth.pcd", *SMALL, "-o", "out.png", "--save-camera", "view.json",
                    "--hierarchy", "depth.surfels")
        up = read_json("view.json")["viewUp"]
        for cloud in ("depth.pcd", "depth.surfels"):
            np.testing.assert_allclose(self.report(cloud)["up"], up, atol=1e-12)

    def test_mixed_pixels_of_a_depth_image(self):
        """What hangs between a panel and the wall behind it is removed, as for a picture."""
        u, v = np.meshgrid(np.arange(80) - 39.5, np.arange(60) - 29.5)
        z = np.where(np.abs(u) < 12, 1.0, 2.0)
        z[5:55:2, 52] = np.linspace(1.1, 1.9, 25)
        points = np.stack([u * z / 70, v * z / 70, z], axis=-1).reshape(-1, 3)
        write_pcd("depth.pcd", pcd_columns(points, np.zeros((len(points), 3), np.uint8)), "binary", 80, 60)
        self.render("depth.pcd", *SMALL, "-o", "out.png", "--stats", "stats.json")
        cleaned, found = read_json("stats.json")["cleaned"], self.report("depth.pcd")["points_found"]
        self.assertEqual((found["stray"], found["noisy"]), (cleaned["stray"], cleaned["moved"]))

    def test_surfels_and_hierarchy(self):
        write_ply("ball.ply", *sphere(1000))
        self.render("ball.ply", *SMALL, "-o", "out.png", "--surfels", "s.vtp", "--hierarchy",
                    "h.vtp")
        self.assertEqual(self.report("s.vtp")["holds"], "surfels")
        self.assertEqual(self.report("h.vtp")["holds"], "hierarchy")
        self.assertIn("surfels", self.info("h.vtp"))

    def test_open_surface(self):
        points, colors = sphere()
        points, colors = points[points[:, 2] > 0], colors[points[:, 2] > 0]
        write_ply("half.ply", points, colors, normals=points)
        tried = [suggestion["options"] for suggestion in self.report("half.ply")["suggestions"]]
        self.assertIn("--sides two", tried)
        behind = ("--position", "0", "0", "-4", "--focal-point", "0", "0", "0")
        for options, ends in ((behind, "so that both sides are drawn"),
                              ((*behind, "--sides", "given"), "and is not drawn; --sides auto shows it"),
                              ((*behind, "--sides", "two"), None), (("--view", "top"), None)):
            said = self.tool("render", "half.ply", *SMALL, *options, "-o", "out.png")
            self.assertEqual("turns its back to the camera" in said, ends is not None, options)
            self.assertIn(ends or "", said)
        self.render("half.ply", *SMALL, "-o", "out.png", "--hierarchy", "half.surfels")
        self.assertNotIn("--sides", self.info("half.surfels"))
        for options in ((), ("--sides", "given")):  # which has no effect on surfels
            said = self.tool("render", "half.surfels", *SMALL, *behind, *options, "-o", "out.png")
            self.assertIn("so that both sides are drawn", said)
            self.assertEqual("--sides has no effect" in said, bool(options))
            self.assertGreater(self.covered("out.png"), 0.1)

    def test_open_things_on_a_ground_that_shows_both_sides(self):
        x, y = np.meshgrid(np.linspace(0, 8, 90), np.linspace(0, 8, 90))
        ground = np.column_stack([x.ravel(), y.ravel(), 0.3 * np.sin(x.ravel())])
        bowl = 0.7 * sphere(1500)[0] + (4, 4, 3)
        write_ply("bowl.ply", np.vstack([ground, bowl[bowl[:, 2] < 3.45]]))
        report = self.report("bowl.ply")
        self.assertGreater(report["two_sided"], 0.8)
        self.assertNotIn("--sides two", [each["options"] for each in report["suggestions"]])

    def test_inside_a_closed_surface(self):
        """One would see the backs of all of it, so both sides are drawn; from outside half of it is
        hidden."""
        write_ply("ball.ply", *sphere(20000))
        for position, shows_backs in ((("0", "0", "0.5"), True), (("0", "0", "1.2"), False),
                                      (("3", "0", "4"), False)):
            look = (*SMALL, "--position", *position, "--focal-point", "0", "0", "-1", "-o")
            said = self.tool("render", "ball.ply", *look, "out.png")
            self.assertEqual("turns its back to the camera" in said, shows_backs, position)
            if shows_backs:
                self.assertGreater(self.covered("out.png"), 0.99)

    def test_broken_pipe(self):
        points, colors = sphere(500)
        write_ply("ball.ply", points, colors)
        result = subprocess.run(f"{TOOL} info ball.ply | true", shell=True, capture_output=True,
                                text=True, check=False)
        self.assertEqual(result.stderr, "")

    def test_no_cloud(self):
        for name, content in (("empty.xyz", ""), ("nan.xyz", "nan nan nan\n" * 30)):
            write(name, content)
            self.refuse("info", name, says=name)


if __name__ == "__main__":
    unittest.main()

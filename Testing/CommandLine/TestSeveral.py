# SPDX-License-Identifier: BSD-3-Clause
"""Several files are one cloud, and a picture without a name gets one."""

import json
import os
import unittest
from unittest import mock

import numpy as np

from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.formats.several import read_clouds
from surfelsplatting.vtkarrays import named_array
from TestReader import write_pcd
from stationclouds import Scene
from toolcase import (CAMERA, SMALL, ToolCase, arrays_of, content_of, places_of, sphere, write,
                      write_data, write_ply)


def columns_of(points, **more):
    return [(axis, points[:, i], "f4") for i, axis in enumerate("xyz")] + [
        (name, values, "f4") for name, values in more.items()]


def joined(names):
    """-> vtkPolyData"""
    progress = mock.Mock()
    progress.update = lambda algorithm, _label: algorithm.Update()
    return read_clouds(names, mock.Mock(), progress).data


class TestSeveral(ToolCase):
    def picture(self, *clouds):
        self.render(*clouds, *CAMERA, *SMALL, "-o", "out.exr")
        return self.read_rgba("out.exr")

    def test_tiles_are_one_cloud(self):
        points, colors = sphere()
        points = points.astype(np.float32).astype(np.float64)
        write_ply("whole.ply", points, colors)
        write_ply("low.ply", points[:1400], colors[:1400])
        np.savetxt("high.xyz", np.column_stack([points[1400:], colors[1400:]]), fmt="%.17g")
        whole = self.picture("whole.ply")
        self.assertGreater(whole[24, 32, 3], 0.9)
        np.testing.assert_array_equal(self.picture("low.ply", "high.xyz"), whole)
        self.assertGreater(np.abs(self.picture("high.xyz") - whole).max(), 0.5)

    def test_a_survey_keeps_its_digits(self):
        """Of places in a country, where floats are half a metre apart."""
        points, _ = sphere()
        points += (500_000, 5_400_000.125, 300)
        for name, part in (("a.xyz", points[:1000]), ("b.xyz", points[1000:])):
            np.savetxt(name, part, fmt="%.6f")
        bounds = self.report("a.xyz", "b.xyz")["bounds"]
        np.testing.assert_allclose(bounds["y"], (5_399_999.125, 5_400_001.125), atol=2e-3)

    def test_tiles_in_degrees(self):
        """They lie beside one another, each of which becomes metres from its own middle."""
        corners = {"a": [(13.0, 52.0), (13.01, 52.01)], "b": [(13.01, 52.01), (13.02, 52.02)]}
        for name, places in corners.items():
            write(f"{name}.csv", "lon,lat,alt\n" + "".join(f"{x},{y},7\n" for x, y in places))
        tiles = places_of(read_clouds(["a.csv", "b.csv"], mock.Mock(), mock.Mock()).data)
        np.testing.assert_allclose(tiles[1], tiles[2], atol=1e-6)
        np.testing.assert_allclose(tiles[3] - tiles[2], tiles[1] - tiles[0], atol=1e-6)
        np.testing.assert_allclose(tiles[1] - tiles[0], (686.9, 1112.7, 0), rtol=1e-3)
        write("metres.csv", "x,y,z\n0,0,0\n1,2,3\n")
        self.refuse("render", "a.csv", "metres.csv", "-o", "out.png",
                    says="a.csv is in degrees, but metres.csv is not")

    def test_files_that_do_not_fit_together_are_named(self):
        """Metres beside millimetres, or a survey beside a scan in coordinates of its own."""
        points, _ = sphere(300)
        for name, places in (("a", points), ("beside", points + (15, 0, 0)), ("row", points + (30, 0, 0)),
                             ("mm", points * 1000), ("utm", points + (500_000, 5_400_000, 300))):
            np.savetxt(f"{name}.xyz", places, fmt="%.6f")

        def read_as(*names):
            return self.report(*(f"{name}.xyz" for name in names))["read_as"]

        self.assertEqual(read_as("a", "row", "beside"), "3 files as one cloud")
        self.assertEqual(read_as("a", "mm"),
                         "mm.xyz is 1000 times as large as a.xyz, as if their units differed: convert one of them")
        self.assertEqual(read_as("a", "beside", "utm"),
                         "utm.xyz is far away from a.xyz, as if their coordinates differed: draw it apart, or "
                         "convert it")
        said = self.tool("render", "a.xyz", "utm.xyz", *CAMERA, *SMALL, "-o", "out.png")
        self.assertIn("a.xyz and 1 more: utm.xyz is far away from a.xyz", said)

    def test_files_behind_options(self):
        points, _ = sphere()
        for name, part in (("a", points[:1500]), ("b", points[1500:])):
            np.savetxt(name + ".xyz", part)
        self.render("a.xyz", "b.xyz", *CAMERA, *SMALL, "-o", "together.png")
        self.render("a.xyz", *CAMERA, *SMALL, "b.xyz", "-o", "apart.png")
        self.assertEqual(content_of("together.png"), content_of("apart.png"))
        self.refuse("render", "a.xyz", *SMALL, "missing.xyz", says="unrecognized arguments: missing.xyz")
        self.refuse("render", "a.xyz", *SMALL, "-o", "together.png", "together.png", says="together.png is ")

    def test_what_not_all_have_is_left_out_and_said(self):
        points, colors = sphere()
        height = points[:, 2]
        write_pcd("a.pcd", columns_of(points[:1400], height=height[:1400], noise=height[:1400]),
                  "binary")
        write_pcd("b.pcd", columns_of(points[1400:], height=height[1400:]), "binary")
        self.tool("info", "a.pcd", "b.pcd", "--json")
        report = json.loads(self.printed)
        self.assertEqual([field["name"] for field in report["fields"]], ["height"])
        self.assertEqual(report["points"], 3000)
        self.assertEqual(report["bytes"], os.path.getsize("a.pcd") + os.path.getsize("b.pcd"))
        self.assertEqual(report["file"], "a.pcd and 1 more")
        said = self.tool("render", "a.pcd", "b.pcd", *CAMERA, *SMALL, "-o", "out.png")
        self.assertIn("a.pcd and 1 more: left out", said)
        self.assertIn("noise", said)
        self.assertNotIn("height", said)

    def test_scans_without_colours_are_grey(self):
        points, colors = sphere()
        write_ply("a.ply", points[:1400], colors[:1400])
        write_ply("b.ply", points[1400:])
        for names in (("a.ply", "b.ply"), ("b.ply", "a.ply")):
            cloud = joined(names)
            self.assertEqual(cloud.GetPointData().GetScalars().GetName(), "RGB")
            found = arrays_of(cloud)["RGB"][np.argsort(-places_of(cloud)[:, 2])]
            np.testing.assert_array_equal(found[:1400], colors[:1400])
            self.assertTrue((found[1400:] == 204).all())

    def test_each_scan_has_its_sensor(self):
        """A corridor, scanned from both ends, faces them."""
        scene = Scene().box((0, 0, 0), (12, 3, 2.5))
        places = (2.0, 1.5, 1.5), (10.0, 1.5, 1.5)
        for name, place in zip(("a.pcd", "b.pcd"), places):
            write_pcd(name, columns_of(scene.scan(place, step=2)[0]), "binary",
                      viewpoint="{} {} {} 1 0 0 0".format(*place))
        report = self.report("a.pcd", "b.pcd")
        np.testing.assert_allclose(report["scanners"]["places"], places, atol=1e-3)
        self.assertGreater(report["scanners"]["known"], 0.99)

    def test_scanners_are_places(self):
        """An array of one number that has the name of the ways to the scanners tells none."""
        points, _ = sphere(100)
        write_pcd("a.pcd", columns_of(points, ToScanner=points[:, 0]), "binary")
        write_pcd("b.pcd", columns_of(points), "binary", viewpoint="9 0 0 1 0 0 0")
        ways = arrays_of(joined(["a.pcd", "b.pcd"]))["ToScanner"]
        np.testing.assert_array_equal(ways[:100], 0)
        np.testing.assert_allclose(ways[100:] + points, np.broadcast_to((9, 0, 0), (100, 3)), atol=1e-5)

    def test_fields_of_another_shape_tell_nothing(self):
        """What is up, and the middle of degrees, in files that others have written."""
        points = polydata_of(sphere(100)[0], {})
        for name in ("ScanUp", "ModelUp", "DegreesMiddle"):
            for shape in ((0, 3), (1, 1), (3, 2)):
                points.GetFieldData().Initialize()
                points.GetFieldData().AddArray(named_array(name, np.ones(shape)))
                write_data("a.vtp", points)
                found = joined(["a.vtp", "a.vtp"])
                np.testing.assert_array_equal(places_of(found)[100:], places_of(points))
                self.assertFalse(found.GetFieldData().HasArray("DegreesMiddle"))

    def test_only_points_are_joined(self):
        points, colors = sphere(300)
        write_ply("a.ply", points, colors)
        self.render("a.ply", *CAMERA, *SMALL, "--hierarchy", "a.surfels", "-o", "a.png")
        self.refuse("render", "a.ply", "a.surfels", "-o", "out.png", says="a.surfels holds surfels")
        self.refuse("render", "a.ply", "b.ply", "-o", "out.png", says="b.ply does not exist")
        self.refuse("render", "a.ply", "a.png", "-o", "a.png", says="a.png is a picture")

    def test_picture_without_a_name(self):
        """It replaces no scan.png that may be a photograph, only what an earlier run has written."""
        points, colors = sphere(300)
        os.mkdir("scans")
        write_ply("scans/ball.ply", points, colors)
        write("ball.png", "a photograph")
        for _ in range(2):
            self.assertEqual(self.tool("render", "scans/ball.ply", *CAMERA, *SMALL),
                             "surfelsplat: ball.ply.png written\n")
        self.render("scans/ball.ply", *CAMERA, *SMALL, "-o", "named.png")
        self.assertEqual(sorted(os.listdir(".")), ["ball.ply.png", "ball.png", "named.png", "scans"])
        self.assertEqual(content_of("ball.ply.png"), content_of("named.png"))
        self.tool("render", "scans/ball.ply", *CAMERA, *SMALL, "--channels", "coc")
        self.assertIn("CoC", self.read_exr("ball.ply.exr"))

    def test_forgotten_option_of_the_output(self):
        points, colors = sphere(300)
        write_ply("a.ply", points, colors)
        self.refuse("render", "a.ply", "out.png", says="-o out.png")


if __name__ == "__main__":
    unittest.main()

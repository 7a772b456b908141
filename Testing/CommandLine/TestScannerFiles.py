# SPDX-License-Identifier: BSD-3-Clause
""".las, .laz and .e57 files, which need packages from PyPI."""

import re
import subprocess
import sys
import unittest

import numpy as np

from surfelsplatting.problems import UserProblem, find_own_packages

find_own_packages()
try:
    import laspy
    from laspy.vlrs.known import GeoKeyDirectoryVlr, WktCoordinateSystemVlr
    import pye57
except ImportError as problem:
    print("SKIPPED: the packages laspy and pye57 are needed:", problem)
    sys.exit(77)
from surfelsplatting.formats.e57 import read_e57_cloud
from surfelsplatting.formats.las import read_las_cloud
from toolcase import SMALL, ToolCase, arrays_of, content_of, sphere, write

FAR = np.array([500_000.0, 5_400_000.0, 300.0])  # UTM


def places_of(cloud):
    return np.array([cloud.GetPoint(i) for i in range(cloud.GetNumberOfPoints())])


class TestLas(ToolCase):
    def write(self, path, points, rgb=None, intensity=None):
        header = laspy.LasHeader(point_format=2 if rgb is not None else 0)
        header.offsets, header.scales = FAR, [0.001] * 3
        las = laspy.LasData(header)
        las.x, las.y, las.z = points.T
        if rgb is not None:
            las.red, las.green, las.blue = rgb.T
        if intensity is not None:
            las.intensity = intensity
        las.write(path)

    def test_places_colors_and_intensity(self):
        points, colors = sphere(200, 5)
        points += FAR
        for path in ("scan.las", "scan.laz"):
            for scale in (1, 257):  # of 8 bits, against the standard, and of 16
                self.write(path, points, colors.astype(np.uint16) * scale, np.arange(200))
                cloud = read_las_cloud(path)
                np.testing.assert_allclose(places_of(cloud), points, atol=0.00051)
                arrays = arrays_of(cloud)
                np.testing.assert_array_equal(arrays["RGB"], colors)
                np.testing.assert_array_equal(arrays["intensity"], np.arange(200))

    def test_z_is_up(self):
        """By the LAS specification, also of a tree that was moved to the origin."""
        header = laspy.LasHeader(point_format=0)
        header.scales = [0.001] * 3
        las = laspy.LasData(header)
        las.x, las.y, las.z = (sphere(2000)[0] * (1, 1, 1.5)).T
        las.write("local.las")
        text = self.info("local.las")
        self.assertRegex(text, r"up +0 0 1\n")

    def test_degrees(self):
        """Longitudes and latitudes become metres, if the header says that they are: as a GeoTIFF key, or as
        text. Projected places stay, whose text has the ellipsoid's name, too."""
        keys = GeoKeyDirectoryVlr()
        keys.parse_record_data(np.array([1, 1, 0, 1, 1024, 0, 1, 2], np.uint16).tobytes())
        metres = (68_680, 111_267)  # of a degree, at 52 degrees north
        for system, scale in ((keys, metres), (WktCoordinateSystemVlr('GEOGCS["WGS 84"]'), metres),
                              (WktCoordinateSystemVlr('PROJCS["x",GEOGCS["WGS 84"]]'), (1, 1))):
            header = laspy.LasHeader(point_format=0)
            header.offsets, header.scales = (13, 52, 0), (1e-7, 1e-7, 0.001)
            header.vlrs.append(system)
            las = laspy.LasData(header)
            las.x, las.y, las.z = np.array([(13, 52, 0), (13.001, 52.001, 50), (13.002, 52, 1)]).T
            las.write("degrees.las")
            size = np.ptp(places_of(read_las_cloud("degrees.las")), axis=0)
            np.testing.assert_allclose(size, (0.002 * scale[0], 0.001 * scale[1], 50), rtol=1e-3)
        self.assertNotIn("degrees as metres", self.info("degrees.las"))

    def test_scalars(self):
        points, _ = sphere(200)
        header = laspy.LasHeader(point_format=3)
        header.offsets, header.scales = FAR, [0.001] * 3
        header.add_extra_dim(laspy.ExtraBytesParams("quality", np.float32))
        las = laspy.LasData(header)
        las.x, las.y, las.z = (points + FAR).T
        las.classification, las.gps_time = np.arange(200) % 7, 3e8 + np.arange(200) / 1e4
        las.quality = np.arange(200) / 3
        las.write("scan.las")
        arrays = arrays_of(read_las_cloud("scan.las"))
        self.assertEqual(set(arrays), {"classification", "gps_time", "quality"})
        np.testing.assert_array_equal(arrays["classification"], np.arange(200) % 7)
        np.testing.assert_array_equal(arrays["gps_time"], 3e8 + np.arange(200) / 1e4)

    def test_colors_that_nobody_has_set(self):
        points, _ = sphere(200)
        self.write("scan.las", points + FAR, np.zeros((200, 3), np.uint16))
        self.assertEqual(arrays_of(read_las_cloud("scan.las")), {})

    def test_picture(self):
        points, colors = sphere()
        self.write("scan.laz", points + FAR, colors.astype(np.uint16) * 257)
        self.render("scan.laz", *SMALL, "-o", "out.exr")
        self.assertGreater(self.read_rgba("out.exr")[24, 32, 3], 0.9)

    def test_damaged(self):
        self.write("scan.las", sphere(200)[0] + FAR)
        content = content_of("scan.las")
        for path, part in (("cut.las", content[:100]), ("half.laz", content[:1500])):
            write(path, part)
            with self.assertRaisesRegex(UserProblem, f"{path} is not a readable"):
                read_las_cloud(path)
        with laspy.open("scan.las") as file:
            begin, size = file.header.offset_to_point_data, file.header.point_format.size
        for end in (begin + 50 * size, begin + 51 * size - 1):  # between two points, and within one
            write("cut.las", content[:end])
            with self.assertRaisesRegex(UserProblem, "says 200 points, and it holds 50; was all of it copied?"):
                read_las_cloud("cut.las")


class TestE57(ToolCase):
    def write(self, *scans, pose=None, poses=()):
        with pye57.E57("scan.e57", mode="w") as file:
            for (points, colors), pose in zip(scans, poses or len(scans) * [pose]):
                data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T))
                if colors is not None:
                    data.update(zip(("colorRed", "colorGreen", "colorBlue"), colors.T))
                rotation = np.array([1.0, 0, 0, 0])
                file.write_scan_raw(data, rotation=rotation, translation=pose)

    def test_one_scan_has_a_viewpoint(self):
        points, colors = sphere(200)
        self.write((points, colors), pose=FAR)
        cloud, viewpoint = read_e57_cloud("scan.e57")
        self.assertEqual(viewpoint, tuple(FAR))
        np.testing.assert_allclose(places_of(cloud), points + FAR, atol=1e-6)
        np.testing.assert_array_equal(arrays_of(cloud)["RGB"], colors)

    def test_scans_are_one_cloud(self):
        points, colors = sphere(200)
        self.write((points, colors), (points + 3, colors), pose=FAR)
        cloud, viewpoint = read_e57_cloud("scan.e57")
        self.assertIsNone(viewpoint)
        np.testing.assert_allclose(places_of(cloud)[200:], points + 3 + FAR, atol=1e-6)
        np.testing.assert_array_equal(arrays_of(cloud)["RGB"], np.tile(colors, (2, 1)))
        self.write((points, colors), (points + 3, None), pose=FAR)
        self.assertEqual(set(arrays_of(read_e57_cloud("scan.e57")[0])), {"ToScanner"})

    def test_scans_know_their_scanners(self):
        """But not if several are at the origin: their points were put into their places."""
        points, _ = sphere(200)
        for shift in (0, 5):
            self.write((points, None), (points, None), poses=(FAR, FAR + [shift, 0, 0]))
            cloud, _ = read_e57_cloud("scan.e57")
            np.testing.assert_allclose(arrays_of(cloud)["ToScanner"], -np.tile(points, (2, 1)),
                                       atol=1e-6)
        self.assertEqual(cloud.GetPointData().GetVectors().GetName(), "ToScanner")
        text = self.info("scan.e57")
        self.assertRegex(text, r"scanners +2, which tell the sides\n +at 500000 5400000 300\n"
                               r" +at 500005 5400000 300\n")
        self.assertRegex(text, r"up +0 0 1\n")
        self.write((points, None), (points + 3, None), poses=(np.zeros(3),) * 2)
        self.assertEqual(arrays_of(read_e57_cloud("scan.e57")[0]), {})

    def test_picture(self):
        points, colors = sphere()
        self.write((points, colors), pose=FAR + [0, 0, 9])
        self.render("scan.e57", *SMALL, "-o", "out.exr")
        self.assertGreater(self.read_rgba("out.exr")[24, 32, 3], 0.9)

    def test_damaged(self):
        write("scan.e57", b"ASTM-E57" + bytes(500))
        with self.assertRaisesRegex(UserProblem, "scan.e57 is not a readable"):
            read_e57_cloud("scan.e57")
        self.write((sphere(200)[0], None))
        write("cut.e57", content_of("scan.e57")[:-1000])
        self.refuse("info", "cut.e57", says="same as actual (ErrorBadFileLength); was all of it copied?")


class TestWithoutPackages(ToolCase):
    def test_says_what_to_install(self):
        for missing, extension, requirement, begin in (
                (["laspy"], "las", "laspy[lazrs]", b"LASF"),
                (["lazrs", "laszip"], "laz", "laspy[lazrs]", b"LASF" + bytes(100) + b"\x82"),
                (["pye57"], "e57", "pye57", b"ASTM-E57")):
            write(f"scan.{extension}", begin)
            code = (f"import sys; sys.modules.update(dict.fromkeys({missing})); sys.argv = "
                    f"['surfelsplat', 'render', 'scan.{extension}', '-o', 'out.png']\n"
                    "from surfelsplatting.commandline import main; sys.exit(main())")
            result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                                    check=False)
            self.assertEqual(result.returncode, 2)
            self.assertRegex(result.stderr, rf"pip install .*'{re.escape(requirement)}'")
            self.assertIn("pdal translate", result.stderr)


if __name__ == "__main__":
    unittest.main()

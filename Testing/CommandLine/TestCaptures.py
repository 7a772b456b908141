# SPDX-License-Identifier: BSD-3-Clause
"""vtkGaussianSplatReader: captures of 3D Gaussian splatting."""

import os
import unittest

import numpy as np
from vtkmodules.vtkCommonCore import VTK_DOUBLE, VTK_FLOAT

from capturecase import EPSILON, CaptureCase, covariance_error, symmetric
from captures import (RESTS, Gaussians, furry_ball, matrices_of, ply_columns, torus,
                      write_columns, write_packed, write_ply, write_splat)
from surfelsplatting import vtkGaussianSplatReader, vtkPointCloudReader
from surfelsplatting.clouds.cloud import is_hierarchy
from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.commandline.session import Session
from surfelsplatting.views.cameras import asked_view
from surfelsplatting.views.framing import complete_view
from toolcase import ToolCase, arrays_of, content_of, sphere, write, write_ply as write_scan

FORMS = ("binary_little_endian", "binary_big_endian", "ascii")


def as_floats(gaussians):
    """The values that a .ply file of floats holds, in float64."""
    logits = np.log(gaussians.opacities) - np.log1p(-gaussians.opacities)
    stored = [values.astype(np.float32).astype(float) for values in (
        gaussians.positions, np.log(gaussians.scales), gaussians.rotations, logits,
        gaussians.harmonics)]
    positions, logs, rotations, logits, harmonics = stored
    return Gaussians(positions, np.exp(logs), rotations, 1 / (1 + np.exp(-logits)), harmonics)


class TestCaptures(CaptureCase):
    def check(self, expected, points, arrays):
        """Within the rounding of float64 to float; entries of a covariance, which are sums of
        products, relative to the largest."""
        np.testing.assert_array_equal(points, expected.positions)
        error = covariance_error(arrays["GaussianCovariance"], symmetric(expected.covariances()))
        self.assertLess(error, EPSILON)
        np.testing.assert_allclose(arrays["GaussianOpacity"], expected.opacities, EPSILON)
        np.testing.assert_array_equal(arrays["GaussianHarmonics"],
                                      expected.harmonics.reshape(len(expected), -1))

    def test_degrees_and_containers(self):
        ball = furry_ball(300)
        for degree, rest in enumerate(RESTS):
            gaussians = ball.of_degree(degree)
            self.assertEqual(sum("f_rest" in name for name in ply_columns(gaussians)), rest)
            for form in FORMS:
                write_ply("ball.ply", gaussians, form)
                reader, points, arrays = self.read("ball.ply")
                self.assertEqual(set(arrays), {"GaussianCovariance", "GaussianOpacity",
                                               "GaussianHarmonics"})
                self.assertEqual(points.dtype, np.float32)
                self.assertEqual(reader.GetNumberOfInvalidGaussians(), 0)
                self.check(as_floats(gaussians), points, arrays)

    def test_order_of_the_harmonics(self):
        """By hand: a property of each channel and coefficient, channel by channel."""
        columns = ply_columns(torus(2))
        columns.update({f"f_rest_{i}": np.full(2, i) for i in range(45)})
        columns.update({f"f_dc_{i}": np.full(2, 100 + i) for i in range(3)})
        write_columns("order.ply", dict(sorted(columns.items())))  # in another order
        _, _, arrays = self.read("order.ply")
        expected = [(100, 101, 102)] + [(k, 15 + k, 30 + k) for k in range(15)]
        np.testing.assert_array_equal(arrays["GaussianHarmonics"][1].reshape(16, 3), expected)

    def test_many_parts(self):
        """More than are decoded at once, with an invalid one in each part."""
        ball = furry_ball(1000).of_degree(0)
        many = ball[np.arange(150_000) % 1000]
        broken = np.array([5, 70_000, 149_999])
        many.positions[broken, 1] = np.nan
        for form in FORMS[:2]:
            write_ply("many.ply", many, form)
            reader, points, arrays = self.read("many.ply")
            self.assertEqual(reader.GetNumberOfInvalidGaussians(), 3)
            self.check(as_floats(many[np.delete(np.arange(150_000), broken)]), points, arrays)

    def test_doubles_stay_doubles(self):
        ball = furry_ball(50)
        ball.positions += (691000.125, 5334000.5, 512.75)
        for form in FORMS:
            write_ply("utm.ply", ball, form, "double")
            reader, points, _ = self.read("utm.ply")
            self.assertEqual(reader.GetOutput().GetPoints().GetDataType(), VTK_DOUBLE)
            np.testing.assert_array_equal(points, ball.positions)

    def test_splat(self):
        record = write_splat("ball.splat", furry_ball(300))
        self.assertEqual(os.path.getsize("ball.splat"), 300 * 32)
        _, points, arrays = self.read("ball.splat")
        np.testing.assert_array_equal(points, record["position"])
        np.testing.assert_array_equal(arrays["RGB"], record["rgba"][:, :3])
        np.testing.assert_allclose(arrays["GaussianOpacity"], record["rgba"][:, 3] / 255, EPSILON)
        axes = matrices_of((record["rotation"] - 128.0) / 128) * record["scale"][:, None].astype(float)
        expected = symmetric(axes @ axes.transpose(0, 2, 1))
        self.assertLess(covariance_error(arrays["GaussianCovariance"], expected), EPSILON)
        self.assertEqual(set(arrays), {"RGB", "GaussianCovariance", "GaussianOpacity"})

    def test_packed(self):
        """Compressed .ply files: three chunks, the last one not full."""
        ball = furry_ball(600)
        for degree in range(4):
            for has_colors in (True, False):
                packed = write_packed("ball.compressed.ply", ball.of_degree(degree), has_colors)
                reader, points, arrays = self.read("ball.compressed.ply")
                self.assertEqual(reader.GetNumberOfInvalidGaussians(), 0)
                np.testing.assert_allclose(points, packed.positions, 2 * EPSILON, 1e-7)
                self.assertLess(covariance_error(arrays["GaussianCovariance"],
                                                 symmetric(packed.covariances())), 1e-5)
                np.testing.assert_allclose(arrays["GaussianOpacity"], packed.opacities, EPSILON)
                np.testing.assert_allclose(arrays["GaussianHarmonics"],
                                           packed.harmonics.reshape(600, -1), 2 * EPSILON, 1e-6)
        # They are the Gaussians that were packed, as exactly as the bits tell.
        spread = np.ptp(ball.positions, axis=0).max()
        self.assertLess(np.abs(points - ball.positions).max(), spread / 1023 / 2 * 1.001)
        self.assertLess(np.abs(arrays["GaussianHarmonics"] - ball.harmonics.reshape(600, -1))[:, 3:]
                        .max(), 4 / 255 * 1.001)

    def test_many_packed(self):
        """More than are decoded at once, and a chunk that is damaged."""
        many = furry_ball(1000).of_degree(1)[np.arange(150_000) % 1000]
        packed = write_packed("many.ply", many)
        with open("many.ply", "r+b") as file:
            file.seek(file.read().index(b"end_header\n") + 11 + 300 * 18 * 4)
            file.write(np.float32(np.nan).tobytes())
        reader, points, arrays = self.read("many.ply")
        self.assertEqual(reader.GetNumberOfInvalidGaussians(), 256)
        kept = np.arange(150_000) // 256 != 300
        np.testing.assert_allclose(points, packed.positions[kept], 2 * EPSILON, 1e-7)
        np.testing.assert_allclose(arrays["GaussianOpacity"], packed.opacities[kept], EPSILON)

    def test_wrong_packed_headers(self):
        write_packed("capture.ply", furry_ball(600).of_degree(1))
        for old, new, says in (
                (b"vertex 600", b"vertex 601", "points, but the file has only"),
                (b"vertex 600", b"vertex 512", "an element chunk for each 256"),
                (b"sh 600", b"sh 599", "an element sh for each"),
                (b"chunk 3", b"chunk 999999999", "999999999 points"),
                (b"float max_scale_y", b"float most_scale_y", "no property max_scale_y of type float"),
                (b"uint packed_scale", b"float packed_scale", "no property packed_scale of type uint"),
                (b"f_rest_8", b"f_rest_9", "no property f_rest_8 of type uchar"),
                (b"uchar f_rest_8", b"uchar g_rest_8", "8 properties f_rest_"),
                (b"float min_x", b"list uchar float min_x", "element chunk has a list"),
                (b"binary_little", b"binary_big", "not binary_little_endian"),
                (b"packed_position", b"packet_position", "vtkPointCloudReader")):
            self.assertIn(says, self.failure(self.with_header(old, new)), new)
        size = os.path.getsize("capture.ply")
        for left in (size - 1, size - 6000, 1200, 700, 300):
            self.assertRegex(self.failure(self.cut(left)), "cut short|damaged")

    def test_extremes(self):
        """Infinite logits and logarithms have a meaning; other infinities and NaN have none."""
        columns = ply_columns(furry_ball(12).of_degree(0))
        columns["opacity"][:2] = -np.inf, np.inf
        columns["scale_1"][2] = -np.inf
        for number, (name, value) in enumerate((
                ("x", np.nan), ("z", np.inf), ("opacity", np.nan), ("scale_0", 60), ("rot_2", np.inf),
                ("f_dc_1", -np.inf), ("scale_2", np.nan)), 3):
            columns[name][number] = value
        for i in range(4):
            columns[f"rot_{i}"][10] = 0
        for form in FORMS:
            write_columns("extremes.ply", columns, form)
            reader, points, arrays = self.read("extremes.ply")
            self.assertEqual((len(points), reader.GetNumberOfInvalidGaussians()), (4, 8))
            for name, values in arrays.items():
                self.assertEqual(len(values), 4, name)
                self.assertTrue(np.isfinite(values).all(), name)
            np.testing.assert_array_equal(arrays["GaussianOpacity"][:2], [0, 1])
            s = arrays["GaussianCovariance"][2].astype(float)
            matrix = s[[0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(3, 3)
            values = np.linalg.eigvalsh(matrix)
            self.assertLess(abs(values[0]), EPSILON * values[2])  # flat
            np.testing.assert_array_equal(points[3], np.float32([columns[c][11] for c in "xyz"]))

    def test_can_read(self):
        ball = furry_ball(20)
        write_ply("capture.ply", ball)
        write_ply("capture.dat", ball, "ascii")
        write_splat("ball.SPLAT", ball)
        write_splat("ball.bin", ball)
        write_scan("scan.ply", *sphere(20))
        write("empty.splat", "")
        write("plywood.ply", "plywood\n")
        with open("compressed.ply", "w") as file:
            file.write("ply\nformat binary_little_endian 1.0\nelement chunk 0\nproperty float min_x\n"
                       "element vertex 0\nproperty uint packed_position\nend_header\n")
        readable = {name: vtkGaussianSplatReader.CanReadFile(name) for name in os.listdir(".")}
        self.assertEqual({name for name, can in readable.items() if can},
                         {"capture.ply", "capture.dat", "ball.SPLAT", "compressed.ply"})
        self.assertEqual(vtkGaussianSplatReader.CanReadFile("missing.splat"), 0)
        self.assertEqual(vtkPointCloudReader.CanReadFile("capture.ply"), 1)  # as points
        for name in ("capture.dat", "ball.SPLAT"):
            self.assertEqual(len(self.read(name)[1]), 20)

    def with_header(self, old, new):
        """capture.ply with another header -> its name"""
        content = content_of("capture.ply")
        self.assertIn(old, content)
        write("wrong.ply", content.replace(old, new, 1))
        return "wrong.ply"

    def cut(self, left):
        """The first bytes of capture.ply -> the name of a file"""
        with open("capture.ply", "rb") as file, open("cut.ply", "wb") as cut:
            cut.write(file.read(left))
        return "cut.ply"

    def test_wrong_headers(self):
        write_ply("capture.ply", furry_ball(20))
        for old, new, says in (
                (b"vertex 20", b"vertex 21", "21 points, but the file has only"),
                (b"vertex 20", b"vertex 2000000000", "2000000000 points"),
                (b"vertex 20", b"vertex 99999999999999999", "99999999999999999 points"),
                (b"vertex 20", b"vertex -20", "is not a whole number"),
                (b"rot_3", b"rot_4", "no property rot_3"),
                (b"float x", b"float w", "no property x"),
                (b"f_rest_44", b"g_rest_44", "44 properties f_rest_"),
                (b"f_rest_44", b"f_rest_45", "no property f_rest_44"),
                (b"float nx", b"list uchar float nx", "list"),
                (b"float nx", b"quad nx", "without known type"),
                (b"element vertex", b"element face 3\nelement vertex", "first"),
                (b"binary_little", b"binary_middle", "neither ascii"),
                (b"end_header", b"end", "end_header"),
                (b"scale_0", b"width_0", "vtkPointCloudReader")):
            self.assertIn(says, self.failure(self.with_header(old, new)), new)

    def test_cut_and_broken_data(self):
        ball = furry_ball(20)
        for form in FORMS:
            write_ply("capture.ply", ball, form)
            size = os.path.getsize("capture.ply")
            for left in (size - 1, size - 300, size // 2, 1500, 300, 5):
                reader = self.reader(self.cut(left))
                reader.Update()  # without its last digit a text may still be whole
                self.assertEqual(reader.GetErrorCode() != 0, form != "ascii" or left < size - 1)
        with open("capture.ply", "rb") as file:
            lines = file.read().split(b"\n")
        lines[-3] = lines[-3].replace(b" ", b" x", 1)
        write("broken.ply", b"\n".join(lines))
        self.assertIn("is not a number", self.failure("broken.ply"))
        write_splat("cut.splat", ball)
        os.truncate("cut.splat", 19 * 32 + 1)
        self.assertIn("no multiple", self.failure("cut.splat"))
        for path, content, says in (("empty.ply", b"", "empty"), ("missing.ply", None, "opened"),
                                    ("other.dat", b"x" * 64, "neither")):
            if content is not None:
                write(path, content)
            self.assertIn(says, self.failure(path))

    def test_all_invalid(self):
        ball = furry_ball(20)
        ball.positions[:] = np.nan
        write_ply("nan.ply", ball)
        self.assertIn("each of its 20 Gaussians", self.failure("nan.ply"))

    def test_none(self):
        write_ply("none.ply", furry_ball(20)[:0])
        reader, points, _ = self.read("none.ply")
        self.assertEqual((len(points), reader.GetOutput().GetPoints().GetDataType()),
                         (0, VTK_FLOAT))

    def test_progress_and_abort(self):
        write_splat("many.splat", furry_ball(1000)[np.arange(200_000) % 1000])
        for stops in (False, True):
            reader, seen = self.reader("many.splat"), []

            def note(caller, _event, seen=seen, stops=stops):
                seen.append(caller.GetProgress())
                caller.SetAbortExecute(stops)

            reader.AddObserver("ProgressEvent", note)
            reader.Update()
            self.assertEqual(seen, sorted(seen))
            self.assertEqual(reader.GetErrorCode(), 0)
            count = reader.GetOutput().GetNumberOfPoints()
            self.assertEqual((count, len(seen) > 3), (0, False) if stops else (200_000, True))


class TestTool(ToolCase):
    """What surfelsplat makes of captures before it draws them."""

    def test_info(self):
        ball = furry_ball(2000)
        ball.positions[7] = np.nan
        write_ply("ball.ply", ball)
        write_splat("ball.splat", ball[8:])
        report = self.report("ball.ply")
        self.assertEqual((report["holds"], report["points"], report["harmonics_degree"]),
                         ("Gaussians", 1999, 3))
        kept = np.arange(2000) != 7
        self.assertEqual(report["opaque"], np.mean(ball.opacities[kept] > 0.9))
        largest = np.median(ball.scales[kept].max(axis=1))
        self.assertAlmostEqual(report["size"], largest, delta=1e-5 * largest)  # floats
        low, high = np.float32((ball.positions[kept].min(axis=0), ball.positions[kept].max(axis=0)))
        self.assertEqual(list(report["bounds"].values()), np.transpose([low, high]).tolist())
        text = self.info("ball.ply")
        for part in ("1999 Gaussians", "a capture of 3D Gaussian splatting; 1 Gaussians with",
                     "harmonics of degree 3"):
            self.assertIn(part, text)
        report = self.report("ball.splat")
        self.assertEqual((report["points"], report.get("harmonics_degree")), (1992, None))
        self.assertIn("RGB: colours", self.info("ball.splat"))

    def test_damage_is_an_error(self):
        write_splat("cut.splat", furry_ball(50))
        os.truncate("cut.splat", 33)
        write_ply("cut.ply", furry_ball(50))
        os.truncate("cut.ply", 5000)
        for path in ("cut.splat", "cut.ply"):
            self.refuse("info", path, says=path)

    def test_what_the_mapper_gets(self):
        """The Gaussians as they were read in a hierarchy, and a view that shows all of them."""
        write_ply("ball.ply", furry_ball(2000))
        session = Session(parse_arguments(["render", "ball.ply", "-o", "out.png"]))
        cloud = session.read()
        surfels = session.surfels(cloud)
        self.assertIs(surfels, cloud.data)
        drawn = session.drawable(surfels)
        self.assertEqual(set(arrays_of(drawn)), {"GaussianCovariance", "GaussianOpacity",
                                                 "GaussianHarmonics"})
        self.assertTrue(is_hierarchy(drawn))
        view = complete_view(asked_view(session.arguments), cloud, surfels)
        self.assertGreater(np.linalg.norm(view.position), 1.5)


if __name__ == "__main__":
    unittest.main()

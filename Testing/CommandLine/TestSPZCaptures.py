# SPDX-License-Identifier: BSD-3-Clause
"""vtkGaussianSplatReader: captures in .spz files."""

import gzip
import os
import random
import struct
import unittest

import numpy as np

from capturecase import EPSILON, CaptureCase, covariance_error, symmetric
from captures import furry_ball, torus, write_ply, write_spz, zstd_columns
from surfelsplatting import vtkGaussianSplatReader
from toolcase import content_of, write
from zstdframes import raw_frame, repeated_frame

ROUNDS = 150  # of damage of either kind
OF_AXES = 0xADBE0003  # the type of an extension


def header(count, version=3, degree=0, bits=12, flags=0, magic=b"NGSP"):
    return magic + struct.pack("<IIBBBB", version, count, degree, bits, flags, 0)


def extension(kind, content):
    return struct.pack("<II", kind, len(content)) + content


class TestSPZCaptures(CaptureCase):
    def check(self, expected, points, arrays):
        """Within the rounding of float64 to float; of quaternions before they become covariances"""
        np.testing.assert_allclose(points, expected.positions, EPSILON)
        error = covariance_error(arrays["GaussianCovariance"], symmetric(expected.covariances()))
        self.assertLess(error, 3 * EPSILON)
        np.testing.assert_allclose(arrays["GaussianOpacity"], expected.opacities, EPSILON)
        np.testing.assert_allclose(arrays["GaussianHarmonics"],
                                   expected.harmonics.reshape(len(expected), -1), EPSILON)

    def test_as_the_ply_file(self):
        """The numbers that were stored, and those of the .ply file within half a step."""
        ball = furry_ball(500)
        for degree in range(4):
            write_ply("ball.ply", ball.of_degree(degree))
            _, points, arrays = self.read("ball.ply")
            largest = arrays["GaussianCovariance"][:, :3].max(axis=1)[:, None]
            for version, turn in ((2, 0.35), (3, 0.08), (4, 0.08)):
                stored = write_spz("ball.spz", ball.of_degree(degree), version)
                reader, read, found = self.read("ball.spz")
                self.assertEqual(set(found), set(arrays))
                self.assertEqual((read.dtype, reader.GetNumberOfInvalidGaussians(),
                                  reader.GetAntialiased()), (np.float32, 0, False))
                self.check(stored, read, found)
                error = {name: np.abs(found[name] - arrays[name]) for name in arrays}
                self.assertLess(np.abs(read - points).max(), 0.5 / 4096 * 1.001)
                self.assertLess(error["GaussianOpacity"].max(), 0.5 / 255 * 1.001)
                self.assertLess(error["GaussianHarmonics"][:, :3].max(), 0.5 / 255 / 0.15 * 1.001)
                self.assertLess(error["GaussianHarmonics"][:, 3:].max(initial=0), 0.5 / 128 * 1.001)
                # A sixteenth of the variance, and more where the axes are turned.
                self.assertLess((error["GaussianCovariance"] / largest).max(), turn)

    def test_bytes(self):
        """By hand: two Gaussians of degree 3 in both versions."""
        columns = (bytes((1, 0, 0, 255, 255, 255, 0, 0, 128)) + bytes((2, 1, 0)) + bytes(6)
                   + bytes((51, 255)) + bytes((0, 255, 51)) * 2 + bytes((160, 176, 144)) * 2)
        rest = bytes(range(129, 129 + 45)) * 2
        # About y by 120 degrees, and not at all.
        for version, rotations in ((2, bytes((127, 238, 127, 127, 127, 127))),
                                   (3, struct.pack("<II", 1 << 30 | 361, 3 << 30))):
            write("two.spz", gzip.compress(header(2, version, 3, 8) + columns + rotations + rest))
            self.check_bytes()
        ends = np.cumsum((0, 18, 2, 6, 6))
        parts = [columns[begin:end] for begin, end in zip(ends, ends[1:])]
        write("two.spz", zstd_columns(header(2, 4, 3, 8)[:15], [*parts, rotations, rest], b"", raw_frame))
        self.check_bytes()

    def check_bytes(self):
        signs = (-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1)  # y and z are turned round
        _, points, arrays = self.read("two.spz")
        np.testing.assert_array_equal(points, [(1 / 256, 1 / 256, 32768), (258 / 256, 0, 0)])
        np.testing.assert_array_equal(arrays["GaussianOpacity"], np.float32([0.2, 1]))
        harmonics = arrays["GaussianHarmonics"][1].reshape(16, 3)
        np.testing.assert_allclose(harmonics[0], [-0.5 / 0.15, 0.5 / 0.15, -0.3 / 0.15], EPSILON)
        np.testing.assert_array_equal(
            harmonics[1:], np.reshape(range(1, 46), (15, 3)) / 128 * np.reshape(signs, (15, 1)))
        x, y, z = np.exp([0, 2, -2])
        np.testing.assert_allclose(arrays["GaussianCovariance"][1], [x, y, z, 0, 0, 0], 2e-2, 8e-2)
        # By -120 degrees where z points forwards: XZ is -sin cos (x - z).
        np.testing.assert_allclose(
            arrays["GaussianCovariance"][0],
            [(x + 3 * z) / 4, y, (z + 3 * x) / 4, 0, 0, 3 ** 0.5 / 4 * (z - x)], 2e-2, 8e-2)

    def test_many_parts(self):
        """More than are decoded at once, and more bytes than are inflated at once."""
        many = furry_ball(1000).of_degree(1)[np.arange(150_000) % 1000]
        last = np.arange(149_000, 150_000)
        for version in (3, 4):
            stored = write_spz("many.spz", many, version)
            _, points, arrays = self.read("many.spz")
            self.check(stored[last], points[last], {name: a[last] for name, a in arrays.items()})
            np.testing.assert_allclose(points, stored.positions, EPSILON)
            np.testing.assert_allclose(arrays["GaussianHarmonics"],
                                       stored.harmonics.reshape(len(many), -1), EPSILON)

    def test_flags_and_axes(self):
        """Whatever axes the file names, the capture is the same."""
        ball = furry_ball(100)
        unknown = extension(0x12340001, b"whatever")
        for axes in range(9):
            bits = 3 if axes == 0 else axes - 1  # 0: unknown, as without the extension
            signs = (1 if bits & 1 else -1, -1 if bits & 2 else 1, 1 if bits & 4 else -1)
            for version in (3, 4):
                stored = write_spz("ball.spz", ball, version, 14, 3,
                                   unknown + extension(OF_AXES, struct.pack("<I", axes)), signs)
                reader, points, arrays = self.read("ball.spz")
                self.assertTrue(reader.GetAntialiased())
                self.check(stored, points, arrays)
                self.assertLess(np.abs(points - ball.positions).max(), 0.5 / 2 ** 14 * 1.001)
        for version in (3, 4):
            write_spz("ball.spz", ball, version, 12, 2, unknown)
            self.assertFalse(self.read("ball.spz")[0].GetAntialiased())
            for extensions, says in ((extension(OF_AXES, struct.pack("<I", 9)), "number 9"),
                                     (unknown[:-1], "are damaged"), (unknown + b"more", "are damaged"),
                                     (bytes(1 << 20), "longer than 1 MiB")):
                write_spz("ball.spz", ball, version, 12, 2, extensions)
                self.assertIn(says, self.failure("ball.spz"))

    def test_wrong_headers(self):
        columns = bytes(20 * 2)
        for content, says in (
                (header(2, 1), "version 1, compressed by gzip; of these, versions 2 and 3"),
                (header(2, 4), "version 4, compressed by gzip"),
                (header(2, degree=4), "degree 4"),
                (header(2, bits=32), "32 fractional bits"),
                (header(3), "3 Gaussians, of 60 bytes, but its columns have only 40"),
                (header(1), "go on after the 20 bytes of the 1 Gaussians"),
                (header(2, degree=1), "have only 40"),
                (header(2, version=2), "go on after the 38 bytes"),
                (header(2, flags=2) + b"more", "extensions"),
                (header(0xFFFFFFFF), "4294967295 Gaussians"),
                (header(40_000_000), "40000000 Gaussians, of 800000000 bytes, but the file has only"),
                (header(2, magic=b"SPNG"), "NGSP")):
            write("wrong.spz", gzip.compress(content + columns))
            self.assertIn(says, self.failure("wrong.spz"))
        for content, says in ((header(2, 5) + columns, "version 5 that is not compressed by gzip"),
                              (header(2, 3) + columns, "of these, version 4 is read"),
                              (b"NGSP", "header is cut short"), (b"", "empty"),
                              (gzip.compress(b"NGSP"), "header is cut short"),
                              (b"\x1f\x8b", "cut short after 0"), (b"text", "gzip stream is damaged")):
            self.assertIn(says, self.failure(write("wrong.spz", content)))
        # As large as 4 GB of compressed data may well be, but not in memory.
        write("huge.spz", gzip.compress(header(2_000_000_000, degree=3) + columns))
        os.truncate("huge.spz", 1 << 32)
        self.assertIn("GiB of memory", self.failure("huge.spz"))

    def test_wrong_tables(self):
        """Of version 4"""
        parts = [bytes(2 * size) for size in (9, 1, 3, 3, 4)]
        whole = zstd_columns(header(2, 4)[:15], parts, b"", raw_frame)
        self.assertEqual(len(self.read(write("two.spz", whole))[1]), 2)
        ends = 32 + 5 * 16
        for content, says in (
                (whole[:15] + b"\6" + whole[16:], "promises 6 columns, and its Gaussians have 5"),
                (whole[:12] + b"\1" + whole[13:], "promises 5 columns, and its Gaussians have 6"),
                (whole[:12] + b"\4" + whole[13:], "degree 4"),
                (whole[:16] + b"\x1f" + whole[17:], "table of its columns at byte 31"),
                (whole[:16] + b"\xff\xff" + whole[18:], "table of its columns at byte 65535"),
                (whole[:32] + bytes(7) + b"\x80" + whole[40:], "columns are cut short"),
                (whole[:40] + b"\x13" + whole[41:], "one of 19 bytes, which for its 2 Gaussians has 18"),
                (whole + b"more", "columns end at byte"), (whole[:-1], "columns are cut short"),
                (whole[:ends - 16], "columns are cut short"), (whole[:20], "header is cut short"),
                (whole[:ends] + b"\0" + whole[ends + 1:], "zstd stream is damaged (Unknown frame"),
                (header(40_000_000, 4) + whole[16:], "40000000 Gaussians, of 800000000 bytes, but")):
            self.assertIn(says, self.failure(write("wrong.spz", content)))
        # Frames of other lengths than the table has.
        content = bytearray(whole)
        content[whole.rindex(b"\x28\xb5\x2f\xfd") + 6] -= 8
        self.assertRegex(self.failure(write("wrong.spz", content)), "zstd stream is|go on after")

    def test_bomb(self):
        """40 KB that stand for 1.3 GB, which the table does not say"""
        parts = [bytes(2 * size) for size in (9, 1, 3, 3, 4)]
        bomb = zstd_columns(header(2, 4)[:15], parts, b"", lambda _: repeated_frame(b"a", 2000))
        self.assertIn("go on after the 40 bytes", self.failure(write("bomb.spz", bomb)))

    def test_no_gaussians_and_what_follows_the_stream(self):
        for version in (3, 4):
            write_spz("none.spz", furry_ball(9)[:0], version)
            self.assertEqual(len(self.read("none.spz")[1]), 0)
        write_spz("padded.spz", furry_ball(9))
        os.truncate("padded.spz", 10_000)
        self.assertEqual(len(self.read("padded.spz")[1]), 9)

    def test_can_read(self):
        ball = furry_ball(20)
        write_spz("ball.SPZ", ball)
        write_spz("ball.dat", ball, 2)
        write("new.spz", header(1, 4))  # read so far as to say what is wrong
        write("other.gz", gzip.compress(b"whatever"))
        write("short.spz", b"\x1f\x8b\x08")
        readable = {name for name in os.listdir(".") if vtkGaussianSplatReader.CanReadFile(name)}
        self.assertEqual(readable, {"ball.SPZ", "ball.dat", "new.spz"})
        for name in ("ball.SPZ", "ball.dat"):
            self.assertEqual(len(self.read(name)[1]), 20)
        self.assertIn("neither", self.failure("other.gz"))

    def test_cut(self):
        for version in (2, 3, 4):
            write_spz("whole.spz", torus(30), version)
            whole = content_of("whole.spz")
            for left in range(0, len(whole), 1 + len(whole) // 60):
                self.assertRegex(self.failure(write("cut.spz", whole[:left])), "cut short|empty")

    def test_damage(self):
        """The checksum finds all of it but that of the name of the system in gzip's header."""
        stored = write_spz("whole.spz", torus(30))
        whole = content_of("whole.spz")
        rnd = random.Random(7)
        for _ in range(ROUNDS):
            damaged = bytearray(whole)
            for _ in range(rnd.choice((1, 1, 2, 5))):
                damaged[rnd.randrange(len(whole))] ^= 1 << rnd.randrange(8)
            reader = self.reader(write("damaged.spz", damaged))
            reader.Update()
            self.assertEqual(len(self.errors), reader.GetErrorCode() != 0)
            if reader.GetErrorCode() == 0:
                self.check(stored, *self.read("damaged.spz")[1:])

    def test_damage_below_the_checksum(self):
        """Headers and columns of any bytes, well compressed."""
        write_spz("whole.spz", torus(30).of_degree(1), flags=3,
                  extensions=extension(OF_AXES, struct.pack("<I", 4)))
        with open("whole.spz", "rb") as file:
            whole = gzip.decompress(file.read())
        rnd = random.Random(8)
        for _ in range(ROUNDS):
            damaged = bytearray(whole)
            for _ in range(rnd.choice((1, 1, 3))):
                place = rnd.randrange(4, 16) if rnd.random() < 0.5 else rnd.randrange(len(whole))
                damaged[place] = rnd.randrange(256)
            reader = self.reader(write("damaged.spz", gzip.compress(bytes(damaged), 1)))
            reader.Update()
            self.assertEqual(len(self.errors), reader.GetErrorCode() != 0)

    def test_damage_of_version_4(self):
        """There are no checksums: what is found is an error, the rest other Gaussians."""
        write_spz("whole.spz", torus(30), 4, flags=3,
                  extensions=extension(OF_AXES, struct.pack("<I", 4)))
        whole = content_of("whole.spz")
        rnd = random.Random(9)
        for _ in range(2 * ROUNDS):
            damaged = bytearray(whole)
            for _ in range(rnd.choice((1, 1, 3))):
                place = rnd.randrange(4, 140) if rnd.random() < 0.5 else rnd.randrange(len(whole))
                damaged[place] = rnd.randrange(256)
            reader = self.reader(write("damaged.spz", damaged))
            reader.Update()
            self.assertEqual(len(self.errors), reader.GetErrorCode() != 0)

    def test_progress_and_abort(self):
        write_spz("many.spz", furry_ball(1000).of_degree(1)[np.arange(150_000) % 1000])
        for most in (1.0, 0.2, 0.6):  # while columns are inflated, and while they are decoded
            reader, seen = self.reader("many.spz"), []

            def note(caller, _event, seen=seen, most=most):
                seen.append(caller.GetProgress())
                caller.SetAbortExecute(seen[-1] > most)

            reader.AddObserver("ProgressEvent", note)
            reader.Update()
            self.assertEqual(seen, sorted(seen))
            self.assertEqual(reader.GetErrorCode(), 0)
            self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 150_000 if most == 1.0 else 0)
            self.assertGreater(len(seen), 4 if most == 1.0 else 1)

    def test_info(self):
        write_spz("ball.spz", furry_ball(300), flags=1)
        report = self.report("ball.spz")
        self.assertEqual((report["holds"], report["points"], report["harmonics_degree"]),
                         ("Gaussians", 300, 3))
        self.assertIn("--capture-filter antialiased",
                      [suggestion["options"] for suggestion in report["suggestions"]])


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""Captures in .sog files, which need Pillow."""

import copy
import json
import os
import random
import subprocess
import sys
import unittest
import zipfile

import numpy as np

try:
    from sogcaptures import image_of, sog_files, store, write_sog
except ImportError as problem:
    print("SKIPPED: the package Pillow is needed (apt install python3-pil):", problem)
    sys.exit(77)
from capturecase import EPSILON, covariance_error, symmetric
from captures import furry_ball, torus, write_ply
from surfelsplatting import vtkGaussianSplatReader
from surfelsplatting.formats.sog import read_sog_capture
from surfelsplatting.formats.sogfiles import folder_meta
from surfelsplatting.problems import UserProblem
from toolcase import ToolCase, arrays_of, content_of, places_of, write

ROUNDS = 200  # of damage of either kind
SIZE = ("--size", "120", "90")


def read(path):
    """-> points, point arrays, number of Gaussians that were left out, whether antialiased"""
    capture, invalid, is_antialiased = read_sog_capture(path)
    return places_of(capture), arrays_of(capture), invalid, is_antialiased


def changed(meta, names, value):
    """A copy with another value, or without one: None"""
    meta = copy.deepcopy(meta)
    section = meta
    for name in names[:-1]:
        section = section[name]
    if value is None:
        del section[names[-1]]
    else:
        section[names[-1]] = value
    return meta


class TestSOGCaptures(ToolCase):
    def check(self, expected, points, arrays):
        """Within the rounding of float64 to float"""
        np.testing.assert_allclose(points, expected.positions, 2 * EPSILON, 1e-12)
        error = covariance_error(arrays["GaussianCovariance"], symmetric(expected.covariances()))
        self.assertLess(error, 3 * EPSILON)
        np.testing.assert_allclose(arrays["GaussianOpacity"], expected.opacities, EPSILON)
        np.testing.assert_allclose(arrays["GaussianHarmonics"],
                                   expected.harmonics.reshape(len(expected), -1), EPSILON, 1e-12)

    def failure(self, path):
        with self.assertRaises(UserProblem) as found:
            read_sog_capture(path)
        self.assertIn(path, str(found.exception))
        return str(found.exception)

    def test_as_the_ply_file(self):
        """The numbers that were stored, in the arrays that the reader of .ply files makes."""
        ball = furry_ball(500)
        for degree in range(4):
            write_ply("ball.ply", ball.of_degree(degree))
            reader = vtkGaussianSplatReader()
            reader.SetFileName("ball.ply")
            reader.Update()
            for version in (1, 2):
                stored = write_sog("ball.sog", ball.of_degree(degree), version)
                points, arrays, invalid, is_antialiased = read("ball.sog")
                self.assertEqual((invalid, is_antialiased, points.dtype), (0, False, np.float32))
                self.check(stored, points, arrays)
                for name, array in arrays_of(reader.GetOutput()).items():
                    self.assertEqual((arrays[name].shape, arrays[name].dtype),
                                     (array.shape, array.dtype), name)
                self.assertLess(np.abs(points - ball.positions).max(), 1e-4)
                self.assertEqual(read_sog_capture("ball.sog")[0].GetNumberOfVerts(), 1)

    def test_bytes(self):
        """By hand: three Gaussians of degree 1, the last without a rotation."""
        meta = {"version": 2, "count": 3, "antialias": True,
                "means": {"mins": [0, -1, -2], "maxs": [1, 1, 2], "files": ["l", "u"]},
                "scales": {"codebook": [0, -1, 2], "files": ["s"]}, "quats": {"files": ["q"]},
                "sh0": {"codebook": [None, *range(1, 256)], "files": ["c"]},
                "shN": {"count": 2, "bands": 1, "codebook": [0.5, 0.25], "files": ["p", "n"]}}
        palette = np.zeros((192, 3))
        palette[4] = 1, 0, 1  # entry 1, harmonic 2
        images = {"l": image_of([[0, 255, 0], [255, 0, 255], [0, 0, 0]]),
                  "u": image_of([[0, 255, 0], [255, 0, 255], [0, 0, 0]]),
                  "s": image_of([[0, 1, 2], [1, 1, 1], [0, 0, 0]]),
                  # By 90 degrees about z: w = z, of which w is said to be the largest; not at all.
                  "q": image_of([[128, 128, 255, 252], [128, 128, 128, 252], [128, 128, 128, 0]]),
                  "c": image_of([[1, 2, 0, 255], [255, 0, 3, 51], [0, 0, 0, 0]]),
                  "p": image_of(palette, 192), "n": image_of([[1, 0, 0], [0, 0, 9], [0, 0, 0]])}
        store("two", meta, images)
        for path in ("two/meta.json", store("two.sog", meta, images, zipfile.ZIP_DEFLATED)):
            points, arrays, invalid, is_antialiased = read(path)
            self.assertEqual((invalid, is_antialiased), (1, True))
            e = np.e
            np.testing.assert_allclose(points, [(0, e - 1, 1 - e * e), (e - 1, 1 - e, e * e - 1)], 1e-6)
            np.testing.assert_allclose(arrays["GaussianCovariance"][0], [e ** -2, 1, e ** 4, 0, 0, 0],
                                       0.05, 0.5)
            np.testing.assert_allclose(arrays["GaussianCovariance"][1], [e ** -2] * 3 + [0] * 3, 1e-5,
                                       1e-5)
            np.testing.assert_allclose(arrays["GaussianOpacity"], [1, 0.2], 1e-6)
            # The first of the codebook is 1 + (1 - 255) / 255.
            np.testing.assert_allclose(arrays["GaussianHarmonics"], [
                [1, 2, 1 / 255, 0.5, 0.5, 0.5, 0.25, 0.5, 0.25, 0.5, 0.5, 0.5],
                [255, 1 / 255, 3, *[0.5] * 9]], 1e-6)

    def test_many_parts(self):
        """More than are decoded at once"""
        many = furry_ball(1000)[np.arange(150_000) % 1000]
        for version in (1, 2):
            stored = write_sog("many.sog", many, version)
            self.check(stored, *read("many.sog")[:2])

    def test_values_that_are_not_finite(self):
        meta, images, stored = sog_files(furry_ball(100).of_degree(0))
        far = changed(meta, ("means", "maxs", 0), 1000.0)
        points, arrays, invalid, _ = read(store("far.sog", far, images))
        self.assertTrue(0 < invalid < 100)
        self.assertEqual(len(points), 100 - invalid)
        self.assertEqual({len(array) for array in arrays.values()}, {100 - invalid})
        self.assertTrue(np.isfinite(points).all())
        images["quats.webp"] = image_of(np.zeros((100, 4)))
        self.assertIn("each of its 100 Gaussians", self.failure(store("none.sog", meta, images)))
        self.assertEqual(len(stored), 100)

    def test_wrong_meta(self):
        meta, images, _ = sog_files(furry_ball(100).of_degree(1))
        for names, value, says in (
                (("version",), 3, "version 3; versions 1 and 2"), (("count",), -1, "-1 as count"),
                (("count",), 1e3, "1000.0 as count"), (("count",), 101, "and not 101 to"),
                (("count",), 1 << 30, "1073741824 Gaussians, but its files have only"),
                (("means",), None, "no 'means'"), (("quats",), [1], "[1] as 'quats'"),
                (("means", "mins"), [0, 1], "2 numbers as mins of 'means', and not 3"),
                (("means", "maxs", 1), float("nan"), "nan as number 1 of maxs of 'means'"),
                (("means", "maxs", 1), 10 ** 400, "as number 1 of maxs"),
                (("means", "files"), ["means_l.webp"], "as files of 'means', and not the names of 2"),
                (("sh0", "files"), ["../sh0.webp"], "['../sh0.webp'] as files of 'sh0'"),
                (("sh0", "files"), ["other.webp"], "its other.webp is missing"),
                (("scales", "codebook"), None, "None as codebook of 'scales'"),
                (("scales", "codebook"), [0.0] * 257, "257 numbers as codebook"),
                (("scales", "codebook"), [0.0, None], "None as number 1 of codebook"),
                (("scales", "codebook"), [0.0], "only 1 numbers"),
                (("shN", "bands"), 2, "192 pixels wide, which no palette of 2 bands is"),
                (("shN", "bands"), "1", "'1' as bands"),
                (("shN", "count"), 129, "room for 128 entries, and not for the 129"),
                (("shN", "count"), 20, "and the palette only 20 entries"),
                (("shN", "codebook"), [1.0], "its shN_centroids.webp has the number")):
            self.assertIn(says, self.failure(store("wrong.sog", changed(meta, names, value), images)))
        for content, says in ((b"", "not readable"), (b"[" * 100_000, "not readable"),
                              (b'{"means": "\xff"}', "not readable"), (b"[1]", "[1]"), (b"{}", "no 'means'"),
                              (b'{"lodLevels": 3}', "streamed"), (b" " * (1 << 21), "more than")):
            self.assertIn(says, self.failure(store("wrong.sog", content, images)))

    def test_wrong_images(self):
        meta, images, _ = sog_files(furry_ball(100))
        for name, content, says in (
                ("means_u.webp", None, "means_u.webp is missing"), ("sh0.webp", b"", "no WebP image"),
                ("sh0.webp", images["sh0.webp"][:99], "sh0.webp"),
                ("quats.webp", image_of(np.zeros((99, 4)), 11), "11 x 9 pixels, and not 100 to"),
                ("shN_labels.webp", image_of(np.full((100, 3), 255)), "the number 65535, and the palette"),
                ("shN_centroids.webp", image_of(np.zeros((100, 3)), 100), "100 pixels wide, which no")):
            files = {**images, name: content}
            if content is None:
                del files[name]
            for path in ("wrong.sog", f"wrong {says}"[:12]):
                store(path, meta, files)
                self.assertIn(says, self.failure(folder_meta(path)))

    def test_bombs(self):
        """Small files that stand for much"""
        meta, images, _ = sog_files(furry_ball(100).of_degree(0))
        zeros = {**images, "means_l.webp": bytes(200_000_000)}
        self.assertIn("more than", self.failure(store("bomb.sog", meta, zeros, zipfile.ZIP_DEFLATED)))
        large = {**images, "means_l.webp": image_of(np.zeros((5000 * 5000, 3)))}
        self.assertIn("5000 x 5000 pixels, and not", self.failure(store("bomb.sog", meta, large)))
        # As many as the bytes may stand for, which are more than fit into memory.
        with zipfile.ZipFile("bomb.sog", "w") as file:
            file.writestr("meta.json", json.dumps(changed(meta, ("count",), 2_000_000_000)))
            file.writestr("means_l.webp", bytes(3_000_000))
        self.assertIn("GiB of memory", self.failure("bomb.sog"))

    def test_cut(self):
        write_sog("whole.sog", torus(30))
        whole = content_of("whole.sog")
        for left in range(0, len(whole), 1 + len(whole) // 60):
            write("cut.sog", whole[:left])
            self.assertIn("no readable zip file", self.failure("cut.sog"))

    def damaged(self, content, rnd):
        content = bytearray(content)
        for _ in range(rnd.choice((1, 1, 2, 5))):
            content[rnd.randrange(len(content))] = rnd.randrange(256)
        return bytes(content)

    def test_damage(self):
        """Of any byte of the file, of the images below their checksums, and of the meta.json"""
        meta, images, stored = sog_files(torus(30))
        store("whole.sog", meta, images)
        whole = content_of("whole.sog")
        rnd, known = random.Random(7), 0
        for i in range(3 * ROUNDS):
            if i % 3 == 0:
                write("damaged.sog", self.damaged(whole, rnd))
            elif i % 3 == 1:
                name = rnd.choice([*images])
                store("damaged.sog", meta, {**images, name: self.damaged(images[name], rnd)})
            else:
                store("damaged.sog", self.damaged(json.dumps(meta).encode(), rnd), images)
            try:
                self.assertLessEqual(len(read("damaged.sog")[0]), len(stored))
            except UserProblem as problem:
                self.assertIn("damaged.sog: ", str(problem))
                known += 1
        self.assertGreater(known, ROUNDS)

    def test_commands(self):
        ball = furry_ball(2000)
        write_ply("ball.ply", ball)
        pictures = []
        write_sog("ball", ball)
        for path in ("ball.ply", write_sog("ball.sog", ball) and "ball.sog", "ball", "ball/meta.json"):
            self.render(path, "--up", "-y", "--blur", "5", *SIZE, "-o", "out.exr")
            pictures.append(self.read_rgba("out.exr"))
        self.assertLess(np.sqrt(np.mean((pictures[1] - pictures[0]) ** 2)), 0.005)
        np.testing.assert_array_equal(pictures[2], pictures[1])
        np.testing.assert_array_equal(pictures[3], pictures[1])

    def test_info(self):
        meta, images, _ = sog_files(furry_ball(300))
        images["quats.webp"] = image_of(np.tile((128, 128, 128, 255), (299, 1)))
        store("ball", {**meta, "antialias": True}, images)
        report = self.report("ball")
        self.assertEqual((report["holds"], report["points"], report["harmonics_degree"]),
                         ("Gaussians", 299, 3))
        self.assertIn("1 Gaussians with values that are not finite", report["read_as"])
        self.assertGreater(report["bytes"], 10_000)
        self.assertIn("--capture-filter antialiased",
                      [suggestion["options"] for suggestion in report["suggestions"]])
        os.mkdir("empty")
        self.assertIn("empty is a folder", self.tool("info", "empty"))
        store("none.sog", {**meta, "count": 0}, images)
        self.assertIn("none.sog holds no points", self.tool("info", "none.sog"))

    def test_without_pillow(self):
        write_sog("ball.sog", furry_ball(9))
        code = ("import sys; sys.modules['PIL'] = None\n"
                "from surfelsplatting.commandline.main import main; sys.exit(main(['info', 'ball.sog']))")
        result = subprocess.run([sys.executable, "-s", "-c", code], capture_output=True, text=True,
                                timeout=100, check=False)
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, "^surfelsplat: .*pip install Pillow.*SuperSplat\n$")


if __name__ == "__main__":
    unittest.main()

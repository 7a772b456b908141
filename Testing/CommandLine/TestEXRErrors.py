# SPDX-License-Identifier: BSD-3-Clause
"""vtkSurfelEXRReader and what it cannot read: one clear error, empty outputs, no crash, and no
memory for what damaged headers announce."""

import contextlib
import os
import resource
import shutil
import struct
import subprocess
import unittest

import numpy as np

from deepfiles import deep_image
from exrfiles import PARTS, TILED, attribute, deep_file, flat_file, header, join
from surfelsplatting import vtkDeepEXRWriter, vtkSurfelEXRWriter
from TestEXRWriter import image_of
from toolcase import ToolCase, content_of, write

CANNOT_OPEN, UNKNOWN_TYPE, BAD_FORMAT, NO_NAME = 20002, 20003, 20005, 20006  # vtkErrorCode
ZIP, DWAB = 3, 9  # OpenEXR's numbers
HUGE = 2**29  # OpenEXR itself refuses twice that


@contextlib.contextmanager
def little_memory(megabytes=300):
    """Nothing larger can be allocated."""
    with open("/proc/self/statm", encoding="ascii") as file:
        used = int(file.read().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + megabytes * 2**20, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


class TestEXRErrors(ToolCase):
    def setUp(self):
        super().setUp()
        self.rng = np.random.default_rng(6)
        self.plane = self.rng.normal(0, 1, (12, 10)).astype("f4")

    def refuse(self, path, says, code=BAD_FORMAT, reader=None):
        reader = reader or self.exr_reader(path)
        reader.SetFileName(path)
        reader.Update()
        self.check_empty(reader)
        self.assertEqual(len(self.errors), 1, self.errors)
        self.assertIn(f"{path or ''}", self.errors[0])
        self.assertIn(says, self.errors[0])
        self.assertEqual(reader.GetErrorCode(), code)
        self.errors.clear()

    def check_empty(self, reader):
        for port in (0, 1):
            output = reader.GetOutputDataObject(port)
            self.assertEqual(output.GetNumberOfPoints(), 0)
            self.assertEqual(output.GetFieldData().GetNumberOfArrays(), 0)

    def test_no_picture(self):
        self.refuse(None, "SetFileName", NO_NAME)
        self.refuse("missing.exr", "cannot be opened", CANNOT_OPEN)
        self.refuse(".", "not an OpenEXR file", UNKNOWN_TYPE)
        for text in ("", "v/1", "ply\nformat ascii 1.0\nend_header\n"):
            write("text.exr", text.encode())
            self.refuse("text.exr", "not an OpenEXR file", UNKNOWN_TYPE)

    def test_the_picture_before_goes_away(self):
        flat_file("good.exr", {"Z": self.plane})
        write("bad.exr", b"bad")
        reader = self.exr_reader("good.exr")
        reader.Update()
        self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 120)
        self.refuse("bad.exr", "not an OpenEXR file", UNKNOWN_TYPE, reader)
        # Each update says so again, and a good file ends it.
        self.refuse("bad.exr", "not an OpenEXR file", UNKNOWN_TYPE, reader)
        reader.SetFileName("good.exr")
        reader.Update()
        self.assertEqual((reader.GetErrorCode(), self.errors), (0, []))
        self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 120)

    def test_kinds_that_are_not_read(self):
        flat_file("parts.exr", {"Z": self.plane}, flags=PARTS)
        self.refuse("parts.exr", "exrmultipart -separate")
        flat_file("chroma.exr", {"BY": self.plane}, sampling=2)
        self.refuse("chroma.exr", "channel BY does not have a value for each pixel")
        flat_file("future.exr", {"Z": self.plane}, flags=1)  # 3
        self.refuse("future.exr", "version")
        one = np.ones((2, 2), int)
        samples = {c: np.ones(4, "f4") for c in "RGBAZ"}
        tiles = attribute("tiles", "tiledesc", struct.pack("<IIB", 2, 2, 0))
        deep_file("tiles.exr", one, samples, kind="deeptile", extra=[tiles])
        self.refuse("tiles.exr", "deep tiles are not supported")
        del samples["A"]
        deep_file("lacking.exr", one, samples)
        self.refuse("lacking.exr", "no channel A")
        write("nothing.exr", join(header({}, (0, 0, 1, 1)), [], 0))
        self.refuse("nothing.exr", "channel")

    def test_parts_by_openexrs_tool(self):
        tool = shutil.which("exrmultipart")
        if not tool:
            self.skipTest("exrmultipart of the package openexr is not installed")
        for name in ("a", "b"):
            flat_file(name + ".exr", {"Z": self.plane},
                      extra=[attribute("name", "string", name.encode()),
                             attribute("type", "string", b"scanlineimage")])
        subprocess.run([tool, "-combine", "-i", "a.exr", "b.exr", "-o", "parts.exr"], check=True,
                       capture_output=True)
        self.refuse("parts.exr", "several parts")

    def test_headers_that_announce_too_much(self):
        kinds = {"R": "f4", "G": "f4", "B": "f4"}
        tiles = [attribute("tiles", "tiledesc", struct.pack("<IIB", HUGE, HUGE, 0))]
        ones = [attribute("tiles", "tiledesc", struct.pack("<IIB", 1, 1, 0))]
        windows = (0, 0, HUGE, 0), (0, 0, 0, HUGE), (-HUGE, -HUGE, HUGE, HUGE)
        large = [header(kinds, window, compression=c) for window in windows
                 for c in (0, ZIP, DWAB)]
        large += [header(kinds, (0, 0, 9, 9), flags=TILED, extra=tiles),
                  header(kinds, (0, 0, 9999, 9999), flags=TILED, extra=ones, compression=DWAB)]
        ends = [header(kinds, (0, 0, 9, 9), extra=[b"long\0string\0" + struct.pack("<i", size)])
                for size in (2**31 - 1, -1)]
        for files, says in ((large, "the file announces"), (ends, "the header is damaged")):
            for data in files:
                write("hostile.exr", data + bytes(500))
                with little_memory():
                    self.refuse("hostile.exr", says)

    def test_numbers_of_samples_that_are_too_large(self):
        many, line = 2**31 // 40, "<iQQQ"
        deep_file("deep.exr", np.ones((1, 1), int), {c: np.ones(1, "f4") for c in "RGBAZ"})
        data = content_of("deep.exr")
        place = len(data) - struct.calcsize(line) - 4 - 20
        chunk = struct.pack(line, 0, 4, 20, 20 * many) + struct.pack("<i", many)
        write("deep.exr", data[:place] + chunk + data[-20:])
        with little_memory():
            self.refuse("deep.exr", f"announces {many} samples")

    def test_pictures_beyond_memory(self):
        begin = header({"Z": "f4"}, (0, 0, 15999, 12499))
        write("large.exr", begin)
        os.truncate("large.exr", len(begin) + 12500 * (16 + 64000))  # takes no room on the disk
        with little_memory():
            self.refuse("large.exr", "does not fit into memory")

    def samples_of_files(self):
        """Files as our writers leave them, and uncompressed ones."""
        counts = self.rng.integers(0, 4, (9, 8))
        samples = self.rng.uniform(0.1, 0.9, (counts.sum(), 5)).astype("f4")
        colors = self.rng.normal(0, 1, (40, 9, 4))
        self.exr_writer(vtkDeepEXRWriter, deep_image(counts, samples), "deep.exr").Write()
        self.exr_writer(vtkSurfelEXRWriter, image_of(colors), "flat.exr").Write()
        deep_file("rawdeep.exr", counts, dict(zip("RGBAZ", samples.T.copy())))
        flat_file("rawflat.exr", {"R": self.plane, "Z": self.plane.astype("f2")}, order=1)
        for name in ("deep.exr", "rawdeep.exr", "flat.exr", "rawflat.exr"):
            with open(name, "rb") as file:
                yield file.read()

    def test_truncated_files(self):
        for whole in self.samples_of_files():
            for length in [4, 8, 20, *np.linspace(60, len(whole) - 1, 40, dtype=int)]:
                write("cut.exr", whole[:length])
                self.refuse("cut.exr", "", UNKNOWN_TYPE if length < 8 else BAD_FORMAT)

    def test_damaged_files(self):
        ends = set()
        for whole in self.samples_of_files():
            for reach in [400] * 150 + [len(whole)] * 150:
                damaged = bytearray(whole)
                for place in self.rng.integers(0, min(len(whole), reach), 3):
                    damaged[place] = self.rng.choice([0, 127, 255, self.rng.integers(0, 256)])
                write("damaged.exr", damaged)
                reader = self.exr_reader("damaged.exr")
                reader.Update()
                ends.add(reader.GetErrorCode())
                if reader.GetErrorCode():
                    self.check_empty(reader)
                    self.assertEqual(len(self.errors), 1)
                else:
                    self.assertGreater(reader.GetOutput().GetNumberOfPoints(), 0)
        self.assertEqual(ends, {0, UNKNOWN_TYPE, BAD_FORMAT})


if __name__ == "__main__":
    unittest.main()

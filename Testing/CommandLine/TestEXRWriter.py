# SPDX-License-Identifier: BSD-3-Clause
"""vtkSurfelEXRWriter: values, order of rows, channels, errors."""

import os
import subprocess
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData

from surfelsplatting import vtkDeepEXRWriter, vtkSurfelEXRWriter, vtkSurfelImageRenderer
from surfelsplatting.vtkarrays import named_array
from toolcase import ToolCase

HALF, FLOAT, ZIP = 1, 2, 3  # OpenEXR's numbers


def image_of(values):
    """values: [height, width, components], top row first."""
    image = vtkImageData()
    image.SetDimensions(values.shape[1], values.shape[0], 1)
    rows = np.ascontiguousarray(values[::-1].reshape(-1, values.shape[2]))
    image.GetPointData().SetScalars(numpy_to_vtk(rows, deep=True))
    return image


class TestEXRWriter(ToolCase):
    def setUp(self):
        super().setUp()
        rng = np.random.default_rng(2)
        self.colors = rng.normal(0, 3, (17, 31, 4)).astype(np.float32)

    def writer(self, image, path="out.exr"):
        return self.exr_writer(vtkSurfelEXRWriter, image, path)

    def write(self, image, *channels):
        writer = self.writer(image)
        for array, channel in channels:
            writer.AddChannel(array, channel)
        writer.Write()
        self.assertEqual((writer.GetErrorCode(), self.errors), (0, []))
        self.assertEqual(os.listdir("."), ["out.exr"])

    def test_floats_come_back_bit_by_bit(self):
        self.write(image_of(self.colors))
        np.testing.assert_array_equal(self.read_rgba("out.exr"), self.colors)

    def test_format_of_the_file(self):
        self.write(image_of(self.colors))
        dump = subprocess.run([os.environ["DUMP_EXR"], "out.exr"], capture_output=True, check=True)
        self.assertEqual(dump.stdout.split(b"\n")[0].decode(),
                         f"31 17 {ZIP} A:{FLOAT} B:{FLOAT} G:{FLOAT} R:{FLOAT}")

    def test_rgb_doubles_and_bytes(self):
        self.write(image_of(self.colors[..., :3].astype(np.float64)))
        planes = self.read_exr("out.exr")
        self.assertEqual(sorted(planes), ["B", "G", "R"])
        np.testing.assert_array_equal(planes["G"], self.colors[..., 1])
        bytes_ = np.arange(17 * 31 * 3, dtype=np.uint8).reshape(17, 31, 3)
        self.write(image_of(bytes_))
        np.testing.assert_allclose(self.read_exr("out.exr")["B"], bytes_[..., 2] / 255.0, rtol=1e-6)

    def test_further_channels(self):
        image = image_of(self.colors)
        depth = np.arange(17 * 31, dtype=np.float32).reshape(17, 31)
        image.GetPointData().AddArray(named_array("Depth", depth[::-1].ravel()))
        self.write(image, ("Depth", "Z"))
        planes = self.read_exr("out.exr")
        np.testing.assert_array_equal(planes["Z"], depth)
        np.testing.assert_array_equal(planes["R"], self.colors[..., 0])

    def test_all_channels(self):
        image = image_of(self.colors)
        values = {"Depth": 1, "Normal": 3, "Coverage": 1, "mine": 1, "pair": 2}
        for i, (name, components) in enumerate(values.items()):
            image.GetPointData().AddArray(
                named_array(name, np.full((17 * 31, components), i + 0.5, np.float32)))
        writer = self.writer(image)
        writer.AllChannelsOn()
        writer.AddChannel("mine", "theirs")
        writer.Write()
        planes = self.read_exr("out.exr")
        self.assertEqual(sorted(planes),
                         ["A", "B", "G", "N.X", "N.Y", "N.Z", "R", "Z", "coverage", "theirs"])
        self.assertTrue((planes["N.Y"] == 1.5).all() and (planes["theirs"] == 3.5).all())
        for name in ("R", "Z"):
            image.GetPointData().AddArray(named_array(name, np.zeros(17 * 31, np.float32)))
            os.remove("out.exr")
            self.refuse_to_write(writer, f"array {name} would be a second channel {name}")
            self.errors.clear()
            image.GetPointData().RemoveArray(name)
            writer.Write()

    def test_writes_anew_at_every_call(self):
        writer = self.writer(image_of(self.colors))
        writer.Write()
        os.remove("out.exr")
        writer.Write()
        np.testing.assert_array_equal(self.read_rgba("out.exr"), self.colors)

    def test_errors(self):
        image = image_of(self.colors)
        self.refuse_to_write(self.writer(image, None), "SetFileName")
        self.refuse_to_write(self.writer(image, "nowhere/out.exr"), "nowhere/out.exr")
        self.refuse_to_write(self.writer(image_of(self.colors[..., :2])), "3 or 4 components, not 2")
        lacking = self.writer(image)
        lacking.AddChannel("Depth", "Z")
        self.refuse_to_write(lacking, "no point array Depth")
        volume = vtkImageData()
        volume.SetDimensions(4, 4, 4)
        self.refuse_to_write(self.writer(volume), "4 x 4 x 4")
        unconnected = self.writer(image)
        unconnected.RemoveAllInputs()
        self.refuse_to_write(unconnected, "input")

    def test_input_that_cannot_be_made(self):
        """Nothing is written then, which the writer has to say."""
        for kind in (vtkSurfelEXRWriter, vtkDeepEXRWriter):
            renderer, writer = vtkSurfelImageRenderer(), kind()
            self.note_errors(renderer)  # there is no camera
            writer.SetInputConnection(renderer.GetOutputPort())
            writer.SetFileName("out.exr")
            writer.Write()
            self.assertNotEqual(writer.GetErrorCode(), 0)
            self.assertEqual((len(self.errors), os.listdir(".")), (1, []))

    def test_arrays_of_another_length(self):
        """They are no channels: what lies behind them in the memory is written nowhere."""
        image = image_of(self.colors)
        image.GetPointData().AddArray(named_array("Depth", np.ones(17 * 31 - 1, np.float32)))
        lacking = self.writer(image)
        lacking.AddChannel("Depth", "Z")
        self.refuse_to_write(lacking, "no point array Depth")
        self.errors.clear()
        every = self.writer(image)
        every.AllChannelsOn()
        every.Write()
        self.assertEqual((sorted(self.read_exr("out.exr")), self.errors), (["A", "B", "G", "R"], []))
        os.remove("out.exr")
        image.GetPointData().GetScalars().SetNumberOfTuples(17 * 31 - 1)
        self.refuse_to_write(self.writer(image), "a value for each pixel")

    def test_color_channels_are_taken(self):
        writer = self.writer(image_of(self.colors))
        writer.AddChannel("Depth", "R")
        self.assertEqual(writer.GetNumberOfChannels(), 0)
        self.assertIn("other than R, G, B and A", self.errors[0])


if __name__ == "__main__":
    unittest.main()

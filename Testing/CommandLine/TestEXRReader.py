# SPDX-License-Identifier: BSD-3-Clause
"""vtkSurfelEXRReader: values, order of rows, samples, cameras, positions in space, pipeline."""

import shutil
import struct
import subprocess
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_DOUBLE
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkDataSetAttributes
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

from deepfiles import deep_image, flatten, sphere_renderer
from exrfiles import attribute, deep_file, flat_file
from surfelsplatting import vtkDeepEXRWriter, vtkSurfelEXRReader, vtkSurfelEXRWriter
from surfelsplatting.vtkarrays import named_array
from TestEXRWriter import image_of
from toolcase import ToolCase, arrays_of, places_of, sphere, write

CENTER, RADIUS = np.array([3.0, -2.0, 1.0]), 0.5


def planes_of(image):
    """{array: [height, width(, components)]}, top row first"""
    width, height, _ = image.GetDimensions()
    return {name: values.reshape(height, width, *values.shape[1:])[::-1]
            for name, values in arrays_of(image).items()}


def field(image, name):
    array = image.GetFieldData().GetArray(name)
    return None if array is None else vtk_to_numpy(array).copy()


def points_of(reader):
    points = reader.GetOutputDataObject(1)
    if points.GetNumberOfPoints() == 0:
        return np.empty((0, 3))
    return places_of(points)


class ReaderCase(ToolCase):
    def setUp(self):
        super().setUp()
        self.rng = np.random.default_rng(4)

    def plane(self, kind="f4", shape=(17, 31)):
        return self.rng.normal(0, 3, shape).astype(kind)

    def read(self, path):
        reader = self.exr_reader(path)
        reader.Update()
        self.assertEqual((reader.GetErrorCode(), self.errors), (0, []))
        return reader


class TestFlat(ReaderCase):
    def test_what_our_writer_wrote_bit_by_bit(self):
        image = image_of(np.stack([self.plane() for _ in "RGBA"], axis=-1))
        for name in ("Depth", "other"):
            image.GetPointData().AddArray(named_array(name, self.plane().ravel()))
        image.GetPointData().GetScalars().SetName("Color")
        writer = self.exr_writer(vtkSurfelEXRWriter, image)
        writer.AddChannel("Depth", "Z")
        writer.AddChannel("other", "other")
        writer.Write()
        read = self.read("out.exr").GetOutput()
        self.assertEqual(read.GetDimensions(), (31, 17, 1))
        self.assertEqual(read.GetPointData().GetScalars().GetName(), "Color")
        written, back = planes_of(image), planes_of(read)
        self.assertEqual(set(back), {"Color", "Depth", "other"})
        for name, plane in written.items():
            np.testing.assert_array_equal(back[name], plane)
            self.assertEqual(back[name].dtype, np.float32)

    def test_any_type_window_and_order_of_rows(self):
        planes = {"R": self.plane("f2"), "G": self.plane("f2"), "B": self.plane("f4"),
                  "id": np.arange(17 * 31, dtype="u4").reshape(17, 31)}
        for corner in ((0, 0), (-7, 1000), (12, -40)):
            for order in (0, 1):
                flat_file("other.exr", planes, corner, order)
                back = planes_of(self.read("other.exr").GetOutput())
                self.assertEqual(set(back), {"Color", "id"})
                np.testing.assert_array_equal(
                    back["Color"], np.stack([planes[c] for c in "RGB"], -1).astype("f4"))
                np.testing.assert_array_equal(back["id"], planes["id"])

    def test_names(self):
        names = ["Z", "N.X", "N.Y", "N.Z", "CoC", "coverage", "fragments", "level", "P.X", "P.Y",
                 "left.R", "A", "Depth"]
        planes = {name: self.plane() for name in names}
        flat_file("names.exr", planes)
        image = self.read("names.exr").GetOutput()
        self.assertIsNone(image.GetPointData().GetScalars())
        back = planes_of(image)
        expected = {"Depth": "Z", "CircleOfConfusion": "CoC", "Coverage": "coverage",
                    "Level": "level", "Fragments": "fragments", "P.X": "P.X", "P.Y": "P.Y",
                    "left.R": "left.R", "A": "A", "Depth_": "Depth"}
        self.assertEqual(set(back), {*expected, "Normal"})
        for array, channel in expected.items():
            np.testing.assert_array_equal(back[array], planes[channel])
        np.testing.assert_array_equal(back["Normal"],
                                      np.stack([planes["N." + c] for c in "XYZ"], -1))

    def test_tiles(self):
        tool = shutil.which("exrmaketiled")
        if not tool:
            self.skipTest("exrmaketiled of the package openexr is not installed")
        planes = {c: self.plane("f2") for c in "RGBA"}
        flat_file("rows.exr", planes, (5, -3))
        for words in ([], ["-m"], ["-r", "-z", "piz"]):
            subprocess.run([tool, *words, "-t", "8", "4", "rows.exr", "tiles.exr"], check=True,
                           capture_output=True)
            back = planes_of(self.read("tiles.exr").GetOutput())["Color"]
            np.testing.assert_array_equal(
                back, np.stack([planes[c] for c in "RGBA"], -1).astype("f4"))

    def test_points_of_pixels_with_a_depth(self):
        depth = np.array([[0.0, 2.0, np.inf], [-1.0, np.nan, 4.0]], "f4")
        planes = {c: self.plane(shape=(2, 3)) for c in "RGB"}
        flat_file("depth.exr", {**planes, "Z": depth})
        reader = self.read("depth.exr")
        # Rows count from below.
        np.testing.assert_array_equal(points_of(reader), [[2.5, 0.5, 4.0], [1.5, 1.5, 2.0]])
        points = reader.GetOutputDataObject(1)
        self.assertEqual(points.GetPoints().GetDataType(), VTK_DOUBLE)
        self.assertEqual(points.GetNumberOfVerts(), 2)
        arrays = arrays_of(points)
        np.testing.assert_array_equal(arrays["Depth"], [4.0, 2.0])
        np.testing.assert_array_equal(
            arrays["Color"], [[planes[c][1, 2] for c in "RGB"], [planes[c][0, 1] for c in "RGB"]])
        flat_file("flat.exr", planes)
        self.assertEqual(self.read("flat.exr").GetOutputDataObject(1).GetNumberOfPoints(), 0)


class TestDeep(ReaderCase):
    def test_what_our_writer_wrote_bit_by_bit(self):
        counts = self.rng.integers(0, 4, (6, 5))
        samples = self.rng.uniform(0.1, 0.9, (counts.sum(), 5)).astype("f4")
        samples[:, 4] = np.arange(len(samples)) + 0.1
        self.exr_writer(vtkDeepEXRWriter, deep_image(counts, samples)).Write()
        reader = self.read("out.exr")
        np.testing.assert_array_equal(planes_of(reader.GetOutput())["SampleCount"], counts)
        np.testing.assert_array_equal(field(reader.GetOutput(), "DeepSamples"), samples)
        # One vertex per sample, from the lowest row up.
        y, x = np.divmod(np.repeat(np.arange(30), counts[::-1].ravel()), 5)
        np.testing.assert_array_equal(points_of(reader),
                                      np.column_stack([x + 0.5, y + 0.5, samples[:, 4]]))
        arrays = arrays_of(reader.GetOutputDataObject(1))
        np.testing.assert_array_equal(arrays["Color"], samples[:, :4])
        np.testing.assert_array_equal(arrays["Depth"], samples[:, 4])

    def test_what_others_may_write(self):
        counts = self.rng.integers(0, 5, (6, 5))
        samples = {c: self.rng.uniform(0, 1, counts.sum()).astype("f2") for c in "RGBA"}
        samples["Z"] = self.rng.uniform(1, 9, counts.sum()).astype("f4")  # in no order
        samples["ZBack"] = samples["Z"] + np.float32(1)
        pixel = np.repeat(np.arange(30), counts.ravel())
        order = np.lexsort([samples["Z"], pixel])
        ordered = {c: samples[c][order].astype("f4") for c in (*"RGBAZ", "ZBack")}
        for corner, direction in (((0, 0), 0), ((-9, 70), 1)):
            deep_file("deep.exr", counts, samples, corner, direction)
            reader = self.read("deep.exr")
            planes = planes_of(reader.GetOutput())
            np.testing.assert_array_equal(planes["SampleCount"], counts)
            np.testing.assert_allclose(planes["Color"], flatten(counts, ordered), atol=1e-6)
            solid = planes["Color"][..., 3] >= 0.5
            np.testing.assert_array_equal(planes["Depth"] > 0, solid)
            self.assertTrue(0 < solid.sum() < solid.size)
            back = field(reader.GetOutput(), "DeepSamples")
            self.assertEqual(sorted(map(tuple, back)),
                             sorted(zip(*(values.tolist() for values in ordered.values()))))
            # Their points are in the middle.
            depths = arrays_of(reader.GetOutputDataObject(1))["Depth"]
            np.testing.assert_allclose(np.sort(depths), np.sort(ordered["Z"] + 0.5), atol=1e-6)

    def test_nothing_to_see(self):
        self.exr_writer(vtkDeepEXRWriter, deep_image(np.zeros((3, 4)), np.zeros((0, 5)))).Write()
        reader = self.read("out.exr")
        self.assertEqual(reader.GetOutput().GetDimensions(), (4, 3, 1))
        self.assertFalse(planes_of(reader.GetOutput())["Color"].any())
        self.assertEqual(len(points_of(reader)), 0)

    def test_samples_without_a_depth_make_no_points(self):
        counts = np.array([[3, 1]])
        samples = {c: np.full(4, 0.25, "f4") for c in "RGBA"}
        samples["Z"] = np.array([np.nan, 2, 1, np.inf], "f4")
        deep_file("deep.exr", counts, samples)
        reader = self.read("deep.exr")
        np.testing.assert_array_equal(points_of(reader)[:, 2], [1, 2])
        np.testing.assert_array_equal(field(reader.GetOutput(), "DeepSamples")[:, 4],
                                      [1, 2, np.nan, np.inf])


class TestCamera(ReaderCase):
    def renderer(self, origin=(0, 0, 0)):
        """A sphere that is seen from aside, not in the middle of the picture, through a pinhole."""
        renderer = sphere_renderer(sphere(8000, RADIUS)[0] + CENTER + origin)
        camera = renderer.GetCamera()
        camera.SetPosition(*np.array([7.0, 1.0, 4.0]) + origin)
        camera.SetFocalPoint(*CENTER + origin)
        camera.SetViewUp(0.2, 1.0, 0.1)
        camera.SetViewAngle(20)
        camera.SetWindowCenter(0.2, -0.1)
        renderer.SetSize(160, 120)
        renderer.GetSplatter().SetLensModeToPinhole()
        renderer.GetSplatter().SetLensCells(1)
        return renderer

    def written(self, renderer, deep):
        writer = vtkDeepEXRWriter() if deep else vtkSurfelEXRWriter()
        writer.SetInputConnection(renderer.GetOutputPort())
        if not deep:
            writer.AddChannel("Depth", "Z")
        writer.SetFileName("out.exr")
        writer.Write()
        return self.read("out.exr")

    def test_camera_comes_back(self):
        renderer = self.renderer()
        renderer.GetSplatter().SetLensModeToCamera()
        for deep in (False, True):
            read = self.written(renderer, deep).GetOutput()
            for name, size in (("CameraLens", 3), ("ScreenWindow", 3)):
                expected = field(renderer.GetOutput(), name)
                self.assertEqual(expected.size, size)
                np.testing.assert_allclose(field(read, name), expected, rtol=1e-6, atol=1e-8)
            np.testing.assert_array_equal(field(read, "WorldToCamera"),
                                          field(renderer.GetOutput(), "WorldToCamera"))

    def test_deep_picture_comes_back(self):
        renderer = self.renderer()
        reader = self.written(renderer, deep=True)
        for name in ("Color", "Depth"):
            np.testing.assert_allclose(planes_of(reader.GetOutput())[name],
                                       planes_of(renderer.GetOutput())[name], atol=1.0 / 255.0)
        np.testing.assert_array_equal(field(reader.GetOutput(), "DeepSamples"),
                                      field(renderer.GetOutput(), "DeepSamples"))

    def test_points_lie_on_the_sphere(self):
        spacing = RADIUS * np.sqrt(4 * np.pi / 8000)
        for origin in ((0, 0, 0), (691000.0, 5334000.0, 512.0)):
            renderer = self.renderer(origin)
            for deep in (False, True):
                reader = self.written(renderer, deep)
                focal_length = field(reader.GetOutput(), "CameraLens").ravel()[0]
                arrays = arrays_of(reader.GetOutputDataObject(1))
                self.assertGreater(len(arrays["Depth"]), 2000)
                pixel = arrays["Depth"] / focal_length
                off = np.abs(np.linalg.norm(points_of(reader) - CENTER - origin, axis=1) - RADIUS)
                # At the rim a surfel reaches beyond the sphere, by its kernel and the prefilter's.
                self.assertLess((off - 3 * (spacing + pixel)).max(), 0.0)
                solid = arrays["Color"][:, 3] > 0.5
                self.assertLess((off - spacing - pixel)[solid].max(), 0.0)
                self.assertLess(np.median(off), 0.1 * spacing)

    def test_parallel_projection_has_no_window(self):
        renderer = self.renderer()
        renderer.GetCamera().ParallelProjectionOn()
        reader = self.written(renderer, deep=True)
        self.assertIsNone(field(renderer.GetOutput(), "ScreenWindow"))
        self.assertIsNone(field(reader.GetOutput(), "ScreenWindow"))
        self.assertTrue((points_of(reader)[:, :2] % 1.0 == 0.5).all())

    def test_window_of_width_one(self):
        image = image_of(self.plane(shape=(4, 8, 3)))
        for name, values in (("ScreenWindow", (0, 0, 1)), ("CameraLens", (16, 0.5, 3))):
            image.GetFieldData().AddArray(named_array(name, [values], float))
        self.exr_writer(vtkSurfelEXRWriter, image).Write()
        read = self.read("out.exr").GetOutput()
        np.testing.assert_allclose(field(read, "ScreenWindow")[0], (0, 0, 1), rtol=2e-7)
        np.testing.assert_allclose(field(read, "CameraLens")[0], (16, 0.5, 3))
        tool = shutil.which("exrheader")
        if tool:
            said = subprocess.run([tool, "out.exr"], capture_output=True, text=True, check=True)
            self.assertIn("pixelAspectRatio (type float): 2\n", said.stdout)

    def test_cropped_file_with_wide_pixels(self):
        """The upper right quarter of a display window of 8 x 4 pixels, 2 : 1."""
        depth = np.array([[10.0, 20.0], [30.0, 40.0]], "f4")
        # A camera at (1, 2, 3): right-handed along -z and, as OpenEXR has it, left-handed along +z.
        for forward in (-1.0, 1.0):
            matrix = np.diag([1.0, 1.0, -forward, 1.0])
            matrix[3, :3] = [-1.0, -2.0, forward * 3.0]
            words = attribute("worldToCamera", "m44f", struct.pack("<16f", *matrix.ravel()))
            flat_file("crop.exr", {"Z": depth}, (106, 200), display=(100, 200, 107, 203),
                      aspect=2.0, screen=(0.5, 0.25, 4.0), extra=[words])
            reader = self.read("crop.exr")
            # At distance 1 pixels are 0.5 x 0.25; the window's middle is at x = 104, y = 202.
            np.testing.assert_allclose(field(reader.GetOutput(), "ScreenWindow")[0],
                                       (2.0, 0.5, 1.0))
            rays = np.array([[1.75, 0.375, -1], [2.25, 0.375, -1], [1.75, 0.625, -1],
                             [2.25, 0.625, -1]])
            np.testing.assert_allclose(points_of(reader),
                                       [1.0, 2.0, 3.0] + rays * depth[::-1].reshape(4, 1))

    def test_cameras_that_cannot_be_inverted(self):
        for values in (np.zeros(16), np.full(16, np.nan)):
            words = attribute("worldToCamera", "m44f", struct.pack("<16f", *values))
            flat_file("bad.exr", {"Z": np.full((1, 1), 5.0, "f4")}, screen=(0, 0, 2), extra=[words])
            np.testing.assert_array_equal(points_of(self.read("bad.exr")), [[0.5, 0.5, 5.0]])


class TestPipeline(ReaderCase):
    def test_information_comes_from_the_header_alone(self):
        planes = {c: self.plane(shape=(5, 7)) for c in "RGB"}
        flat_file("rgb.exr", planes)
        flat_file("rgba.exr", {**planes, "A": planes["R"]})
        flat_file("z.exr", {"Z": planes["R"]})
        deep_file("deep.exr", np.ones((5, 7), int), {c: np.ones(35, "f4") for c in "RGBAZ"})
        reader = vtkSurfelEXRReader()
        for path, components in (("rgb.exr", 3), ("rgba.exr", 4), ("z.exr", None), ("deep.exr", 4)):
            reader.SetFileName(path)
            reader.UpdateInformation()
            info = reader.GetOutputInformation(0)
            self.assertEqual(info.Get(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT()),
                             (0, 6, 0, 4, 0, 0))
            scalars = vtkDataObject.GetActiveFieldInformation(
                info, vtkDataObject.FIELD_ASSOCIATION_POINTS, vtkDataSetAttributes.SCALARS)
            self.assertEqual(
                scalars and scalars.Get(vtkDataObject.FIELD_NUMBER_OF_COMPONENTS()), components)
            self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 0)

    def test_runs_again_for_another_file_only(self):
        flat_file("one.exr", {"Z": np.ones((2, 3), "f4")})
        flat_file("two.exr", {"Z": np.full((4, 5), 2.0, "f4")})
        reader = self.exr_reader("one.exr")
        runs = []
        reader.AddObserver("EndEvent", lambda *_: runs.append(reader.GetFileName()))
        for port in (0, 1, 0):
            reader.Update(port)
        self.assertEqual((runs, reader.GetOutput().GetDimensions()), (["one.exr"], (3, 2, 1)))
        reader.SetFileName("two.exr")
        reader.Update(1)
        self.assertEqual(runs, ["one.exr", "two.exr"])
        self.assertEqual(reader.GetOutput().GetDimensions(), (5, 4, 1))
        self.assertEqual(len(points_of(reader)), 20)
        reader.GeneratePointsOff()
        reader.Update()
        self.assertEqual((len(points_of(reader)), len(runs)), (0, 3))

    def test_progress(self):
        flat_file("one.exr", {"Z": np.ones((50, 3), "f4")})
        reader = self.exr_reader("one.exr")
        seen = []
        reader.AddObserver("ProgressEvent", lambda *_: seen.append(reader.GetProgress()))
        reader.Update()
        self.assertEqual(seen, sorted(seen))
        self.assertGreater(len(seen), 10)

    def test_can_read_goes_by_content(self):
        flat_file("picture.dat", {"Z": np.ones((2, 2), "f4")})
        write("text.exr", "no picture\n")
        found = [vtkSurfelEXRReader.CanReadFile(name)
                 for name in ("picture.dat", "text.exr", "missing.exr", ".")]
        self.assertEqual(found, [1, 0, 0, 0])


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""Deep OpenEXR files: sound by OpenEXR's own check, tidy, and composited the flat picture; half a
file is never left."""

import os
import shutil
import subprocess
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkRenderingCore import vtkActor, vtkCamera

from deepfiles import check_tidy, deep_image, flatten, through
from surfelsplatting import (vtkDeepEXRWriter, vtkPointsToSurfels, vtkSurfelImageRenderer,
                             vtkSurfelMapper, vtkVolumeSplatting)
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.transfer import make_property
from volumefiles import ball, make_image, write_image
from surfelsplatting.vtkarrays import named_array
from toolcase import CAMERA, SMALL, ToolCase, arrays_of, sphere, write_ply

FLOAT, ZIPS, NO_STATE, TIDY = 2, 2, -1, 3  # OpenEXR's numbers; -1 is DumpEXR's


def write_scene(path):
    """A sphere behind a translucent mask."""
    points, colors = sphere()
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 60), np.linspace(-0.8, 0.8, 60))
    mask = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 2.0)])
    alpha = np.concatenate([np.full(len(points), 255), np.full(len(mask), 90)])
    rgb = np.concatenate([colors, np.full((len(mask), 3), 250)])
    normals = np.concatenate([points, np.tile([0.0, 0.0, 1.0], (len(mask), 1))])
    write_ply(path, np.concatenate([points, mask]), np.column_stack([rgb, alpha]), normals)


class TestDeepEXR(ToolCase):
    def read_deep(self, path):
        """-> header's words, [height, width] counts, {channel: [n] samples}, top row first"""
        dump = subprocess.run([os.environ["DUMP_EXR"], path], capture_output=True, check=True)
        line, values = dump.stdout.split(b"\n", 1)
        width, height, compression, state, *channels = line.decode().split()
        size = int(width) * int(height)
        counts = np.frombuffer(values, np.uint32, size).reshape(int(height), int(width))
        samples = np.frombuffer(values, np.float32, -1, 4 * size).reshape(len(channels), -1)
        names = [channel.split(":")[0] for channel in channels]
        return (int(compression), int(state), channels), counts, dict(zip(names, samples))

    def test_composited_it_is_the_flat_picture(self):
        write_scene("scene.ply")
        blur = ["--circle-of-confusion", 6]
        for lens in ([], [*blur, "--lens-cells", 1], [*blur, "--lens-cells", 7]):
            words = ["scene.ply", *CAMERA, *SMALL, *lens]
            self.render(*words, "-o", "flat.exr")
            self.render(*words, "--deep", "-o", "deep.exr")
            header, counts, samples = self.read_deep("deep.exr")
            self.assertEqual(header, (ZIPS, NO_STATE, [f"{c}:{FLOAT}" for c in "ABGRZ"]))
            check_tidy(self, counts, samples)
            self.assertGreaterEqual(counts.max(), 2)
            flat = self.read_rgba("flat.exr")
            self.assertGreater((flat[..., 3] > 0.99).mean(), 0.1)
            np.testing.assert_allclose(flatten(counts, samples), flat, atol=1.0 / 255.0)
            # The mask is 4 from the camera, the sphere's front 5.
            self.assertLess(abs(samples["Z"].min() - 4.0), 0.05)

    def test_volumes_have_samples_with_an_extent(self):
        """They give the flat picture, what is put into the fog is as dim as it should be at each depth,
        and there are few of them."""
        write_image("fog.vti", make_image(np.ones((13, 13, 41))))
        depth = 3.0  # optical, of the whole fog
        view = ("--position", -100, 6, 6, "--focal-point", 20, 6, 6, "--view-up", 0, 0, 1,
                "--view-angle", 5)
        look = ("--opacity", f"0:0,1:{1 - np.exp(-depth / 40)}", "--unit-distance", 1)
        for lens in ((), ("--circle-of-confusion", 9, "--lens-cells", 1)):
            words = ("fog.vti", *view, *look, *SMALL, *lens)
            self.render(*words, "-o", "flat.exr")
            self.render(*words, "--deep", "-o", "deep.exr")
            header, counts, samples = self.read_deep("deep.exr")
            self.assertEqual(header[2], [f"{c}:{FLOAT}" for c in ("A", "B", "G", "R", "Z", "ZBack")])
            check_tidy(self, counts, samples)
            np.testing.assert_allclose(flatten(counts, samples), self.read_rgba("flat.exr"),
                                       atol=1 / 1000)
            first = counts.ravel()[:24 * 64 + 32].sum()
            pixel = {name: values[first:first + counts[24, 32]] for name, values in samples.items()}
            at = np.linspace(102, 138, 50)
            np.testing.assert_allclose(through(pixel, at), np.exp(-depth * (at - 100) / 40), atol=0.02)
            self.assertLess(counts[24, 32], 25)
        reader = self.exr_reader("deep.exr")
        reader.Update()
        picture = arrays_of(reader.GetOutput())
        self.assertAlmostEqual(picture["Depth"].reshape(48, 64)[23, 32],
                               100 + 40 / depth * np.log(2), delta=1)
        np.testing.assert_allclose(picture["Color"].reshape(48, 64, 4)[::-1],
                                   self.read_rgba("flat.exr"), atol=1 / 1000)
        writer = self.writer(reader.GetOutput(), "again.exr")
        writer.Write()
        for name, values in self.read_deep("again.exr")[2].items():
            np.testing.assert_array_equal(values, samples[name])
        # Cells of the lens would overlap.
        self.render(*words, "--lens-cells", 3, "--deep", "-o", "deep.exr")
        self.assertEqual(self.read_deep("deep.exr")[0][2], [f"{c}:{FLOAT}" for c in "ABGRZ"])

    def test_surfaces_in_volumes(self):
        """Samples with and without extent, of which none lies within another."""
        splatting, surfels = vtkVolumeSplatting(), vtkPointsToSurfels()
        splatting.SetInputData(make_image(ball(25)))
        splatting.SetVolumeProperty(make_property([(0, 0), (1, 0.3)], "gray", (0, 1), 1))
        surfels.SetInputData(polydata_of(7 * sphere(6000)[0] + 12, {}))
        renderer = vtkSurfelImageRenderer()
        for source in (splatting, surfels):
            source.Update()
            mapper, actor = vtkSurfelMapper(), vtkActor()
            mapper.SetInputData(source.GetOutput())
            actor.SetMapper(mapper)
            actor.GetProperty().SetOpacity(0.5)
            renderer.AddActor(actor)
        camera = vtkCamera()
        camera.SetPosition(12, 12, 90)
        camera.SetFocalPoint(12, 12, 12)
        renderer.SetCamera(camera)
        renderer.SetSize(48, 48)
        renderer.GetSplatter().DeepSamplesOn()
        renderer.Update()
        picture = renderer.GetOutput()
        counts = arrays_of(picture)["SampleCount"].reshape(48, 48)
        values = vtk_to_numpy(picture.GetFieldData().GetArray("DeepSamples"))
        samples = dict(zip(("R", "G", "B", "A", "Z", "ZBack"), values.T))
        check_tidy(self, counts, samples)
        self.assertTrue(0.05 < np.mean(samples["ZBack"] > samples["Z"]) < 0.95)
        np.testing.assert_allclose(flatten(counts, samples),
                                   arrays_of(picture)["Color"].reshape(48, 48, 4), atol=1 / 255)

    def test_debians_tools_read_it(self):
        tool = shutil.which("exrheader")
        if not tool:
            self.skipTest("exrheader of the package openexr is not installed")
        write_scene("scene.ply")
        self.render("scene.ply", *CAMERA, *SMALL, "--circle-of-confusion", 6, "--deep", "-o", "deep.exr")
        said = subprocess.run([tool, "deep.exr"], capture_output=True, text=True, check=True).stdout
        for words in ("deepscanline", "worldToCamera", "focus", "lensDiameter"):
            self.assertIn(words, said)
        self.assertNotIn("deepImageState", said)
        writer = self.writer(deep_image(np.ones((2, 2)), np.full((4, 5), 0.5)))
        writer.DeepImageStateOn()
        writer.Write()
        said = subprocess.run([tool, "out.exr"], capture_output=True, text=True, check=True).stdout
        self.assertIn("deepImageState", said)

    def test_tidy_is_said_when_asked(self):
        writer = self.writer(deep_image(np.ones((2, 2)), np.full((4, 5), 0.5)))
        self.assertFalse(writer.GetDeepImageState())
        writer.DeepImageStateOn()
        writer.Write()
        header, _, _ = self.read_deep("out.exr")
        self.assertEqual(header, (ZIPS, TIDY, [f"{c}:{FLOAT}" for c in "ABGRZ"]))

    def writer(self, image, path="out.exr"):
        return self.exr_writer(vtkDeepEXRWriter, image, path)

    def test_values_and_order_of_rows(self):
        counts = np.array([[0, 2, 1], [3, 0, 1]])
        samples = np.arange(1, 36, dtype=np.float32).reshape(7, 5) / 40.0
        writer = self.writer(deep_image(counts, samples))
        writer.Write()
        self.assertEqual((writer.GetErrorCode(), self.errors), (0, []))
        self.assertEqual(writer.GetNumberOfSamples(), 7)
        _, read_counts, read = self.read_deep("out.exr")
        np.testing.assert_array_equal(read_counts, counts)
        top_first = np.concatenate([samples[4:], samples[:4]])
        for c, channel in enumerate("RGBAZ"):
            np.testing.assert_array_equal(read[channel], top_first[:, c])

    def test_nothing_to_see_is_a_file_too(self):
        self.writer(deep_image(np.zeros((3, 4)), np.zeros((0, 5)))).Write()
        _, counts, samples = self.read_deep("out.exr")
        self.assertEqual((counts.shape, counts.sum(), len(samples["R"])), ((3, 4), 0, 0))

    def test_errors(self):
        flat = vtkImageData()
        flat.SetDimensions(4, 4, 1)
        self.refuse_to_write(self.writer(flat), "DeepSamplesOn")
        image = deep_image(np.ones((2, 2)), np.ones((3, 5)))
        self.refuse_to_write(self.writer(image), "SampleCount sums to 4, but DeepSamples has 3 tuples")
        image = deep_image(np.ones((1, 3)), np.ones((3, 5)))
        image.SetDimensions(2, 2, 1)
        self.refuse_to_write(self.writer(image), "SampleCount has 3 values for 4 pixels")
        image.GetPointData().AddArray(named_array("SampleCount", np.array([-2, 3, 1, 1])))
        self.refuse_to_write(self.writer(image), "SampleCount has the value -2")
        image = deep_image(np.ones((2, 2)), np.ones((4, 5)))
        self.refuse_to_write(self.writer(image, "nowhere/out.exr"), "nowhere/out.exr")
        self.refuse_to_write(self.writer(image, None), "SetFileName")

    def test_options_that_exclude_each_other(self):
        for words, says in ((["-o", "out.png"], "--deep needs an OUT.exr"),
                            (["-o", "out.exr", "--background", 1, 1, 1], "--deep and --background")):
            self.refuse("render", "scene.ply", "--deep", *words, says=says)


if __name__ == "__main__":
    unittest.main()

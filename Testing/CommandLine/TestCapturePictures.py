# SPDX-License-Identifier: BSD-3-Clause
"""Captures of 3D Gaussian splatting through the commands: views, lens, layers, colours, files."""

import os
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkRenderingCore import vtkActor, vtkCamera

import captures
from captures import (Gaussians, furry_ball, joined, of_surface, torus, write_ply, write_splat,
                      write_spz)
from surfelsplatting import (vtkSurfelEstimation, vtkSurfelHierarchyWriter, vtkSurfelImageRenderer,
                             vtkSurfelMapper)
from surfelsplatting.clouds.polydata import polydata_of
from toolcase import CAMERA, IN_MIDDLE, ToolCase, read_json, sphere

SIZE = ["--size", "120", "90"]


def round_ones(points, deviation, opacity, color):
    """Gaussians of one size and colour"""
    count = len(points)
    harmonics = np.tile((np.asarray(color) - 0.5) / captures.C0, (count, 1, 1))
    return Gaussians(points, np.full((count, 3), deviation), np.tile((1.0, 0, 0, 0), (count, 1)),
                     np.full(count, opacity), harmonics)


def ball(color=(0.8, 0.2, 0.1)):
    """Opaque Gaussians on the unit sphere"""
    points, _ = sphere(4000)
    return of_surface(points, points, np.tile(color, (4000, 1)), 0.05).of_degree(0)


class TestPictures(ToolCase):
    def picture(self, *words):
        """-> [height, width, 4] float RGBA of a run that says nothing"""
        self.render(*words, *SIZE, "-o", "out.exr")
        return self.read_rgba("out.exr")

    def test_hierarchy_files(self):
        write_ply("ball.ply", furry_ball(500))
        first = self.picture("ball.ply", "--up", "-y", "--blur", "5", "--hierarchy", "h.vtp",
                             "--surfels", "g.vtp")
        for path in ("h.vtp", "g.vtp"):
            np.testing.assert_array_equal(self.picture(path, "--up", "-y", "--blur", "5"), first,
                                          path)
        self.assertIn("h.surfels: such files hold surfels, but ball.ply holds Gaussians",
                      self.tool("render", "ball.ply", "-o", "o.png", "--hierarchy", "h.surfels"))
        self.assertEqual((self.code, os.path.exists("h.surfels"), os.path.exists("o.png")),
                         (2, False, False))
        writer = vtkSurfelHierarchyWriter()
        self.note_errors(writer)
        writer.SetFileName("h.surfels")
        writer.SetInputData(self.read_vtp("h.vtp"))
        for write in (writer.Write, lambda: writer.AddPiece(self.read_vtp("h.vtp"))):
            self.assertFalse(write())
            self.assertIn("not Gaussians in space", self.errors[-1])
        self.assertEqual([name for name in os.listdir(".") if "surfels" in name], [])

    def test_why_hardly_anything_is_seen(self):
        points = sphere(4000)[0]
        for name, count, deviation, opacity, says in (
                ("ball", 4000, 0.05, 0.9, None), ("few", 200, 0.2, 0.9, None),
                ("small", 200, 1e-3, 0.9, "are less than 0.0.* px wide, with gaps between them"),
                ("faint", 4000, 0.02, 0.01, "have an opacity below 0.01$")):
            some = points[::4000 // count]
            write_ply(name + ".ply", round_ones(some, deviation, opacity, (1.0, 1, 1)))
            said = self.tool("render", name + ".ply", "--up", "y", *SIZE, "-o", "out.png")
            self.assertEqual(self.code, 0)
            if says:
                self.assertRegex(said, "warning: hardly anything .* half of its Gaussians " + says)
            else:
                self.assertEqual(said, "", name)
        # Neither of what is far away.
        self.assertEqual(self.tool("render", "ball.ply", "--up", "y", "--zoom", "0.05", *SIZE, "-o",
                                   "out.png"), "")

    def test_level_of_detail(self):
        """Small things need few splats, and come no farther from a picture of 8 times the size."""
        write_ply("torus.ply", torus(4000))
        far = ("render", "torus.ply", "--zoom", "0.1", "--up", "z", "--view", "front", "--azimuth", "30",
               "--elevation", "22", "-o", "out.exr", "--size")
        pictures = []
        for words in ((960, 720, "--no-lod"), (120, 90, "--no-lod"),
                      (120, 90, "--stats", "s.json")):
            self.assertEqual(self.tool(*far, *words), "")
            pictures.append(self.read_rgba("out.exr"))
        self.assertLess(read_json("s.json")["splats"], 1000)
        truth = pictures[0].reshape(90, 8, 120, 8, 4).mean(axis=(1, 3))
        without, with_levels = (np.sqrt(np.mean((p - truth) ** 2)) for p in pictures[1:])
        self.assertLess(with_levels, 1.02 * without)  # rounding of nodes

    def test_spz_file(self):
        """It looks as the .ply file from which it was converted, harmonics included."""
        gaussians = furry_ball(2000)
        write_ply("ball.ply", gaussians)
        plain = self.picture("ball.ply", "--up", "-y", "--blur", "5")
        for version, most in ((2, 0.008), (3, 0.004)):
            write_spz("ball.spz", gaussians, version)
            seen = self.picture("ball.spz", "--up", "-y", "--blur", "5")
            self.assertLess(np.sqrt(np.mean((seen - plain) ** 2)), most)

    def test_filter(self):
        """From afar, --capture-filter antialiased comes much nearer to a picture of 8 times the size,
        since small Gaussians do not grow."""
        write_ply("ball.ply", furry_ball(4000))
        pictures = []
        for words in ((320, 240), (40, 30), (40, 30, "--capture-filter", "antialiased")):
            self.assertEqual(self.tool("render", "ball.ply", "-o", "out.exr", "--size", *words), "")
            pictures.append(self.read_rgba("out.exr"))
        truth = pictures[0].reshape(30, 8, 40, 8, 4).mean(axis=(1, 3))
        classic, antialiased = (np.sqrt(np.mean((p - truth) ** 2)) for p in pictures[1:])
        self.assertLess(antialiased, 0.5 * classic)

    def test_focus_pixel_and_blur(self):
        write_ply("ball.ply", ball())
        camera = ("ball.ply", *CAMERA)
        sharp = self.picture(*camera)
        self.assertEqual(self.tool("render", *camera, *SIZE, "--focus-pixel", "60", "45", "--blur",
                                   "8", "--save-camera", "c.json", "-o", "out.exr"), "")
        focus = read_json("c.json")["focusPoint"]
        np.testing.assert_allclose(focus, (0, 0, 1), atol=0.05)  # one standard deviation
        blurred = self.read_rgba("out.exr")
        np.testing.assert_allclose(blurred[45, 60], sharp[45, 60], atol=0.02)
        # What was the edge is blurred: more pixels are neither empty nor opaque.
        soft = [np.mean((p[..., 3] > 0.1) & (p[..., 3] < 0.9)) for p in (sharp, blurred)]
        self.assertGreater(soft[1], 2 * soft[0])
        # Cells of the lens agree with one picture of it to some levels of 8 bits.
        cells = self.picture("ball.ply", "--camera", "c.json", "--lens-cells", "7")
        self.assertLess(np.abs(cells - blurred).mean(), 4 / 255)
        self.assertIn("nothing is seen at the pixel 1 1",
                      self.tool("render", *camera, *SIZE, "--focus-pixel", "1", "1", "--blur", "3",
                                "-o", "out.png"))

    def test_scalars(self):
        """They win over the harmonics."""
        gaussians = ball()
        gaussians.opacities[:] = np.where(gaussians.positions[:, 0] > 0, 0.99, 0.9)
        write_ply("ball.ply", gaussians)
        seen = self.picture("ball.ply", *CAMERA, "--scalars", "GaussianOpacity", "--colormap", "gray")
        self.assertLess(seen[45, 45, :3].max(), 0.02)
        self.assertGreater(seen[45, 75, :3].min(), 0.98)

    def test_linear_light(self):
        """Harmonics stay as they are stored; colours of .splat files become light."""
        write_ply("ball.ply", ball())
        write_splat("ball.splat", ball())
        plain = self.picture("ball.ply", *CAMERA)
        said = self.tool("render", "ball.ply", *CAMERA, *SIZE, "--linear-light", "-o", "out.exr")
        self.assertIn("--linear-light has no effect on ball.ply", said)
        np.testing.assert_array_equal(self.read_rgba("out.exr"), plain)
        light = self.picture("ball.splat", *CAMERA, "--linear-light")
        code = np.round(255 * plain[45, 60, 0]) / 255
        self.assertAlmostEqual(light[45, 60, 0], ((code + 0.055) / 1.055) ** 2.4, delta=0.02)

    def test_normals_are_zero(self):
        write_ply("ball.ply", ball())
        said = self.tool("render", "ball.ply", *CAMERA, *SIZE, "--channels", "all", "-o", "out.exr")
        self.assertIn("the channel normal is 0 on ball.ply", said)
        planes = self.read_exr("out.exr")
        for name in ("N.X", "N.Y", "N.Z"):
            self.assertEqual(np.abs(planes[name]).max(), 0)
        self.assertAlmostEqual(planes["coverage"][45, 60], 1.0, delta=0.01)

    def test_default_view_without_stray_gaussians(self):
        """A sky around the scene and stray ones in between: the view is nearly that of the scene."""
        rng = np.random.default_rng(3)
        directions = rng.normal(size=(600, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        scene = torus(8000).of_degree(0)
        strays = joined(round_ones(50 * directions, 4.0, 0.9, (0.4, 0.6, 0.9)),
                        round_ones(rng.normal(0, 8, (200, 3)), 1.0, 0.1, (0.5, 0.5, 0.5)))
        distances = []
        for gaussians in (scene, joined(scene, strays)):
            write_ply("scene.ply", gaussians)
            self.tool("render", "scene.ply", *SIZE, "--save-camera", "c.json", "-o", "out.png")
            view = read_json("c.json")
            self.assertLess(np.linalg.norm(view["focalPoint"]), 1.0)
            distances.append(np.linalg.norm(view["position"]))
        self.assertLess(distances[1], 4 * distances[0])  # not 50 away

    def test_film(self):
        write_ply("ball.ply", ball())
        said = self.tool("film", "ball.ply", *SIZE, "--frames", "2", "--blur", "4", "-o", "film")
        self.assertRegex(said, rf"\A{IN_MIDDLE.pattern}\Z")
        for name in ("0000.png", "0001.png"):
            self.assertGreater(self.read_png(os.path.join("film", name))[45, 60, 0], 180)


class TestScenes(ToolCase):
    """Captures and scans in one picture."""

    def render(self, *clouds, deep=False):
        renderer = vtkSurfelImageRenderer()
        for data in clouds:
            mapper, actor = vtkSurfelMapper(), vtkActor()
            mapper.SetInputData(data)
            actor.SetMapper(mapper)
            actor.GetProperty().LightingOff()
            renderer.AddActor(actor)
        camera = vtkCamera()
        camera.SetPosition(0, 0, 6)
        camera.SetFocalDistance(6)
        camera.SetFocalDisk(0.3)
        renderer.SetCamera(camera)
        renderer.SetSize(80, 80)
        renderer.GetSplatter().SetDeepSamples(deep)
        self.note_errors(renderer)
        renderer.Update()
        self.assertEqual(self.errors, [])
        return renderer.GetOutput()

    def clouds(self):
        """A red capture and a green scan: crossing balls at x = -0.4 and 0.4."""
        from surfelsplatting import vtkGaussianSplatReader
        left = ball()
        left.positions -= (0.4, 0, 0)
        write_ply("left.ply", left)
        reader, estimation = vtkGaussianSplatReader(), vtkSurfelEstimation()
        reader.SetFileName("left.ply")
        reader.Update()
        points, _ = sphere(4000)
        colors = np.tile(np.uint8((30, 220, 30)), (4000, 1))
        estimation.SetInputData(polydata_of(points + (0.4, 0, 0), {"RGB": colors,
                                                                  "Normals": points}))
        estimation.Update()
        return reader.GetOutput(), estimation.GetOutput()

    def test_order(self):
        seen = vtk_to_numpy(self.render(*self.clouds()).GetPointData().GetArray("Color"))
        row = seen.reshape(80, 80, 4)[40]
        # Both spheres are equally near in the middle, which is where the front one changes.
        self.assertTrue((row[24:37, 0] > 0.7).all() and (row[24:37, 1] < 0.3).all(), row)
        self.assertTrue((row[43:56, 1] > 0.7).all() and (row[43:56, 0] < 0.3).all(), row)
        self.assertGreater(row[22:58, 3].min(), 0.97)

    def test_deep_samples(self):
        """Sorted, and composited they are the picture to 1/1000 (DataContract.md)."""
        picture = self.render(*self.clouds(), deep=True)
        data = picture.GetPointData()
        counts = vtk_to_numpy(data.GetArray("SampleCount"))
        samples = vtk_to_numpy(picture.GetFieldData().GetArray("DeepSamples"))
        ends = np.cumsum(counts)
        composited = np.zeros((80 * 80, 4))
        for pixel in np.nonzero(counts)[0]:
            mine = samples[ends[pixel] - counts[pixel]:ends[pixel]]
            self.assertTrue((np.diff(mine[:, 4]) > 0).all())
            through = np.concatenate([[1.0], np.cumprod(1 - mine[:-1, 3])])
            composited[pixel] = through @ mine[:, :4]
        np.testing.assert_allclose(composited, vtk_to_numpy(data.GetArray("Color")), atol=1e-3)
        self.assertGreater(counts.max(), 5)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""What is in focus, and that a camera file gives the same picture again."""

import math
import os
import subprocess
import tempfile
import unittest
from dataclasses import replace

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.commandline.outputs import write_view
from surfelsplatting.problems import UserProblem
from surfelsplatting.surfels import make_surfels
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.views.cameras import View, asked_view, read_view
from surfelsplatting.views.focus import point_at_pixel
from surfelsplatting.views.vtkcamera import make_camera, set_lens
from surfelsplatting.vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelMapper
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from vtkmodules.vtkRenderingCore import vtkActor
from toolcase import CAMERA, SMALL, TOOL, ToolCase, content_of, sphere, write_ply

UTM = np.array([691608.125, 5334780.375, 512.5])
VIEW = View(tuple(UTM + (0, 0, 6)), tuple(UTM), (0.0, 1.0, 0.0), 30.0, (160, 120))


def renderer_of(view):
    mapper = vtkSurfelMapper()
    mapper.SetInputData(make_surfels(polydata_of(sphere(8000)[0] + UTM, {})))
    actor = vtkActor()
    actor.SetMapper(mapper)
    renderer = vtkSurfelImageRenderer()
    renderer.AddActor(actor)
    show(renderer, view)
    return renderer


def show(renderer, view):
    renderer.SetCamera(make_camera(view))
    set_lens(renderer.GetSplatter(), view)
    renderer.SetSize(*view.size)


def picture_of(renderer):
    renderer.Update()
    return vtk_to_numpy(renderer.GetOutput().GetPointData().GetScalars()).copy()


def distance_in_focus(renderer):
    renderer.Update()
    lens = renderer.GetOutput().GetFieldData().GetArray("CameraLens")
    return lens.GetComponent(0, 2)


class TestPointAtPixel(ToolCase):
    @classmethod
    def setUpClass(cls):
        cls.renderer = renderer_of(VIEW)

    def point_at(self, *pixel):
        return np.array(point_at_pixel(self.renderer, pixel)) - UTM

    def test_point_is_on_the_surface_at_the_pixel(self):
        for pixel in ((80, 60), (60, 30), (100, 85), (45, 60)):
            point = self.point_at(*pixel)
            self.assertAlmostEqual(np.linalg.norm(point), 1, delta=0.02)
            self.assertGreater(point[2], 0)
            # The middle of the picture is at 80 60; rows go down.
            px = 2 * np.tan(np.radians(15)) / 120
            expected = [(pixel[0] + 0.5 - 80) * px, (60 - pixel[1] - 0.5) * px]
            np.testing.assert_allclose(point[:2] / (6 - point[2]), expected, atol=1e-9)

    def test_lens_does_not_matter_and_stays(self):
        sharp = self.point_at(50, 50)
        splatter = self.renderer.GetSplatter()
        blurred = replace(VIEW, circle_of_confusion=40.0)
        show(self.renderer, blurred)
        splatter.SetLensCells(3)
        before = picture_of(self.renderer)
        np.testing.assert_array_equal(self.point_at(50, 50), sharp)
        self.assertEqual((splatter.GetLensCells(), splatter.GetLensMode()),
                         (3, splatter.LENS_CIRCLE_OF_CONFUSION))
        np.testing.assert_array_equal(picture_of(self.renderer), before)
        splatter.SetLensCells(1)
        show(self.renderer, VIEW)

    def test_point_comes_into_focus(self):
        point = point_at_pixel(self.renderer, (60, 30))
        view = replace(VIEW, circle_of_confusion=20.0, focus_point=point)
        show(self.renderer, view)
        depth = VIEW.position[2] - point[2]
        self.assertAlmostEqual(distance_in_focus(self.renderer), depth, delta=1e-9)
        show(self.renderer, VIEW)

    def test_pixels_that_see_nothing(self):
        with self.assertRaisesRegex(UserProblem, r"pixel 3 60.* nearest .* is (\d+) (60|59)$"):
            self.point_at(3, 60)
        with self.assertRaisesRegex(UserProblem, "no pixel 160 60 in a picture of 160 x 120"):
            self.point_at(160, 60)
        with self.assertRaisesRegex(UserProblem, "no pixel -1 0"):
            self.point_at(-1, 0)
        away = replace(VIEW, focal_point=tuple(UTM + (0, 0, 12)))
        show(self.renderer, away)
        with self.assertRaisesRegex(UserProblem, "sees nothing of the cloud"):
            self.point_at(80, 60)
        show(self.renderer, VIEW)


class TestDefault(ToolCase):
    def test_what_is_hidden_does_not_count(self):
        """A sparse panel before a dense wall: in focus is what is seen."""
        rng = np.random.default_rng(1)
        panel, wall = (np.column_stack([*rng.uniform(-1, 1, (2, count)), np.full(count, z)])
                       for count, z in ((4000, 1.0), (60_000, -1.0)))
        write_ply("panel.ply", np.vstack([panel, wall]))
        for command in ("render panel.ply -o out.png", "render panel.ply --blur 5 -o out.exr"):
            said = self.tool(*command.split(), *SMALL, "--position", 0, 0, 9, "--view-up", 0, 1, 0,
                             "--save-camera", "out.json")
            self.assertEqual(self.code, 0, said)
            self.assertAlmostEqual(read_view("out.json").focal_distance, 8, delta=0.1)

    def test_bulk_counts_where_the_middle_shows_little(self):
        """A trunk before the plane of its crown, which has most of what is seen; behind the trunk there
        is nothing, or a wall, which fills the middle."""
        rng = np.random.default_rng(1)
        trunk, crown, wall = (np.column_stack([rng.uniform(-w, w, n), rng.uniform(*ys, n),
                                               np.full(n, z)])
                              for w, ys, z, n in ((0.03, (-1.5, 0.5), 1.0, 2000),
                                                  (1.0, (0.5, 1.5), 0.0, 20_000),
                                                  (1.0, (-1.5, 0.5), 0.5, 20_000)))
        for name, parts, distance in (("tree", (trunk, crown), 9), ("wall", (trunk, crown, wall), 8.5)):
            write_ply(name + ".ply", np.vstack(parts))
            self.render(name + ".ply", *SMALL, "--position", 0, 0, 9, "--view-up", 0, 1, 0,
                        "--sides", "two", "--save-camera", "out.json", "-o", "out.png")
            found = read_view("out.json").focal_distance
            self.assertAlmostEqual(found, distance, delta=0.1, msg=name)


class TestCameraFile(ToolCase):
    def test_file_gives_the_same_view(self):
        for changes in ({}, {"circle_of_confusion": 12.3, "focus_point": (1 / 3, 2e-7, -5e6)},
                        {"focal_disk": 0.1 + 0.2, "focal_distance": 1 / 7},
                        {"circle_of_confusion": 0.0}):
            view = replace(VIEW, view_angle=100 / 3, view_up=(0.1, 0.7, 0.3), **changes)
            write_view(view, "camera.json")
            self.assertEqual(read_view("camera.json"), view)

    def test_file_gives_the_same_picture(self):
        renderer = renderer_of(VIEW)
        for lens in ({"circle_of_confusion": 15.0, "focus_point": tuple(UTM + (0.5, 0.5, 0.7))},
                     {"focal_disk": 0.7, "focal_distance": 5.2}, {}):
            view = replace(VIEW, **lens)
            show(renderer, view)
            before = picture_of(renderer)
            write_view(view, "camera.json")
            show(renderer, VIEW)
            show(renderer, read_view("camera.json"))
            np.testing.assert_array_equal(picture_of(renderer), before)


class TestOptions(ToolCase):
    """Focus and lens from the command line."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.cloud = os.path.join(folder.name, "ball.ply")
        points, colors = sphere(8000)
        write_ply(cls.cloud, points, colors)
        # Its hierarchy takes less time.
        cls.hierarchy = os.path.join(folder.name, "ball.vtp")
        subprocess.run([TOOL, "render", cls.cloud, "-o", os.path.join(folder.name, "out.png"),
                        "--hierarchy", cls.hierarchy], check=True)

    def camera(self, *options):
        """-> the picture with these options, and the saved camera."""
        self.render(self.hierarchy, *CAMERA, "--size", 160, 120, *options, "-o", "out.png",
                    "--save-camera", "out.json")
        return self.read_png("out.png"), read_view("out.json")

    def blur_at(self, view, depth):
        focus = math.dist(view.position, view.focus_point) if view.focus_point else (
            view.focal_distance or math.dist(view.position, view.focal_point))
        infinite = view.circle_of_confusion
        if infinite is None:
            infinite = 60 / math.tan(math.radians(15)) * view.focal_disk / 2 / focus
        return infinite * abs(1 - focus / depth)

    def test_focus_pixel(self):
        _, view = self.camera("--focus-pixel", 60, 30, "--blur", 8)
        focus = np.array(view.focus_point)
        self.assertAlmostEqual(np.linalg.norm(focus), 1, delta=0.02)
        self.assertLess(focus[0], -0.3)  # left of the middle
        self.assertGreater(focus[1], 0.3)  # above it
        # The same pixel of the same cloud, asked for in Python.
        renderer = renderer_of(replace(view, circle_of_confusion=None, focus_point=None))
        mapper = renderer.GetActors().GetLastActor().GetMapper()
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(self.hierarchy)
        reader.Update()
        mapper.SetInputData(reader.GetOutput())
        self.assertEqual(point_at_pixel(renderer, (60, 30)), view.focus_point)

    def test_middle_of_a_strip(self):
        """The picture that finds it would be wider than pictures can be."""
        self.render(self.hierarchy, "--position", 0, 0, 6, "--blur", 8, "--size", 5500, 10, "-o", "out.png",
                    "--save-camera", "out.json")
        self.assertAlmostEqual(read_view("out.json").focal_distance, 5.0, delta=0.1)

    def test_focus_point(self):
        picture, view = self.camera("--focus-point", 0.2, -0.3, 0.4, "--circle-of-confusion", 20)
        self.assertEqual(view.focus_point, (0.2, -0.3, 0.4))
        by_distance, _ = self.camera("--focal-distance", 5.6, "--circle-of-confusion", 20)
        np.testing.assert_array_equal(picture, by_distance)

    def test_blur_is_that_of_the_far_or_the_near_end(self):
        self.render(self.hierarchy, *CAMERA, "--size", 160, 120, "-o", "out.exr")
        depths = self.read_exr("out.exr")["Z"]
        near, far = np.percentile(depths[depths > 0], (1, 99))
        self.assertTrue(5 < near < 5.05 and 5.5 < far < 6)
        for options, depth in ((["--focal-distance", "5.2"], far), (["--focal-distance", "5.5"], near),
                               (["--focus-pixel", "80", "60"], far)):
            _, view = self.camera("--blur", 6, *options)
            self.assertAlmostEqual(self.blur_at(view, depth), 6, delta=1e-3)

    def test_saved_camera_gives_the_same_picture(self):
        for options in (["--blur", "8", "--focus-pixel", "60", "30"], ["--f-number", "0.05"], [],
                        ["--focal-disk", "0.7", "--azimuth", "40", "--elevation", "-25"],
                        ["--circle-of-confusion", "30", "--roll", "33", "--zoom", "1.7"]):
            picture, view = self.camera(*options)
            self.render(self.hierarchy, "--camera", "out.json", "-o", "again.png",
                        "--save-camera", "again.json")
            np.testing.assert_array_equal(self.read_png("again.png"), picture)
            self.assertEqual(read_view("again.json"), view)
        for options in (["--view", "left", "--blur", "9"], ["--up", "-z", "--elevation", "30"], []):
            self.render(self.cloud, *options, *SMALL, "-o", "out.png", "--save-camera", "out.json")
            self.render(self.cloud, "--camera", "out.json", "-o", "again.png")
            self.assertEqual(content_of("out.png"), content_of("again.png"))

    def test_larger_picture_of_a_saved_camera_looks_the_same(self):
        small, view = self.camera("--circle-of-confusion", 12, "--focal-distance", 4)
        self.render(self.hierarchy, "--camera", "out.json", "--size", 320, 240, "-o", "large.png",
                    "--save-camera", "large.json")
        self.assertEqual(read_view("large.json").circle_of_confusion, 24)
        large = self.read_png("large.png").astype(float)
        halved = large.reshape(120, 2, 160, 2, -1).mean(axis=(1, 3))
        self.assertLess(np.abs(halved - small).mean(), 1.0)

    def test_what_is_refused(self):
        self.refuse("render", "missing.ply", *SMALL, "--focus-pixel", "64", "0", "-o", "out.png",
                    says="no pixel 64 0 in a picture of 64 x 48")  # before the cloud is read
        for pixel, says in (((0, 0), "nearest one"), ((64, 0), "no pixel 64 0 in a picture of 64 x 48")):
            self.refuse("render", self.hierarchy, *CAMERA, *SMALL, "--focus-pixel", *pixel, "--blur", 5,
                        "-o", "out.png", says=says)

    def test_options_that_are_refused(self):
        for options, says in (("--focus-pixel 1.5 0", "'1.5' is not a whole number"),
                              ("--focus-point 0 0 9 --position 0 0 6 --focal-point 0 0 0",
                               "behind the camera"),
                              ("--focus-point 0 0 1 --focus-pixel 3 3", "combined"),
                              ("--blur 5 --f-number 2", "--f-number and --blur cannot be combined"),
                              ("--f-number 0", "0 is not above 0"),
                              ("--zoom -1", "-1 is not above 0"),
                              ("--view left --position 0 0 1",
                               "--view and --position cannot be combined"),
                              ("--up z --view-up 0 0 1", "--up and --view-up cannot be combined"),
                              ("--up q", "'q'"),
                              ("--view-angle 20 --focal-length 50", "cannot be combined")):
            with self.assertRaisesRegex(UserProblem, says):
                asked_view(parse_arguments(["render", "x.ply", "-o", "x.png", *options.split()]))

    def test_facts(self):
        """-v tells bounds, spacing, focus and blur."""
        said = self.tool("render", self.cloud, *CAMERA, *SMALL, "--blur", "5",
                         "--focus-pixel", "32", "24", "-o", "out.png", "-v")
        self.assertRegex(said, r"; x -0\.99\d+ to 0\.99.*, z -0\.99.*; spacing 0\.039\d")
        self.assertRegex(said, r"in focus at 5\.0\d+; seen from .*, blurred there by 0\.\d+ and 5 px\n")
        sharp = self.tool("render", self.cloud, *CAMERA, *SMALL, "-o", "out.png", "-v")
        self.assertRegex(sharp, r"in focus at 6; seen .* direction\n")  # without a lens nothing blurs

    def test_line_about_the_middle(self):
        """Who has a lens and does not say what shall be sharp learns what is, and how to move it."""
        for command, out, line in (("render", "out.png", r"in focus at 3\.\d+, {}; seen .* by [0-9.]+ and 5 px"),
                                   ("film", "pictures", "in focus: {}")):
            def run(*options):
                output = os.path.join(tempfile.mkdtemp(dir="."), out)
                frames = ["--frames", "2"] if command == "film" else []
                said = self.tool(command, self.cloud, "--view", "front", *SMALL, *frames, *options, "-o", output)
                self.assertEqual(self.code, 0, said)
                return said

            middle = r"the middle of the picture \(--focus-pixel X Y moves it\)"
            self.assertRegex(run("--blur", "5"), r"\Asurfelsplat: " + line.format(middle) + r"\n\Z")
            self.assertEqual(run(), "")
            self.assertEqual(run("--blur", "5", "--focus-pixel", "32", "24"), "")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""Camera files, what overrides them, and the view that is found where none is asked for."""

import json
import math
import os
import unittest
import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData

from surfelsplatting.clouds.polydata import named_array, polydata_of
from surfelsplatting.clouds.reading import Cloud
from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.problems import UserProblem
from surfelsplatting.views.cameras import View, Wishes, asked_view, read_view
from surfelsplatting.views.framing import Samples, complete_view
from surfelsplatting.views.sensor import keep_sensor
from surfelsplatting.surfels import make_surfels
from surfelsplatting.views.up import find_up, floor_normal
from surfelsplatting.views.vtkcamera import make_camera
from toolcase import ToolCase, sphere, write_ply

VIEW = {"name": "one", "position": [1, 2, 3], "focalPoint": [0, 0, 0], "viewUp": [0, 0, 1],
        "viewAngle": 25.0, "size": [320, 200], "focalDisk": 0.5, "focalDistance": 4}


def surfels_of(points, normals, origin=None, two_sided=False):
    surfels = vtkPolyData()
    vertices = vtkPoints()
    vertices.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float32), deep=True))
    surfels.SetPoints(vertices)
    for name, values, kind in (("SurfelAreaVector", normals, np.float32),
                               ("SurfelTwoSided", np.full(len(points), two_sided), np.uint8)):
        array = numpy_to_vtk(np.ascontiguousarray(values, kind), deep=True)
        array.SetName(name)
        surfels.GetPointData().AddArray(array)
    if origin is not None:
        array = numpy_to_vtk(np.array([origin], np.float64), deep=True)
        array.SetName("SurfelOrigin")
        surfels.GetFieldData().AddArray(array)
    return surfels


TO_Y = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # turns z to y; its transpose z to -y


def capture_of(points, faint=False):
    """Round Gaussians, opaque or faint."""
    covariance = np.tile([1e-4, 1e-4, 1e-4, 0, 0, 0], (len(points), 1))
    opacity = np.where(faint, 0.2, 0.95) * np.ones(len(points))
    capture = polydata_of(points, {})
    for name, values in (("GaussianCovariance", covariance), ("GaussianOpacity", opacity)):
        capture.GetPointData().AddArray(named_array(name, values, np.float32))
    return capture


def scene(noise=0.0):
    """[n, 3]: a ball on the ground, z is up"""
    rng = np.random.default_rng(2)
    ball = 0.6 * sphere(5000)[0] + [0.3, 0, 0.6]
    ground = np.column_stack([*rng.uniform(-2, 2, (2, 10_000)), np.zeros(10_000)])
    points = np.vstack([ball, ground])
    return points + noise * rng.normal(size=points.shape)


def on_screen(view, points):
    """Where points come to lie: [n, 2], -1 to 1 over the picture, and their depths."""
    position, target, up = (np.array(v) for v in (view.position, view.focal_point, view.view_up))
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    local = points - position
    depth = local @ forward
    tan_y = math.tan(math.radians(view.view_angle) / 2)
    tan_x = tan_y * view.size[0] / view.size[1]
    return np.column_stack([local @ right / depth / tan_x,
                            local @ np.cross(right, forward) / depth / tan_y]), depth


class TestCameras(ToolCase):
    def write(self, content):
        with open("camera.json", "w") as file:
            json.dump(content, file)

    def asked(self, *options):
        return asked_view(parse_arguments(["render", "cloud.ply", "-o", "out.png", *options]))

    def test_spellings(self):
        """Numbers as one word, choices in capitals; files may have such names."""
        for size in (["--size", "320x200"], ["--size=320X200"], ["--size", "320", "200"],
                     ["--size", "320,200"], ["--size=320 200"], ["--size", "320 × 200"]):
            arguments = parse_arguments(["render", "640x480", *size, "--view", "Top", "--up", "-Z",
                                         "-o", "5x5.png"])
            self.assertEqual(arguments.size, [320, 200])
            self.assertEqual((arguments.view, arguments.up), ("top", "-z"))
            self.assertEqual((arguments.cloud, arguments.output), ("640x480", "5x5.png"))
        view = self.asked("--focus-pixel", "140,100", "--position", "-1.5,+2,-3e-1",
                          "--focal-point=0, .5, 1.")
        self.assertEqual((view.wishes.focus_pixel, view.position, view.focal_point),
                         ((140, 100), (-1.5, 2, -0.3), (0, 0.5, 1)))
        for wrong in (["--size", "320xx200"], ["--size", "320,200,1"], ["--size", "320,2.5"],
                      ["--focus-pixel", "140"]):
            with self.assertRaisesRegex(UserProblem, wrong[0]):
                parse_arguments(["render", "scan.ply", *wrong, "-o", "a.png"])

    def test_file_of_views(self):
        self.write({"points": 3, "views": [VIEW, dict(VIEW, name="two", viewAngle=40)]})
        expected = View((1, 2, 3), (0, 0, 0), (0, 0, 1), 25.0, (320, 200), 0.5, 4.0)
        self.assertEqual(read_view("camera.json:one"), expected)
        self.assertEqual(read_view("camera.json"), expected)
        self.assertEqual(read_view("camera.json:two").view_angle, 40)

    def test_single_view(self):
        self.write(VIEW)
        self.assertEqual(read_view("camera.json").size, (320, 200))
        self.assertEqual(read_view("camera.json:one").focal_disk, 0.5)

    def test_every_option_overrides(self):
        self.write(VIEW)
        view = self.asked("--camera", "camera.json", "--position", "-1", "-2.5", "-1e-3",
                          "--focal-point", "0", "1", "0", "--view-up", "1", "0", "0",
                          "--view-angle", "50", "--size", "10", "20", "--focal-disk", "0.25",
                          "--focal-distance", "7")
        self.assertEqual(view, View((-1, -2.5, -1e-3), (0, 1, 0), (1, 0, 0), 50, (10, 20), 0.25, 7))
        self.assertEqual(self.asked("--camera", "camera.json", "--pinhole").focal_disk, 0)
        kept = self.asked("--camera", "camera.json", "--view-angle", "50")
        self.assertEqual((kept.position, kept.view_angle, kept.focal_disk), ((1, 2, 3), 50, 0.5))

    def test_default_is_sharp(self):
        view = self.asked()
        self.assertEqual((view.focal_disk, view.circle_of_confusion), (0, None))
        self.assertEqual(view.size, (800, 600))

    def test_another_side_leaves_the_lens_of_a_file(self):
        self.write(dict(VIEW, focusPoint=[0.1, 0.2, 0.3]))
        view = self.asked("--camera", "camera.json", "--view", "left", "--up", "-z")
        self.assertEqual((view.position, view.focal_point, view.focal_distance), (None, None, 0))
        self.assertEqual((view.view_up, view.focal_disk, view.focus_point, view.wishes.side),
                         ((0, 0, -1), 0.5, (0.1, 0.2, 0.3), "left"))
        self.assertIsNone(self.asked("--camera", "camera.json", "--up", "auto").view_up)

    def test_one_lens_replaces_another(self):
        self.write(VIEW)
        for options, lens in ((["--circle-of-confusion", "7"], (0, 7, None, None)),
                              (["--f-number", "2"], (0, None, 2, None)),
                              (["--blur", "5"], (0, None, None, 5)),
                              (["--focal-disk", "3"], (3, None, None, None)),
                              (["--pinhole"], (0, None, None, None)), ([], (0.5, None, None, None))):
            view = self.asked("--camera", "camera.json", *options)
            self.assertEqual((view.focal_disk, view.circle_of_confusion, view.wishes.f_number,
                              view.wishes.blur), lens)
            self.assertEqual(view.has_lens, options != ["--pinhole"])

    def test_one_focus_replaces_another(self):
        self.write(dict(VIEW, focusPoint=[0.1, 0.2, 0.3]))
        for options, focus in ((["--focal-distance", "2"], (2, None, None)),
                               (["--focus-point", "1", "0", "-1"], (0, (1, 0, -1), None)),
                               (["--focus-pixel", "4", "5"], (0, None, (4, 5))),
                               ([], (4, (0.1, 0.2, 0.3), None))):
            view = self.asked("--camera", "camera.json", *options)
            self.assertEqual((view.focal_distance, view.focus_point, view.wishes.focus_pixel), focus)

    def test_focal_length(self):
        """24 mm is the shorter side of 35 mm film: 50 mm see 27 degrees of it, 39.6 of the longer."""
        self.assertAlmostEqual(self.asked("--focal-length", "50").view_angle, 26.99, places=2)
        tall = self.asked("--focal-length", "50", "--size", "400", "600")
        self.assertAlmostEqual(tall.view_angle, 39.60, places=2)


class TestTurns(unittest.TestCase):
    """A view that is complete but for its turns, against vtkCamera."""

    START = View((3.0, -4.0, 2.0), (1.0, 0.5, 0.25), (0.0, 0.0, 2.5), 40.0, focal_distance=2.0)

    def turned(self, **wishes):
        return complete_view(replace(self.START, wishes=Wishes(**wishes)), None, vtkPolyData())

    def camera(self):
        return make_camera(self.START)

    def check(self, view, camera):
        np.testing.assert_allclose(view.position, camera.GetPosition(), atol=1e-12)
        ours = make_camera(view).GetViewTransformMatrix()
        theirs = camera.GetViewTransformMatrix()
        for row in range(4):
            for column in range(4):
                self.assertAlmostEqual(ours.GetElement(row, column),
                                       theirs.GetElement(row, column), delta=1e-12)
        self.assertEqual(view.wishes, Wishes())

    def test_azimuth_elevation_roll_are_those_of_vtk(self):
        for angle in (-200, -30, 0.1, 75):
            camera = self.camera()
            camera.Azimuth(angle)
            self.check(self.turned(azimuth=angle), camera)
            camera = self.camera()
            camera.Roll(angle)
            self.check(self.turned(roll=angle), camera)
        camera = self.camera()
        camera.Azimuth(20)
        camera.Elevation(35)
        camera.Roll(-50)
        self.check(self.turned(azimuth=20, elevation=35, roll=-50), camera)

    def test_over_the_pole(self):
        """Straight above and beyond there is a view, upside down at last."""
        level = math.degrees(math.atan2(1.75, math.hypot(2, 4.5)))
        above = self.turned(elevation=90 - level)
        np.testing.assert_allclose(np.subtract(above.position, above.focal_point)[:2], 0, atol=1e-9)
        beyond = self.turned(elevation=140 - level)
        self.assertGreater(beyond.position[2], 2)
        self.assertLess(beyond.view_up[2], 0)

    def test_zoom(self):
        for factor in (0.5, 1.0, 3.0):
            view = self.turned(zoom=factor)
            tangents = [math.tan(math.radians(v.view_angle) / 2) for v in (self.START, view)]
            self.assertAlmostEqual(tangents[0] / tangents[1], factor)
            self.assertEqual(view.position, self.START.position)
        with self.assertRaisesRegex(UserProblem, "view angle"):
            self.turned(zoom=1e9)

    def test_f_number(self):
        """A lens of 32.97 mm, which sees 40 degrees, at f/2: 16.5 mm wide, also when it zooms."""
        self.assertAlmostEqual(self.turned(f_number=2).focal_disk, 0.016485, places=6)
        self.assertAlmostEqual(self.turned(f_number=2, zoom=3).focal_disk, 3 * 0.016485, places=5)


class TestHint(ToolCase):
    def test_what_is_up_is_said_where_it_is_a_guess(self):
        write_ply("ball.ply", *sphere())
        write_ply("egg.ply", sphere()[0] * (1, 1, 1.5))
        write_ply("scene.ply", scene())
        write_ply("turned.ply", scene() * (1, -1, -1))
        for words, says in (("egg.ply", "y was taken, and --up z, -y or -z turns it"),
                            ("egg.ply --up y", ""), ("egg.ply --view-up 0 1 0", ""),
                            ("ball.ply", ""),
                            ("scene.ply", ""), ("scene.ply --azimuth 30", ""),
                            ("turned.ply", "-z was taken, and --up y, z or -y turns it")):
            for command in ("render", "film --frames 1"):
                said = self.tool(*command.split(), *words.split(), "--size", "40x30", "-o",
                                 f"{len(os.listdir())}.png" if command == "render" else
                                 f"{len(os.listdir())}")
                self.assertEqual(self.code, 0, said)
                self.assertIn(says, said)
                self.assertEqual("is not clear" in said, bool(says), words)


class TestFraming(unittest.TestCase):
    def setUp(self):
        self.cloud = SimpleNamespace(viewpoint=None, columns=0)
        points, _ = sphere(5000)
        self.points, self.normals = points * [2, 1, 1], points

    def view_of(self, points, normals, view=View(), **options):
        return complete_view(view, self.cloud, surfels_of(points, normals, **options))

    def test_cloud_fills_the_picture(self):
        for size in ((800, 600), (300, 900), (2000, 300)):
            view = self.view_of(self.points, self.normals, View(size=size))
            screen, depth = on_screen(view, self.points)
            self.assertTrue((depth > 0).all())
            self.assertLess(np.abs(screen).max(), 1.0, size)
            self.assertGreater(np.abs(screen).max(), 0.85, size)
            middle = (screen.min(axis=0) + screen.max(axis=0)) / 2
            np.testing.assert_allclose(middle, 0, atol=0.06)

    def test_view_is_a_three_quarter_view(self):
        view = self.view_of(self.points, self.normals)
        direction = np.subtract(view.position, view.focal_point)
        direction /= np.linalg.norm(direction)
        self.assertTrue((np.abs(direction) > 0.2).all(), direction)
        self.assertGreater(direction @ np.array(view.view_up), 0.2)

    def test_stray_points_do_not_shrink_the_cloud(self):
        rng = np.random.default_rng(1)
        stray = rng.uniform(-1, 1, (40, 3)) * 5000
        points = np.vstack([self.points, stray, [[np.nan] * 3]])
        normals = np.vstack([self.normals, np.ones((41, 3))])
        view = self.view_of(points, normals)
        screen, _ = on_screen(view, self.points)
        self.assertTrue(0.85 < np.abs(screen).max() < 1.0)

    def test_local_origin_counts(self):
        origin = np.array([691000.0, 5334000.0, 512.0])
        upright = View(view_up=(0.0, 1.0, 0.0))
        near = self.view_of(self.points, self.normals, upright)
        far = self.view_of(self.points, self.normals, upright, origin=origin)
        np.testing.assert_allclose(np.subtract(far.position, origin), near.position, atol=1e-6)
        self.assertEqual(self.view_of(self.points, self.normals, origin=origin).view_up, (0, 0, 1))

    def test_terrain_lies_flat(self):
        x, y = np.random.default_rng(1).uniform(-50, 50, (2, 4000))
        ground = np.column_stack([x, y, np.sin(x / 7)])
        up = np.tile([0, 0, 1.0], (4000, 1))
        for two_sided in (False, True):
            view = self.view_of(ground, up, two_sided=two_sided)
            self.assertEqual(view.view_up, (0, 0, 1))
            self.assertGreater(view.position[2], 5)
        sideways = self.view_of(ground[:, [0, 2, 1]], up[:, [0, 2, 1]])
        self.assertEqual(sideways.view_up, (0, 1, 0))

    def test_ground_tells_what_is_up(self):
        """A ball on a table, whose outside is known or not; a street between two walls."""
        rng = np.random.default_rng(1)
        x, y = rng.uniform(-2, 2, (2, 3000))
        ball, _ = sphere(5000)
        table = np.column_stack([x, y, np.full(3000, -1.0)])
        points = np.vstack([ball, table])
        normals = np.vstack([ball, np.tile([0, 0, 1.0], (3000, 1))])
        for two_sided in (False, True):
            for order, up in (([0, 1, 2], [0, 0, 1]), ([0, 2, 1], [0, 1, 0])):
                surfels = surfels_of(points[:, order], normals[:, order], two_sided=two_sided)
                np.testing.assert_array_equal(find_up(Samples(surfels)).axis, up)
        walls = np.column_stack([x, np.sign(rng.uniform(-1, 1, 3000)) * 2, y + 1])
        street = np.vstack([table, walls])
        normals = np.vstack([np.tile([0, 0, 1.0], (3000, 1)), np.tile([0, 1.0, 0], (3000, 1))])
        np.testing.assert_array_equal(
            find_up(Samples(surfels_of(street, normals, two_sided=True))).axis, [0, 0, 1])

    def test_open_bottom_tells_what_is_up(self):
        bowl = sphere(5000)[0]
        bowl = bowl[bowl[:, 2] > -0.6]
        self.check_up(surfels_of(bowl, bowl), (0, 0, 1), True)
        self.check_up(surfels_of(bowl[:, [0, 2, 1]], bowl[:, [0, 2, 1]]), (0, 1, 0), True)
        self.check_up(surfels_of(bowl * (1, 1, -1), bowl * (1, 1, -1)), (0, 0, -1), False)

    def check_up(self, surfels, axis, is_clear):
        up = find_up(Samples(surfels))
        self.assertEqual((tuple(up.axis), up.is_clear), (axis, is_clear))

    def test_upside_down(self):
        """The ground is above, as in the axes of many cameras. That is unusual, thus a guess."""
        for points, sides in ((scene(), "auto"), (scene(), "two"), (scene(0.06), "two")):
            for matrix, axis, is_clear in ((np.eye(3), (0, 0, 1), True), (TO_Y, (0, 1, 0), True),
                                           (TO_Y.T, (0, -1, 0), False),
                                           (TO_Y @ TO_Y, (0, 0, -1), False)):
                with self.subTest(f"{len(points)} {sides} {axis}"):
                    with warnings.catch_warnings():
                        warnings.simplefilter("ignore")
                        surfels = make_surfels(polydata_of(points @ matrix.T, {}), sides=sides)
                    self.check_up(surfels, axis, is_clear)

    def test_ground_may_be_a_wall(self):
        """It is behind a ball that floats before it."""
        points = scene()
        points[:5000, 2] += 1.5
        self.check_up(make_surfels(polydata_of(points, {})), (0, 0, 1), False)

    def test_nothing_tells_what_is_up(self):
        ball = sphere(5000)[0]
        self.check_up(surfels_of(ball, ball), (0, 1, 0), True)  # it does not matter
        self.check_up(surfels_of(ball * (1, 1, 2), ball), (0, 1, 0), False)
        sides = [(axis, sign) for axis in range(3) for sign in (-1, 1)]
        faces = np.random.default_rng(1).uniform(-1, 1, (6, 500, 3))
        normals = np.zeros((6, 500, 3))
        for face, normal, (axis, sign) in zip(faces, normals, sides):
            face[:, axis] = normal[:, axis] = sign
        box = faces.reshape(-1, 3) * (2, 2, 1.5)
        self.check_up(surfels_of(box, normals.reshape(-1, 3)), (0, 1, 0), False)

    def test_base_tells_what_is_up(self):
        """A closed thing stands on what is flat."""
        ball = sphere(8000)[0]
        ball = ball[ball[:, 2] > -0.6]
        x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 1250))
        base = np.column_stack([x, y, np.full(1250, -0.6)])
        points = np.vstack([ball, base])
        normals = np.vstack([ball, np.tile([0, 0, -1.0], (1250, 1))])
        self.check_up(surfels_of(points, normals), (0, 0, 1), True)
        self.check_up(surfels_of(points @ TO_Y.T, normals @ TO_Y.T), (0, 1, 0), True)
        self.check_up(surfels_of(points * (1, 1, -1), normals * (1, 1, -1)), (0, 0, 1), False)

    def test_what_is_up_in_captures(self):
        """The same, through the centres of opaque Gaussians; without a sign it is -y."""
        rng = np.random.default_rng(1)
        x, y = rng.uniform(-2, 2, (2, 4000))
        ball = sphere(6000)[0]
        scene = np.vstack([ball, np.column_stack([x, y, np.full(4000, -1.0)])])
        bowl = ball[ball[:, 2] > -0.6]
        floaters = rng.uniform(-2, 2, (300, 3))
        for points in (scene, bowl):
            for matrix, up in ((np.eye(3), (0, 0, 1)), (TO_Y, (0, 1, 0)), (TO_Y.T, (0, -1, 0)),
                               (TO_Y @ TO_Y, (0, 0, -1))):
                places = np.vstack([points @ matrix.T, floaters])
                faint = np.arange(len(places)) >= len(points)
                self.assertEqual(tuple(find_up(Samples(capture_of(places, faint))).axis), up)
        for points in (ball, rng.normal(size=(2000, 3)), np.zeros((3, 3))):
            self.assertEqual(tuple(find_up(Samples(capture_of(points))).axis), (0, -1, 0))
        # The camera of COLMAP looks along z.
        self.assertLess(complete_view(View(), Cloud(capture_of(ball)), capture_of(ball)).position[2], -1)

    def test_shell_is_seen_from_its_outside(self):
        shell = sphere(8000)[0]
        for axis, sign in ((2, -1), (0, 1), (0, -1)):
            half = shell[shell[:, axis] * sign > 0.2]
            view = self.view_of(half, half)
            self.assertGreater(view.position[axis] * sign, view.focal_point[axis] * sign)

    def test_focus_on_a_surface_is_left_to_the_picture(self):
        """focused_on_front finds it; what is asked for stays."""
        for asked in (View(), View(position=(0, 9, 0)), View(focal_point=(0, 0, 0.5))):
            self.assertEqual(self.view_of(self.points, self.normals, asked).focal_distance, 0)
        kept = self.view_of(self.points, self.normals, View(focal_distance=3.5))
        self.assertEqual(kept.focal_distance, 3.5)

    def test_what_is_given_stays(self):
        view = self.view_of(self.points, self.normals, View(position=(0, 9, 0)))
        self.assertEqual(view.position, (0, 9, 0))
        np.testing.assert_allclose(view.focal_point, 0, atol=0.05)
        self.assertGreater(np.linalg.norm(np.cross(view.view_up, (0, 1, 0))), 0.5)
        view = self.view_of(self.points, self.normals, View(focal_point=(1, 2, 3)))
        self.assertEqual(view.focal_point, (1, 2, 3))
        view = self.view_of(self.points, self.normals, View(view_up=(1, 0, 0)))
        self.assertEqual(view.view_up, (1, 0, 0))
        complete = View((1, 2, 3), (0, 0, 0), (0, 1, 0), 30.0)
        self.assertIs(self.view_of(self.points, self.normals, complete), complete)

    def test_sides(self):
        for up, front in (((0, 0, 1.0), (0, -1.0, 0)), ((0, 1.0, 0), (0, 0, 1.0)),
                          ((0, -1.0, 0), (0, 0, -1.0))):
            right = np.cross(up, front)
            for side, direction in (("front", front), ("back", np.negative(front)),
                                    ("right", right), ("left", -right), ("top", up),
                                    ("iso", (np.add(front, right) + up) / math.sqrt(3))):
                view = self.view_of(self.points, self.normals,
                                    View(view_up=up, wishes=Wishes(side=side)))
                seen_from = np.subtract(view.position, view.focal_point)
                seen_from /= np.linalg.norm(seen_from)
                np.testing.assert_allclose(seen_from, direction, atol=1e-9)
                picture_up = np.negative(front) if side == "top" else up
                np.testing.assert_allclose(view.view_up, picture_up, atol=1e-9)
                self.assertLess(np.abs(on_screen(view, self.points)[0]).max(), 1)

    def test_turned_view_is_whole(self):
        for wishes in (Wishes(azimuth=50), Wishes(elevation=60), Wishes(roll=90),
                       Wishes("left", 10, 20, 30)):
            view = self.view_of(self.points, self.normals, View(wishes=wishes, size=(900, 300)))
            screen = np.abs(on_screen(view, self.points)[0]).max()
            self.assertTrue(0.85 < screen < 1, wishes)

    def test_single_surfel(self):
        view = self.view_of(np.array([[1.0, 2, 3]]), np.array([[0, 0, 1.0]]))
        self.assertTrue(np.isfinite(view.position).all())
        self.assertGreater(np.linalg.norm(np.subtract(view.position, view.focal_point)), 0)


class TestSensors(unittest.TestCase):
    """A wall seen by a camera of 40 x 30 pixels whose axis goes through the image's middle; half of
    the image is empty, so that the mean of the rays is another direction."""

    PLACE = np.array([1.0, 2.0, 3.0])
    TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    TURN *= np.linalg.det(TURN)

    def cloud_of(self, rays, depth=4.0, columns=40):
        points = (depth * rays) @ self.TURN.T + self.PLACE
        points[:len(points) // 3] = np.nan
        points[np.arange(len(points)) % columns > 0.6 * columns] = np.nan
        surfels = surfels_of(points, self.PLACE - points)
        return SimpleNamespace(data=surfels, viewpoint=tuple(self.PLACE), columns=columns), surfels

    def setUp(self):
        x, y = np.meshgrid((np.arange(40) - 19.5) / 40, (np.arange(30) - 14.5) / 40)
        self.rays = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
        self.cloud, self.surfels = self.cloud_of(self.rays)

    def view_of(self, view=View()):
        return complete_view(view, self.cloud, self.surfels)

    def angle(self, tangent):
        return math.degrees(2 * math.atan(tangent))

    def test_place_axis_and_angle(self):
        view = self.view_of()
        self.assertEqual(view.position, tuple(self.PLACE))
        np.testing.assert_allclose(np.subtract(view.focal_point, self.PLACE), 4 * self.TURN[:, 2],
                                   atol=1e-5)
        np.testing.assert_allclose(view.view_up, -self.TURN[:, 1], atol=1e-5)
        self.assertAlmostEqual(view.view_angle, self.angle(0.375), delta=1e-4)
        for size, tangent in (((400, 400), 0.5), ((900, 300), 0.375), ((300, 900), 1.5)):
            self.assertAlmostEqual(self.view_of(View(size=size)).view_angle, self.angle(tangent),
                                   delta=1e-4)

    def test_what_is_given_stays(self):
        self.assertEqual(self.view_of(View(view_angle=20.0)).view_angle, 20)
        zoomed = self.view_of(View(wishes=Wishes(zoom=2)))
        self.assertAlmostEqual(zoomed.view_angle, self.angle(0.1875), delta=1e-4)
        target = tuple(self.PLACE + 3 * self.TURN[:, 2] + 0.5 * self.TURN[:, 0])
        aimed = self.view_of(View(focal_point=target))
        self.assertEqual((aimed.position, aimed.focal_point), (tuple(self.PLACE), target))
        turned = self.view_of(View(focal_point=target, wishes=Wishes(azimuth=90)))
        self.assertEqual(turned.focal_point, target)
        self.assertAlmostEqual(math.dist(turned.position, target), math.dist(self.PLACE, target))
        left = self.view_of(View(wishes=Wishes("left")))
        self.assertGreater(math.dist(left.position, self.PLACE), 1)
        self.assertEqual(left.view_angle, 30)

    def test_from_aside_all_is_shown(self):
        points = np.array([self.cloud.data.GetPoint(i)
                           for i in range(self.cloud.data.GetNumberOfPoints())])
        points = points[np.isfinite(points).all(axis=1)]
        for wishes in (Wishes(azimuth=60), Wishes(azimuth=-30, elevation=20), Wishes(elevation=40)):
            view = self.view_of(View(wishes=wishes))
            reach = np.abs(on_screen(view, points)[0]).max()
            self.assertTrue(0.85 < reach < 1, (wishes, reach))

    def test_floor_is_level(self):
        """A sensor that looks down by 35 degrees sees a floor, and a wall that is nearly as large."""
        down = math.radians(35)
        normal = np.array([0, -math.cos(down), -math.sin(down)])  # y is down in the image
        front = np.array([0, math.sin(down), -math.cos(down)])
        with np.errstate(divide="ignore"):
            depths = np.stack([-1.5 / (self.rays @ normal), -2.5 / (self.rays @ front)])
        depths[depths < 0] = np.inf
        depth = depths.min(axis=0)
        points = (depth[:, None] * self.rays) @ self.TURN.T + self.PLACE
        normals = np.where((depths[0] < depths[1])[:, None], normal, front)
        surfels = surfels_of(points, depth[:, None] ** 2 * normals @ self.TURN.T)
        self.cloud = SimpleNamespace(data=surfels, viewpoint=tuple(self.PLACE), columns=40)
        self.surfels = surfels
        np.testing.assert_allclose(self.view_of().view_up, -self.TURN[:, 1], atol=1e-5)
        for wishes in (Wishes("left"), Wishes(azimuth=50)):
            np.testing.assert_allclose(self.view_of(View(wishes=wishes)).view_up,
                                       self.TURN @ normal, atol=1e-5)
        wall = Samples(surfels_of(self.rays, -self.rays))
        np.testing.assert_array_equal(floor_normal(wall, np.array([0, -1.0, 0])), [0, -1, 0])

    def test_surfels_keep_it(self):
        """The surfels of a depth image have no rows, but what keep_sensor wrote."""
        view, alone = self.view_of(), SimpleNamespace(viewpoint=None, columns=0)
        self.assertNotEqual(complete_view(View(), alone, self.surfels), view)
        keep_sensor(self.cloud, self.surfels)
        self.assertEqual(complete_view(View(), alone, self.surfels), view)
        for name in ("ScanSensorPlace", "ScanSensorSpread"):  # unknown to earlier versions
            self.surfels.GetFieldData().RemoveArray(name)
        old = complete_view(View(), alone, self.surfels)
        away, before = np.array(old.position) - old.focal_point, view.position
        before = np.array(before) - view.focal_point
        self.assertGreater(away @ before / np.linalg.norm(away) / np.linalg.norm(before), 0.99)
        for name in ("ScanSensorUp", "ScanSensorPlace"):
            keep_sensor(self.cloud, self.surfels)
            self.surfels.GetFieldData().GetArray(name).Fill(math.nan)
            self.assertNotEqual(complete_view(View(), alone, self.surfels).position, view.position)

    def test_scanner_that_turns(self):
        """No picture shows what it saw; the view shows all from outside, upright."""
        around, up = np.meshgrid(np.radians(np.arange(0, 360, 9.0)), np.radians(np.arange(60, -60, -4.0)))
        rays = np.stack([np.cos(up) * np.sin(around), -np.sin(up), np.cos(up) * np.cos(around)],
                        axis=-1).reshape(-1, 3)
        self.cloud, self.surfels = self.cloud_of(rays)
        view = self.view_of()
        self.assertGreater(math.dist(view.position, self.PLACE), 4)
        self.assertEqual(view.view_angle, 30)

    def test_one_row(self):
        """Nothing tells what is up, but where the sensor was."""
        self.cloud, self.surfels = self.cloud_of(self.rays[-40:])
        ray = self.TURN @ self.rays[-22]  # in the middle of what was seen
        view = self.view_of()
        away = np.array(view.position) - view.focal_point
        self.assertLess(away @ ray / np.linalg.norm(away) / np.linalg.norm(ray), -0.99)


if __name__ == "__main__":
    unittest.main()

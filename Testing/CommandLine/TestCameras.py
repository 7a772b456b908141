# SPDX-License-Identifier: BSD-3-Clause
"""Camera files, what overrides them, and the view that is found where none is asked for."""

import json
import math
import unittest
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from vtkmodules.vtkCommonDataModel import vtkPolyData

from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.problems import UserProblem
from surfelsplatting.shapes.samples import Samples
from surfelsplatting.shapes.sensor import keep_sensor
from surfelsplatting.shapes.up import floor_normal
from surfelsplatting.views.cameras import View, Wishes, asked_view, read_view
from surfelsplatting.views.framing import complete_view
from surfelsplatting.views.vtkcamera import make_camera
from toolcase import ToolCase, sphere, write
from viewclouds import on_screen, surfels_of

VIEW = {"name": "one", "position": [1, 2, 3], "focalPoint": [0, 0, 0], "viewUp": [0, 0, 1],
        "viewAngle": 25.0, "size": [320, 200], "focalDisk": 0.5, "focalDistance": 4}


class TestCameras(ToolCase):
    def write(self, content):
        write("camera.json", json.dumps(content))

    def asked(self, *options):
        return asked_view(parse_arguments(["render", "cloud.ply", "-o", "out.png", *options]))

    def test_spellings(self):
        """Numbers as one word, choices in capitals, dashes for hyphens; files may have such names."""
        for size in (["--size", "320x200"], ["--size=320X200"], ["--size", "320", "200"],
                     ["--size", "320,200"], ["--size=320 200"], ["--size", "320 × 200"], ["--size", "320*200"],
                     ["\u2014size", "320", "200"], ["\u2013-size", "320x200"]):
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
        self.assertEqual(self.asked("--camera", "camera.json", "--blur", "0").focal_disk, 0)
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
                              (["--blur", "0"], (0, None, None, None)), ([], (0.5, None, None, None))):
            view = self.asked("--camera", "camera.json", *options)
            self.assertEqual((view.focal_disk, view.circle_of_confusion, view.wishes.f_number,
                              view.wishes.blur), lens)
            self.assertEqual(view.has_lens, options != ["--blur", "0"])

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


class TestFraming(unittest.TestCase):
    def setUp(self):
        self.cloud = SimpleNamespace(viewpoint=None, columns=0, image=None)
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
                                    ("bottom", np.negative(up)),
                                    ("iso", (np.add(front, right) + up) / math.sqrt(3))):
                view = self.view_of(self.points, self.normals,
                                    View(view_up=up, wishes=Wishes(side=side)))
                seen_from = np.subtract(view.position, view.focal_point)
                seen_from /= np.linalg.norm(seen_from)
                np.testing.assert_allclose(seen_from, direction, atol=1e-9)
                picture_up = {"top": np.negative(front), "bottom": front}.get(side, up)
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
        return SimpleNamespace(data=surfels, viewpoint=tuple(self.PLACE), columns=columns,
                               image=None), surfels

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
        self.cloud = SimpleNamespace(data=surfels, viewpoint=tuple(self.PLACE), columns=40,
                                     image=None)
        self.surfels = surfels
        np.testing.assert_allclose(self.view_of().view_up, -self.TURN[:, 1], atol=1e-5)
        for wishes in (Wishes("left"), Wishes(azimuth=50)):
            np.testing.assert_allclose(self.view_of(View(wishes=wishes)).view_up,
                                       self.TURN @ normal, atol=1e-5)
        wall = Samples(surfels_of(self.rays, -self.rays))
        np.testing.assert_array_equal(floor_normal(wall, np.array([0, -1.0, 0])), [0, -1, 0])

    def test_surfels_keep_it(self):
        """The surfels of a depth image have no rows, but what keep_sensor wrote."""
        view, alone = self.view_of(), SimpleNamespace(viewpoint=None, columns=0, image=None)
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

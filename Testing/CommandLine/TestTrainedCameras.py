# SPDX-License-Identifier: BSD-3-Clause
"""The cameras that a capture was trained with: files of them, and views that come of them."""

import json
import math
import os
import unittest

import numpy as np

from captures import torus, write_ply
from surfelsplatting.clouds.cloud import Cloud
from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.problems import UserProblem
from surfelsplatting.views.cameras import View, asked_view, read_view, read_views
from surfelsplatting.views.focus import has_focus
from surfelsplatting.views.framing import complete_view, home_in
from surfelsplatting.views.trained import cameras_file, cameras_in, pivot_of
from toolcase import ToolCase, write
from viewclouds import capture_of

PIVOT, UP = np.array([0.3, -0.2, 0.1]), np.array([0.0, -0.8, -0.6])  # as of COLMAP, tilted
SIDE = np.array([1.0, 0.0, 0.0])


def camera_at(position, target, name="", number=0):
    """An object of cameras.json"""
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, UP)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=1)
    return {"id": number, "img_name": name or f"IMG_{number:03d}", "width": 2400, "height": 1600,
            "position": position.tolist(), "rotation": rotation.tolist(), "fx": 2000.0, "fy": 2000.0}


def ring(count=12, part=1.0):
    """Cameras around the pivot, or on a part of the way, at two heights"""
    cameras = []
    for number in range(count):
        angle = 2 * math.pi * part * number / count
        level = math.cos(angle) * SIDE + math.sin(angle) * np.cross(UP, SIDE)
        place = PIVOT + 3 * level + (0.8 + number % 2) * UP
        cameras.append(camera_at(place, PIVOT, number=number))
    return cameras


def as_frame(camera):
    """The same for transforms.json"""
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(camera["rotation"]) * (1, -1, -1)
    matrix[:3, 3] = camera["position"]
    return {"file_path": f"images/{camera['img_name']}.jpg", "transform_matrix": matrix.tolist()}


class TestTrainedCameras(ToolCase):
    def write(self, content, path="cameras.json"):
        write(path, json.dumps(content))

    def cloud(self, path="capture.ply"):
        """A capture at the pivot, as if it was in this file"""
        rng = np.random.default_rng(4)
        directions = rng.normal(size=(3000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        cloud = Cloud(capture_of(PIVOT + 0.5 * directions))
        cloud.path = path
        return cloud

    def view(self, *options, cloud=None, hint=None):
        cloud = cloud or self.cloud()
        asked = asked_view(parse_arguments(["render", "a.ply", "-o", "a.png", *options]))
        return complete_view(asked, cloud, cloud.data, hint)

    def test_pivot(self):
        pivot = pivot_of(cameras_in("a", ring()))
        np.testing.assert_allclose(pivot, PIVOT, atol=1e-12)
        outward = [camera_at(PIVOT + 0.1 * d, PIVOT + d) for d in (SIDE, -SIDE, np.cross(UP, SIDE))]
        self.assertIsNone(pivot_of(cameras_in("a", outward)))
        parallel = [camera_at(PIVOT + x * SIDE, PIVOT + x * SIDE + [0, 0, 5]) for x in range(5)]
        self.assertIsNone(pivot_of(cameras_in("a", parallel)))
        self.assertIsNone(pivot_of(cameras_in("a", parallel[:1])))

    def test_photographs(self):
        """By image or number; transforms.json is the same."""
        self.write(ring())
        self.write({"w": 2400, "h": 1600, "fl_x": 2000, "frames": [as_frame(c) for c in ring()]},
                   "transforms.json")
        for text in ("cameras.json:IMG_005", "cameras.json:5", "transforms.json:IMG_005.jpg",
                     "transforms.json:IMG_005", "transforms.json:images/IMG_005.jpg"):
            view, camera = read_view(text), ring()[5]
            np.testing.assert_allclose(view.position, camera["position"], atol=1e-12)
            np.testing.assert_allclose(view.focal_point, PIVOT, atol=1e-12)
            np.testing.assert_allclose(view.view_up, -np.array(camera["rotation"])[:, 1], atol=1e-12)
            self.assertAlmostEqual(view.view_angle, 2 * math.degrees(math.atan(0.4)))
            self.assertEqual(view.size, (1600, 1067))
            self.assertFalse(has_focus(view))
        self.assertEqual(read_view("cameras.json"), read_view("cameras.json:0"))
        self.assertEqual(len(read_views("cameras.json")), 12)
        view = self.view("--camera", "cameras.json:5", "--size", "300", "200", "--roll", "10")
        np.testing.assert_allclose(view.position, ring()[5]["position"])
        self.assertEqual(view.size, (300, 200))
        frame = dict(as_frame(ring()[0]), camera_angle_x=1.0)
        self.write({"frames": [frame]}, "transforms.json")
        self.assertAlmostEqual(read_view("transforms.json").view_angle, math.degrees(1.0))

    def test_where_files_are(self):
        """Beside the capture, or in the folder of the model."""
        os.makedirs("model/point_cloud/iteration_7000")
        os.makedirs("model/scans")
        deep = "model/point_cloud/iteration_7000/point_cloud.ply"
        self.assertIsNone(cameras_file(deep))
        self.write(ring(), "model/cameras.json")
        self.assertEqual(cameras_file(deep), os.path.abspath("model/cameras.json"))
        self.assertEqual(cameras_file("model/a.ply"), os.path.abspath("model/cameras.json"))
        self.assertIsNone(cameras_file("model/scans/a.ply"))
        self.write(ring(), "model/point_cloud/iteration_7000/transforms.json")
        self.assertTrue(cameras_file(deep).endswith("transforms.json"))

    def test_default_view(self):
        """From one of the cameras at what all look at; upright; within its image."""
        outside = self.view()
        self.write(ring())
        view = self.view()
        places = np.array([camera["position"] for camera in ring()])
        self.assertLess(np.linalg.norm(places - view.position, axis=1).min(), 1e-9)
        np.testing.assert_allclose(view.focal_point, PIVOT, atol=1e-9)
        self.assertGreater(np.dot(view.view_up, UP), 0.999)
        self.assertAlmostEqual(math.tan(math.radians(view.view_angle / 2)), 0.4)
        wide = self.view("--size", "800", "200")
        self.assertAlmostEqual(math.tan(math.radians(wide.view_angle / 2)), 0.6 / 4)
        self.assertNotEqual(view.position, outside.position)
        top = self.view("--view", "top")
        np.testing.assert_allclose(np.subtract(top.position, PIVOT) @ UP,
                                   np.linalg.norm(np.subtract(top.position, PIVOT)))
        turned = self.view("--azimuth", "30")
        self.assertAlmostEqual(*(np.linalg.norm(np.subtract(v.position, PIVOT))
                                 for v in (turned, view)))
        self.assertEqual(self.view("--up", "z").view_up, (0, 0, 1))

    def test_turns(self):
        """All around where the cameras are all around."""
        for part, degrees in ((1.0, 360.0), (0.3, 40.0)):
            self.write(ring(part=part))
            cloud = self.cloud()
            self.assertEqual(home_in(cloud, cloud.data).turn, degrees)

    def test_looking_outward(self):
        """Without a common point: from the middle, along the camera's axis."""
        around = [math.cos(a) * SIDE + math.sin(a) * np.cross(UP, SIDE) for a in np.arange(8) / 8 * 6.28]
        self.write([camera_at(PIVOT + 0.02 * d, PIVOT + d, number=i) for i, d in enumerate(around)])
        view = self.view()
        self.assertLess(np.linalg.norm(np.subtract(view.position, PIVOT)), 0.03)
        self.assertAlmostEqual(np.linalg.norm(np.subtract(view.focal_point, view.position)), 0.49,
                               delta=0.05)

    def test_files_that_do_not_belong(self):
        """A line tells why they are not used, and the view is that without them."""
        expected = self.view()
        far = [dict(camera, position=(np.array(camera["position"]) + 100).tolist())
               for camera in ring()]
        for content, says in ((far, "see hardly anything"), (ring()[:1] + [7], "camera 1 is 7"),
                              ([dict(ring()[0], fx=-2)], "fx is -2")):
            self.write(content)
            said = []
            self.assertEqual(self.view(hint=said.append), expected)
            self.assertRegex(said[0], f"cameras.json.*{says}.*found without it")
        self.write({"cameras": []})  # of another program
        said = []
        self.assertEqual((self.view(hint=said.append), said), (expected, []))

    def test_wrong_files(self):
        camera, frame = ring()[0], as_frame(ring()[0])
        turned = np.array(camera["rotation"])
        frames = {"w": 4, "h": 4, "fl_x": 3}
        for content, says in (
                ([dict(camera, position=[0, 1])], "position is .0, 1.; it must be three"),
                ([dict(camera, position=[0, 1, math.nan])], "position is .0, 1, NaN"),
                ([dict(camera, position=[0, 1, 1e300])], "position is"),
                ([dict(camera, position=[0, 1, True])], "position is"),
                ([dict(camera, position={"x": 1})], "position is"),
                ([{k: v for k, v in camera.items() if k != "position"}], "position is missing"),
                ([dict(camera, rotation=[[1, 0, 0], [0, 1], [0, 0, 1]])], "rotation is"),
                ([dict(camera, rotation=[1, 0, 0, 0, 1, 0, 0, 0, 1])], "rotation is"),
                ([dict(camera, rotation="none")], "rotation is \"none\""),
                ([dict(camera, rotation=(2 * turned).tolist())], "lengths 2, 2, 2"),
                ([dict(camera, rotation=(turned * (1, 1, -1)).tolist())], "left-handed"),
                ([dict(camera, rotation=[[1, 1, 0], [0, 0, 0], [0, 0, 1]])], "not perpendicular"),
                ([camera, dict(camera, width=0)], "camera 1: width is 0"),
                ([dict(camera, fy="wide")], "fy is \"wide\""),
                ([dict(camera, fx=10**400)], "fx is 1"),
                ([dict(camera, img_name=3)], "img_name is 3"),
                ([camera, None], "camera 1 is null"),
                ({"frames": []}, "frames holds no cameras"),
                ({"frames": 3}, "frames holds no cameras"),
                ({"frames": [frame]}, "camera_angle_x is missing"),
                ({"frames": [frame], "camera_angle_x": 4}, "camera_angle_x is 4"),
                ({"frames": [frame], "fl_x": 3}, "w is missing"),
                ({"frames": [dict(frame, transform_matrix=[[1]])], **frames}, "transform_matrix is"),
                ({"frames": [dict(frame, transform_matrix=(-np.eye(4)).tolist())], **frames},
                 "left-handed")):
            self.write(content)
            with self.assertRaisesRegex(UserProblem, f"^cameras.json.*{says}"):
                read_view("cameras.json")
        self.write(ring())
        for name in ("IMG_999", "12", "-1", ""):
            with self.assertRaisesRegex(UserProblem, "number from 0 to 11, or an image such as IMG_000"):
                read_view(f"cameras.json:{name}")
        with open("cameras.json", "w") as file:
            file.truncate(65_000_000)
        with self.assertRaisesRegex(UserProblem, "65 MB"):
            read_view("cameras.json")

    def test_tool(self):
        """From the file to the picture, and an error in one line."""
        write_ply("torus.ply", torus(2000))
        options = ["torus.ply", "--size", "60", "40", "-o", "a.png", "--save-camera", "saved.json"]
        cameras = [camera_at(np.array([3.0, -1.0, z]), np.zeros(3)) for z in (-1.0, 0.0, 1.0)]
        self.write(cameras)
        self.assertEqual(self.tool("render", *options), "")
        saved = read_view("saved.json")
        places = [camera["position"] for camera in cameras]
        self.assertLess(np.linalg.norm(np.subtract(places, saved.position), axis=1).min(), 1e-9)
        self.assertEqual(self.tool("render", *options, "--camera", "cameras.json:2"), "")
        self.assertEqual(list(read_view("saved.json").position), [3, -1, 1])
        self.assertRegex(self.tool("render", *options, "--camera", "cameras.json:7"),
                         "^surfelsplat: .*no camera '7'.*\n$")
        self.assertEqual(self.code, 2)
        self.assertRegex(self.tool("render", *options[:-1], "cameras.json"), "cameras.json")
        self.assertEqual((self.code, len(read_views("cameras.json"))), (2, 3))  # it is kept
        self.assertEqual(self.tool("render", *options[:-1], "transforms.json"), "")
        self.assertEqual(self.tool("render", *options[:-1], "transforms.json"), "")  # of this tool
        os.remove("transforms.json")
        self.assertIn("of 3 in cameras.json", self.info("torus.ply"))

    def test_other_clouds(self):
        """Clouds without Gaussians, and views that are complete, are as without a file."""
        cloud = self.cloud()
        view = View((1, 2, 3), (0, 0, 0), (0, 1, 0), 30.0)
        self.write(ring())
        self.assertEqual(complete_view(view, cloud, cloud.data), view)


if __name__ == "__main__":
    unittest.main()

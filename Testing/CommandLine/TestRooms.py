# SPDX-License-Identifier: BSD-3-Clause
"""Rooms that were scanned from inside, without normals and without the place of the scanner."""

import math
import re
import unittest
from pathlib import Path

import numpy as np

from surfelsplatting.shapes import rooms, surfaces

from roomclouds import CEILING, CUPBOARD, FLOOR, WALLS, room
from TestMeshFaces import write_obj
from TestOutward import box, joined
from toolcase import SMALL, ToolCase, read_json, write_ply
from viewclouds import TO_Y


ORIENTATION = Path(__file__).parents[2] / "Filters" / "Orientation"


class TestLimits(unittest.TestCase):
    def test_filters_have_the_same(self):
        """What the filters turn inward as a room, the views must show as one."""
        text = "".join((ORIENTATION / name).read_text(encoding="utf-8")
                       for name in ("Rooms.cxx", "OutsideDecision.h"))
        found = {name: float(value) for name, value in re.findall(r"\b(\w+) = ([\d.]+)[,;]", text)}
        low, high = surfaces.BULK
        for name, limit in (("WallCosine", rooms.WALL), ("LevelCosine", rooms.LEVEL),
                            ("EndPart", rooms.END), ("LowPercentile", low / 100),
                            ("HighPercentile", high / 100), ("MinLevel", rooms.LEAST),
                            ("MinUpright", rooms.UPRIGHT), ("LowestRoom", rooms.HEIGHTS[0]),
                            ("HighestRoom", rooms.HEIGHTS[1]), ("MaxImbalance", rooms.CLOSED)):
            self.assertAlmostEqual(found[name], limit, msg=name)


class TestRooms(ToolCase):
    def view_of(self, *cloud, options=()):
        """-> what render says, the camera, the parts of the picture that have the colour of floor,
        ceiling, walls and cupboard"""
        write_ply("cloud.ply", *cloud)
        said = self.tool("render", "cloud.ply", "--unlit", "--size", "160x120", "-o", "out.png",
                         "--save-camera", "camera.json", *options)
        self.assertEqual(self.code, 0, said)
        camera = read_json("camera.json")
        picture = self.read_png("out.png")[..., :3].astype(int)
        return said, camera, [np.mean(np.abs(picture - color).max(axis=-1) < 12)
                              for color in (FLOOR, CEILING, WALLS, CUPBOARD)]

    def check_looks_in(self, *cloud, up=(0, 0, 1)):
        said, camera, (floor, ceiling, walls, furniture) = self.view_of(*cloud)
        self.assertEqual(said, "")
        self.assertEqual(tuple(camera["viewUp"]), up)
        self.assertGreater(floor, 0.05)
        self.assertLess(ceiling, 0.01)
        self.assertGreater(walls, 0.1)
        self.assertGreater(furniture, 0.005)

    def test_furniture_tells(self):
        """It stands free, or is part of the surface; a sloping axis and noise do not matter."""
        for furniture in ({"table": True}, {"cupboard": True}):
            points, colors = room(**furniture)
            self.check_looks_in(points, colors)
            self.check_looks_in(points @ TO_Y.T, colors, up=(0, 1, 0))
            turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
            self.check_looks_in(points @ turn.T, colors)
            noise = np.random.default_rng(1).normal(size=points.shape)
            self.check_looks_in(points + 0.01 * noise, colors)

    def test_without_ceiling(self):
        """One looks over the walls."""
        said, camera, (floor, _, _, cupboard) = self.view_of(*room(ceiling=False, cupboard=True))
        self.assertEqual(said, "")
        arm = np.subtract(camera["position"], camera["focalPoint"])
        self.assertGreater(math.degrees(math.asin(arm[2] / np.linalg.norm(arm))), 45)
        self.assertGreater(floor, 0.07)
        self.assertGreater(cupboard, 0.005)

    def test_empty(self):
        """It may be a box. What the hint says looks into it: floor, ceiling and walls all around."""
        for size in ((5, 4, 2.5), (14, 2, 2.6)):
            said, camera, _ = self.view_of(*room(size))
            self.assertEqual(said.count("\n"), 1, said)
            self.assertEqual(tuple(camera["viewUp"]), (0, 0, 1))
            options = re.search("it may be a room; (--.*) looks into it", said)[1].split()
            said, camera, seen = self.view_of(*room(size), options=options)
            self.assertEqual(said, "")
            self.assertTrue((np.array(camera["position"]) < size).all())
            self.assertGreater(min(seen[:3]), 0.01)
            self.assertGreater(sum(seen[:3]), 0.9)
            for words in (["--up", "z"], ["--view", "left"]):
                self.assertNotIn("room", self.view_of(*room(size), options=words)[0])

    def test_in_parts(self):
        """All is two-sided then, and nothing tells whether one looks at a room."""
        said, _, _ = self.view_of(*room(table=True), options=["--points-per-part", "8000"])
        self.assertRegex(said, "it may be a room; --up z --position [0-9. ]* --view-angle 75 looks")

    def test_boxes_stay_boxes(self):
        """Small ones, and small ones that are wider above."""
        for options in ({}, {"cupboard": True}):
            points, colors = room((0.5, 0.4, 0.25), 0.005, **options)
            said, _, (floor, ceiling, walls, _) = self.view_of(points, colors,
                                                               options=["--up", "z"])
            self.assertEqual(said, "")
            self.assertGreater(ceiling, 0.1)
            self.assertGreater(walls, 0.1)
            self.assertEqual(floor, 0)

    def test_boxes_on_one_another(self):
        """One of the size of a room may be one."""
        low = box((3, 3, 2))
        for more, is_room in (((), True), ((box((2, 2, 1.4), (0.5, 0.5, 2)),), False),
                              ((box((3, 3, 2), (0, 0, 2)),), False)):
            write_obj("boxes.obj", *joined(low, *more))
            self.assertEqual("it may be a room" in self.tool("render", "boxes.obj", *SMALL, "-o", "a.png"), is_room)

    def test_info(self):
        for options, says, tries in ((["table"], True, "looks into the room"),
                                     ([], False, "looks into it, if it is a room")):
            write_ply("room.ply", *room(**dict.fromkeys(options, True)))
            text = self.info("room.ply")
            self.assertEqual("seen from inside" in text, says)
            self.assertRegex(text, f"--position .* --view-angle 75  {tries}")
        write_ply("box.ply", *room((0.5, 0.4, 0.25), 0.005))
        self.assertNotIn("room", self.info("box.ply").replace("box.ply", ""))


if __name__ == "__main__":
    unittest.main()

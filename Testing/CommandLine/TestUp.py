# SPDX-License-Identifier: BSD-3-Clause
"""What is up in a cloud, and what is said where that is a guess."""

import os
import unittest
import warnings
from types import SimpleNamespace

import numpy as np

from surfelsplatting.clouds.cloud import Cloud
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.notes import note_model, note_up
from surfelsplatting.shapes.samples import Samples
from surfelsplatting.shapes.up import find_up
from surfelsplatting.surfels import make_surfels
from surfelsplatting.views.cameras import View
from surfelsplatting.views.framing import complete_view
from TestMeshFaces import write_obj
from TestOutward import joined, table
from roomclouds import FLOOR, WALLS, Scan, facade, room
from toolcase import ToolCase, sphere, write_ply
from viewclouds import TO_Y, capture_of, scene, surfels_of

TO_X = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # y to x


def turned_about_x(degrees):
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    return np.array([[1, 0, 0], [0, cosine, sine], [0, -sine, cosine]])


class TestHint(ToolCase):
    def test_what_is_up_is_said_where_it_is_a_guess(self):
        write_ply("ball.ply", *sphere())
        write_ply("egg.ply", sphere()[0] * (1, 1, 1.5))
        write_ply("leaning.ply", sphere()[0] * (0.6, 1.2, 0.6) @ turned_about_x(30))
        write_ply("floating.ply", scene() + np.where(np.arange(15_000) < 5000, 1.5, 0)[:, None]
                  * [0, 0, 1])
        block = Scan(0.03)
        block.add_box((0, 0, 0), (2, 1.4, 1), (0, 0, 0))
        write_ply("block.ply", block.cloud()[0])  # it lies on its largest sides
        write_ply("scene.ply", scene())
        write_ply("turned.ply", scene() * (1, -1, -1))
        for words, says in (("floating.ply", "z was taken, and --up y, -y or -z turns it"),
                            ("floating.ply --up y", ""), ("floating.ply --view-up 0 1 0", ""),
                            ("ball.ply", ""), ("egg.ply", ""),  # as is usual for models
                            ("leaning.ply", "y was taken, and --up z, -y or -z turns it"),
                            ("block.ply", "y was taken, and --up z, -y or -z turns it"),
                            ("scene.ply", ""), ("scene.ply --azimuth 30", ""),
                            ("turned.ply", "-z was taken, and --up y, z or -y turns it")):
            commands = ["render"] + ["film --frames 1"] * (words in ("floating.ply", "scene.ply"))
            for command in commands:
                said = self.tool(*command.split(), *words.split(), "--size", "40x30", "-o",
                                 f"{len(os.listdir())}.png" if command == "render" else
                                 f"{len(os.listdir())}")
                self.assertEqual(self.code, 0, said)
                self.assertIn(says, said)
                self.assertEqual("is not clear" in said, bool(says), words)
        self.assertIn("0 1 0, a guess; --up turns it", self.info("egg.ply"))

    def test_tables_stand_on_their_legs(self):
        """From its top, a table is a ground with poles on it; models have y or z up. A file of their
        surfels is seen as they are."""
        places, triangles = joined(*table())
        write_obj("z.obj", places, triangles)
        write_obj("y.obj", places[:, [0, 2, 1]] * (1, 1, -1), triangles)
        self.tool("render", "z.obj", "--surfels", "z.vtp", "--size", "40x30", "-o", "z.png")
        for path, up in (("z.obj", "0 0 1"), ("y.obj", "0 1 0"), ("z.vtp", "0 0 1")):
            self.assertIn(f"up       {up}, a guess", self.info(path))


class TestUp(unittest.TestCase):
    def view_of(self, points, normals, two_sided=False):
        return complete_view(View(), SimpleNamespace(viewpoint=None, columns=0, image=None),
                             surfels_of(points, normals, two_sided=two_sided))

    def test_terrain_lies_flat(self):
        x, y = np.random.default_rng(1).uniform(-50, 50, (2, 4000))
        ground = np.column_stack([x, y, np.sin(x / 7)])
        up = np.tile([0, 0, 1.0], (4000, 1))
        for two_sided in (False, True):
            view = self.view_of(ground, up, two_sided)
            self.assertEqual(view.view_up, (0, 0, 1))
            self.assertGreater(view.position[2], 5)
        sideways = self.view_of(ground[:, [0, 2, 1]], up[:, [0, 2, 1]])
        self.assertEqual(sideways.view_up, (0, 1, 0))

    def test_facade_stands(self):
        """Along z, and if it is thin along z, along y. Windows behind it and a cornice before it tell
        it from things on a ground."""
        for cornice, turn, axis, is_clear in ((True, np.eye(3), (0, 0, 1), True),
                                              (True, TO_X, (0, 0, 1), True),
                                              (True, TO_Y, (0, 1, 0), False),
                                              (False, np.eye(3), (0, 0, 1), False)):
            points = facade(cornice)
            points += 0.003 * np.random.default_rng(1).normal(size=points.shape)
            surfels = make_surfels(polydata_of(points @ turn.T, {}), cleaning="off")
            self.check_up(surfels, axis, is_clear)

    def test_wall_stands_on_the_ground_before_it(self):
        """Seen from the front, so that nothing tells the wall from a ground but the strip of street at
        its foot. A floor in the axes of a camera has its wall at the far end."""
        scan = Scan(0.1)
        scan.add((0, 0, 0), (12, 0, 6), WALLS)
        scan.add((0, -1.5, 0), (12, 0, 0), FLOOR)
        points = scan.cloud()[0]
        points = points + 0.02 * np.random.default_rng(1).normal(size=points.shape)
        for places, axis in ((points, (0, 0, 1)), (points[:, [0, 2, 1]], (0, 1, 0)),
                             (points * (1, 1, -1), (0, -1, 0))):
            self.check_up(make_surfels(polydata_of(places, {})), axis, False)

    def test_terrain_is_no_facade(self):
        """Nor is a ground with houses, one of which is turned, and a floor between walls."""
        rng = np.random.default_rng(1)
        ground = np.column_stack([*rng.uniform(0, 40, (2, 20_000)), np.zeros(20_000)])
        houses = []
        for x, y, angle in ((5, 5, 0.4), (25, 8, 0.9), (12, 28, 1.3), (30, 28, 0.1)):
            scan = Scan(0.15)
            scan.add_sides((0, 0, 0), (6, 6, 4), (0, 0, 0))
            scan.add((0, 0, 4), (6, 6, 4), (0, 0, 0))
            turn = [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
            houses.append(scan.cloud()[0] @ turn + [x, y, 0])
        for points in (np.vstack([ground, *houses]), room((12, 10, 2.5), 0.1, ceiling=False)[0]):
            for turn, axis in ((np.eye(3), (0, 0, 1)), (TO_Y, (0, 1, 0))):
                surfels = make_surfels(polydata_of(points @ turn.T, {}), cleaning="off")
                self.assertEqual(tuple(find_up(Samples(surfels)).axis), axis)

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

    def test_trees_stand(self):
        random = np.random.default_rng(8)
        tree = random.normal(size=(3000, 3)) * (0.4, 0.5, 2)
        for order, up, is_clear in (([0, 1, 2], (0, 0, 1), True), ([0, 2, 1], (0, 1, 0), False)):
            normals = random.normal(size=tree.shape)
            self.check_up(surfels_of(tree[:, order], normals, two_sided=True), up, is_clear)

    def test_wide_trees_stand_on_their_trunk(self):
        random = np.random.default_rng(8)
        crown = 2 * sphere(3000)[0] * random.uniform(0.3, 1, (3000, 1)) + [0, 0, 6]
        trunk = random.uniform(-0.1, 0.1, (600, 3)) + np.linspace(0, 4, 600)[:, None] * [0, 0, 1]
        tree = np.vstack([crown, trunk])
        normals = random.normal(size=tree.shape)
        self.check_up(surfels_of(tree, normals, two_sided=True), (0, 0, 1), True)
        self.check_up(surfels_of(tree[:, [0, 2, 1]], normals, two_sided=True), (0, 1, 0), False)

    def test_figures_stand(self):
        """With arms spread they are thin, and would lie on their backs as safely as a plate."""
        parts = [((0, 0, 1.1), (0.2, 0.12, 0.4)), ((0, 0, 1.65), (0.12, 0.12, 0.15)),
                 ((0.5, 0, 1.4), (0.4, 0.06, 0.06)), ((-0.5, 0, 1.4), (0.4, 0.06, 0.06)),
                 ((0.15, 0, 0.4), (0.09, 0.09, 0.4)), ((-0.15, 0, 0.4), (0.09, 0.09, 0.4)),
                 ((0.15, 0, 0.04), (0.07, 0.13, 0.04)), ((-0.15, 0, 0.04), (0.07, 0.13, 0.04))]
        ball = sphere(3000)[0]
        points = np.vstack([ball * size + place for place, size in parts])
        normals = np.vstack([ball / size for _, size in parts])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        for depth in (1, 3):
            self.check_up(surfels_of(points * (1, depth, 1), normals), (0, 0, 1), True)
            self.check_up(surfels_of(points * (1, depth, 1) @ TO_Y.T, normals @ TO_Y.T), (0, 1, 0),
                          True)
        plate = np.array((1, 0.9, 0.1))
        self.check_up(surfels_of(ball * plate, ball / plate), (0, 0, 1), True)

    def test_what_tips_over_is_not_upside_down(self):
        """A statue with a hole below its nose, and so an open top if it were upside down, stands on its
        base."""
        ball = sphere(8000)[0]
        for matrix, up in ((np.eye(3), (0, 0, 1)), (TO_Y, (0, 1, 0))):
            cone = np.column_stack([ball[:, 0] * (1.2 - ball[:, 2]), ball[:, 1] * (1.2 - ball[:, 2]),
                                    2 * ball[:, 2]]) + [0.8, 0, 0] * (ball[:, 2:] + 1)
            kept = (ball @ (0, 0, 1.0) > -0.5)
            points, normals = cone[kept] @ matrix.T, ball[kept] * (1, 1, -1) @ matrix.T
            self.check_up(surfels_of(points, normals), up, False)

    def test_places_do_not_tip_over(self):
        """A ground that slopes, with a wall and a post on it, is at its lower end on one side only."""
        lean = np.radians(5)
        slope = np.array([[1, 0, 0], [0, np.cos(lean), -np.sin(lean)], [0, np.sin(lean), np.cos(lean)]])
        rng = np.random.default_rng(1)
        points = np.concatenate([scene(), rng.uniform((-2, -2, 0), (2, -2, 0.8), (2000, 3)),
                                 rng.uniform((0.9, -1.4, 0), (1.1, -1.4, 2.5), (400, 3))])
        for matrix, axis in ((np.eye(3), (0, 0, 1)), (TO_Y.T, (0, -1, 0))):
            surfels = make_surfels(polydata_of(points @ (matrix @ slope).T, {}), sides="two")
            self.check_up(surfels, axis, False)

    def test_heads_have_an_open_neck(self):
        """Models whose opening is at their back: they do not stand, along its axis neither, as a cup does,
        which is open at its top."""
        ball = sphere(8000)[0]
        ball = ball[ball[:, 2] < 0.6]
        head = surfels_of(ball + [0, 1.5, 0] * ball[:, 2:], ball - [0, 0, 1.5] * ball[:, 1:2])
        cup = surfels_of(ball * (1, 1, 0.6), ball)
        for surfels, axis in ((head, (0, 1, 0)), (cup, (0, 0, 1))):
            note_model(surfels)
            self.check_up(surfels, axis, False)

    def test_coordinates_of_a_country(self):
        """They are far off in x and in y. A model may be anywhere along one axis."""
        ball = sphere(2000)[0]
        for place, axis, is_clear in (((2e5, 5e6, 0), (0, 0, 1), True), ((40, 0, 0), (0, 1, 0), False),
                                      ((40, 0, -30), (0, 1, 0), False)):
            self.check_up(surfels_of(ball * (1, 1, 2) + place, ball), axis, is_clear)

    def test_file_says_what_is_up(self):
        ball = sphere(2000)[0]
        surfels = surfels_of(ball * (1, 1, 2), ball)
        for up, found in (((1, 0, 0), (1, 0, 0)), ((np.nan, 0, 0), (0, 1, 0)), ((1,), (0, 1, 0))):
            note_up(surfels, up)
            self.assertEqual(tuple(find_up(Samples(surfels)).axis), found)

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
        box = faces.reshape(-1, 3) * (0.2, 0.2, 0.15)  # smaller than rooms
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

    def test_closed_things_stand(self):
        """An animal on four legs, in the axes of either convention. What would lie on its back as well
        as it stands does not tell."""
        ball = sphere(2000)[0]
        legs = [((x, y, 0.4), (0.1, 0.1, 0.4)) for x in (-0.6, 0.6) for y in (-0.25, 0.25)]
        parts = [((0, 0, 1), (1, 0.4, 0.35)), ((1.2, 0, 1.4), (0.3, 0.2, 0.2)), *legs]
        points = np.vstack([ball * size + place for place, size in parts])
        normals = np.vstack([ball / size for _, size in parts])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        self.check_up(surfels_of(points, normals), (0, 0, 1), True)
        self.check_up(surfels_of(points @ TO_Y.T, normals @ TO_Y.T), (0, 1, 0), True)
        sizes = np.array((0.5, 1, 0.6))
        stone = surfels_of(ball * sizes, ball / sizes)
        self.check_up(stone, (0, 1, 0), False)

    def test_what_stands_rather_than_y(self):
        """A bird with short legs in front settles on them with z up, and would fall from the wing that
        it stands on with y up. So z is the guess, unless it is a model."""
        ball = sphere(2000)[0]
        legs = [((x, y, 0.4 + lift), (0.1, 0.1, 0.4 - lift)) for x, lift in ((-0.6, 0.0), (0.6, 0.05))
                for y in (-0.25, 0.25)]
        wings = [((0, y, 1.1), (0.3, 0.6, 0.05)) for y in (-0.9, 0.9)]
        parts = [((0, 0, 1), (1, 0.4, 0.35)), ((1.2, 0, 1.4), (0.3, 0.2, 0.2)), *wings, *legs]
        points = np.vstack([ball * size + place for place, size in parts])
        normals = np.vstack([ball / size for _, size in parts])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        bird = surfels_of(points, normals)
        self.check_up(bird, (0, 0, 1), False)
        note_model(bird)
        self.check_up(bird, (0, 1, 0), False)

    def test_statue_on_a_small_base(self):
        """With wings behind it, by which it would settle on its back with y up."""
        ball = sphere(6000)[0]
        ball = ball[ball[:, 2] > -0.9]
        x, y = np.random.default_rng(1).uniform(-0.4, 0.4, (2, 400))
        inside = np.hypot(x, y) < 0.43
        base = np.column_stack([x, y, np.full(400, -0.9)])[inside] * (0.5, 0.3, 1)
        wings = [0.1 * sphere(200)[0] * (1, 1, 2) + (x, -0.31, 0.5) for x in (-0.6, 0.6)]
        points = np.vstack([ball * (0.5, 0.3, 1), base, *wings])
        outward = ball / (0.5, 0.3, 1)
        normals = np.vstack([outward / np.linalg.norm(outward, axis=1)[:, None],
                             np.tile([0, 0, -1.0], (len(base), 1)), *[sphere(200)[0]] * 2])
        for is_one in (False, True):
            statue = surfels_of(points, normals)
            note_model(statue, is_one)
            self.check_up(statue, (0, 0, 1), False)

    def test_cars_that_lean_settle(self):
        """A car that leans forward touches the ground with two wheels, and would fall on its side, where
        it lies firmly; but it falls on its other wheels."""
        ball = sphere(2000)[0]
        wheels = [((x, y, 0.2), (0.2, 0.14, 0.2)) for x in (-0.6, 0.6) for y in (-0.3, 0.3)]
        parts = [((0, 0, 0.45), (1, 0.42, 0.25)), ((-0.2, 0, 0.7), (0.5, 0.36, 0.2)), *wheels]
        car = np.vstack([ball * size + place for place, size in parts])
        normals = np.vstack([ball / size for _, size in parts])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        for degrees in (0, 5):
            lean = TO_X.T @ turned_about_x(degrees) @ TO_X @ TO_Y.T
            self.check_up(surfels_of(car @ lean, normals @ lean), (0, 1, 0), False)
        lying = TO_X.T @ turned_about_x(40) @ TO_X @ TO_Y.T  # too far
        self.check_up(surfels_of(car @ lying, normals @ lying), (0, 0, 1), True)

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
        # A guess does not count against what is usual: this bowl is open between y and z.
        tilted = capture_of(ball[ball @ (0, 0.5, 0.8) < 0.5])
        up = find_up(Samples(tilted))
        self.assertEqual((tuple(up.axis), up.is_clear), ((0, -1, 0), False))
        # The camera of COLMAP looks along z.
        self.assertLess(complete_view(View(), Cloud(capture_of(ball)), capture_of(ball)).position[2], -1)

    def test_bulk_of_captures(self):
        """A long neck is shown, a sky and a few stray Gaussians are not."""
        rng = np.random.default_rng(2)
        body = rng.uniform(-1, 1, (9000, 3))  # quartiles at +-0.5
        neck = np.column_stack([rng.normal(size=(500, 2)) * 0.1, rng.uniform(1, 2.4, 500)])
        stray = np.array([[0.0, 0, 4], [0, -5, 0]])
        sky = 30 * sphere(500)[0]
        guitar = np.vstack([body, neck, stray])
        self.assertAlmostEqual(Samples(capture_of(guitar)).high[2], 2.4, delta=0.05)
        self.assertAlmostEqual(Samples(capture_of(guitar)).low[1], -1, delta=0.05)
        self.assertLess(Samples(capture_of(np.vstack([guitar, sky]))).high[2], 2.35)


if __name__ == "__main__":
    unittest.main()

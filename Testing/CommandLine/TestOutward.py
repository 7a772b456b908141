# SPDX-License-Identifier: BSD-3-Clause
"""Parts of meshes and of clouds with normals that are inside out are turned; rooms and what is seen
from both sides stay."""

import unittest
from unittest import mock

import numpy as np
from vtkmodules.vtkCommonComputationalGeometry import vtkParametricMobius, vtkParametricTorus
from vtkmodules.vtkFiltersSources import vtkParametricFunctionSource
from vtkmodules.util.numpy_support import vtk_to_numpy

from roomclouds import room
from surfelsplatting.clouds.cloud import Cloud, cloud_of
from surfelsplatting.clouds.polydata import cells_of, polydata_of
from surfelsplatting.shapes.outward import turn_outward
from TestMeshFaces import BOX, TRIANGLES, ball, write_obj, write_stl
from toolcase import SMALL, ToolCase, arrays_of, fewer_on_faces, places_of, sphere, write_ply

FLOOR, CEILING = 4, 5  # of the sides of a box
LEGS = [(x, y, 0) for x in (0, 0.95) for y in (0, 0.55)]


def box(size=(1, 1, 1), at=(0, 0, 0), without=()):
    """-> [8, 3] vertices, triangles, some sides left out"""
    kept = [side for side in range(6) if side not in without]
    return BOX * size + at, np.array(TRIANGLES).reshape(6, 2, 3)[kept].reshape(-1, 3)


def turned(mesh):
    return mesh[0], mesh[1][:, ::-1]


def joined(*meshes):
    firsts = np.cumsum([0, *(len(places) for places, _ in meshes)])
    return (np.concatenate([places for places, _ in meshes]),
            np.concatenate([triangles + first for (_, triangles), first in zip(meshes, firsts)]))


def table(wrong=()):
    """Its top, number 0, and legs; those of the numbers are inside out."""
    parts = [box((1, 0.6, 0.05), (0, 0, 0.7)), *(box((0.05, 0.05, 0.7), leg) for leg in LEGS)]
    return [turned(part) if i in wrong else part for i, part in enumerate(parts)]


def bowl(radius=1.0):
    places, triangles = ball(20)
    is_low = (places[triangles, 2] < 0.01).all(axis=1)
    return radius * places, triangles[is_low]


def parametric(function):
    source = vtkParametricFunctionSource()
    source.SetParametricFunction(function)
    source.GenerateNormalsOff()
    source.Update()
    mesh = source.GetOutput()
    return (places_of(mesh).astype(float),
            vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3))


def data_of(mesh, arrays=None):
    places, triangles = mesh
    return polydata_of(places, arrays or {}, cells_of(triangles.ravel(),
                                                      np.arange(0, triangles.size + 1, 3)))


def normals_of(cloud):
    return arrays_of(cloud.data)["Normals"].copy()


class TestOutward(ToolCase):
    def setUp(self):
        super().setUp()
        fewer = fewer_on_faces(10_000)
        fewer.start()
        self.addCleanup(fewer.stop)

    def check_mesh(self, mesh, count, arrays=None):
        """Turning takes so many parts. -> which points it turns"""
        cloud = cloud_of(data_of(mesh, arrays))
        how, before = cloud.how, normals_of(cloud)
        turn_outward(cloud)
        is_turned = (normals_of(cloud) * before).sum(axis=1) < 0
        parts = np.unique(cloud.parts[is_turned])
        self.assertEqual(len(parts), count)
        self.assertEqual(is_turned.sum(), np.isin(cloud.parts, parts).sum())
        total = cloud.parts.max() + 1
        self.assertEqual(cloud.how, how + (
            f"; parts that were inside out, and are turned: {count} of {total}" if count else ""))
        self.assertFalse(cloud.is_unsure)
        return is_turned

    def check_stays(self, *meshes):
        self.assertFalse(self.check_mesh(joined(*meshes), 0).any())

    def test_boxes_that_touch(self):
        """Their normals point to both sides of one plane, and are right, in one file and in two."""
        pair = box(), box(at=(0, 0, 1))
        write_obj("pair.obj", *joined(*pair))
        for name, one in zip(("low.obj", "high.obj"), pair):
            write_obj(name, *one)
        for files in (("pair.obj",), ("low.obj", "high.obj")):
            self.assertNotIn("normals", self.tool("render", *files, *SMALL, "-o", "out.png"))
            self.assertEqual(self.code, 0)

    def test_closed_meshes(self):
        for mesh in (box(), box((2, 2, 2)), ball(20), parametric(vtkParametricTorus())):
            self.check_stays(mesh)
            self.assertTrue(self.check_mesh(turned(mesh), 1).all())

    def test_parts(self):
        self.check_stays(*table())
        for wrong in ([0], [1, 4], range(5)):
            places, triangles = joined(*table(wrong))
            self.check_mesh((places, triangles), len(wrong))
            mixed = np.random.default_rng(1).permutation(triangles)  # those of all parts by turns
            self.check_mesh((places, mixed), len(wrong))
        for x in (1.0, 3.0):  # one meets the other, or is apart
            places, triangles = ball(20)
            self.check_mesh(joined((places, triangles), turned((places + [x, 0, 0], triangles))), 1)

    def test_solids_that_touch(self):
        """Four faces meet at their edges. Faces of leaves with two sides are there twice."""
        self.check_stays(box(), box(at=(1, 0, 0)))
        self.check_mesh(joined(box(), turned(box(at=(1, 0, 0)))), 1)
        for count in (2_000, 20_000, 60_000, 200_000):  # the walls between tell nothing at any
            with fewer_on_faces(count):
                for at in np.eye(3):
                    self.check_mesh(joined(box(), turned(box(at=at))), 1)
                self.check_mesh(joined(*(turned(box(at=(x, 0, 0))) for x in range(3))), 3)
        leaves = [box(at=(0, 0, z), without=range(4)) for z in range(5)]
        self.assertIsNone(cloud_of(data_of(joined(*leaves, *map(turned, leaves)))).parts)

    def test_two_walls(self):
        """Of a mug. An inner wall may be seen through the opening only."""
        outer, inner = bowl(), bowl(0.9)
        self.check_stays(outer, turned(inner))
        is_turned = self.check_mesh(joined(outer, inner), 1)
        self.assertAlmostEqual(is_turned.mean(), 0.81 / 1.81, delta=0.01)
        self.check_mesh(turned(joined(outer, turned(inner))), 2)

    def test_hidden_parts_stay(self):
        places, triangles = ball(20)
        self.check_stays((places, triangles), (0.8 * places, triangles[:, ::-1]),
                         (0.5 * places, triangles))
        self.check_mesh(joined((places, triangles[:, ::-1]), (0.5 * places, triangles)), 1)

    def test_both_sides(self):
        """Of open sheets, and of faces that are there twice, as leaves are."""
        sheet = box(without=range(1, 6))
        for mesh in (sheet, parametric(vtkParametricMobius()), bowl(), turned(bowl())):
            self.check_stays(mesh)
        leaves = [(0.1 * sheet[0][:4] + at, sheet[1][:1])
                  for at in np.random.default_rng(1).random((100, 3))]
        self.check_stays(*leaves, *table(), *map(turned, leaves))

    def test_rooms(self):
        """They stay if they are furnished, or as high as rooms. A box with a box in it is turned."""
        size = (5, 4, 2.5)
        inside = [(places + 1, triangles) for places, triangles in table()]
        shell = turned(box(size))
        self.check_stays(shell)
        self.check_stays(shell, *inside)
        small = [(places / 100, triangles) for places, triangles in (shell, *inside)]
        self.check_stays(*small)
        self.check_mesh(small[0], 1)
        for without in ([CEILING], [CEILING, 0], [0]):
            self.check_stays(turned(box(size, without=without)), *inside)
        walls = [turned(box(size, without=[i for i in range(6) if i != side])) for side in range(6)]
        self.check_stays(*walls, *inside)
        self.check_mesh(joined(shell, *map(turned, inside)), 1)

    def test_given_normals_of_meshes(self):
        """They count, and not the order of the corners."""
        places, triangles = ball(20)
        for mesh in ((places, triangles), (places, triangles[:, ::-1])):
            self.check_mesh(mesh, 0, {"Normals": places})
            self.check_mesh(mesh, 1, {"Normals": -places})

    def check_points(self, points, normals, wanted, **known):
        """Turning takes the wanted points, and leaves the caller's."""
        data = polydata_of(points, {"Normals": normals})
        cloud = Cloud(data, **known)
        turn_outward(cloud)
        signs = np.where(wanted, -1, 1)[:, None]
        np.testing.assert_array_equal(normals_of(cloud), np.float32(normals) * signs)
        np.testing.assert_array_equal(arrays_of(data)["Normals"], np.float32(normals))
        self.assertEqual(cloud.is_unsure, np.any(wanted))
        self.assertEqual("point inward" in cloud.how, np.any(wanted))

    def test_points(self):
        points, _ = sphere()
        self.check_points(points, points, points[:, 0] > 9)
        self.check_points(points, -points, points[:, 0] < 9)
        two = np.concatenate([points, points + [3, 0, 0]])
        self.check_points(two, np.concatenate([points, -points]), two[:, 0] > 1.5)
        is_half = points[:, 2] < 0
        self.check_points(points[is_half], -points[is_half], points[is_half, 0] > 9)
        self.check_points(points, -points, points[:, 0] > 9, viewpoint=(0, 0, 0))
        self.check_points(points[:50], -points[:50], points[:50, 0] > 9)

    def test_many_points_and_some_without_normals(self):
        points, _ = sphere(5000)
        normals = -points
        normals[::7] = 0
        points[::11] = np.nan
        wanted = np.isfinite(points).all(axis=1) & normals.any(axis=1)
        with mock.patch("surfelsplatting.shapes.outward.MOST_POINTS", 1500):
            self.check_points(points, normals, wanted)

    def test_points_of_rooms(self):
        """With a table, without a ceiling; and of a box."""
        for options, scale in (({}, 1), ({"table": True}, 1), ({"ceiling": False}, 1), ({}, 0.1)):
            points, _ = room(spacing=0.1, **options)
            ends = np.stack([points - points.min(axis=0), points.max(axis=0) - points])
            end, axis = np.divmod(ends.min(axis=0).argmin(axis=1)
                                  + 3 * ends.min(axis=2).argmin(axis=0), 3)
            normals = np.eye(3)[axis] * np.where(end, -1, 1)[:, None]
            self.check_points(scale * points, normals, np.full(len(points), scale < 1))

    def test_says_so(self):
        """Of meshes with -v, of points always. --sides given takes normals and faces as they are."""
        write_stl("cube.stl", *turned(box()))
        render = ["--size", "64x48", "-o", "a.png"]
        said = self.tool("render", "cube.stl", *render, "-v")
        self.assertIn("parts that were inside out, and are turned: 1 of 1", said)
        self.assertEqual(self.tool("render", "cube.stl", *render), "")
        self.assertNotIn("turned", self.tool("render", "cube.stl", *render, "--sides", "given", "-v"))
        points, colors = sphere()
        write_ply("ball.ply", points, colors, -points)
        self.assertEqual(self.tool("render", "ball.ply", *render),
                         "surfelsplat: ball.ply: the normals of 100 % of the points point inward, and "
                         "are turned; --sides given keeps them\n")
        self.assertNotIn("turned", self.tool("render", "ball.ply", *render, "--sides", "given"))

    def test_normals_that_tell_nothing(self):
        """Their signs are chance, or they are all alike: the picture is that without them."""
        points, colors = sphere(20_000)
        signs = np.random.default_rng(1).choice([-1, 1], len(points))[:, None]
        render = ["--size", "64x48", "--unlit"]
        write_ply("none.ply", points, colors)
        self.tool("render", "none.ply", *render, "-o", "none.png")
        for normals, said in ((signs * points, "point to both sides of one surface"),
                              (points * 0 + [1, 0, 0], "are not those of the surface")):
            write_ply("ball.ply", points, colors, normals)
            told = self.tool("render", "ball.ply", *render, "-o", "a.png")
            line = f"surfelsplat: ball.ply: the normals {said}"
            self.assertIn(line, told)
            self.assertIn("; --sides given keeps them", told)
            self.assertLess(np.abs(self.read_png("a.png").astype(int)
                                   - self.read_png("none.png")).mean(), 1)
            told = self.tool("render", "ball.ply", *render, "-o", "a.png", "--sides", "given")
            self.assertNotIn("the normals", told)
            self.assertIn(line, self.tool("render", "ball.ply", *render, "-o", "a.png",
                                          "--points-per-part", "8000"))

    def test_cube_looks_right(self):
        """An inside-out cube is the picture of a right one, within noise of the points' places."""
        pictures = []
        for name, mesh in (("right", box()), ("wrong", turned(box()))):
            write_stl(f"{name}.stl", *mesh)
            self.tool("render", f"{name}.stl", "--size", "64x48", "-o", f"{name}.png")
            pictures.append(self.read_png(f"{name}.png").astype(int))
        self.assertLess(np.abs(pictures[0] - pictures[1]).mean(), 1)


if __name__ == "__main__":
    unittest.main()

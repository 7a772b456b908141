# SPDX-License-Identifier: BSD-3-Clause
"""--every N: a part of the points, to see a large cloud soon."""

import unittest
from unittest import mock

import numpy as np
from vtkmodules.vtkCommonCore import vtkStringArray

from surfelsplatting.clouds.cloud import Cloud
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.clouds.thinning import one_of
from surfelsplatting.commandline import estimation
from toolcase import CAMERA, SMALL, ToolCase, arrays_of, places_of, sphere, write_ply


class TestThinning(ToolCase):
    def thin(self, every, count=1000):
        """-> Cloud, and the numbers of its points"""
        arrays = {"RGB": np.arange(3 * count).reshape(count, 3) % 256,
                  "Normals": np.random.default_rng(1).normal(size=(count, 3)),
                  "intensity": np.arange(count), "time": np.arange(count, dtype=np.float64)}
        data = polydata_of(np.arange(3.0 * count).reshape(count, 3) + 1e7, arrays)
        cloud = one_of(every, Cloud(data, (1.0, 2.0, 3.0), parts=np.arange(count)))
        chosen = cloud.parts
        found, points = arrays_of(cloud.data), cloud.data.GetPointData()
        self.assertEqual(set(found), set(arrays))
        for name, values in arrays.items():
            np.testing.assert_array_equal(found[name], values[chosen].astype(found[name].dtype))
        np.testing.assert_array_equal(places_of(cloud.data), places_of(data)[chosen])
        self.assertEqual(points.GetScalars().GetName(), "RGB")
        self.assertEqual(points.GetNormals().GetName(), "Normals")
        self.assertEqual((cloud.normals, cloud.viewpoint), (["Normals"], (1.0, 2.0, 3.0)))
        return chosen

    def test_one_of_each_run(self):
        for every in (1, 2, 7, 999):
            chosen = self.thin(every)
            runs = np.minimum(np.arange(0, 1000, every)[:-1] // every, 999)
            np.testing.assert_array_equal(chosen[:-1] // every, runs)
            self.assertLess(chosen[-1], 1000)
            np.testing.assert_array_equal(self.thin(every), chosen)  # as before
        self.assertEqual(len(self.thin(5000)), 1)

    def test_words(self):
        """A file of VTK may name the species of each tree."""
        data = polydata_of(np.arange(3000.0).reshape(1000, 3), {"intensity": np.arange(1000)})
        words = vtkStringArray()
        words.SetName("species")
        for number in range(1000):
            words.InsertNextValue(f"tree {number}")
        data.GetPointData().AddArray(words)
        thinned = one_of(7, Cloud(data, None)).data.GetPointData()
        found, numbers = thinned.GetAbstractArray("species"), thinned.GetArray("intensity")
        self.assertEqual([found.GetValue(i) for i in range(found.GetNumberOfValues())],
                         [f"tree {numbers.GetValue(i):g}" for i in range(143)])

    def test_rows_of_a_scan(self):
        """A fixed one of each run would be of one column, where rows are as long."""
        columns = self.thin(10, 10_000) % 10
        self.assertGreater(np.bincount(columns, minlength=10).min(), 60)  # of 100 expected

    def test_picture(self):
        write_ply("ball.ply", *sphere(40_000))
        for name, words in (("all", ()), ("few", ("--every", 4)), ("again", ("--every", 4))):
            self.render("ball.ply", *CAMERA, *SMALL, "--lit", "--stats", name + ".json", *words,
                        "-o", name + ".exr")
        everything, few = (self.read_rgba(name + ".exr") for name in ("all", "few"))
        self.assertLess(np.sqrt(np.mean((few - everything) ** 2)), 0.03)
        np.testing.assert_array_equal(few, self.read_rgba("again.exr"))

    def test_number_of_points(self):
        write_ply("ball.ply", *sphere(4000))
        said = self.tool("render", "ball.ply", *SMALL, "-v", "--every", 3, "-o", "out.png")
        self.assertIn("ball.ply: 1334 points; one of every 3 points", said)
        self.assertEqual(self.code, 0)

    def test_too_little_memory(self):
        """The message names the option where it has an effect."""
        write_ply("ball.ply", *sphere(100))
        self.render("ball.ply", *SMALL, "-o", "out.png", "--surfels", "ball.vtp")
        with mock.patch.object(estimation, "vtkSurfelHierarchy") as hierarchy:
            hierarchy.CheckMemory.return_value = "too many points."
            for name, advice in (("ball.ply", " --every N uses one of every N points."),
                                 ("ball.vtp", "")):
                said = self.tool("render", name, *SMALL, "--blur", 9, "-o", "out.png")
                self.assertEqual(said, f"surfelsplat: {name}: too many points.{advice}\n")

    def test_not_a_number(self):
        write_ply("ball.ply", *sphere(100))
        for number in ("0", "2.5", "few"):
            self.refuse("render", "ball.ply", "-o", "out.png", "--every", number,
                        says=["--every", f"{number!r} is not a whole number of at least 1"])


if __name__ == "__main__":
    unittest.main()

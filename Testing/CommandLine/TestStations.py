# SPDX-License-Identifier: BSD-3-Clause
"""Projects of several scans: the place of each scanner tells the sides of what it has seen."""

import json
import unittest
import warnings

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkAppendPolyData, vtkMaskPoints
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter

from stationclouds import attic, project, tunnel
from surfelsplatting import vtkPartitionedSurfelEstimation, vtkPointsToSurfels
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.clouds.stations import scanners_of
from surfelsplatting.formats.ptx import read_ptx_cloud
from surfelsplatting.vtkarrays import named_array
from toolcase import ToolCase, write_data

FLOOR, REST = (150, 100, 50), (210, 210, 230)
AXES = "1 0 0\n0 1 0\n0 0 1\n"


def write_ptx(path, points, colors, numbers, places):
    """Coordinates of each scan are relative to its scanner."""
    with open(path, "w", encoding="ascii") as file:
        for number, place in enumerate(places):
            own = numbers == number
            x, y, z = place
            file.write(f"{own.sum()}\n1\n{x} {y} {z}\n{AXES}1 0 0 0\n0 1 0 0\n0 0 1 0\n{x} {y} {z} 1\n")
            rows = np.column_stack([points[own] - place, np.full(own.sum(), 0.5), colors[own]])
            np.savetxt(file, rows, fmt="%.6f %.6f %.6f %.1f %d %d %d")


class TestStations(ToolCase):
    @classmethod
    def setUpClass(cls):
        cls.scans = {}
        for name, (scene, places) in (("attic", attic()), ("tunnel", tunnel())):
            points, normals, from_places, numbers = project(scene, places, step=1.5)
            colors = np.where(normals[:, 2:] > 0.9, FLOOR, REST).astype(np.uint8)
            cls.scans[name] = points, normals, from_places - points, numbers, places, colors

    def cloud(self, name, chosen=slice(None)):
        """The points of a scene with the normals that were seen in an array of another name"""
        points, normals, ways, *_ = (values[chosen] for values in self.scans[name][:4])
        data = polydata_of(points, {"ToScanner": ways})
        data.GetPointData().AddArray(named_array("seen", normals))
        return data

    def check_sides(self, data, filters=None, turn=np.eye(3), least=0.985):
        """At least so much of the area is one-sided and faces where it was seen from."""
        filters = filters or vtkPointsToSurfels()
        filters.AddObserver("WarningEvent", lambda *_: None)  # of stray points
        filters.SetInputData(data)
        filters.Update()
        arrays = filters.GetOutput().GetPointData()
        areas, two, seen = (vtk_to_numpy(arrays.GetArray(name))
                            for name in ("SurfelAreaVector", "SurfelTwoSided", "seen"))
        sizes = np.linalg.norm(areas, axis=1)
        right = (np.einsum("ni,ni->n", areas, seen @ turn.T) > 0) & (two == 0)
        share = np.average(right, weights=sizes)
        self.assertGreater(share, least)
        return share

    def test_sides(self):
        """The shape says of the tunnel that it is seen from outside."""
        for name in self.scans:
            data = self.cloud(name)
            self.check_sides(data)
        data.GetPointData().RemoveArray("ToScanner")
        with self.assertRaises(AssertionError):
            self.check_sides(data, least=0.5)

    def test_in_parts(self):
        parts = vtkPartitionedSurfelEstimation()
        parts.SetPointsPerPart(20_000)
        self.check_sides(self.cloud("tunnel"), parts)

    def test_filters_before(self):
        """Points that were merged, thinned, cut, or turned, moved and scaled."""
        numbers = self.scans["attic"][3]
        merged, thinned = vtkAppendPolyData(), vtkMaskPoints()
        for number in (0, 1):
            merged.AddInputData(self.cloud("attic", numbers == number))
        merged.Update()
        self.check_sides(merged.GetOutput())
        thinned.SetInputData(self.cloud("attic"))
        thinned.SetOnRatio(2)
        thinned.SetMaximumNumberOfPoints(1 << 30)
        thinned.Update()
        self.check_sides(thinned.GetOutput(), least=0.97)  # half as many, at edges as well
        self.check_sides(self.cloud("attic", self.scans["attic"][0][:, 0] < 3))
        transform, moved = vtkTransform(), vtkTransformPolyDataFilter()
        transform.RotateX(90)
        transform.Scale(3, 3, 3)
        transform.Translate(5, 6, 7)
        moved.SetTransform(transform)
        moved.SetInputData(self.cloud("attic"))
        moved.Update()
        self.check_sides(moved.GetOutput(), turn=np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]))

    def test_picture(self):
        """One looks through the near side of the tunnel on its floor, by files of all kinds."""
        points, _, _, numbers, places, colors = self.scans["tunnel"]
        write_ptx("tunnel.ptx", points, colors, numbers, places)
        cloud, viewpoint, missing = read_ptx_cloud("tunnel.ptx")
        self.assertEqual((viewpoint, missing), (None, ""))
        write_data("tunnel.vtp", cloud)
        cloud.GetPointData().RemoveArray("ToScanner")
        write_data("without.vtp", cloud)
        seen = {}
        for path in ("tunnel.ptx", "tunnel.vtp", "without.vtp"):
            said = self.tool("render", path, "--up", "z", "--unlit", "--size", "160x120",
                             "-o", "out.png")
            self.assertEqual(self.code, 0, said)
            picture = self.read_png("out.png")[..., :3].astype(int)
            seen[path] = np.mean(np.abs(picture - FLOOR).max(axis=-1) < 12)
        self.assertGreater(seen["tunnel.ptx"], 0.04)
        self.assertEqual(seen["tunnel.vtp"], seen["tunnel.ptx"])
        self.assertLess(seen["without.vtp"], 0.004)

    def test_places_that_no_file_tells(self):
        """Scans one after another, in the order in which they were measured"""
        scene, places = attic()
        points, normals, *_ = project(scene, places, step=1.0)
        data = polydata_of(points, {})
        write_data("attic.vtp", data)
        text = self.run_tool("info", "attic.vtp").stdout
        self.assertRegex(text, r"scanners +2, told by the order of the points, which tell the sides\n"
                               r" +at 2\.5\d* [01]\.\d+ 1\.[34]\d*\n")
        found = json.loads(self.run_tool("info", "attic.vtp", "--json").stdout)["scanners"]
        np.testing.assert_allclose(found["places"], places, atol=0.02)  # gaps under the roof
        self.assertEqual(found["told_by"], "the order of the points")
        data.GetPointData().AddArray(named_array("seen", normals))
        self.check_sides(data)

    def test_info(self):
        points, _, _, numbers, places, colors = self.scans["tunnel"]
        write_ptx("tunnel.ptx", points, colors, numbers, places)
        text = self.run_tool("info", "tunnel.ptx").stdout
        self.assertRegex(text, r"scanners +3, which tell the sides\n +at 4 -0.5 1.6\n"
                               r" +at 15 0.5 1.6\n +at 26 -0.5 1.6\n")
        self.assertRegex(text, r"up +0 0 1\n")
        found = json.loads(self.run_tool("info", "tunnel.ptx", "--json").stdout)
        np.testing.assert_allclose(found["scanners"]["places"], places, atol=2e-6)
        self.assertEqual(found["scanners"]["known"], 1)
        # Of the points: above a scanner the noise is as large as their distances.
        self.assertLess(found["two_sided"], 0.05)

    def test_places(self):
        data = self.cloud("attic")
        ways = vtk_to_numpy(data.GetPointData().GetArray("ToScanner"))
        ways[:len(ways) // 4], ways[-1] = 0, np.nan
        places, known = scanners_of(data)
        np.testing.assert_allclose(places, self.scans["attic"][4], atol=1e-5)
        self.assertAlmostEqual(known, 0.75, 2)
        ways[:] += np.random.default_rng(1).normal(size=ways.shape)  # as means of several would be
        self.assertIsNone(scanners_of(data)[0])
        ways[:] = 0
        self.assertEqual(scanners_of(data), (None, 0.0))

    def test_wild_places(self):
        """A damaged file may put a scan anywhere."""
        points = np.array([[0, 0, 1], [0, 1, 0], [1e39, 0, 2], [1e39, 2, 0]])
        data = polydata_of(points, {"ToScanner": -points * [0, 1, 1]})
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertEqual(scanners_of(data), ([[0, 0, 0], [1e39, 0, 0]], 1.0))


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: BSD-3-Clause
"""The plugin in pvpython: its filters, and points and surfels as Surfel Splats in a render view."""

import os
import sys
import unittest

import numpy as np
from paraview import simple
from paraview.numpy_support import vtk_to_numpy
from paraview.vtk.vtkCommonCore import vtkFloatArray, vtkPoints
from paraview.vtk.vtkCommonDataModel import vtkPolyData
from paraview.vtk.vtkIOImage import vtkPNGReader
from paraview.vtk.vtkIOLegacy import vtkPolyDataWriter

simple.LoadPlugin(os.environ["PLUGIN"], remote=False, ns=simple.__dict__)
SIZE = 300


def write_sphere(path, count=20000, center=(0.0, 0.0, 0.0)):
    """Points alone, with their height as a scalar."""
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    r, t = np.sqrt(1 - z * z), i * np.pi * (3 - np.sqrt(5))
    data, points, height = vtkPolyData(), vtkPoints(), vtkFloatArray()
    height.SetName("height")
    for p in np.stack([r * np.cos(t), r * np.sin(t), z], 1) + center:
        points.InsertNextPoint(p)
        height.InsertNextValue(p[2])
    data.SetPoints(points)
    data.GetPointData().AddArray(height)
    writer = vtkPolyDataWriter()
    writer.SetInputData(data)
    writer.SetFileName(path)
    writer.Write()


def make_view(kind):
    view = simple.CreateView(kind)
    view.ViewSize = [SIZE, SIZE]
    view.UseColorPaletteForBackground = 0
    view.Background = [0.0, 0.0, 0.0]
    view.OrientationAxesVisibility = 0
    view.UseFXAA = 0
    view.CameraPosition = [0, 0, 5]
    view.CameraFocalPoint = [0, 0, 0]
    view.CameraViewUp = [0, 1, 0]
    view.CameraFocalDisk = 0.0
    return view


def screenshot(view):
    """-> [height, width, 3] bytes, the lowest row first"""
    simple.SaveScreenshot("picture.png", view)
    reader = vtkPNGReader()
    reader.SetFileName("picture.png")
    reader.Update()
    scalars = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
    return scalars.reshape(SIZE, SIZE, -1)[..., :3].astype(float)


class PluginCase(unittest.TestCase):
    view_type = "RenderView"

    def setUp(self):
        os.chdir("/tmp")
        write_sphere("sphere.vtk")
        self.points = simple.LegacyVTKReader(FileNames=["sphere.vtk"])
        self.view = make_view(self.view_type)

    def tearDown(self):
        simple.Delete(self.view)
        simple.ResetSession()

    def show(self, source):
        display = simple.Show(source, self.view)
        display.Representation = "Surfel Splats"
        display.ColorArrayName = ["POINTS", ""]
        display.AmbientColor = display.DiffuseColor = [1.0, 1.0, 1.0]
        return display


class Filters(PluginCase):
    def test_filters(self):
        estimation = simple.SurfelEstimation(Input=self.points)
        normalization = simple.SurfelNormalization(Input=estimation)
        hierarchy = simple.SurfelHierarchy(Input=normalization)
        hierarchy.UpdatePipeline()
        names = set(hierarchy.PointData.keys())
        self.assertLessEqual({"SurfelCovariance", "SurfelAreaVector", "height"}, names)
        self.assertIn("SurfelNodes", hierarchy.FieldData.keys())
        parts = simple.PartitionedSurfelEstimation(Input=self.points, PointsPerPart=5000)
        parts.UpdatePipeline()
        self.assertEqual(parts.GetDataInformation().GetNumberOfPoints(), 20000)
        self.assertEqual(estimation.NumberOfNeighbors, 16)


class SurfelSplats(PluginCase):
    def test_raw_points_are_a_closed_sphere(self):
        self.show(self.points)
        seen = screenshot(self.view)
        # The sphere of radius 1 seen from 5: sin = 1/5.
        radius = SIZE / 2 / np.tan(np.radians(15)) * np.tan(np.arcsin(0.2))
        y, x = np.mgrid[0:SIZE, 0:SIZE] + 0.5 - SIZE / 2
        inside = np.hypot(x, y) < radius - 4
        self.assertGreater(seen[inside].min(), 40)  # lit from the camera; no holes
        self.assertEqual(seen[np.hypot(x, y) > radius + 4].max(), 0)

    def test_surfels_are_drawn_as_they_are(self):
        self.show(self.points)
        raw = screenshot(self.view)
        simple.Hide(self.points, self.view)
        estimation = simple.SurfelEstimation(Input=self.points)
        normalization = simple.SurfelNormalization(Input=estimation)
        self.show(simple.SurfelHierarchy(Input=normalization))
        self.assertLess(np.abs(screenshot(self.view) - raw).max(), 2)

    def test_lens_of_the_view_and_of_the_representation(self):
        display = self.show(self.points)
        sharp = screenshot(self.view)
        self.view.CameraFocalDisk = 0.6
        self.view.CameraFocalDistance = 9.0
        through_camera = screenshot(self.view)
        self.assertGreater(np.abs(through_camera - sharp).max(), 60)
        of_view = self.view_type == "SurfelRenderView"
        settings, prefix = (self.view, "") if of_view else (display, "Surfel")
        setattr(settings, prefix + "LensMode", "Pinhole")
        self.assertLess(np.abs(screenshot(self.view) - sharp).max(), 2)
        setattr(settings, prefix + "LensMode", "Circle of confusion")
        # The same lens: f R / z_f.
        setattr(settings, prefix + "CircleOfConfusion",
                SIZE / 2 / np.tan(np.radians(15)) * 0.3 / 9.0)
        self.assertLess(np.abs(screenshot(self.view) - through_camera).max(), 2)

    def test_colors_by_an_array(self):
        display = self.show(self.points)
        simple.ColorBy(display, ("POINTS", "height"))
        simple.GetColorTransferFunction("height").RGBPoints = [-1, 0, 0, 1, 1, 1, 0, 0]
        self.view.CameraPosition = [5, 0, 0]
        self.view.CameraViewUp = [0, 0, 1]
        seen = screenshot(self.view)
        column = seen[:, SIZE // 2]
        self.assertGreater(column[SIZE // 2 + 40, 0], column[SIZE // 2 - 40, 0] + 60)
        self.assertGreater(column[SIZE // 2 - 40, 2], column[SIZE // 2 + 40, 2] + 20)

    def test_hidden_by_and_hiding_a_mesh(self):
        self.show(self.points)
        box = simple.Box(XLength=0.5, YLength=0.5, ZLength=0.5, Center=[0, 0, 1.5])
        simple.Show(box, self.view).DiffuseColor = [0.0, 1.0, 0.0]
        middle = SIZE // 2
        self.assertLess(screenshot(self.view)[middle, middle, 0], 5)
        box.Center = [0, 0, -1.5]
        self.assertGreater(screenshot(self.view)[middle, middle, 0], 180)


class SurfelRenderView(SurfelSplats):
    """The same, and meshes through the lens, in the view that has the pass."""

    view_type = "SurfelRenderView"

    def width_of_edges(self):
        row = screenshot(self.view)[SIZE // 2, :, 0]
        self.assertGreater(row.max(), 100)
        return ((row > 0.1 * row.max()) & (row < 0.9 * row.max())).sum()

    def test_meshes_are_blurred(self):
        plane = simple.Plane(Origin=[-1, -1, -3], Point1=[0, -1, -3], Point2=[-1, 1, -3])
        display = simple.Show(plane, self.view)
        display.AmbientColor = display.DiffuseColor = [1.0, 1.0, 1.0]
        self.view.CameraFocalDisk = 0.6
        self.view.CameraFocalDistance = 4.0
        for cells in (1, 7):
            self.view.LensCells = cells
            self.assertGreater(self.width_of_edges(), 15, cells)
        self.view.OtherPropsThroughLens = 0
        self.assertLess(self.width_of_edges(), 3)


if __name__ == "__main__":
    loader = unittest.defaultTestLoader
    result = unittest.TextTestRunner(verbosity=2).run(unittest.TestSuite(
        loader.loadTestsFromTestCase(case) for case in (Filters, SurfelSplats, SurfelRenderView)))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0 if result.wasSuccessful() else 1)  # pvpython's own end takes no status

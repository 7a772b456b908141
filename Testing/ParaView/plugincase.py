# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the plugin share: clouds in files, views, screenshots."""

import os
import unittest

import numpy as np
from paraview import simple
from paraview.numpy_support import numpy_to_vtk, vtk_to_numpy
from paraview.vtk.vtkCommonCore import vtkFloatArray, vtkPoints
from paraview.vtk.vtkCommonDataModel import vtkPolyData
from paraview.vtk.vtkIOImage import vtkPNGReader
from paraview.vtk.vtkIOLegacy import vtkPolyDataWriter

from views import SIZE, plain_view, show_splats

simple.LoadPlugin(os.environ["PLUGIN"], remote=False, ns=simple.__dict__)
simple._DisableFirstRenderCameraReset()
FOCAL_LENGTH = SIZE / 2 / np.tan(np.radians(15))  # px


def sphere(count, center, radius=1.0):
    """-> [count, 3] Fibonacci points"""
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    r, t = np.sqrt(1 - z * z), i * np.pi * (3 - np.sqrt(5))
    return np.stack([r * np.cos(t), r * np.sin(t), z], 1) * radius + center


def write_sphere(path, count=20000, center=(0.0, 0.0, 0.0), colors=False):
    """Points alone, with their height as a scalar; or with colours, red at the left, blue at the right."""
    data, points, height = vtkPolyData(), vtkPoints(), vtkFloatArray()
    height.SetName("height")
    places = sphere(count, center)
    for p in places:
        points.InsertNextPoint(p)
        height.InsertNextValue(p[2])
    data.SetPoints(points)
    data.GetPointData().AddArray(height)
    if colors:
        red_or_blue = np.where(places[:, :1] < 0, (255, 0, 0), (0, 0, 255)).astype(np.uint8)
        array = numpy_to_vtk(red_or_blue, deep=1)
        array.SetName("RGB")
        data.GetPointData().AddArray(array)
    writer = vtkPolyDataWriter()
    writer.SetInputData(data)
    writer.SetFileName(path)
    writer.Write()


def make_view(kind):
    view = plain_view(kind, [0.0, 0.0, 0.0], [0, 0, 5])
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
        os.chdir(os.environ["FOLDER"])
        write_sphere("sphere.vtk")
        self.points = simple.LegacyVTKReader(FileNames=["sphere.vtk"])
        self.view = make_view(self.view_type)

    def tearDown(self):
        for proxy in [*simple.GetViews(), *simple.GetSources().values()]:
            simple.Delete(proxy)

    @classmethod
    def tearDownClass(cls):
        simple.ResetSession()  # takes as long as most of the cases

    def show(self, source):
        return show_splats(source, self.view)

# SPDX-License-Identifier: BSD-3-Clause
"""Surfels, captures and scenes for the tests of views."""

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData

from surfelsplatting.clouds.polydata import named_array, polydata_of
from toolcase import sphere

TO_Y = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # turns z to y; its transpose z to -y


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

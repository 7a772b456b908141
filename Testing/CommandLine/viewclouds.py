# SPDX-License-Identifier: BSD-3-Clause
"""Surfels, captures and scenes for the tests of views."""

import math

import numpy as np
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData

from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.vtkarrays import named_array
from toolcase import sphere

TO_Y = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # turns z to y; its transpose z to -y


def surfels_of(points, normals, origin=None, two_sided=False):
    surfels = vtkPolyData()
    vertices = vtkPoints()
    vertices.SetData(named_array("Points", points, np.float32))
    surfels.SetPoints(vertices)
    for name, values, kind in (("SurfelAreaVector", normals, np.float32),
                               ("SurfelTwoSided", np.full(len(points), two_sided), np.uint8)):
        surfels.GetPointData().AddArray(named_array(name, values, kind))
    if origin is not None:
        surfels.GetFieldData().AddArray(named_array("SurfelOrigin", [origin], float))
    return surfels


def capture_of(points, faint=False):
    """Round Gaussians, opaque or faint."""
    covariance = np.tile([1e-4, 1e-4, 1e-4, 0, 0, 0], (len(points), 1))
    opacity = np.where(faint, 0.2, 0.95) * np.ones(len(points))
    capture = polydata_of(points, {})
    for name, values in (("GaussianCovariance", covariance), ("GaussianOpacity", opacity)):
        capture.GetPointData().AddArray(named_array(name, values, np.float32))
    return capture


def on_screen(view, points):
    """Where points come to lie: [n, 2], -1 to 1 over the picture, and their depths."""
    position, target, up = (np.array(v) for v in (view.position, view.focal_point, view.view_up))
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    local = points - position
    depth = local @ forward
    tan_y = math.tan(math.radians(view.view_angle) / 2)
    tan_x = tan_y * view.size[0] / view.size[1]
    return np.column_stack([local @ right / depth / tan_x,
                            local @ np.cross(right, forward) / depth / tan_y]), depth


def scene(noise=0.0):
    """[n, 3]: a ball on the ground, z is up"""
    rng = np.random.default_rng(2)
    ball = 0.6 * sphere(5000)[0] + [0.3, 0, 0.6]
    ground = np.column_stack([*rng.uniform(-2, 2, (2, 10_000)), np.zeros(10_000)])
    points = np.vstack([ball, ground])
    return points + noise * rng.normal(size=points.shape)

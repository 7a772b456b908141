# SPDX-License-Identifier: BSD-3-Clause
"""A scene of meshes and the cloud sampled from it: what a point cloud is compared on with renderers
of meshes. Thin bars out of focus, a bumpy ball in focus, a striped wall behind."""

import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkIdTypeArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkCamera

from clouds import color_array, points_of


def _grid(function, rows, columns):
    """Triangles over (u, v) in [0, 1]^2; function(u, v) -> positions, colours."""
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
    positions, colors = function(u.ravel(), v.ravel())
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    triangles = np.concatenate([
        np.column_stack([corner, corner + 1, corner + columns]),
        np.column_stack([corner + 1, corner + columns + 1, corner + columns])])
    return positions, colors, triangles


def _wall(u, v):
    x, y = 8 * u - 4, 8 * v - 4
    stripes = np.tanh(6 * np.sin(5 * x) * np.sin(5 * y))
    colors = np.column_stack([0.55 + 0.4 * stripes, 0.5 + 0 * x, 0.55 - 0.35 * stripes])
    return np.column_stack([x, y, 0 * x - 2.5]), colors


def _ball(u, v):
    angle, height = 2 * math.pi * u, 0.9995 * math.pi * (v - 0.5)  # poles are not triangles
    unit = np.column_stack([np.cos(height) * np.cos(angle), np.cos(height) * np.sin(angle),
                            np.sin(height)])
    bumps = 1 + 0.04 * np.sin(7 * unit).prod(axis=1)
    shade = np.tanh(5 * np.sin(9 * unit[:, 2] + 2 * np.sin(5 * unit[:, 0])))
    colors = np.column_stack([0.85 + 0.1 * shade, 0.5 + 0.3 * shade, 0.25 + 0 * shade])
    return unit * bumps[:, None], colors


def _bar(x, slope, hue):
    def surface(u, v):
        angle, y = -2 * math.pi * u, 6 * v - 3  # normals outwards
        ring = np.column_stack([0.05 * np.cos(angle), 0 * y, 0.05 * np.sin(angle)])
        axis = np.column_stack([x + slope * y, y, 0 * y + 2.4])
        light = 0.6 + 0.3 * np.tanh(8 * np.sin(6 * y))
        return axis + ring, light[:, None] * np.array(hue)
    return surface


def _join(parts):
    positions, colors, triangles, count = [], [], [], 0
    for p, c, t in parts:
        positions.append(p)
        colors.append(c)
        triangles.append(t + count)
        count += len(p)
    return np.concatenate(positions), np.concatenate(colors), np.concatenate(triangles)


class MeshScene:
    name = "bars, ball and wall"

    def __init__(self, detail=1.0, points=400_000):
        def n(count):
            return max(8, round(count * detail))
        self.positions, self.colors, self.triangles = _join([
            _grid(_wall, n(480), n(480)), _grid(_ball, n(240), n(480)),
            *(_grid(_bar(x, slope, hue), n(240), n(24)) for x, slope, hue in (
                (-0.9, 0.1, (1, 0.9, 0.3)), (-0.25, -0.12, (0.4, 1, 0.5)),
                (0.35, 0.05, (0.5, 0.8, 1)), (0.95, -0.08, (1, 0.5, 0.8))))])
        self.points = points

    def camera(self):
        camera = vtkCamera()
        camera.SetPosition(0.3, 0.2, 6)
        camera.SetFocalPoint(0, 0, 0)
        camera.SetViewAngle(30)
        camera.SetFocalDistance(5.2)  # the ball's front
        return camera

    def mesh(self):
        mesh = vtkPolyData()
        mesh.SetPoints(points_of(self.positions))
        mesh.GetPointData().SetScalars(color_array(self.colors))
        ids = np.column_stack([np.full(len(self.triangles), 3), self.triangles]).astype(np.int64)
        cells = vtkCellArray()
        array = numpy_to_vtk(ids.ravel(), deep=True, array_type=vtkIdTypeArray().GetDataType())
        cells.ImportLegacyFormat(array)
        mesh.SetPolys(cells)
        return mesh

    def cloud(self):
        """Points spread evenly over the triangles, at random."""
        rng = np.random.default_rng(7)
        corners = self.positions[self.triangles]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(sides, axis=1)
        which = rng.choice(len(area), self.points, p=area / area.sum())
        a, b = rng.random((2, self.points))
        flip = a + b > 1
        a[flip], b[flip] = 1 - a[flip], 1 - b[flip]
        weights = np.stack([1 - a - b, a, b], axis=1)[:, :, None]
        cloud = vtkPolyData()
        cloud.SetPoints(points_of((corners[which] * weights).sum(axis=1)))
        colors = self.colors[self.triangles[which]]
        cloud.GetPointData().SetScalars(color_array((colors * weights).sum(axis=1)))
        return cloud

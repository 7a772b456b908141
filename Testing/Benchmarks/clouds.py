# SPDX-License-Identifier: BSD-3-Clause
"""What the benchmarks measure on: clouds, their surfels and cameras."""

import json
import math
import subprocess
from types import SimpleNamespace

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData

from renderers import view_camera
from surfelsplatting.shapes.samples import Samples
from surfelsplatting.views.cameras import View
from surfelsplatting.views.framing import complete_view, surface_in_the_middle
from surfelsplatting.vtkarrays import named_array
from surfelsplatting.vtkSurfelFilters import vtkSurfelEstimation, vtkSurfelNormalization
from surfelsplatting.vtkSurfelReaders import vtkPointCloudReader

TRUTH_SCENES = ("plane", "stanford-bunny", "bars", "veil")


def read(path):
    reader = vtkPointCloudReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def surfels_of(cloud):
    estimation = vtkSurfelEstimation()
    estimation.SetInputData(cloud)
    normalization = vtkSurfelNormalization()
    normalization.SetInputConnection(estimation.GetOutputPort())
    normalization.Update()
    return normalization.GetOutput()


def resample(surfels, count):
    """A cloud of about `count` points drawn from the surfels' kernels, with their colours."""
    rng = np.random.default_rng(1)
    points = vtk_to_numpy(surfels.GetPoints().GetData()).astype(float)
    s = vtk_to_numpy(surfels.GetPointData().GetArray("SurfelCovariance")).astype(float)
    matrices = s[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    values, vectors = np.linalg.eigh(matrices)
    pick = rng.integers(0, len(points), count)
    steps = rng.normal(size=(count, 3)) * np.sqrt(np.maximum(values[pick], 0))
    moved = points[pick] + np.einsum("nij,nj->ni", vectors[pick], steps)
    cloud = vtkPolyData()
    cloud.SetPoints(points_of(moved))
    scalars = surfels.GetPointData().GetScalars()
    if scalars:
        cloud.GetPointData().SetScalars(named_array("RGB", vtk_to_numpy(scalars)[pick]))
    return cloud


def framed_camera(surfels):
    """As surfelsplat render shows it."""
    anywhere = SimpleNamespace(viewpoint=None, columns=None, image=None)
    view = complete_view(View(size=(512, 512)), anywhere, surfels)
    focus = surface_in_the_middle(Samples(surfels), np.array(view.position),
                                  np.array(view.focal_point), view)
    return view_camera({"position": view.position, "focalPoint": view.focal_point,
                        "viewUp": view.view_up, "viewAngle": view.view_angle,
                        "focalDistance": focus})


def largest_confusion(surfels, camera):
    """Largest circle of confusion of any surfel but one in a hundred, over that of a point at
    infinity."""
    points = vtk_to_numpy(surfels.GetPoints().GetData()).astype(float)
    depth = (points - camera.GetPosition()) @ np.array(camera.GetDirectionOfProjection())
    depth = depth[depth > 0.05 * camera.GetDistance()]
    return np.abs(1 - camera.GetFocalDistance() / np.percentile(depth, [0.5, 99.5])).max()


def truth_views(folder, scene):
    """-> {blur at infinity in px: (view, path of the ray-traced picture)}"""
    with open(f"{folder}/{scene}.json", encoding="utf-8") as file:
        views = {view["name"]: view for view in json.load(file)["views"]}
    names = {0: "pinhole", 4: "coc4", 12: "coc12", 36: "coc36"}
    return {blur: (views[name], f"{folder}/{scene}-{name}.exr") for blur, name in names.items()}


def read_exr(dump, path):
    """[height, width, 3], top row first, by the DumpEXR of the build's tests."""
    found = subprocess.run([dump, path], capture_output=True, check=True).stdout
    line, values = found.split(b"\n", 1)
    width, height, _, *channels = line.decode().split()
    planes = np.frombuffer(values, np.float32).reshape(len(channels), int(height), int(width))
    names = [channel.split(":")[0] for channel in channels]
    return np.stack([planes[names.index(c)] for c in "RGB"], axis=-1).astype(float)


def points_of(positions):
    points = vtkPoints()
    points.SetData(named_array("Points", positions, np.float32))
    return points


def color_array(values):
    """[n, 3] in [0, 1] -> unsigned char RGB."""
    return named_array("RGB", np.round(255 * np.clip(values, 0, 1)), np.uint8)


def unit_sphere(count):
    """[n, 3] points, evenly spread"""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    ring, angle = np.sqrt(1 - z * z), k * 2.399963229728653
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])


def bumpy_ball(count=60_000):
    """Points of a textured ball, without any file."""
    unit = unit_sphere(count)
    cloud = vtkPolyData()
    cloud.SetPoints(points_of(unit * (1 + 0.05 * np.sin(9 * unit).prod(axis=1))[:, None]))
    cloud.GetPointData().SetScalars(color_array(0.5 + 0.5 * np.sin(20 * unit)))
    return cloud


def sphere_surfels(count):
    """Surfels on the unit sphere, by formula: millions of points need no estimation here."""
    normals = unit_sphere(count)
    area = 4 * math.pi / count
    s = 0.25 * area * np.stack([1 - normals[:, 0] ** 2, 1 - normals[:, 1] ** 2,
                                1 - normals[:, 2] ** 2, -normals[:, 0] * normals[:, 1],
                                -normals[:, 1] * normals[:, 2], -normals[:, 0] * normals[:, 2]], 1)
    surfels = vtkPolyData()
    surfels.SetPoints(points_of(normals))
    for name, values in (("SurfelCovariance", s), ("SurfelAreaVector", area * normals)):
        surfels.GetPointData().AddArray(named_array(name, values, np.float32))
    surfels.GetPointData().SetScalars(color_array(0.5 + 0.5 * np.sin(20 * normals)))
    return surfels

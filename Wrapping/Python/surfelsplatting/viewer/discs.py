# SPDX-License-Identifier: BSD-3-Clause
"""Points as discs, to be looked at until their surfels are estimated."""

import math

import numpy as np

from ..backend import vtk
from ..clouds.thinning import copy_rows
from ..vtkarrays import named_array, to_numpy

LARGEST = 200_000  # points that are shown
SAMPLES = 500  # points whose neighbours are looked up
NEIGHBORS = 6


def _area_per_point(points):
    """The median over samples of the area that a point has to itself, world units squared."""
    locator = vtk("vtkCommonDataModel").vtkStaticPointLocator()
    locator.SetDataSet(points)
    locator.BuildLocator()
    places = points.GetPoints()
    count = points.GetNumberOfPoints()
    found = vtk("vtkCommonCore").vtkIdList()
    areas = []
    for index in range(0, count, max(1, count // SAMPLES)):
        place = places.GetPoint(index)
        locator.FindClosestNPoints(NEIGHBORS + 1, place, found)  # the point itself is one of them
        far = places.GetPoint(found.GetId(found.GetNumberOfIds() - 1))
        areas.append(math.pi * math.dist(place, far) ** 2 / NEIGHBORS)
    area = float(np.median(areas))
    if area > 0:
        return area
    return max(points.GetLength(), 1e-6) ** 2 / count  # most points have several copies


def _chosen(cloud):
    """-> indices of the finite points that are shown, and their coordinates"""
    places = to_numpy(cloud.GetPoints().GetData())
    count = len(places)
    some = np.arange(0, count, -(-count // LARGEST))
    with np.errstate(invalid="ignore"):
        places = places[some].astype(np.float64)
    finite = np.isfinite(places).all(axis=1)
    return some[finite], places[finite]


def _normals(cloud, chosen):
    """[n, 3] unit normals from the file, or None; zero where there is none."""
    data = cloud.GetPointData()
    array = data.GetNormals() or data.GetArray("Normals")
    if not array or array.GetNumberOfComponents() != 3:
        return None
    with np.errstate(invalid="ignore"):
        normals = to_numpy(array)[chosen].astype(np.float32)
    length = np.linalg.norm(normals, axis=1)
    usable = np.isfinite(length) & (length > 0.5)
    if usable.mean() < 0.5:
        return None
    normals[~usable], length[~usable] = 0, 1
    return normals / length[:, None]


def _kernels(area, normals, count):
    """-> covariances and area vectors, with half the spacing as deviation. Without normals they are
    balls, which look the same from everywhere."""
    across = np.ones(6, np.float32) * (1, 1, 1, 0, 0, 0)
    if normals is None:
        return np.tile(area / 4 * across, (count, 1)), np.tile((0, 0, area), (count, 1))
    x, y, z = normals.T
    products = np.column_stack([x * x, y * y, z * z, x * y, y * z, x * z])
    return area / 4 * (across - products), area * normals


def discs_of(cloud):
    """-> vtkPolyData with the arrays of the data contract; empty without finite points."""
    chosen, places = _chosen(cloud)
    count = len(places)
    origin = np.round(places.mean(axis=0)) if count else np.zeros(3)
    points = vtk("vtkCommonCore").vtkPoints()
    points.SetData(named_array("Points", (places - origin).astype(np.float32)))
    discs = vtk("vtkCommonDataModel").vtkPolyData()
    discs.SetPoints(points)
    if not count:
        return discs
    copy_rows(cloud, discs, chosen)
    normals = _normals(cloud, chosen)
    covariances, areas = _kernels(_area_per_point(discs), normals, count)
    data = discs.GetPointData()
    data.AddArray(named_array("SurfelCovariance", covariances.astype(np.float32)))
    data.AddArray(named_array("SurfelAreaVector", areas.astype(np.float32)))
    if normals is None:
        data.AddArray(named_array("SurfelTwoSided", np.ones(count, np.uint8)))
    discs.GetFieldData().AddArray(named_array("SurfelOrigin", origin))
    return discs


def turn_discs(discs, direction):
    """Turns discs without normals to a camera that looks in this direction, a unit vector."""
    if not discs.GetPointData().HasArray("SurfelTwoSided"):
        return
    vectors = discs.GetPointData().GetArray("SurfelAreaVector")
    area = math.hypot(*vectors.GetTuple3(0))
    for component in range(3):
        vectors.FillComponent(component, -area * direction[component])
    vectors.Modified()
    discs.Modified()

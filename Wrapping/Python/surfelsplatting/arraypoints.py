# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of numpy as a cloud of points: their types and shapes are checked."""

import os

import numpy as np

from .backend import vtk
from .colormaps import range_of
from .vtkarrays import named_array

SCALARS = "Scalars"  # the array of numbers that colour points


def _rows(values, count, widths, what):
    """An array of one row of numbers for each of count points."""
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{what} have the type {array.dtype}; give integers or floats")
    if array.ndim != 2 or array.shape[1] not in widths:
        wanted = " or ".join(f"(n, {width})" for width in widths)
        raise ValueError(f"{what} have the shape {array.shape}; it must be {wanted}")
    if count is not None and len(array) != count:
        raise ValueError(f"{what} have {len(array)} rows, but there are {count} points; give one "
                         "row for each point")
    return array


def point_rows(points):
    """Coordinates of points as floats; doubles unless they are floats already."""
    if isinstance(points, (str, os.PathLike)):
        raise TypeError(f"points are {points!r}; give an array of shape (n, 3), for example "
                        "pyvista.read(file).points")
    if np.ma.isMaskedArray(points):
        points = np.ma.filled(points.astype(np.float64), np.nan)
    points = _rows(points, None, (3,), "points")
    return points if points.dtype == np.float32 else points.astype(np.float64)


def color_rows(colors, count):
    """RGB or RGBA of points as bytes; floats are from 0 to 1."""
    if np.shape(colors) in ((3,), (4,)):  # one for all
        colors = np.tile(colors, (count, 1))
    colors = _rows(colors, count, (3, 4), "colors")
    largest = 1 if colors.dtype.kind == "f" else 255
    if colors.size and not (colors.min() >= 0 and colors.max() <= largest):  # not if NaN, either
        raise ValueError(f"colors are from {colors.min()} to {colors.max()}; integers must be from "
                         "0 to 255, floats from 0 to 1")
    return (np.rint(255 * colors) if largest == 1 else colors).astype(np.uint8)


def polydata_of_arrays(points, colors, normals):
    points = point_rows(points)
    cloud = vtk("vtkCommonDataModel").vtkPolyData()
    positions = vtk("vtkCommonCore").vtkPoints()
    positions.SetData(named_array("Points", points))
    cloud.SetPoints(positions)
    data = cloud.GetPointData()
    if colors is not None:
        data.SetScalars(named_array("Colors", color_rows(colors, len(points))))
    if normals is not None:
        normals = _rows(normals, len(points), (3,), "normals").astype(np.float32)
        data.SetNormals(named_array("Normals", normals))
    return cloud


def add_scalars(cloud, scalars, colors, limits):
    """Adds the scalars to the points. -> their limits, or None without scalars"""
    if scalars is None:
        return None
    if colors is not None:
        raise ValueError("there are both scalars and colors; give one of them")
    values = np.asarray(scalars)
    count = cloud.GetNumberOfPoints()
    if values.dtype.kind not in "biuf" or values.shape != (count,):
        raise ValueError(f"scalars have the type {values.dtype} and the shape {values.shape}; give one "
                         f"number for each of the {count} points")
    cloud.GetPointData().AddArray(named_array(SCALARS, values.astype(np.float64)))
    if limits is None:
        return range_of(cloud, SCALARS)
    if len(limits) != 2 or limits[0] == limits[1] or not np.isfinite(limits).all():
        raise ValueError(f"clim is {limits!r}; it must be two numbers that differ")
    return tuple(limits)

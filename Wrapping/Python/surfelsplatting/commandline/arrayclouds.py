# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of numpy as point clouds."""

import numpy as np

from ..backend import vtk


def _to_vtk(name, values, kind):
    array = vtk("util.numpy_support").numpy_to_vtk(np.ascontiguousarray(values, dtype=kind), deep=True)
    array.SetName(name)
    return array


def polydata_of(places, arrays):
    """-> vtkPolyData with double points.

    arrays: those there are of "RGB" (bytes), "Normals" and "intensity", each with a row per point.
    """
    points = vtk("vtkCommonCore").vtkPoints()
    points.SetData(_to_vtk("Points", places, np.float64))
    cloud = vtk("vtkCommonDataModel").vtkPolyData()
    cloud.SetPoints(points)
    data = cloud.GetPointData()
    if "RGB" in arrays:
        data.SetScalars(_to_vtk("RGB", arrays["RGB"], np.uint8))
    if "Normals" in arrays:
        data.SetNormals(_to_vtk("Normals", arrays["Normals"], np.float32))
    if "intensity" in arrays:
        data.AddArray(_to_vtk("intensity", arrays["intensity"], np.float32))
    return cloud

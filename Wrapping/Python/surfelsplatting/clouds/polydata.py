# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of numpy as point clouds."""

import numpy as np

from ..backend import vtk
from .stations import TO_SCANNER
from ..vtkarrays import named_array


def cells_of(corners, ends):
    """-> vtkCellArray; corners: numbers of points of all cells in a row; ends: [n + 1] where cells
    begin and end there"""
    core, cells = vtk("vtkCommonCore"), vtk("vtkCommonDataModel").vtkCellArray()
    support = vtk("util.numpy_support")
    cells.SetData(*(support.numpy_to_vtk(np.ascontiguousarray(values, np.int64), deep=True,
                                         array_type=core.vtkIdTypeArray().GetDataType())
                    for values in (ends, corners)))
    return cells


def polydata_of(places, arrays, faces=None):
    """-> vtkPolyData with double points.

    arrays: those there are of "RGB" (bytes), "Normals", "ToScanner", "intensity" and other scalars,
    each with a row per point.
    faces: vtkCellArray
    """
    points = vtk("vtkCommonCore").vtkPoints()
    points.SetData(named_array("Points", places, np.float64))
    cloud = vtk("vtkCommonDataModel").vtkPolyData()
    cloud.SetPoints(points)
    if faces is not None:
        cloud.SetPolys(faces)
    data = cloud.GetPointData()
    if "RGB" in arrays:
        data.SetScalars(named_array("RGB", arrays["RGB"], np.uint8))
    if "Normals" in arrays:
        data.SetNormals(named_array("Normals", arrays["Normals"], np.float32))
    if TO_SCANNER in arrays:  # filters that turn points turn active vectors with them
        data.SetVectors(named_array(TO_SCANNER, arrays[TO_SCANNER], np.float32))
    for name, values in arrays.items():
        if name not in ("RGB", "Normals", TO_SCANNER):
            kind = np.float32 if name == "intensity" else values.dtype  # times need all digits
            data.AddArray(named_array(name, values, kind))
    return cloud

# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of numpy, and data sets of VTK, as point clouds."""

import numpy as np

from ..backend import vtk
from .stations import TO_SCANNER
from ..vtkarrays import named_array, to_numpy


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


def _grid_points(grid):
    """vtkPoints of a vtkImageData or vtkRectilinearGrid; x runs fastest."""
    origin, matrix = np.zeros(3), np.eye(3)
    if grid.IsA("vtkRectilinearGrid"):
        arrays = grid.GetXCoordinates(), grid.GetYCoordinates(), grid.GetZCoordinates()
        axes = [to_numpy(array) if array else np.zeros(0) for array in arrays]
    else:
        extent, spacing = grid.GetExtent(), grid.GetSpacing()
        axes = [spacing[i] * np.arange(extent[2 * i], extent[2 * i + 1] + 1) for i in range(3)]
        origin, direction = np.array(grid.GetOrigin()), grid.GetDirectionMatrix()
        matrix = np.array([[direction.GetElement(i, j) for j in range(3)] for i in range(3)])
    z, y, x = np.meshgrid(*reversed(axes), indexing="ij")
    places = origin + np.column_stack([x.ravel(), y.ravel(), z.ravel()]) @ matrix.T
    points = vtk("vtkCommonCore").vtkPoints()
    points.SetData(named_array("Points", places, float))
    return points


def _faces_of(grid):
    """-> vtkCellArray of the cells of a vtkUnstructuredGrid; None if some of them are no faces, or
    do not pass from corner to corner. Points and lines are cells with fewer than three corners."""
    if not grid.GetNumberOfCells():
        return None
    types = vtk("vtkCommonDataModel")
    flat = (types.VTK_VERTEX, types.VTK_LINE, types.VTK_TRIANGLE, types.VTK_QUAD, types.VTK_POLYGON)
    # VTK 9.1 knows only the types of all cells, which are deprecated in 9.6.
    found = getattr(grid, "GetDistinctCellTypesArray", grid.GetCellTypesArray)()
    is_flat = np.isin(to_numpy(found), flat).all()
    return grid.GetCells() if is_flat else None


def as_polydata(data):
    """The points of a vtkDataSet and their arrays, and its faces if it has no other cells."""
    if data is None or data.GetNumberOfPoints() <= 0:  # damaged extents make it negative
        return vtk("vtkCommonDataModel").vtkPolyData()
    if data.IsA("vtkPolyData"):
        return data
    cloud = vtk("vtkCommonDataModel").vtkPolyData()
    is_grid = data.IsA("vtkImageData") or data.IsA("vtkRectilinearGrid")
    points = _grid_points(data) if is_grid else data.GetPoints()
    if points.GetNumberOfPoints() != data.GetNumberOfPoints():
        return cloud
    cloud.SetPoints(points)
    cloud.GetPointData().ShallowCopy(data.GetPointData())
    cloud.GetFieldData().ShallowCopy(data.GetFieldData())
    if data.IsA("vtkUnstructuredGrid"):
        cloud.SetPolys(_faces_of(data))
    return cloud

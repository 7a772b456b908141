# SPDX-License-Identifier: BSD-3-Clause
"""Reads the points of VTK's own files, .vtp, .vtu, .vti and .vtk, and volumes."""

import os
from contextlib import nullcontext

import numpy as np

from ..backend import vtk
from .colors import COLOR_NAMES, color_bytes, is_colors
from .probing import check_survives, silent_libraries
from .rawvolumes import check_raw_size
from .volumes import is_volume
from ..problems import UserProblem
from ..vtkarrays import named_array, to_numpy

_READERS = {".vtp": ("vtkIOXML", "vtkXMLPolyDataReader"),
            ".vtu": ("vtkIOXML", "vtkXMLUnstructuredGridReader"),
            ".vti": ("vtkIOXML", "vtkXMLImageDataReader"),
            ".vtk": ("vtkIOLegacy", "vtkDataSetReader"),
            ".mhd": ("vtkIOImage", "vtkMetaImageReader"),
            ".mha": ("vtkIOImage", "vtkMetaImageReader"),
            ".nrrd": ("vtkIOImage", "vtkNrrdReader"),
            ".nhdr": ("vtkIOImage", "vtkNrrdReader")}
_RAW = (".mhd", ".mha", ".nrrd", ".nhdr")
END_OF_TEXT = "file stream is fail after read"  # of numbers as text; the last one may end the file


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


def _use_colors(cloud):
    """Colours that other programs write by name become the scalars."""
    data = cloud.GetPointData()
    if is_colors(data.GetScalars()):
        return
    for number in range(data.GetNumberOfArrays()):
        if (data.GetArrayName(number) or "").lower() in COLOR_NAMES:
            colors = color_bytes(data.GetArray(number))
            if colors is not None and colors.GetNumberOfTuples() == cloud.GetNumberOfPoints():
                data.SetScalars(colors)
                return


def _make_reader(path):
    module, name = _READERS[os.path.splitext(path)[1].lower()]
    reader = getattr(vtk(module), name)()
    reader.SetFileName(path)
    if name == "vtkDataSetReader":
        for kind in ("Scalars", "Vectors", "Normals", "ColorScalars", "Fields"):
            getattr(reader, "ReadAll" + kind + "On")()
    return reader


def _volume_or_points(data):
    """-> vtkImageData of a volume, or vtkPolyData of the points"""
    if data is not None and data.GetNumberOfPoints() > 0 and is_volume(data):
        return data
    cloud = as_polydata(data)
    _use_colors(cloud)
    return cloud


def _check_said(path, said):
    """UserProblem if the library of raw volumes printed something other than warnings, for which VTK
    has no word, or fewer words."""
    lines = [line.strip() for line in said.splitlines() if "warning" not in line.lower()]
    lines = [line for line in lines if line and END_OF_TEXT not in line]
    if lines:
        # The first ones tell the cause, those that begin with a class who passed it on.
        text = next((line for line in lines if not line.startswith("Meta")), lines[0])
        raise UserProblem(f"{path} is damaged: {text}")


def read_dataset(path, messages, progress):
    """-> vtkPolyData, or vtkImageData of a volume"""
    def try_out():
        reader = _make_reader(path)
        reader.Update()
        _volume_or_points(reader.GetOutput())

    reader = _make_reader(path)  # loads its module before there is a child
    said = check_survives(path, try_out)
    with silent_libraries() if said else nullcontext():
        progress.update(reader, "reading")
    extension, is_text = os.path.splitext(path)[1], False
    if extension.lower() in _RAW:  # first: it says what is missing
        is_text = check_raw_size(path, reader.GetOutput().GetPointData().GetScalars())
        _check_said(path, said)
    if is_text:
        messages.forget()  # VTK 9.7 takes it for an error if the last number ends the file
    messages.check(f"{path} is not a readable {extension} file: ")
    return _volume_or_points(reader.GetOutput())

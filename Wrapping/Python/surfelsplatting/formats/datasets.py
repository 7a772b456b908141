# SPDX-License-Identifier: BSD-3-Clause
"""Reads the points of VTK's own files, .vtp, .vtu, .vti and .vtk, and volumes."""

import os
from contextlib import nullcontext

import numpy as np

from ..backend import vtk
from ..clouds.colors import COLOR_NAMES, color_bytes, is_colors
from ..clouds.polydata import as_polydata
from ..clouds.volumes import is_volume
from ..problems import UserProblem
from ..vtkarrays import named_array, to_numpy
from .columnnames import NORMALS, RGB, XYZ, meanings_of
from .columns import Columns, arrays_of_columns
from .probing import check_survives, silent_libraries
from .rawvolumes import check_raw_size

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


def _numbers_by_meaning(data, count):
    """-> {red and the like: name} of arrays with one number for each of so many points"""
    arrays = [data.GetArray(number) for number in range(data.GetNumberOfArrays())]
    arrays = [array for array in arrays if array and array.GetName() and array.GetNumberOfComponents() == 1
              and array.GetNumberOfTuples() == count]
    names = [array.GetName() for array in arrays]
    return dict(zip(meanings_of(names), names))


def _join_columns(cloud):
    """Colours and normals in three arrays, as of tables that ParaView has read, become one."""
    data = cloud.GetPointData()
    named = _numbers_by_meaning(data, cloud.GetNumberOfPoints())
    wanted = [*([] if is_colors(data.GetScalars()) else [RGB]), *([] if data.GetNormals() is not None else [NORMALS])]
    meanings = [meaning for triple in wanted if set(triple) <= set(named) for meaning in triple]
    if not meanings or not cloud.GetNumberOfPoints():
        return
    places = to_numpy(cloud.GetPoints().GetData())
    table = np.column_stack([places, *(to_numpy(data.GetArray(named[meaning])) for meaning in meanings)])
    _, arrays = arrays_of_columns(table, Columns([*XYZ, *meanings], "by their names"))
    for meaning in meanings:
        data.RemoveArray(named[meaning])
    if "RGB" in arrays:
        data.SetScalars(named_array("RGB", arrays["RGB"]))
    if "Normals" in arrays:
        data.SetNormals(named_array("Normals", arrays["Normals"], np.float32))


def _make_reader(path):
    module, name = _READERS[os.path.splitext(path)[1].lower()]
    reader = getattr(vtk(module), name)()
    reader.SetFileName(os.fsencode(path))
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
    _join_columns(cloud)
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

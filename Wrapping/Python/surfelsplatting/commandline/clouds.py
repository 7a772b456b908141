# SPDX-License-Identifier: BSD-3-Clause
"""Reads point clouds of all formats that the tool supports."""

import os
from dataclasses import dataclass, field
from typing import Optional, Tuple

from ..backend import vtk
from .problems import UserProblem

SURFEL_ARRAYS = ("SurfelCovariance", "SurfelAreaVector")


def is_hierarchy(surfels):
    return bool(surfels.GetFieldData().HasArray("SurfelLeaves"))


@dataclass
class Cloud:
    data: object  # vtkPolyData
    viewpoint: Optional[Tuple[float, float, float]] = None  # of the sensor, if the file has it
    columns: int = 0  # of a depth image, stored row by row; 0 for other clouds
    is_surfels: bool = field(init=False)
    has_normals: bool = field(init=False)

    def __post_init__(self):
        points = self.data.GetPointData()
        self.has_normals = points.GetNormals() is not None or points.HasArray("Normals")
        self.is_surfels = all(points.HasArray(name) for name in SURFEL_ARRAYS)


def _read_scan(path, messages, progress):
    from ..vtkSurfelReaders import vtkPointCloudReader

    reader = vtkPointCloudReader()
    reader.SetFileName(path)
    progress.update(reader, "reading")
    messages.check()
    columns, rows = reader.GetDimensions()
    return Cloud(reader.GetOutput(), reader.GetViewpoint() if reader.GetHasViewpoint() else None,
                 columns if rows > 1 else 0)


def _read_vtp(path, messages, progress):
    reader = vtk("vtkIOXML").vtkXMLPolyDataReader()
    reader.SetFileName(path)
    progress.update(reader, "reading")
    messages.check(f"{path} is not a readable .vtp file: ")
    return Cloud(reader.GetOutput())


def _read_text(path, _messages, _progress):
    from .textclouds import read_text_cloud

    return Cloud(read_text_cloud(path))


def _read_las(path, _messages, _progress):
    from .scannerclouds import read_las_cloud

    return Cloud(read_las_cloud(path))


def _read_e57(path, _messages, _progress):
    from .scannerclouds import read_e57_cloud

    return Cloud(*read_e57_cloud(path))


_READERS = {
    ".ply": _read_scan,
    ".pcd": _read_scan,
    ".vtp": _read_vtp,
    ".xyz": _read_text,
    ".txt": _read_text,
    ".las": _read_las,
    ".laz": _read_las,
    ".e57": _read_e57,
}


def _check_file(path):
    if os.path.isdir(path):
        raise UserProblem(f"{path} is a folder; give a point cloud file")
    if not os.path.exists(path):
        raise UserProblem(f"{path} does not exist")
    if not os.access(path, os.R_OK):
        raise UserProblem(f"{path} is not readable; check its permissions")


def read_cloud(path, messages, progress):
    """-> Cloud with at least one point, or UserProblem."""
    extension = os.path.splitext(path)[1].lower()
    _check_file(path)
    if extension not in _READERS:
        raise UserProblem(f"{path}: unknown extension {extension!r}; a point cloud is a "
                          ".ply, .pcd, .xyz, .txt, .las, .laz, .e57 or .vtp file")
    if os.path.getsize(path) == 0 and _READERS[extension] not in (_read_las, _read_e57):
        raise UserProblem(f"{path} is empty")
    cloud = _READERS[extension](path, messages, progress)
    if cloud.data.GetNumberOfPoints() == 0:
        raise UserProblem(f"{path} holds no points")
    return cloud

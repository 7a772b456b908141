# SPDX-License-Identifier: BSD-3-Clause
"""Reads .las, .laz and .e57 files, where the Python packages for them are installed."""

import importlib

import numpy as np

from .arrayclouds import polydata_of
from .problems import UserProblem


def _package(name, requirement, path):
    try:
        return importlib.import_module(name)
    except ImportError:
        raise UserProblem(f"{path}: such files need the Python package {name}: pip install "
                          f"'{requirement}'; or convert the file, for example with `pdal translate "
                          f"{path} out.ply`") from None


def _arrays(rgb, intensity):
    """Colours of 8 or 16 bits as bytes, and intensity; each may be None. Writers that have no colours
    or intensities leave zeros."""
    arrays = {}
    if rgb is not None and rgb.any():
        arrays["RGB"] = np.round(rgb / (257 if rgb.max() > 255 else 1)).astype(np.uint8)
    if intensity is not None and intensity.any():
        arrays["intensity"] = intensity
    return arrays


def read_las_cloud(path):
    """-> vtkPolyData with double points."""
    laspy = _package("laspy", "laspy[lazrs]", path)
    try:
        las = laspy.read(path)
        places = np.column_stack([las.x, las.y, las.z])
        names = set(las.point_format.dimension_names)
        rgb = np.column_stack([las.red, las.green, las.blue]) if "red" in names else None
        arrays = _arrays(rgb, np.asarray(las.intensity))
    except Exception as error:  # laspy passes on those of numpy, struct and the decoder
        raise UserProblem(f"{path} is not a readable .las or .laz file: {error}") from error
    return polydata_of(places, arrays)


def _read_e57_scan(file, index):
    """-> places, colours or None, intensities or None, in the coordinates of all scans."""
    data = file.read_scan(index, colors=True, intensity=True, transform=True,
                          ignore_missing_fields=True)

    def columns(*names):
        return np.column_stack([data[n] for n in names]) if names[0] in data else None

    return (columns("cartesianX", "cartesianY", "cartesianZ"),
            columns("colorRed", "colorGreen", "colorBlue"), data.get("intensity"))


def read_e57_cloud(path):
    """-> vtkPolyData with double points, and the place of the scanner if it was one scan."""
    pye57 = _package("pye57", "pye57", path)
    try:
        with pye57.E57(path) as file:
            parts = list(zip(*(_read_e57_scan(file, i) for i in range(file.scan_count))))
            header = file.get_header(0)
            one = file.scan_count == 1 and header.has_pose()
            viewpoint = tuple(map(float, header.translation)) if one else None
        # What one of the scans lacks cannot be shown for all.
        places, *attributes = (None if any(p is None for p in part) else np.concatenate(part)
                               for part in parts)
        cloud = polydata_of(places, _arrays(*attributes))
    except Exception as error:  # pye57 has no common class of errors
        raise UserProblem(f"{path} is not a readable .e57 file: {error}") from error
    return cloud, viewpoint

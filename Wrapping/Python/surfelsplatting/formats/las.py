# SPDX-License-Identifier: BSD-3-Clause
"""Reads .las and .laz files, where the Python package laspy is installed."""

import os

import numpy as np

from ..clouds.colors import colors_and_intensity
from ..clouds.degrees import cloud_of_degrees
from ..clouds.polydata import polydata_of
from ..problems import UserProblem, how_to_install
from .packages import package_for

FORMAT_AT, COMPRESSED = 104, 128  # byte of the header with the format of the points, and its bit of .laz files
CHUNKS_OFFSET_AT = 96  # byte of the header with the offset of the points, which begin with that of
# the table of chunks (LAZ specification 1.4, "Chunk table")
WKT = 2112  # record of a .las file with the coordinate system as text (LAS specification 1.4)
MODEL_TYPE, GEOGRAPHIC = 1024, 2  # GeoTIFF's key of the kind of coordinate system, and its value
LAS_SCALARS = ("classification", "return_number", "gps_time")


def _is_compressed(path):
    with open(path, "rb") as file:
        header = file.read(FORMAT_AT + 1)
    return len(header) > FORMAT_AT and bool(header[FORMAT_AT] & COMPRESSED)


def _check_decoder(laspy, path):
    """laspy itself reads what is not compressed."""
    if _is_compressed(path) and not laspy.LazBackend.detect_available():
        how = how_to_install("'laspy[lazrs]'")
        raise UserProblem(f"{path}: compressed files need a decoder for the Python package laspy: "
                          f"{how}; or convert the file, for example with `pdal translate {path} "
                          "out.las`")


def _check_chunks(path):
    """Raises ValueError if a .laz file says that it has more chunks than bytes: the decoder would end
    the process when it has no memory for them."""
    with open(path, "rb") as file:
        content = file.read(CHUNKS_OFFSET_AT + 4)
        file.seek(int.from_bytes(content[CHUNKS_OFFSET_AT:], "little"))
        table = int.from_bytes(file.read(8), "little", signed=True)
        size = os.fstat(file.fileno()).st_size
        if table == -1:  # written by a program that could not go back; the offset is at the end
            file.seek(max(0, size - 8))
            table = int.from_bytes(file.read(8), "little", signed=True)
        file.seek(min(max(0, table), size))
        count = int.from_bytes(file.read(8)[4:], "little")  # after the version
        if count > size:
            raise ValueError(f"it says that it has {count} chunks in {size} bytes")


def _check_points(laspy, path):
    """Raises ValueError if a .las file ends before the last point that its header says: laspy would read
    those before, or speak of a buffer."""
    with laspy.open(path) as file:
        header = file.header
    there = (os.path.getsize(path) - header.offset_to_point_data) // header.point_format.size
    if there < header.point_count:
        raise ValueError(f"its header says {header.point_count} points, and it holds {max(0, there)}")


def _las_scalars(las):
    """{name: values} of what may be worth a colour, if it is not the same everywhere."""
    names = [name for name in LAS_SCALARS if name in set(las.point_format.dimension_names)]
    names += las.point_format.extra_dimension_names
    scalars = {name: np.asarray(las[name]) for name in names}
    return {name: values for name, values in scalars.items()
            if values.ndim == 1 and len(values) and values.min() < values.max()}


def _is_in_degrees(header):
    """Whether the header of a .las file says that x and y are longitudes and latitudes."""
    for record in header.vlrs:
        for key in getattr(record, "geo_keys", []):
            if key.id == MODEL_TYPE:
                return key.value_offset == GEOGRAPHIC
        text = getattr(record, "string", "") if record.record_id == WKT else ""
        if text:
            return "PROJ" not in text and ("GEOGCS[" in text or "GEOGCRS[" in text)
    return False


def read_las_cloud(path):
    """-> vtkPolyData with double points; longitudes and latitudes become metres (degrees.py)."""
    laspy = package_for(path, "laspy", "laspy[lazrs]", b"LASF")
    _check_decoder(laspy, path)
    try:
        if _is_compressed(path):
            _check_chunks(path)
        else:
            _check_points(laspy, path)
        las = laspy.read(path)
        places = np.column_stack([las.x, las.y, las.z])
        names = set(las.point_format.dimension_names)
        rgb = np.column_stack([las.red, las.green, las.blue]) if "red" in names else None
        arrays = {**_las_scalars(las), **colors_and_intensity(rgb, np.asarray(las.intensity))}
        make = cloud_of_degrees if _is_in_degrees(las.header) else polydata_of
    except BaseException as error:  # laspy passes on those of numpy, struct and the decoder
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        raise UserProblem(f"{path} is not a readable .las or .laz file: {error}; was all of it "
                          "copied?") from error
    return make(places, arrays)

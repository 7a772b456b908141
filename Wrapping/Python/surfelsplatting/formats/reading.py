# SPDX-License-Identifier: BSD-3-Clause
"""Reads point clouds of all formats that the tool supports."""

import os
from collections import Counter
from contextlib import suppress
from difflib import get_close_matches
from glob import glob
from shlex import quote

import numpy as np

from ..clouds.cloud import Cloud, cloud_of, with_image
from ..clouds.stations import TO_SCANNER
from ..notes import note_model, note_scan, note_up
from ..problems import UserProblem, no_points
from ..vtkSurfelReaders import vtkGaussianSplatReader, vtkPointCloudReader
from ..vtkSurfelRendering import vtkSurfelHierarchyReader
from .sogfiles import folder_meta


def _of_vertices(data, how=""):
    """The same of a file that is no longer a mesh once it is read."""
    cloud = cloud_of(data, how)
    cloud.data.SetPolys(None)
    return cloud


def _updated(reader, path, messages, progress):
    """-> the reader of VTK's kind, which has read the file"""
    reader.SetFileName(os.fsencode(path))  # names on old disks may be no UTF-8
    progress.update(reader, "reading")
    messages.check()
    return reader


def _read_scan(path, messages, progress):
    reader = _updated(vtkPointCloudReader(), path, messages, progress)
    columns, rows = reader.GetDimensions()
    if reader.GetOutput().GetNumberOfPolys():
        return _of_vertices(reader.GetOutput())
    cloud = Cloud(reader.GetOutput(), reader.GetViewpoint() if reader.GetHasViewpoint() else None,
                  columns if rows > 1 else 0)
    return cloud if cloud.columns else with_image(cloud)


def _capture_cloud(data, invalid, is_antialiased):
    how = "a capture of 3D Gaussian splatting"
    if invalid:
        how += f"; {invalid} Gaussians with values that are not finite are left out"
    if is_antialiased:
        how += "; it was trained with antialiasing, as --capture-filter antialiased draws it"
    return Cloud(data, how=how, is_antialiased=is_antialiased)


def _read_capture(path, messages, progress):
    reader = _updated(vtkGaussianSplatReader(), path, messages, progress)
    return _capture_cloud(reader.GetOutput(), reader.GetNumberOfInvalidGaussians(),
                          reader.GetAntialiased())


def _read_sog(path, _messages, _progress):
    from .sog import read_sog_capture

    return _capture_cloud(*read_sog_capture(path))


def _read_ply_or_pcd(path, messages, progress):
    from .headers import check_header

    check_header(path)
    read = _read_capture if vtkGaussianSplatReader.CanReadFile(os.fsencode(path)) else _read_scan
    return read(path, messages, progress)


def _read_dataset(path, messages, progress):
    from .datasets import read_dataset

    data = read_dataset(path, messages, progress)
    how = ""
    if data.IsA("vtkImageData"):
        how = "a volume of {} x {} x {}".format(*data.GetDimensions())
    return cloud_of(data, how)


def _read_mapped(path, messages, progress):
    return Cloud(_updated(vtkSurfelHierarchyReader(), path, messages, progress).GetOutput())


def _of_columns(data, columns):
    if columns.are_degrees:
        note_up(data, (0, 0, 1))
    return with_image(Cloud(data, how=str(columns), is_unsure=columns.unsure))


def _read_text(path, _messages, _progress):
    from .colmap import HOW, is_colmap, read_colmap_cloud
    from .text import read_text_cloud

    if is_colmap(path):
        return Cloud(read_colmap_cloud(path), how=HOW)
    return _of_columns(*read_text_cloud(path))


def _read_npy(path, _messages, _progress):
    from .npy import read_npy_cloud

    return _of_columns(*read_npy_cloud(path))


def _read_bin(path, _messages, _progress):
    from .colmap import HOW, is_colmap, read_colmap_cloud
    from .sweeps import read_sweep

    if is_colmap(path):
        return Cloud(read_colmap_cloud(path), how=HOW)
    data, how = read_sweep(path)
    note_up(data, (0, 0, 1))  # lidars stand on cars and robots
    return Cloud(data, how=how)


def _read_las(path, _messages, _progress):
    from ..clouds.degrees import HOW, has_degrees
    from .las import read_las_cloud

    data = read_las_cloud(path)
    note_up(data, (0, 0, 1))  # z is the elevation (LAS specification)
    return Cloud(data, how=HOW if has_degrees(data) else "")


def _of_scanners(data, viewpoint, how=""):
    note_scan(data, viewpoint)
    if data.GetPointData().HasArray(TO_SCANNER):
        note_up(data, (0, 0, 1))  # scanners are level
    return Cloud(data, viewpoint, how=how)


def _read_e57(path, _messages, _progress):
    from .e57 import read_e57_cloud

    return _of_scanners(*read_e57_cloud(path))


def _read_ptx(path, _messages, _progress):
    from .ptx import read_ptx_cloud

    return _of_scanners(*read_ptx_cloud(path))


OF_MESHES = "the vertices of its meshes"


def _read_mesh(path, _messages, _progress):
    from .meshes import read_obj_cloud, read_stl_cloud
    from .off import read_off_cloud

    readers = {".obj": read_obj_cloud, ".stl": read_stl_cloud, ".off": read_off_cloud}
    data = readers[os.path.splitext(path)[1].lower()](path)
    note_model(data)
    return _of_vertices(data, OF_MESHES)


def _read_gltf(path, _messages, _progress):
    from .gltf import read_gltf_cloud

    data = read_gltf_cloud(path)
    note_up(data, (0, 1, 0))  # y is up (glTF 2.0, 3.4)
    return _of_vertices(data, OF_MESHES)


_READERS = {
    ".surfels": _read_mapped,
    ".ply": _read_ply_or_pcd,
    ".splat": _read_capture,
    ".spz": _read_capture,
    ".sog": _read_sog,
    ".json": _read_sog,
    ".pcd": _read_ply_or_pcd,
    ".vtp": _read_dataset,
    ".vtu": _read_dataset,
    ".vti": _read_dataset,
    ".vtk": _read_dataset,
    ".mhd": _read_dataset,
    ".mha": _read_dataset,
    ".nrrd": _read_dataset,
    ".nhdr": _read_dataset,
    ".obj": _read_mesh,
    ".stl": _read_mesh,
    ".off": _read_mesh,
    ".gltf": _read_gltf,
    ".glb": _read_gltf,
    ".xyz": _read_text,
    ".xyzn": _read_text,
    ".xyzrgb": _read_text,
    ".txt": _read_text,
    ".tsv": _read_text,
    ".asc": _read_text,
    ".csv": _read_text,
    ".pts": _read_text,
    ".npy": _read_npy,
    ".ptx": _read_ptx,
    ".bin": _read_bin,
    ".las": _read_las,
    ".laz": _read_las,
    ".e57": _read_e57,
}
# What files begin with, whatever they are called.
_BEGINS = {b"ply\n": ".ply", b"ply\r": ".ply", b"# .PCD": ".pcd", b"LASF": ".las", b"ASTM-E57": ".e57",
           b"glTF": ".glb", b"\x93NUMPY": ".npy", b"\x1f\x8b": ".gz"}
LONGEST_BEGIN = max(map(len, _BEGINS))
# Programs give tables of points names of their own, such as .dat.
_TABLE = ".txt"
# What unpacks a file.
_PACKED = {".zip": "unzip", ".gz": "gunzip -k", ".bz2": "bunzip2 -k", ".xz": "unxz -k", ".zst": "unzstd",
           ".7z": "7z x", ".rar": "unrar x", ".tar": "tar xf", ".tgz": "tar xf"}


def _meant(path):
    """-> what may be meant, such as a file beside it, as the end of a sentence, or nothing"""
    if "://" in path:
        return "; download it first"
    plain = os.path.expanduser(path.replace("\\", "/"))  # Windows separates folders by it
    if os.path.exists(plain):
        return f"; did you mean {quote(plain)}?"
    if glob(plain):
        return "; without quotes the shell finds the files"
    folder, name = os.path.split(path)
    near = []
    with suppress(OSError):  # a folder that is missing, or not readable
        near = get_close_matches(name, os.listdir(folder or "."), 1)
    return f"; did you mean {os.path.join(folder, near[0])}?" if near else ""


def _check_file(path):
    if os.path.isdir(path):
        known = []
        with suppress(OSError):
            kinds = Counter(os.path.splitext(name)[1] for name in os.listdir(path))
            known = [kind for kind, _ in kinds.most_common() if kind.lower() in _READERS]
        example = f", for example {os.path.join(path, '*' + known[0])}" if known else ""
        raise UserProblem(f"{path} is a folder; give a point cloud file, or several{example}")
    if not os.path.exists(path):
        raise UserProblem(f"{path} does not exist{_meant(path)}")
    if not os.path.isfile(path):
        raise UserProblem(f"{path} is no file but a pipe or a device, which can be read only once; save what "
                          "it gives in a file first")
    if not os.access(path, os.R_OK):
        raise UserProblem(f"{path} is not readable; check its permissions")


def _name_arrays(data):
    """Gives arrays whose names are no text, as in damaged files, names that are."""
    arrays = [data.GetAbstractArray(number) for number in range(data.GetNumberOfArrays())]
    for number, array in enumerate(arrays):
        name = array.GetName()
        if not isinstance(name, str):
            array.SetName(f"array {number}" if name is None else
                          name.decode(errors="backslashreplace"))


# Documentation/DataContract.md
_COMPONENTS = {"SurfelCovariance": (6,), "SurfelAreaVector": (3,), "SurfelTwoSided": (1,),
               "SurfelOverlap": (1,), "GaussianCovariance": (6,), "GaussianOpacity": (1,),
               "GaussianExtinction": (1,), "GaussianNormal": (3,),
               "GaussianHarmonics": (3, 12, 27, 48)}


def _check_arrays(data, path):
    fields, points = data.GetFieldData(), data.GetPointData()
    origin = fields.GetArray("SurfelOrigin")
    if origin is not None and origin.GetNumberOfValues() != 3:
        fields.RemoveArray("SurfelOrigin")  # the picture shows the whole, wherever that is
    for name, components in _COMPONENTS.items():
        array = points.GetArray(name)  # None for one of texts
        if points.HasArray(name) and (array is None
                                      or array.GetNumberOfComponents() not in components
                                      or array.GetNumberOfTuples() != data.GetNumberOfPoints()):
            numbers = " or ".join(map(str, components))
            raise UserProblem(f"{path}: its array {name} does not have {numbers} numbers for "
                              "each point; make the file again from what it was made of")


def _kind_by_content(path):
    """-> the extension of what a file is by its first bytes, or nothing; programs that download or copy files
    change their names"""
    with open(path, "rb") as file:
        start = file.read(LONGEST_BEGIN)
    return next((kind for begin, kind in _BEGINS.items() if start.startswith(begin)), "")


def _reader_of(path):
    """-> one of _READERS, or UserProblem"""
    named = os.path.splitext(path)[1].lower()
    kind = _kind_by_content(path) or named
    if kind == ".gz" and named == ".spz":  # it is packed by itself
        kind = named
    if kind in _PACKED:
        program = "tar xf" if ".tar." in path.lower() else _PACKED[named if named in _PACKED else kind]
        how = f"{program} {quote(path)}"
        if named not in _PACKED:  # gunzip refuses such names
            how = f"gunzip < {quote(path)} > {quote('unpacked-' + os.path.basename(path))}"
        raise UserProblem(f"{path} is packed; unpack it first: {how}")
    if kind not in _READERS:
        from .text import is_table

        kind = _TABLE if is_table(path) else kind
    if kind not in _READERS:
        unknown = f"unknown extension {named!r}" if named else "it has no extension"
        raise UserProblem(f"{path}: {unknown}; save it as .ply, .las or .e57 by the program that made it, or by "
                          "CloudCompare; surfelsplat render --help lists all files that are read")
    return _READERS[kind]


def read_cloud(path, messages, progress):
    """-> Cloud with at least one point, or UserProblem."""
    path = folder_meta(path)
    _check_file(path)
    read = _reader_of(path)
    if os.path.getsize(path) == 0:
        raise UserProblem(f"{path} is empty")
    with np.errstate(all="ignore"):  # casts of damaged values warn
        cloud = read(path, messages, progress)
    if cloud.data.GetNumberOfPoints() == 0:
        raise no_points(path)
    cloud.path = path
    _name_arrays(cloud.data.GetPointData())
    _name_arrays(cloud.data.GetCellData())
    _name_arrays(cloud.data.GetFieldData())
    if cloud.is_drawable:
        _check_arrays(cloud.data, path)
    return cloud

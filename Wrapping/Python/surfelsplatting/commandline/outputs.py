# SPDX-License-Identifier: BSD-3-Clause
"""Writes pictures, surfels and statistics: whole files or none."""

import json
import os
from contextlib import contextmanager

from .problems import UserProblem

PICTURES = (".png", ".exr")


def check_output(path, extensions=None):
    """Before anything is computed: can this file be written?"""
    if extensions and os.path.splitext(path)[1].lower() not in extensions:
        raise UserProblem(f"{path}: unknown extension for this output; it must be "
                          + " or ".join(extensions))
    folder = os.path.dirname(path) or "."
    if os.path.isdir(path):
        raise UserProblem(f"{path} is a folder; give a file name")
    if not os.path.isdir(folder):
        raise UserProblem(f"cannot write {path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK):
        raise UserProblem(f"cannot write {path}: the folder {folder} is not writable")


def check_distinct(cloud, *others):
    """Refuses to write over what is read, or one output over another."""
    *inputs, picture, surfels, stats = (cloud, *others)
    read = {os.path.realpath(path) for path in inputs}
    written = set()
    for path in filter(None, (picture, surfels, stats)):
        real = os.path.realpath(path)
        if real in read:
            raise UserProblem(f"{path} is read as input; give the output another name")
        if real in written:
            raise UserProblem(f"{path} is named for two outputs; give each its own name")
        written.add(real)


@contextmanager
def whole_file(path):
    """Yields the name of a temporary file beside path that becomes path if all goes well."""
    stem, extension = os.path.splitext(path)
    temporary = f"{stem}.{os.getpid()}.part{extension}"
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as problem:
        raise UserProblem(f"cannot write {path}: {problem.strerror}") from problem
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


def _encode_png(picture):
    """-> bytes of 8-bit RGB, 255 times the opaque picture's values."""
    import numpy as np
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkIOImage import vtkPNGWriter

    colors = vtk_to_numpy(picture.GetPointData().GetScalars())[:, :3]
    image = vtkImageData()
    image.SetDimensions(picture.GetDimensions())
    rounded = np.clip(colors * 255 + 0.5, 0, 255).astype(np.uint8)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(rounded), deep=True))
    writer = vtkPNGWriter()
    writer.SetInputData(image)
    writer.WriteToMemoryOn()
    writer.Write()
    return memoryview(writer.GetResult())


def _write_png(picture, path, messages):
    content = _encode_png(picture)
    messages.check()
    with whole_file(path) as temporary, open(temporary, "wb") as file:
        file.write(content)


def _write_exr(picture, path, messages):
    from ..vtkSurfelOpenEXR import vtkSurfelEXRWriter

    writer = vtkSurfelEXRWriter()
    writer.SetInputData(picture)
    writer.AddChannel("Depth", "Z")
    writer.SetFileName(path)
    writer.Write()
    messages.check()


def write_picture(picture, path, messages):
    is_exr = path.lower().endswith(".exr")
    (_write_exr if is_exr else _write_png)(picture, path, messages)


def write_surfels(surfels, path, messages):
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(surfels)
    writer.SetHeaderTypeToUInt64()  # an array may pass 4 GiB
    writer.SetCompressorTypeToNone()  # floats hardly shrink, and zlib takes longer than splatting
    writer.SetEncodeAppendedData(False)
    with whole_file(path) as temporary:
        writer.SetFileName(temporary)
        written = writer.Write()
        if not written or writer.GetErrorCode():
            raise UserProblem(f"cannot write {path}: writing failed; is the disk full?")
    messages.check()


def write_json(content, path):
    with whole_file(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        json.dump(content, file, indent=1)
        file.write("\n")

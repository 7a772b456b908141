# SPDX-License-Identifier: BSD-3-Clause
"""Writes pictures, surfels and statistics; never leaves an incomplete file."""

import json
import os
import shutil
import tempfile
from contextlib import contextmanager, nullcontext

from ..backend import vtk
from ..pictures import jpeg_bytes, png_bytes, png_of_array, straight_bytes
from ..problems import UserProblem
from ..views.cameras import view_values
from ..vtkmessages import errors_of
from ..vtkSurfelOpenEXR import vtkDeepEXRWriter, vtkSurfelEXRWriter
from ..vtkSurfelRendering import vtkSurfelHierarchyWriter
from .arguments import JPEGS

HIERARCHIES = (".surfels", ".vtp")


def _is_device(path):
    """Whether the path is a device or a pipe such as /dev/stdout, which no file may replace."""
    return os.path.exists(path) and not os.path.isfile(path)


def check_output(path, extensions):
    """Checks, before anything is computed, that this file can be written."""
    if not _is_device(path) and os.path.splitext(path)[1].lower() not in extensions:
        raise UserProblem(f"{path}: unknown extension for this output; it must be "
                          + " or ".join(extensions))
    if os.path.isdir(path):
        raise UserProblem(f"{path} is a folder; give a file name")
    if _is_device(path):
        if not os.access(path, os.W_OK):
            raise UserProblem(f"cannot write {path}: the device is not writable")
        return
    folder = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(folder):
        raise UserProblem(f"cannot write {path}: the folder {folder} does not exist; make it first")
    if not os.access(folder, os.W_OK):
        raise UserProblem(f"cannot write {path}: the folder {folder} is not writable")


def check_distinct(inputs, outputs):
    """Refuses an output that would replace an input or another output."""
    read = {os.path.realpath(path) for path in inputs}
    written = set()
    for path in filter(None, outputs):
        real = os.path.realpath(path)
        if real in read:
            raise UserProblem(f"{path} is also an input; give the output another name")
        if real in written:
            raise UserProblem(f"{path} is used for two outputs; give each its own name")
        if not _is_device(path):
            written.add(real)


@contextmanager
def whole_file(path):
    """Yields the name of a temporary file that replaces path when it is complete.

    A link stays, and its target is replaced. The complete file is copied into a device or a pipe.
    """
    device = _is_device(path)
    target = os.path.realpath(path)
    stem, extension = os.path.splitext(target)
    if device:
        stem = os.path.join(tempfile.gettempdir(), "surfelsplat")
    temporary = f"{stem}.{os.getpid()}.part{extension}"
    try:
        yield temporary
        if device:
            with open(temporary, "rb") as source, open(path, "wb") as sink:
                shutil.copyfileobj(source, sink)
        else:
            os.replace(temporary, target)
    except OSError as problem:
        raise UserProblem(f"cannot write {path}: {problem.strerror}") from problem
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


def _content_of(picture, path, linear_light, transparent):
    if path.lower().endswith(JPEGS):
        return jpeg_bytes(picture, linear_light)
    return (png_of_array(straight_bytes(picture, linear_light)) if transparent
            else png_bytes(picture, linear_light))


def _write_bytes(picture, path, linear_light, messages, transparent):
    content = _content_of(picture, path, linear_light, transparent)
    messages.check()
    with whole_file(path) as temporary, open(temporary, "wb") as file:
        file.write(content)


def _write(writer, data, path, messages):
    """By a writer that itself never leaves an incomplete file, but needs a file in which it can seek."""
    writer.SetInputData(data)
    with whole_file(path) if _is_device(path) else nullcontext(path) as name:
        writer.SetFileName(os.fsencode(name))
        writer.Write()
        messages.check()


def _write_exr(picture, path, deep, messages):
    writer = vtkDeepEXRWriter() if deep else vtkSurfelEXRWriter()
    if not deep:
        writer.AllChannelsOn()
    _write(writer, picture, path, messages)


def write_picture(picture, path, deep, linear_light, messages, transparent=False):
    """deep: whether an .exr file keeps the layers.
    linear_light: whether the picture is linear light; .png and .jpg files are then converted to sRGB.
    transparent: whether a .png file has the picture's alpha.
    """
    if path.lower().endswith(".exr"):
        _write_exr(picture, path, deep, messages)
    else:
        _write_bytes(picture, path, linear_light, messages, transparent)


def write_hierarchy(hierarchy, path, messages):
    """-> warnings of what the file lacks"""
    if path.lower().endswith(".vtp"):
        write_surfels(hierarchy, path, messages)
    else:
        writer = vtkSurfelHierarchyWriter()
        with errors_of(writer, event="WarningEvent") as warnings:
            _write(writer, hierarchy, path, messages)
        return warnings
    return []


def write_polydata(data, path):
    """-> whether the whole .vtp file was written"""
    writer = vtk("vtkIOXML").vtkXMLPolyDataWriter()
    writer.SetInputData(data)
    writer.SetHeaderTypeToUInt64()  # an array may pass 4 GiB
    writer.SetCompressorTypeToNone()  # floats hardly shrink, and zlib takes longer than splatting
    writer.SetEncodeAppendedData(False)
    writer.SetFileName(os.fsencode(path))
    return bool(writer.Write()) and not writer.GetErrorCode()


def write_surfels(surfels, path, messages):
    with whole_file(path) as temporary:
        if not write_polydata(surfels, temporary):
            raise UserProblem(f"cannot write {path}: writing failed; is the disk full?")
    messages.check()


def write_json(content, path):
    with whole_file(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        json.dump(content, file, indent=1)
        file.write("\n")


def write_view(view, path):
    """Writes a camera file, which --camera takes."""
    write_json(view_values(view), path)

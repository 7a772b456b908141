# SPDX-License-Identifier: BSD-3-Clause
"""Pictures as 8-bit PNG and JPEG files."""

import os
import struct
import zlib
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from .backend import vtk
from .vtkarrays import named_array, to_numpy
from .vtkmessages import update

STRIP = 64  # rows that are compressed together
UP = 2  # PNG's filter: each byte less the one above
JPEG_QUALITY = 95  # percent
LEVEL = 4  # of zlib: 5 takes twice as long for 3 % less


def to_srgb(light):
    """sRGB codes of linear light (IEC 61966-2-1)."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.power(light, 1 / 2.4) - 0.055)


def _rgb_of(colors, linear_light):
    """[..., 4] floats -> [..., 3] bytes; bytes stay as they are"""
    if colors.dtype == np.uint8:
        return colors[..., :3]
    colors = to_srgb(colors[..., :3]) if linear_light else colors[..., :3]
    return np.clip(colors * 255 + 0.5, 0, 255).astype(np.uint8)


def _colors_of(picture):
    """[n, 3 or 4] values of the pixels, row 0 is the bottom row."""
    return to_numpy(picture.GetPointData().GetScalars())


def rgb_bytes(picture, linear_light=False):
    """[n, 3] bytes of the pixels, row 0 is the bottom row; see png_bytes."""
    return _rgb_of(_colors_of(picture), linear_light)


def straight_bytes(picture, linear_light=False):
    """[height, width, 4] bytes of the pixels, the top row first, with straight alpha; see png_bytes."""
    width, height, _ = picture.GetDimensions()
    values = _colors_of(picture).reshape(height, width, 4)[::-1]
    alpha = values[..., 3:]
    colors = values[..., :3] / np.maximum(alpha, 1e-6)
    values = np.concatenate([to_srgb(colors) if linear_light else colors, alpha], axis=2)
    return np.clip(values * 255 + 0.5, 0, 255).astype(np.uint8)


def _chunk(name, content):
    checksum = zlib.crc32(content, zlib.crc32(name))
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", checksum)


def _filtered(colors, begin, linear_light):
    """A strip of rows as bytes to compress. colors: [height, width, 3 or 4]"""
    rows = _rgb_of(colors[max(begin - 1, 0):begin + STRIP], linear_light)
    rows = rows.reshape(len(rows), -1)
    lines = np.diff(rows, axis=0, prepend=rows[:0] if begin else np.zeros_like(rows[:1]))
    return np.insert(lines, 0, UP, axis=1)


def png_bytes(picture, linear_light=False):
    """The contents of a PNG file: 8-bit RGB, 255 times the picture's values.

    picture: vtkImageData with float RGBA scalars, premultiplied; where it is transparent, black
    shows through. Or with scalars of bytes, the second output of a vtkSurfelImageRenderer, which are
    written as they are.
    linear_light: float scalars are linear light and are converted to sRGB.
    """
    width, height, _ = picture.GetDimensions()
    if 0 in (width, height):
        raise ValueError("the picture is empty; the second output of a vtkSurfelImageRenderer is made by "
                         "Update(1)")
    colors = _colors_of(picture).reshape(height, width, -1)[::-1]
    begins = range(0, height, STRIP)

    def deflated(begin):
        """Of one strip: its bytes, and its chunk, which ends with a whole byte."""
        strip = _filtered(colors, begin, linear_light)
        compressor = zlib.compressobj(LEVEL, wbits=-zlib.MAX_WBITS)
        end = zlib.Z_FINISH if begin == begins[-1] else zlib.Z_FULL_FLUSH
        return strip, _chunk(b"IDAT", compressor.compress(strip) + compressor.flush(end))

    # vtkPNGWriter, which has one thread, takes four times as long.
    with ThreadPoolExecutor(vtk("vtkCommonCore").vtkSMPTools.GetEstimatedNumberOfThreads()) as pool:
        strips = list(pool.map(deflated, begins))
    checksum = 1
    for strip, _ in strips:
        checksum = zlib.adler32(strip, checksum)
    return b"".join((b"\x89PNG\r\n\x1a\n",
                     _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
                     _chunk(b"IDAT", b"\x78\x5e"), *(chunk for _, chunk in strips),
                     _chunk(b"IDAT", struct.pack(">I", checksum)), _chunk(b"IEND", b"")))


def png_of_array(picture):
    """The contents of a PNG file of an array of bytes, [height, width, 3 or 4] with the top row first, as
    `render` makes it."""
    array = np.asarray(picture)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] not in (3, 4) or 0 in array.shape:
        raise TypeError(f"the picture is of the type {type(picture).__name__}"
                        + (f", {array.dtype} and the shape {array.shape}" if array.ndim else "")
                        + "; give a vtkSurfelImageRenderer, its output, or uint8 of the shape "
                          "(height, width, 3) or (height, width, 4)")
    rows = np.ascontiguousarray(array[::-1]).reshape(-1, array.shape[2])
    return _written(vtk("vtkIOImage").vtkPNGWriter(), "PNG", rows, array.shape[1], array.shape[0])


def jpeg_bytes(picture, linear_light=False):
    """The contents of a JPEG file; see png_bytes."""
    writer = vtk("vtkIOImage").vtkJPEGWriter()
    writer.SetQuality(JPEG_QUALITY)
    return _written(writer, "JPEG", rgb_bytes(picture, linear_light), *picture.GetDimensions()[:2])


def _written(writer, what, rows, width, height):
    """What a writer of VTK makes of bytes, [n, 3 or 4] with the bottom row first"""
    image = vtk("vtkCommonDataModel").vtkImageData()
    image.SetDimensions(width, height, 1)
    image.GetPointData().SetScalars(named_array("Color8", rows))
    writer.WriteToMemoryOn()
    writer.SetInputData(image)
    update(writer, what, writer.Write)
    return memoryview(writer.GetResult())


def write_png(picture, path, linear_light=False):
    """Writes a picture to a .png file; see png_bytes.

    picture: a vtkSurfelImageRenderer, which is updated first, or one of its outputs; or an array of
    `render`.
    RuntimeError: what the renderer says if it cannot render.
    OSError: why the file cannot be written.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"path is {path!r}; give the name of a file")
    extension = os.path.splitext(path)[1]
    if extension.lower() not in (".png", ""):
        raise ValueError(f"{os.fspath(path)!r}: what is written is a PNG file; let its name end in .png "
                         f"instead of {extension}")
    if not hasattr(picture, "IsA"):
        content = png_of_array(picture)
    else:
        if not picture.IsA("vtkDataObject"):
            update(picture, "rendering")
            picture = picture.GetOutput()
        content = png_bytes(picture, linear_light)
    with open(path, "wb") as file:
        file.write(content)

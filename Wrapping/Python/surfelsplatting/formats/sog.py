# SPDX-License-Identifier: BSD-3-Clause
"""Reads captures of 3D Gaussian splatting in .sog files of PlayCanvas and SuperSplat.

These hold images with one pixel for each Gaussian, row by row, and a meta.json that says what their
bytes stand for (developer.playcanvas.com, "The SOG Format"; of version 1, playcanvas/splat-transform):

| image, channels       | value                                                                    |
|-----------------------|--------------------------------------------------------------------------|
| means_l, means_u: RGB | low and high bytes of x y z, from mins to maxs of sign(x) log(1 + abs(x)) |
| scales: RGB           | logarithms of standard deviations                                        |
| quats: RGB            | of w x y z all but the largest, from -1 / sqrt(2) to 1 / sqrt(2)         |
| quats: A              | 252 + which is largest                                                   |
| sh0: RGB, A           | harmonics of degree 0; opacity, in version 1 its logit                   |
| shN_labels: R, G      | low and high byte of the number of an entry                              |
| shN_centroids: RGB    | 64 entries in a row, each one pixel for each harmonic from degree 1 on   |

Bytes stand for numbers of a codebook in version 2, for steps between two ends in version 1. Axes are
those of .ply files.
"""

import importlib

import numpy as np

from ..backend import vtk
from ..clouds.polydata import cells_of
from ..problems import UserProblem
from ..vtkarrays import named_array, to_numpy
from ..vtkSurfelReaders import vtkGaussianSplatReader
from .sogfiles import SogFiles
from .sogmeta import AGAIN, OTHERWISE, SogProblem, parse_meta

PART = 1 << 16  # Gaussians that are decoded at once
ROW, MOST_ENTRIES = 64, 1 << 16  # of the palette
HARMONICS = (1, 4, 9, 16)  # by degree
BYTES_OF_IMAGES = 24.0  # for each Gaussian, while these are decoded
# Of w x y z, by the one that is left out.
OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])


def _check_pillow(path):
    try:
        if importlib.import_module("PIL.features").check("webp"):
            return
    except ImportError:
        pass
    raise UserProblem(f"{path}: .sog files need the Python package Pillow with WebP: pip install Pillow, "
                      f"or apt install python3-pil; or {OTHERWISE}")


def _floats(name, count, components):
    """-> vtkFloatArray, and its numbers [count, components], not yet set"""
    array = vtk("vtkCommonCore").vtkFloatArray()
    array.SetName(name)
    array.SetNumberOfComponents(components)
    np.empty((count, components), np.float32)  # a MemoryError, where VTK would end the process
    array.SetNumberOfTuples(count)
    values = to_numpy(array)
    return array, values.reshape(count, components)


def _parts(count):
    return (slice(first, min(first + PART, count)) for first in range(0, count, PART))


def _check_levels(levels, pixels):
    """That the bytes of an image stand for something"""
    if len(pixels) and pixels.max() >= len(levels.values):
        raise SogProblem(f"its {levels.name} has the number {pixels.max()}, and the codebook of its "
                         f"meta.json only {len(levels.values)} numbers; {AGAIN}")


def _positions(files, meta):
    """-> vtkFloatArray, [n, 3]"""
    low, high = (files.pixels(name, meta.count) for name in meta.means)
    array, positions = _floats("Points", meta.count, 3)
    fractions = np.arange(1 << 16)[:, None] / 65535
    logs = meta.ends[0] + fractions * (meta.ends[1] - meta.ends[0])
    places = (np.sign(logs) * np.expm1(np.abs(logs))).astype(np.float32)
    for part in _parts(meta.count):
        numbers = low[part, :3] | high[part, :3].astype(np.uint16) << 8
        positions[part] = np.take_along_axis(places, numbers.astype(np.intp), axis=0)
    return array, positions


def _quaternions(pixels):
    """-> [n, 4] w x y z of unit length; NaN where no component is said to be the largest"""
    some = np.flatnonzero(pixels[:, 3] >= 252)
    largest = pixels[some, 3] - 252
    rest = (pixels[some, :3] / 127.5 - 1) * np.sqrt(0.5)
    quaternions = np.full((len(pixels), 4), np.nan)
    quaternions[some[:, None], OTHERS[largest]] = rest
    quaternions[some, largest] = np.sqrt(np.maximum(0, 1 - (rest ** 2).sum(axis=1)))
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def _covariances_of(scales, quaternions):
    """-> [n, 6] XX YY ZZ XY YZ XZ of R diag(scales^2) R'"""
    w, x, y, z = quaternions.T
    rotations = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                          2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                          2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    axes = rotations.reshape(-1, 3, 3) * scales[:, None, :]
    return (axes @ axes.transpose(0, 2, 1))[:, (0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)]


def _covariances(files, meta):
    """-> vtkFloatArray, [n, 6]"""
    scales, quats = files.pixels(meta.scales.name, meta.count), files.pixels(meta.quats, meta.count)
    _check_levels(meta.scales, scales[:, :3])
    deviations = np.exp(meta.scales.values)
    array, covariances = _floats("GaussianCovariance", meta.count, 6)
    for part in _parts(meta.count):
        of_axes = np.take_along_axis(deviations, scales[part, :3].astype(np.intp), axis=0)
        covariances[part] = _covariances_of(of_axes, _quaternions(quats[part]))
    return array, covariances


def _palette(files, palette):
    """-> [entries, harmonics from degree 1 on, 3]"""
    image = files.image(palette.centroids.name, 1, (HARMONICS[-1] - 1) * MOST_ENTRIES)
    widths = {ROW * (count - 1): degree for degree, count in enumerate(HARMONICS) if degree}
    degree = widths.get(image.shape[1])
    if degree is None or palette.degree not in (None, degree):
        of = "" if palette.degree is None else f" of {palette.degree} bands"
        raise SogProblem(f"its {palette.centroids.name} is {image.shape[1]} pixels wide, which no palette"
                         f"{of} is; {AGAIN}")
    room = ROW * len(image)
    entries = room if palette.entries is None else palette.entries
    if entries > room:
        raise SogProblem(f"its {palette.centroids.name} has room for {room} entries, and not for the "
                         f"{entries} of its meta.json; {AGAIN}")
    numbers = image[:, :, :3].reshape(room, -1, 3)[:entries]
    _check_levels(palette.centroids, numbers)
    return palette.centroids.values.astype(np.float32)[:, 0][numbers]


def _labels(files, meta, palette):
    """-> [n] numbers of entries"""
    name = meta.palette.labels
    pixels = files.pixels(name, meta.count)
    labels = pixels[:, 0] | pixels[:, 1].astype(np.uint16) << 8
    if len(labels) and labels.max() >= len(palette):
        raise SogProblem(f"its {name} has the number {labels.max()}, and the palette only {len(palette)} "
                         f"entries; {AGAIN}")
    return labels


def _opacities_and_harmonics(files, meta):
    """-> vtkFloatArrays"""
    pixels = files.pixels(meta.colors.name, meta.count)
    _check_levels(meta.colors, pixels[:, :3])
    opacity, opacities = _floats("GaussianOpacity", meta.count, 1)
    opacities[:, 0] = meta.opacities[pixels[:, 3]]
    palette = np.empty((1, 0, 3)) if meta.palette is None else _palette(files, meta.palette)
    labels = 0 if meta.palette is None else _labels(files, meta, palette)
    array, harmonics = _floats("GaussianHarmonics", meta.count, 3 + palette[0].size)
    for part in _parts(meta.count):
        numbers = pixels[part, :3].astype(np.intp)
        harmonics[part, :3] = np.take_along_axis(meta.colors.values, numbers, axis=0)
        if meta.palette is not None:
            harmonics[part, 3:] = palette.reshape(len(palette), -1)[labels[part]]
    return opacity, array


def _capture(points, arrays):
    """-> vtkPolyData; all points are one vertex cell, so that ordinary mappers show them"""
    capture = vtk("vtkCommonDataModel").vtkPolyData()
    places = vtk("vtkCommonCore").vtkPoints()
    places.SetData(points)
    capture.SetPoints(places)
    count = points.GetNumberOfTuples()
    capture.SetVerts(cells_of(np.arange(count), np.array([0, count])))
    for array in arrays:
        capture.GetPointData().AddArray(array)
    return capture


def _chosen(array, chosen):
    return named_array(array.GetName(), to_numpy(array)[chosen])


def _decode(files):
    """-> vtkPolyData, number of Gaussians that were left out, whether trained with antialiasing"""
    meta = parse_meta(files.meta())
    files.check_count(meta.count)
    problem = vtkGaussianSplatReader.CheckMemory(meta.count, HARMONICS[-1] if meta.palette else 1,
                                                 BYTES_OF_IMAGES)
    if problem:
        raise SogProblem(problem)
    points, places = _positions(files, meta)
    covariance, covariances = _covariances(files, meta)
    arrays = covariance, *_opacities_and_harmonics(files, meta)
    valid = np.isfinite(places).all(axis=1) & np.isfinite(covariances).all(axis=1)
    invalid = meta.count - int(np.count_nonzero(valid))
    if 0 < meta.count == invalid:
        raise SogProblem(f"each of its {meta.count} Gaussians has a value that is not finite; {AGAIN}")
    if invalid:
        points, *arrays = (_chosen(array, valid) for array in (points, *arrays))
    return _capture(points, arrays), invalid, meta.is_antialiased


def read_sog_capture(path):
    """-> vtkPolyData with the arrays of vtkGaussianSplatReader, number of Gaussians that were left out
    because a value is not finite, whether the capture was trained with antialiasing

    path: of a .sog file or of a meta.json
    """
    _check_pillow(path)
    try:
        with SogFiles(path) as files, np.errstate(all="ignore"):  # of numbers beyond floats
            return _decode(files)
    except SogProblem as problem:
        raise UserProblem(f"{path}: {problem}") from None

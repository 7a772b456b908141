# SPDX-License-Identifier: BSD-3-Clause
"""Volumes: images with scalars along three axes."""

import math

import numpy as np

from ..backend import vtk
from .colors import COLOR_NAMES, color_bytes, is_colors, may_be_colors
from ..problems import UserProblem
from ..vtkarrays import named_array, to_numpy

GHOSTS = "vtkGhostType"
HIDDEN_POINT, HIDDEN_CELL = 2, 32  # bits, as in vtkDataSetAttributes
MOST_SAMPLES = 4_000_000  # values that stand for all
MOST_LABELS = 16  # values of a mask or a segmentation
SMOOTHING = 1.5  # voxels: then the normals of a ball of voxels are wrong by 1.4 degrees instead of 10
MOST_SMOOTHED = 1 << 26  # points: 0.3 GB, a few times
LUMINANCE = (0.30, 0.59, 0.11)  # of red, green and blue, as in vtkImageLuminance


def is_volume(data):
    """Whether a vtkDataSet is an image with at least two points along each axis."""
    return bool(data.IsA("vtkImageData") and min(data.GetDimensions()) > 1)


def _usable(data, count):
    """The numeric arrays with a name; active scalars first, then those with one component."""
    bit = vtk("vtkCommonCore").VTK_BIT
    arrays = [data.GetArray(number) for number in range(data.GetNumberOfArrays())]
    usable = [a for a in arrays if a and a.GetName() and a.GetName() != GHOSTS
              and a.GetNumberOfTuples() == count and a.GetDataType() != bit]
    active = data.GetScalars()
    return sorted(usable, key=lambda a: (a is not active, a.GetNumberOfComponents() > 1))


def _candidates(image):
    """{name: (array, whether its values are at cells)}, the best first."""
    found = {}
    for data, count, at_cells in (
            (image.GetPointData(), image.GetNumberOfPoints(), False),
            (image.GetCellData(), image.GetNumberOfCells(), True)):
        for array in _usable(data, count):
            found.setdefault(array.GetName(), (array, at_cells))
    return found


def scalar_names(image):
    """Names of the arrays that a volume can show; the first is shown by default."""
    return list(_candidates(image))


def has_choice(image):
    """Whether the file leaves open which of several arrays is shown."""
    active = image.GetPointData().GetScalars() or image.GetCellData().GetScalars()
    return not active and len(_candidates(image)) > 1


def _centers_of_cells(image):
    """-> an image whose points are the centres of the cells"""
    volume = vtk("vtkCommonDataModel").vtkImageData()
    volume.CopyStructure(image)
    first = [0.0, 0.0, 0.0]
    image.TransformContinuousIndexToPhysicalPoint(0.5, 0.5, 0.5, first)
    extent = image.GetExtent()
    volume.SetExtent([end - i % 2 for i, end in enumerate(extent)])
    volume.SetOrigin(first)
    return volume


def _ghosts(data, count):
    """The array that says what is hidden, or None if there is none, or a damaged one."""
    array = data.GetArray(GHOSTS)
    is_usable = (array and array.GetDataTypeAsString() == "unsigned char"
                 and array.GetNumberOfComponents() == 1 and array.GetNumberOfTuples() == count)
    return array if is_usable else None


def _add_ghosts(image, volume, at_cells):
    points = _ghosts(image.GetPointData(), image.GetNumberOfPoints())
    cells = _ghosts(image.GetCellData(), image.GetNumberOfCells())
    if at_cells and cells:
        hidden = (to_numpy(cells) & HIDDEN_CELL) != 0
        volume.GetPointData().AddArray(named_array(GHOSTS, HIDDEN_POINT * hidden.astype(np.uint8)))
    elif not at_cells:
        for ghosts, data in ((points, volume.GetPointData()), (cells, volume.GetCellData())):
            if ghosts:
                data.AddArray(ghosts)


def _chosen(image, name):
    """-> the array with this name, or the best one, and whether it is at cells; None without any"""
    found = _candidates(image)
    return found.get(next(iter(found), None) if name is None else name)


def color_components(image, name=None):
    """How many components the chosen array has if it is colours, 3 or 4; else 0."""
    array, _ = _chosen(image, name) or (None, False)
    is_named = array is not None and array.GetName().lower() in COLOR_NAMES
    if not is_colors(array) and not (is_named and may_be_colors(array)):
        return 0
    return array.GetNumberOfComponents()


def _colors_and_scalar(array):
    """-> [n, 4] bytes: red, green, blue, and the opacity, or where there is none the luminance"""
    values = to_numpy(color_bytes(array))
    if values.shape[1] == 4:
        return values
    luminance = np.round(values @ np.array(LUMINANCE)).astype(np.uint8)
    return np.column_stack([values, luminance])


def _magnitudes(array):
    with np.errstate(over="ignore"):  # infinite ones are not finite, as they should be
        return np.linalg.norm(to_numpy(array).astype(np.float64), axis=1)


def volume_of(image, name=None):
    """-> vtkImageData with one scalar at each point; of several components, their magnitude. Colours
    have four: their own three, and the scalar. Values of cells are at their centres. UserProblem if
    there is no such array, or none at all."""
    found = _candidates(image)
    if not found:
        raise UserProblem("the volume has no scalars, so there is nothing to see")
    if name is not None and name not in found:
        raise UserProblem(f"there are no scalars {name!r}; there are {', '.join(found)}")
    array, at_cells = _chosen(image, name)
    if at_cells:
        volume = _centers_of_cells(image)
    else:
        volume = vtk("vtkCommonDataModel").vtkImageData()
        volume.CopyStructure(image)
    _add_ghosts(image, volume, at_cells)
    if color_components(image, name):
        array = named_array(array.GetName(), _colors_and_scalar(array))
    elif array.GetNumberOfComponents() > 1:
        array = named_array(array.GetName(), _magnitudes(array))
    volume.GetPointData().SetScalars(array)
    return volume


def _is_shown(volume):
    """[n] whether a point belongs to a cell that is not hidden, or None if nothing is."""
    points = volume.GetPointData().GetArray(GHOSTS)
    cells = volume.GetCellData().GetArray(GHOSTS)
    shape = volume.GetDimensions()[::-1]
    shown = None
    if cells:
        shown = np.zeros(shape, bool)
        inside = ((to_numpy(cells) & HIDDEN_CELL) == 0).reshape([n - 1 for n in shape])
        for corner in range(8):
            shown[tuple(slice(1, None) if corner >> axis & 1 else slice(-1)
                        for axis in range(3))] |= inside
        shown = shown.ravel()
    if points:
        seen = (to_numpy(points) & HIDDEN_POINT) == 0
        shown = seen if shown is None else shown & seen
    return shown


def samples_of(volume):
    """-> finite values that are not hidden, up to MOST_SAMPLES of them, and their smallest and
    largest; (0, 0) if there are none"""
    values = to_numpy(volume.GetPointData().GetScalars())
    if values.ndim > 1:
        values = values[:, 3]
    shown = _is_shown(volume)
    if shown is not None:
        values = values[shown]
    if values.dtype.kind == "f":
        values = values[np.isfinite(values)]
    if not len(values):
        return values, (0.0, 0.0)
    limits = float(values.min()), float(values.max())
    step = -(-len(values) // MOST_SAMPLES)
    row, plane = volume.GetDimensions()[0], math.prod(volume.GetDimensions()[:2])
    while step > 1 and math.gcd(step, row * plane) > 1:  # samples of all columns and rows
        step += 1
    return values[::step].astype(np.float64), limits


def are_labels(samples):
    """Whether scalars are so few that their differences are those of a staircase."""
    return all(len(np.unique(some)) <= MOST_LABELS for some in (samples[:10000], samples))


def add_smoothed(volume):
    """Adds the scalars that are classified, smoothed by SMOOTHING voxels. -> the array's name; None
    if there is something among them that is no number or hidden, or if there are too many"""
    scalars = volume.GetPointData().GetScalars()
    component = scalars.GetNumberOfComponents() - 1
    values = to_numpy(scalars).reshape(-1, component + 1)[:, component]
    if (len(values) > MOST_SMOOTHED or _is_shown(volume) is not None
            or not np.isfinite(values).all()):
        return None
    image = vtk("vtkCommonDataModel").vtkImageData()
    image.CopyStructure(volume)
    image.GetPointData().SetScalars(named_array("values", values.astype(np.float32)))
    smoothing = vtk("vtkImagingGeneral").vtkImageGaussianSmooth()
    smoothing.SetInputData(image)
    smoothing.SetStandardDeviation(SMOOTHING)
    smoothing.SetRadiusFactor(3)
    smoothing.Update()
    smoothed = smoothing.GetOutput().GetPointData().GetScalars()
    smoothed.SetName(f"{scalars.GetName()} smoothed")
    volume.GetPointData().AddArray(smoothed)
    return smoothed.GetName()


def _sums(values, factor):
    """Sums over blocks of factor^3; those at the ends are smaller. values: [z, y, x]"""
    for axis, count in enumerate(values.shape):
        values = np.add.reduceat(values, range(0, count, factor), axis=axis)
    return values


def _block_means(values, shown, factor):
    """[z, y, x] means over blocks of factor^3; NaN where all is hidden. values: [z, y, x]"""
    means = []
    for begin in range(0, len(values), factor):  # some slices at a time need little memory
        slab = values[begin:begin + factor].astype(np.float64)
        usable = np.isfinite(slab)
        if shown is not None:
            usable &= shown[begin:begin + factor]
        slab[~usable] = 0
        with np.errstate(invalid="ignore"):
            means.append(_sums(slab, factor) / _sums(usable.astype(np.int32), factor))
    return np.concatenate(means)


def _mean_colors(values, shown, factor):
    """The same of colours and a scalar, by which they are weighted, where there is any: what is
    transparent may have any colour."""
    scalar = _block_means(values[..., 3], shown, factor)
    weights = values[..., 3] + 1e-6
    total = _block_means(weights, shown, factor)
    colors = [_block_means(values[..., i] * weights, shown, factor) / total / 255 for i in range(3)]
    return np.stack([*colors, scalar], axis=-1)


def coarsened(volume, factor):
    """-> vtkImageData whose scalars are the means over blocks of factor^3 of those that are finite
    and not hidden, NaN where there are none; of colours, fractions of 1."""
    scalars = volume.GetPointData().GetScalars()
    shape = volume.GetDimensions()[::-1]
    values, shown = to_numpy(scalars).reshape(*shape, -1), _is_shown(volume)
    shown = None if shown is None else shown.reshape(shape)
    if values.shape[-1] == 1:
        means = _block_means(values[..., 0], shown, factor)[..., None]
    else:
        means = _mean_colors(values, shown, factor)
    result = vtk("vtkCommonDataModel").vtkImageData()
    result.CopyStructure(volume)
    result.SetExtent([end for count in volume.GetDimensions()
                      for end in (0, (count - 1) // factor)])
    first = [0.0, 0.0, 0.0]
    middle = (factor - 1) / 2
    volume.TransformContinuousIndexToPhysicalPoint(
        *(begin + middle for begin in volume.GetExtent()[::2]), first)
    result.SetOrigin(first)
    result.SetSpacing([factor * length for length in volume.GetSpacing()])
    result.GetPointData().SetScalars(named_array(scalars.GetName(), means.reshape(-1, means.shape[-1])))
    return result

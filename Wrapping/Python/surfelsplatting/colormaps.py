# SPDX-License-Identifier: BSD-3-Clause
"""Colours for scalars."""

import importlib

import numpy as np

from .backend import vtk
from .problems import UserProblem

# Each colour map by colours at equal steps, between which it is linear.
COLORMAPS = {
    # Smith, van der Walt, Firing 2015; each 15th of its 256 colours (CC0), at most 5 of 255 off
    "viridis": "440154 481769 472a7a 433d84 3d4e8a 355e8d 2e6d8e 297b8e 23898e 1f978b 21a585 2eb37c "
               "46c06f 65cb5e 89d548 b0dd2f d8e219 fde725",
    "gray": "000000 ffffff",
}
SIZE = 256
OWN_AXES = ("x", "y", "z")  # scalars that every cloud has: its coordinates


def _known(name):
    """[n, 3] colours from 0 to 1"""
    values = [int(word, 16) for word in COLORMAPS[name].split()]
    return np.array([(v >> 16, v >> 8 & 255, v & 255) for v in values]) / 255


def _of_matplotlib(name):
    try:
        colormaps = importlib.import_module("matplotlib").colormaps
    except ImportError:
        raise UserProblem(f"the colour map {name!r} needs matplotlib: pip install matplotlib; "
                          f"without it there are {', '.join(COLORMAPS)}") from None
    if name not in colormaps:
        raise UserProblem(f"matplotlib has no colour map {name!r}; try viridis, magma, cividis, "
                          "turbo, coolwarm or gray")
    return colormaps[name](np.linspace(0, 1, SIZE))[:, :3]


def colors_of(name):
    """-> [SIZE, 3] colours from 0 to 1, or UserProblem if there is no such colour map."""
    knots = _known(name) if name in COLORMAPS else _of_matplotlib(name)
    places = np.linspace(0, len(knots) - 1, SIZE)
    return np.stack([np.interp(places, range(len(knots)), channel) for channel in knots.T], axis=1)


def lookup_table(name, first, last):
    """-> vtkLookupTable, from the scalar with the first colour to that with the last"""
    colors = colors_of(name)
    if first > last:
        first, last, colors = last, first, colors[::-1]
    table = vtk("vtkCommonCore").vtkLookupTable()
    table.SetNumberOfTableValues(SIZE)
    for i, color in enumerate(colors):
        table.SetTableValue(i, *color, 1.0)
    table.SetNanColor(0.5, 0.5, 0.5, 1.0)
    table.SetTableRange(first, last)
    return table


def _own_names(data):
    """Names of the point arrays with one number for each point."""
    points = data.GetPointData()
    arrays = [points.GetArray(i) for i in range(points.GetNumberOfArrays())]
    bit = vtk("vtkCommonCore").VTK_BIT
    return [array.GetName() for array in arrays
            if array and array.GetName() and not array.GetName().startswith("Surfel")
            and array.GetNumberOfComponents() == 1 and array.GetDataType() != bit]


def scalar_names(data):
    """Names of what a vtkPolyData may be coloured by."""
    names = _own_names(data)
    return names + [axis for axis in OWN_AXES if axis not in names]


def check_scalars(data, name):
    if name not in scalar_names(data):
        raise UserProblem(f"there are no scalars {name!r}; there are "
                          + ", ".join(scalar_names(data)))


def with_scalars(surfels, name):
    """The surfels with this array, if it is a coordinate."""
    if name in _own_names(surfels):
        return surfels
    numpy_support = vtk("util.numpy_support")
    axis = OWN_AXES.index(name)
    values = numpy_support.vtk_to_numpy(surfels.GetPoints().GetData())[:, axis].astype(np.float64)
    origin = surfels.GetFieldData().GetArray("SurfelOrigin")
    if origin and origin.GetNumberOfValues() == 3:
        values += numpy_support.vtk_to_numpy(origin).ravel()[axis]
    array = numpy_support.numpy_to_vtk(values, deep=True)
    array.SetName(name)
    copy = surfels.NewInstance()
    copy.ShallowCopy(surfels)
    copy.GetPointData().AddArray(array)
    return copy


def range_of(surfels, name):
    """The smallest and the largest finite value."""
    values = vtk("util.numpy_support").vtk_to_numpy(surfels.GetPointData().GetArray(name))
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)


def color_by(mapper, name, colormap="viridis", limits=None):
    """Colours the surfels of a vtkSurfelMapper by an array, between limits or over its range."""
    surfels = with_scalars(mapper.GetInput(), name)
    if surfels is not mapper.GetInput():
        mapper.SetInputData(surfels)
    mapper.SetScalarVisibility(True)
    mapper.SetColorModeToMapScalars()
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray(name)
    mapper.SetLookupTable(lookup_table(colormap, *(limits or range_of(surfels, name))))
    mapper.UseLookupTableScalarRangeOn()

# SPDX-License-Identifier: BSD-3-Clause
"""Colours for scalars."""

import importlib

import numpy as np

from .backend import vtk
from .problems import UserProblem
from .vtkarrays import named_array, to_numpy

# Each colour map by colours at equal steps, between which it is linear: each 15th of its 256 colours,
# of cividis each 5th; at most 7 of 255 off.
COLORMAPS = {
    # Smith, van der Walt, Firing 2015 (CC0)
    "viridis": "440154 481769 472a7a 433d84 3d4e8a 355e8d 2e6d8e 297b8e 23898e 1f978b 21a585 "
              "2eb37c 46c06f 65cb5e 89d548 b0dd2f d8e219 fde725",
    "plasma": "0d0887 2f0596 4903a0 6100a7 7801a8 8e0ca4 a21d9a b42e8d c43e7f d24f71 de6164 "
              "e97257 f3854b f99a3e fdaf31 fdc627 f8df25 f0f921",
    "inferno": "000004 0a0722 1e0c45 380962 510e6c 69166e 801f6c 982766 b0315b c63d4d d94d3d "
              "e9612b f47918 fa9407 fcb014 f8cd37 f2ea69 fcffa4",
    "magma": "000004 090720 1a1042 311165 4a1079 621980 792282 912b81 aa337d c23b75 d9466b "
              "ec5860 f7725c fc8e64 feaa74 fec68a fde2a3 fcfdbf",
    # Nunez, Anderton, Renslow 2018: for all kinds of colour vision
    "cividis": "00224e 002656 002a5f 002d68 003070 083370 163770 203a6f 273e6e 2e416d 34456c "
              "3a486c 3f4c6c 444f6c 49536c 4e566c 535a6d 575d6d 5c616e 60646f 656870 696b71 "
              "6d6f72 727274 767676 7a7a78 7e7d78 838179 888578 8d8878 928c78 969077 9b9476 "
              "a09875 a59c74 aaa073 afa471 b5a86f baac6d bfb06b c4b468 c9b965 cfbd62 d4c15f "
              "dac65b dfca57 e5cf52 ead34c f0d846 f6dd3f fce236 fee838",
    # Mikhailov 2019, Google (Apache 2.0): a rainbow without bands
    "turbo": "30123b 3f3e9c 4666dd 458cfd 2fb2f4 1ad4d0 22ebaa 52fa7a 8bff4b b7f735 dbe236 "
              "f5c53a fea130 f9751d e84b0c ce2d04 a91601 7a0403",
    # Moreland 2009: for scalars with a middle
    "coolwarm": "3b4cc0 4c66d6 5f7fe8 7396f5 88abfd 9dbdff b1cbfc c4d5f3 d5dbe5 e4d9d2 f0cdbb "
              "f6bea4 f7aa8c f39475 e97a5f dc5d4a ca3b37 b40426",
    "gray": "000000 ffffff",
}
SIZE = 256
OWN_AXES = ("x", "y", "z")  # scalars that every cloud has: its coordinates
BULK = (0.5, 99.5)  # percentiles of scalars
OUTLYING = 4  # times as long as the bulk's is a range of scalars that outliers stretch
MOST_SAMPLES = 1_000_000  # scalars that tell the bulk


def _known(name):
    """[n, 3] colours from 0 to 1"""
    values = [int(word, 16) for word in COLORMAPS[name].split()]
    return np.array([(v >> 16, v >> 8 & 255, v & 255) for v in values]) / 255


def _of_matplotlib(name):
    try:
        colormaps = importlib.import_module("matplotlib").colormaps
    except ImportError:
        raise UserProblem(f"the colour map {name!r} needs matplotlib: apt install python3-matplotlib, or pip "
                          f"install matplotlib; without it there are {', '.join(COLORMAPS)}") from None
    if name not in colormaps:
        raise UserProblem(f"matplotlib has no colour map {name!r}; try {', '.join(COLORMAPS)}")
    return colormaps[name](np.linspace(0, 1, SIZE))[:, :3]


def colors_of(name):
    """-> [SIZE, 3] colours from 0 to 1, or UserProblem if there is no such colour map."""
    knots = _known(name.lower()) if name.lower() in COLORMAPS else _of_matplotlib(name)
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
    axis = OWN_AXES.index(name)
    values = to_numpy(surfels.GetPoints().GetData())[:, axis].astype(np.float64)
    origin = surfels.GetFieldData().GetArray("SurfelOrigin")
    if origin and origin.GetNumberOfValues() == 3:
        values += to_numpy(origin).ravel()[axis]
    copy = surfels.NewInstance()
    copy.ShallowCopy(surfels)
    copy.GetPointData().AddArray(named_array(name, values))
    return copy


def range_of(surfels, name):
    """The smallest and the largest finite value."""
    values = to_numpy(surfels.GetPointData().GetArray(name))
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)


def range_without_outliers(values, limits):
    """-> texts of the smallest and the largest of the bulk of the values, or None where outliers do not
    stretch their limits"""
    some = values[::max(1, len(values) // MOST_SAMPLES)]
    some = some[np.isfinite(some)]
    if len(some) == 0:
        return None
    low, high = np.percentile(some, BULK)
    is_stretched = 0 < high - low < (limits[1] - limits[0]) / OUTLYING
    return (f"{low:.4g}", f"{high:.4g}") if is_stretched else None


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

# SPDX-License-Identifier: BSD-3-Clause
"""Transfer functions of volumes: opacities and colours of scalars."""

import numpy as np

from .backend import vtk
from .colormaps import SIZE, colors_of

BINS = 64  # of the histogram
QUIET = 0.05  # share of the range about the background that counts as background: noise is there
DEPTH = 1.5  # optical depth of the volume in the mean: three quarters of the light are absorbed
MOST_OPACITY = 0.99  # over the unit distance
LARGEST = 1e300  # vtkVolumeSplatting: scalars beyond are not finite


def _solve(counts, distances, edge):
    """The opacity m for which the optical depths -ln(1 - m distance) add up to DEPTH in the mean, on
    a way of `edge` unit distances; MOST_OPACITY if that is less."""
    shares = counts / counts.sum()
    low, high = 0.0, MOST_OPACITY
    for _ in range(50):
        middle = (low + high) / 2
        if edge * (shares @ -np.log1p(-middle * distances)) < DEPTH:
            low = middle
        else:
            high = middle
    return high


def automatic_opacity(values, limits, edge):
    """[(scalar, opacity)]: the most frequent scalar is transparent, as background, and the opacity
    grows with the distance from it, on both sides.

    values: finite scalars. limits: the scalars between which the opacity changes. edge: of the
    volume, in units of the distance that the opacities are for.
    """
    low, high = np.clip(sorted(limits), -LARGEST, LARGEST)
    span = high / 2 - low / 2  # halves, since the whole may be larger than what float64 holds
    if span == 0:
        return [(float(low), _solve(np.ones(1), np.ones(1), edge))]
    places = np.clip((values / 2 - low / 2) / span, 0, 1)
    counts, borders = np.histogram(places, BINS, (0.0, 1.0))
    centers = (borders[1:] + borders[:-1]) / 2
    background = centers[np.argmax(counts)]
    farthest = max(background, 1 - background)
    knots = np.array([0.0, background - QUIET, background + QUIET, 1.0])
    knots = np.unique(np.clip(knots, 0, 1))

    def distance(place):
        return np.maximum(0.0, (np.abs(place - background) - QUIET) / (farthest - QUIET))

    most = _solve(counts, distance(centers), edge)
    return [(float((1 - place) * low + place * high), float(most * distance(place)))
            for place in knots]


def make_property(opacities, colormap, limits, unit_distance):
    """-> vtkVolumeProperty

    opacities: [(scalar, opacity)] over the unit distance, world units. limits: the scalars with the
    first and the last colour.
    """
    opacity = vtk("vtkCommonDataModel").vtkPiecewiseFunction()
    for point in opacities:
        opacity.AddPoint(*point)
    color = vtk("vtkRenderingCore").vtkColorTransferFunction()
    colors = colors_of(colormap)
    if limits[0] == limits[1]:
        color.AddRGBPoint(limits[0], *colors[SIZE // 2])
    else:
        for share, rgb in zip(np.linspace(0, 1, SIZE), colors):
            color.AddRGBPoint((1 - share) * limits[0] + share * limits[1], *rgb)
    result = vtk("vtkRenderingCore").vtkVolumeProperty()
    result.SetScalarOpacity(opacity)
    result.SetColor(color)
    result.SetScalarOpacityUnitDistance(unit_distance)
    return result

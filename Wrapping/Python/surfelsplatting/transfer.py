# SPDX-License-Identifier: BSD-3-Clause
"""Transfer functions of volumes: opacities and colours of scalars."""

import math

import numpy as np

from .backend import vtk
from .colormaps import SIZE, colors_of

BINS = 64  # of the histogram
QUIET = 0.05  # share of the range about the background that counts as background: noise is there
DEPTH = 1.5  # optical depth of the volume in the mean: three quarters of the light are absorbed
MOST_OPACITY = 0.99  # over the unit distance
LARGEST = 1e300  # vtkVolumeSplatting: scalars beyond are not finite
DIGITS = 3  # of opacities, and at least so many of scalars tell places of the range apart


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


def _round(opacities, span):
    """[(scalar, opacity)] in as few digits as tell them apart. span: of the scalars"""
    digits = DIGITS - math.floor(math.log10(span)) if span > 0 else None
    return [(float(scalar) if digits is None else round(float(scalar), digits),
             float(f"{opacity:.{DIGITS}g}")) for scalar, opacity in opacities]


class _Histogram:
    """Of scalars as places from 0 to 1 between limits."""

    def __init__(self, values, limits, background):
        """background: a scalar; None: the most frequent one"""
        self.low, self.high = np.clip(sorted(limits), -LARGEST, LARGEST)
        # Halves, since the whole may be larger than what float64 holds.
        self.half = self.high / 2 - self.low / 2
        places = np.clip(self._place(values), 0, 1) if self.half else np.zeros(len(values))
        self.counts, borders = np.histogram(places, BINS, (0.0, 1.0))
        self.centers = (borders[1:] + borders[:-1]) / 2
        self.background = (self.centers[np.argmax(self.counts)] if background is None
                           else self._place(background) if self.half else 0.0)

    def _place(self, scalars):
        return (scalars / 2 - self.low / 2) / self.half

    def scalar(self, place):
        return (1 - place) * self.low + place * self.high

    def border(self):
        """The place between two classes that differ most (Otsu 1979); 1/2 if there is one bin."""
        shares, moments = (np.cumsum(c / self.counts.sum())[:-1]
                           for c in (self.counts, self.counts * self.centers))
        apart = shares * (1 - shares)
        mean = self.centers @ self.counts / self.counts.sum()
        with np.errstate(divide="ignore", invalid="ignore"):
            variances = np.where(apart > 1e-12, (mean * shares - moments) ** 2 / apart, 0.0)
        best = np.flatnonzero(variances >= variances.max() * (1 - 1e-9))
        return (float(best[0] + best[-1]) / 2 + 1) / BINS  # the middle of a gap


def automatic_opacity(values, limits, edge, background=None):
    """[(scalar, opacity)]: the background is transparent, and the opacity grows with the distance
    from it, on both sides.

    values: finite scalars. limits: the scalars between which the opacity changes. edge: of the
    volume, in units of the distance that the opacities are for. background: a scalar; None: the
    most frequent one.
    """
    found = _Histogram(values, limits, background)
    if found.half == 0:
        opacity = _solve(np.ones(1), np.ones(1), edge) if background is None else 0.0
        return _round([(found.low, opacity)], 0)
    background = found.background
    farthest = max(background, 1 - background)
    knots = np.array([0.0, background - QUIET, background + QUIET, 1.0])
    knots = np.unique(np.clip(knots, 0, 1))

    def distance(place):
        beyond = np.abs(place - background) - QUIET
        return np.where(beyond > 1e-9, beyond / (farthest - QUIET), 0.0)  # 0 where QUIET ends

    most = _solve(found.counts, distance(found.centers), edge)
    return _round([(found.scalar(place), most * distance(place)) for place in knots],
                  2 * found.half)


def surface_look(values, limits, background=None):
    """-> [(scalar, opacity)] with which light falls on surfaces, and the scalars with the first and
    the last colour; parameters as of automatic_opacity.

    Inside of things, where scalars hardly change, normals point anywhere, and what is lit there is
    dark. So that all light is gathered before, the opacity grows from the background's end to
    MOST_OPACITY at the border between background and things. The background has the colour in the
    middle, so that what is seen has the brighter ones.
    """
    found = _Histogram(values, limits, background)
    if found.half == 0:
        return _round([(found.low, MOST_OPACITY if background is None else 0.0)], 0), limits
    border, background = found.border(), found.background
    side = 1 if border > background else -1
    begin = background + side * QUIET
    end = background + side * max(2 * QUIET, abs(border - background))
    points = sorted((found.scalar(place), opacity)
                    for place, opacity in ((begin, 0.0), (end, MOST_OPACITY)))
    farthest = (side + 1) / 2
    colors = found.scalar(2 * background - farthest), found.scalar(farthest)
    return _round(points, 2 * found.half), tuple(map(float, colors))


def _color_function(colormap, limits):
    color = vtk("vtkRenderingCore").vtkColorTransferFunction()
    colors = colors_of(colormap)
    if limits[0] == limits[1]:
        color.AddRGBPoint(limits[0], *colors[SIZE // 2])
    else:
        for share, rgb in zip(np.linspace(0, 1, SIZE), colors):
            color.AddRGBPoint((1 - share) * limits[0] + share * limits[1], *rgb)
    return color


def make_property(opacities, colormap, limits, unit_distance):
    """-> vtkVolumeProperty

    opacities: [(scalar, opacity)] over the unit distance, world units. colormap: None if the volume
    has colours of its own. limits: the scalars with the first and the last colour.
    """
    opacity = vtk("vtkCommonDataModel").vtkPiecewiseFunction()
    for point in opacities:
        opacity.AddPoint(*point)
    result = vtk("vtkRenderingCore").vtkVolumeProperty()
    result.SetScalarOpacity(opacity)
    if colormap is None:
        result.IndependentComponentsOff()
    else:
        result.SetColor(_color_function(colormap, limits))
    result.SetScalarOpacityUnitDistance(unit_distance)
    return result

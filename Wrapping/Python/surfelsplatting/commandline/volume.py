# SPDX-License-Identifier: BSD-3-Clause
"""A volume to Gaussians in space, as the options say."""

import math
from dataclasses import dataclass

import numpy as np

from ..clouds.cloud import Cloud
from ..clouds.volumes import (add_smoothed, are_labels, coarsened, color_components, has_choice,
                              samples_of, scalar_names, volume_of)
from ..problems import UserProblem
from ..transfer import DIGITS, automatic_opacity, make_property, surface_look
from ..vtkSurfelVolumes import vtkVolumeSplatting

# The most cells along an edge for which cells are split so often: of 21 cells, layers need two
# levels, and cells of larger volumes than these are hardly larger than pixels.
SUBDIVISIONS = ((32, 2), (256, 1))
MOST_GAUSSIANS = 1 << 24  # a minute of one core's time to make, and 4 GB


@dataclass
class Classified:
    """A volume, and how the options say that it looks."""
    volume: object  # vtkImageData with scalars
    scalars: str  # name
    colors: int  # components of the scalars if they are colours, 3 or 4; else 0
    samples: object  # [n] of the scalars; of colours the opacities, or without these the luminances
    limits: tuple  # the smallest and the largest scalar
    opacities: list  # [(scalar, opacity)]
    colors_between: tuple  # the scalars with the first and the last colour
    unit_distance: float  # over which the opacities are, world units

    @property
    def meaning(self):
        """What the opacities are of."""
        return {0: "", 3: "the luminance of ", 4: "the fourth component of "}[self.colors] + (
            repr(self.scalars))

    @property
    def option_text(self):
        """The options that make the same of it."""
        text = f"--opacity {self.opacity_text} --unit-distance {self.unit_distance:.6g}"
        if self.colors or self.colors_between == self.limits:
            return text
        return text + " --range " + " ".join(map(self._text, self.colors_between))

    @property
    def opacity_text(self):
        """The opacities as --opacity has them."""
        return ",".join(f"{self._text(scalar)}:{opacity:.{DIGITS}g}"
                        for scalar, opacity in self.opacities)

    def _text(self, scalar):
        """In digits that tell the scalars apart."""
        largest, span = max(map(abs, self.limits)), self.limits[1] - self.limits[0]
        digits = 1 + DIGITS + max(0, round(math.log10(largest / span))) if span > 0 else 17
        return f"{scalar:.{digits}g}"


def _cells(volume):
    """-> cells along an edge, as a geometric mean"""
    return math.prod((n - 1) ** (1 / 3) for n in volume.GetDimensions())


def _unit_distance(volume):
    """As ParaView's volumes have it: about the diagonal of a cell, world units."""
    return volume.GetLength() / _cells(volume)


def classify(cloud, arguments):
    """-> Classified. cloud: of a volume. UserProblem without such scalars, or if none is finite."""
    volume = volume_of(cloud.data, arguments.volume_scalars)
    name = volume.GetPointData().GetScalars().GetName()
    samples, limits = samples_of(volume)
    components = color_components(cloud.data, arguments.volume_scalars)
    if not len(samples):
        raise UserProblem(f"{arguments.cloud}: no scalar of {name!r} is finite and not hidden, so "
                          "there is nothing to see")
    transparent = 0.0 if components == 4 else None
    if transparent is not None:
        limits = transparent, limits[1]
    colors = tuple(arguments.range or limits)
    unit = _unit_distance(volume)
    if arguments.opacity:
        opacities = arguments.opacity
    elif arguments.shade:
        opacities, bright = surface_look(samples, colors, transparent)
        colors = tuple(arguments.range or bright)
    else:
        edge = _cells(volume) * math.prod(abs(s) ** (1 / 3) for s in volume.GetSpacing())
        opacities = automatic_opacity(samples, colors, edge / unit, transparent)
    return Classified(volume, name, components, samples, limits, opacities, colors,
                      arguments.unit_distance or unit)


def take_scalars(arguments):
    """The scalars of a volume decide what it shows; they do not colour what becomes of it."""
    if arguments.scalars:
        arguments.volume_scalars, arguments.scalars = arguments.scalars, None


def _resolved(found):
    """-> the volume to draw, how many of its points became one along each axis, and how often its
    cells may be split: so that it becomes MOST_GAUSSIANS at most."""
    opacities = np.interp(found.samples, *np.transpose(found.opacities))
    count = _cells(found.volume)
    cells = np.mean(opacities > 0) * count**3
    factor = max(1, math.ceil((cells / MOST_GAUSSIANS) ** (1 / 3)))
    if factor > 1:
        return coarsened(found.volume, factor), factor, 0
    times = next((times for most, times in SUBDIVISIONS if count <= most), 0)
    while times and cells * 8**times > MOST_GAUSSIANS:
        times -= 1
    return found.volume, 1, times


def _smooth_normals(splatting, volume, session):
    """Light that falls on a mask shows the steps of its voxels, so that normals come from smoothed
    scalars. The opacity keeps the data: thin parts and narrow gaps would be lost."""
    name = add_smoothed(volume)
    if name:
        splatting.SetGradientArrayName(name)
        session.note("has few different scalars, as masks have: the light takes them smoothed, so that "
                     "steps of voxels are not lit")


def splat_volume(cloud, session):
    """-> Cloud of the Gaussians of a cloud that is a volume."""
    arguments = session.arguments
    found = classify(cloud, arguments)
    if has_choice(cloud.data) and not arguments.volume_scalars:
        session.note(f"shows {found.scalars!r} of {', '.join(scalar_names(cloud.data))}; --scalars "
                     "chooses another")
    volume, factor, subdivision = _resolved(found)
    if factor > 1:
        session.note("is large and drawn as {1} x {2} x {3}, the means of {0} x {0} x {0} points; "
                     "with an --opacity that leaves more of it transparent it gets finer".format(
                         factor, *volume.GetDimensions()))
    splatting = vtkVolumeSplatting()
    splatting.SetInputData(volume)
    splatting.SetSubdivision(subdivision)
    colormap = None if found.colors else arguments.colormap or "viridis"
    prop = make_property(found.opacities, colormap, found.colors_between, found.unit_distance)
    prop.SetShade(arguments.shade)
    splatting.SetVolumeProperty(prop)
    if arguments.shade and are_labels(found.samples):
        _smooth_normals(splatting, volume, session)
    with session.run.stage("volume"):
        session.progress.update(splatting, "volume")
    session.messages.check(f"{arguments.cloud}: ")
    session.say("{} from {:.6g} to {:.6g}, drawn with {}".format(
        found.meaning, *found.limits, found.option_text))
    if splatting.GetOutput().GetNumberOfPoints() == 0:
        raise UserProblem(
            "{}: all of it is transparent: {} is from {:.6g} to {:.6g}, and the opacity is {}".format(
                arguments.cloud, found.meaning, *found.limits, found.opacity_text))
    return Cloud(splatting.GetOutput(), how=cloud.how)

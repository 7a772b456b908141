# SPDX-License-Identifier: BSD-3-Clause
"""What is up in a cloud, whose file does not say it."""

import warnings
from types import SimpleNamespace

import numpy as np

from ..backend import vtk
from ..clouds.polydata import polydata_of
from ..surfels import make_surfels

FLAT = 0.35  # thickness over width below which a cloud is a terrain
LOWEST = 0.05  # the part of the height in which the ground is looked for
GROUND = 0.03  # part of the area above which level area there is a ground
LEVEL = 0.95  # cosine of the slope up to which area is level
OPEN = 0.05  # net area over area above which a surface has an open side
OPAQUE = 0.5  # opacity of a capture's Gaussians that are taken for a surface
CENTERS = 50_000  # of them, up to which a surface is estimated: a quarter of a second

Y, Z = np.eye(3)[1:]
OF_SCANS, OF_CAPTURES = (Y, Z), (0 - Y, Y, Z, 0 - Z)  # what may be up; of captures the usual one comes first


def _up_of_ground(samples, ups):
    """Whichever of these directions has more level area at its lower end, which faces up. Of two
    walls on opposite sides without known outsides, one looks like a ground; so the upper end counts
    against it, but less: rooms have ceilings."""
    area = np.linalg.norm(samples.areas, axis=1)
    best, most = None, GROUND * area.sum()
    for up in ups:
        along = samples.areas @ up
        level = np.where(samples.two_sided, np.abs(along), along) > LEVEL * area
        height = samples.points @ up
        bottom, top = height.min(), height.max()
        low = height < bottom + LOWEST * (top - bottom)
        high = height > top - LOWEST * (top - bottom)
        ground = area[level & low].sum() - 0.5 * area[level & high].sum()
        if ground > most:
            best, most = up, ground
    return best


def _opening(samples):
    """-> the sum of the area vectors whose outside is known, over the sum of the areas"""
    one_sided = samples.areas[~samples.two_sided]
    total = np.linalg.norm(one_sided, axis=1).sum()
    return one_sided.sum(axis=0) / total if total > 0 else np.zeros(3)


def _up_of_openings(samples, ups):
    """Objects are rarely scanned from below, so the sum of the area vectors points up."""
    opening = _opening(samples)
    up = max(ups, key=lambda direction: direction @ opening)
    return up if up @ opening >= max(OPEN, np.abs(opening).max()) else None


def is_open(samples):
    """Whether the surface has an open side, through which its back would be seen."""
    return bool(np.linalg.norm(_opening(samples)) > OPEN)


def _surface_of(samples):
    """-> what surfels through the centres of a capture's opaque Gaussians say, or None"""
    centers = samples.points[samples.opacities > OPAQUE]
    if not len(centers):
        return None
    centers = centers[::max(1, len(centers) // CENTERS)]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            surfels = make_surfels(polydata_of(centers, {}), hierarchy=False)
    except (RuntimeError, ValueError):  # they are no surface
        return None
    to_numpy, data = vtk("util.numpy_support").vtk_to_numpy, surfels.GetPointData()
    return SimpleNamespace(points=to_numpy(surfels.GetPoints().GetData()).astype(float),
                           areas=to_numpy(data.GetArray("SurfelAreaVector")).astype(float),
                           two_sided=to_numpy(data.GetArray("SurfelTwoSided")).astype(bool))


def up_axis(samples):
    """z in coordinates of a country, and of a volume, whose slices are stacked along it; a terrain's
    normal; up from a ground; away from an open bottom; otherwise y, as is usual for models, or of a
    capture -y, as for the cameras of COLMAP, with which most are trained."""
    if samples.has_origin or samples.is_volume:
        return Z
    ups = OF_CAPTURES if samples.is_capture else OF_SCANS
    thin = int(np.argmin(samples.extent))
    if thin != 0 and samples.extent[thin] < FLAT * np.delete(samples.extent, thin).min():
        ups = [up for up in ups if up[thin]]
    surface = samples if len(ups) == 1 or not samples.is_capture else _surface_of(samples)
    if len(ups) > 1 and surface is not None:
        for guess in (_up_of_ground, _up_of_openings):
            up = guess(surface, ups)
            if up is not None:
                return up
    return ups[0]

# SPDX-License-Identifier: BSD-3-Clause
"""What is up in a cloud, whose file does not say it."""

import warnings
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from ..backend import vtk
from ..clouds.polydata import polydata_of
from ..surfels import make_surfels
from .turning import unit

FLAT = 0.35  # thickness over width below which a cloud is a terrain
SLICES, THICK, NEAR_END = 60, 3, 9  # of the height; as thick as a ground is; where its end is
BULK = (0.5, 99.5)  # percent of the heights
GROUND = 0.03  # part of the area above which level area there is a ground
GAP = 1e-4  # part of the area below which a slice is empty
BASE = 0.08  # the same of closed things, at both ends; of balls it is 0.05
SLAB = 0.15  # the same of any area, where noise hides what is level
CLEAR = 2.0  # times as much evidence as any other direction has
AGAINST_USAGE = 3.0  # times as much of a ground at the top as at the bottom
LEVEL = 0.95  # cosine of the slope up to which area is level
OPEN = 0.05  # net area over area above which a surface has an open side
OPAQUE = 0.5  # opacity of a capture's Gaussians that are taken for a surface
ENOUGH = 50_000  # samples, of which what is up is told within a quarter of a second
STEEPEST = 0.5  # cosine of the angle between a floor's normal and what is up in a depth image
EVEN = 0.99  # cosine of the angle between the normals of one floor
PERCENTS = range(5, 100, 5)  # of the heights
ALIKE = 0.05  # of the extent, by which heights differ of things that look alike
FLOOR = 0.15  # part of the area above which there is a floor
TRIED = 500  # normals that may be a floor's

X, Y, Z = np.eye(3)
OF_SCANS, OF_CAPTURES = (Y, Z, 0 - Y, 0 - Z), (0 - Y, Y, Z, 0 - Z)  # what may be up, usual first


class Up(NamedTuple):
    axis: np.ndarray
    is_clear: bool  # else it is a guess


def _is_usual(index, ups):
    """Whether no opposite direction comes first."""
    return not any(up @ ups[index] < 0 for up in ups[:index])


def _thick_slices(samples, up, areas):
    """-> the part of all area that these areas have in each slice and the next ones, upwards"""
    height = samples.points @ up
    low, high = np.percentile(height, BULK)
    share = np.clip((height - low) / max(high - low, 1e-300), 0, 1)
    slices = np.histogram(share, SLICES, (0, 1), weights=areas)[0]
    total = max(np.linalg.norm(samples.areas, axis=1).sum(), 1e-300)
    return np.convolve(slices, np.ones(THICK), "valid") / total


def _near_ends(samples, up, areas):
    """-> the most of these areas that a slice near the lower and near the upper end has, over all
    area. Noise is on both sides of a ground, so that the very end has little."""
    slices = _thick_slices(samples, up, areas)
    return slices[:NEAR_END].max(), slices[-NEAR_END:].max()


def _level_ends(samples, up):
    """-> the same of level area that faces up; area without a known outside faces both ways."""
    area = np.linalg.norm(samples.areas, axis=1)
    along = samples.areas @ up
    level = np.where(samples.two_sided, np.abs(along), along) > LEVEL * area
    return _near_ends(samples, up, area * level)


def _most(ends, ups, least):
    """-> Up with the most at its lower end. Of two walls on opposite sides without known outsides,
    one looks like a ground; so the upper end counts against it, but less: rooms have ceilings. None
    if it is less than the least."""
    scores = [low - 0.5 * high for low, high in ends]
    lower = {tuple(up): low for up, (low, _) in zip(ups, ends)}
    for index, up in enumerate(ups):
        if not _is_usual(index, ups) and lower[tuple(up)] < AGAINST_USAGE * lower[tuple(0 - up)]:
            scores[index] = 0.0
    best = int(np.argmax(scores))
    if scores[best] <= least:
        return None
    others = max([0.0, *scores[:best], *scores[best + 1:]])
    return Up(ups[best], _is_usual(best, ups) and scores[best] > CLEAR * others)


def _of_ground(samples, ups):
    """A guess if nothing stands on it: then it may be a wall, behind what is seen."""
    up = _most([_level_ends(samples, up) for up in ups], ups, GROUND)
    if up and up.is_clear:
        slices = _thick_slices(samples, up.axis, np.linalg.norm(samples.areas, axis=1))
        up = up._replace(is_clear=not (slices[int(np.argmax(slices[:NEAR_END])):] < GAP).any())
    return up


def _of_slab(samples, ups):
    """Most points of scenes are at the ground. Where noise hides what is level, this remains."""
    if samples.two_sided.mean() < 0.5:
        return None
    area = np.linalg.norm(samples.areas, axis=1)
    every = (*ups, X, 0 - X)
    up = _most([_near_ends(samples, up, area) for up in every], every, SLAB)
    return up if up and up.is_clear and up.axis @ X == 0 else None


def _opening(samples):
    """-> the sum of the area vectors whose outside is known, over the sum of the areas"""
    one_sided = samples.areas[~samples.two_sided]
    total = np.linalg.norm(one_sided, axis=1).sum()
    return one_sided.sum(axis=0) / total if total > 0 else np.zeros(3)


def _of_openings(samples, ups):
    """Objects are rarely scanned from below, so the sum of the area vectors points up."""
    opening = _opening(samples)
    along = [direction @ opening for direction in ups]
    best = int(np.argmax(along))
    if along[best] < max(OPEN, np.abs(opening).max()):
        return None
    others = max([0.0, *(abs(x) for x, up in zip(along, ups) if up @ ups[best] == 0)])
    return Up(ups[best], _is_usual(best, ups) and along[best] > CLEAR * others)


def _of_base(samples, ups):
    """Closed things stand on what is level, or have it on top; which of them, usage tells."""
    usual = [up for index, up in enumerate(ups) if _is_usual(index, ups)]
    outward = SimpleNamespace(points=samples.points, two_sided=np.zeros_like(samples.two_sided),
                              areas=np.where(samples.two_sided[:, None], 0.0, samples.areas))
    base = [_level_ends(outward, 0 - up)[1] for up in usual]
    most = [low + _level_ends(outward, up)[1] for low, up in zip(base, usual)]
    best = int(np.argmax(most))
    others = max([0.0, *most[:best], *most[best + 1:]])
    if most[best] <= max(BASE, CLEAR * others):
        return None
    return Up(usual[best], base[best] > CLEAR * (most[best] - base[best]))


def is_open(samples):
    """Whether the surface has an open side, through which its back would be seen."""
    return bool(np.linalg.norm(_opening(samples)) > OPEN)


def _some_of(samples):
    some = slice(None, None, max(1, len(samples.points) // ENOUGH))
    return SimpleNamespace(points=samples.points[some], areas=samples.areas[some],
                           two_sided=samples.two_sided[some])


def _surface_of(samples):
    """-> what surfels through the centres of a capture's opaque Gaussians say, or None"""
    centers = samples.points[samples.opacities > OPAQUE]
    if not len(centers):
        return None
    centers = centers[::max(1, len(centers) // ENOUGH)]
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


def _is_alike_from(samples, ups):
    """Whether it does not matter which of these is up, as of balls: their heights are the same."""
    heights = [np.percentile(samples.points @ up, PERCENTS) - samples.center @ up for up in ups]
    return bool(np.ptp(heights, axis=0).max() <= ALIKE * samples.extent[1:].max())


def find_up(samples):
    """-> Up: z in coordinates of a country, and of a volume, whose slices are stacked along it; a
    terrain's normal; up from a ground; away from an open bottom or a flat base; otherwise y, as is
    usual for models, or of a capture -y, as for the cameras of COLMAP, with which most are trained."""
    if samples.is_far or samples.is_volume:
        return Up(Z, True)
    ups = OF_CAPTURES if samples.is_capture else OF_SCANS
    thin = int(np.argmin(samples.extent))
    is_thin = thin != 0 and samples.extent[thin] < FLAT * np.delete(samples.extent, thin).min()
    if is_thin:
        ups = [up for up in ups if up[thin]]
    surface = _surface_of(samples) if samples.is_capture else _some_of(samples)
    if surface is not None:
        for rule in (_of_ground, _of_openings, _of_base, _of_slab):
            up = rule(surface, ups)
            if up:
                return up
    # What is thin along y may be a wall.
    return Up(ups[0], is_thin and thin == 2 or _is_alike_from(samples, OF_SCANS))


def floor_normal(samples, up):
    """The normal of a depth image's floor, or the direction that is up in the image if there is none:
    sensors look down at things. Walls are too steep, and ceilings face down."""
    area = np.linalg.norm(samples.areas, axis=1)
    normals = samples.areas / np.maximum(area, 1e-300)[:, None]
    tried = normals[normals @ up > STEEPEST]
    if not len(tried):
        return up
    tried = tried[::max(1, len(tried) // TRIED)]
    some = slice(None, None, max(1, len(area) // 20 // TRIED))
    votes = [area[some][normals[some] @ normal > EVEN].sum() for normal in tried]
    normal = tried[int(np.argmax(votes))]
    for _ in range(2):
        same = normals @ normal > EVEN
        normal = unit(samples.areas[same].sum(axis=0))
    return normal if area[same].sum() > FLOOR * area.sum() else up

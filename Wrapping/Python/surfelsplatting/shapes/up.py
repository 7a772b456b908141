# SPDX-License-Identifier: BSD-3-Clause
"""What is up in a cloud, whose file does not say it."""

import warnings
from typing import NamedTuple

import numpy as np

from ..clouds.polydata import polydata_of
from ..surfels import make_surfels
from ..vtkarrays import to_numpy
from .directions import unit
from .rooms import height_axis, is_room, may_be_room
from .samples import ENOUGH
from .surfaces import Surface, found_once, heights_along

FLAT, LEAN = 0.35, 0.6  # thickness over width below which a cloud is a terrain; and of figures
SLENDER, TALL, ROUND = 3.0, 1.5, 2.0  # height over width of masts, of trees; width over depth
FOOT, NARROW = 0.2, 0.25  # part of the height that is trunk at least, its width over that of the tree
SLICES, THICK, NEAR_END = 60, 3, 9  # of the height; as thick as a ground is; where its end is
GROUND = 0.03  # part of the area above which level area there is a ground
GAP = 1e-4  # part of the area below which a slice is empty
BASE = 0.08  # the same of closed things, at both ends; of balls it is 0.05
SLAB = 0.15  # the same of any area, where noise hides what is level
FREE = 0.25  # as much at the top as at the bottom, up to which nothing is above a ground
CLEAR = 2.0  # times as much evidence as any other direction has
AGAINST_USAGE = 3.0  # times as much of a ground at the top as at the bottom, or as stable
LEVEL = 0.95  # cosine of the slope up to which area is level
STANCE, STABLE = 0.03, 0.1  # part of the height that touches the ground; slope up to which it stands
SETTLED, FAR_OFF = 0.985, 10.0  # cosine of the turn by which a thing settles; tangent of one too far
TIPS = 8  # times at most that it touches the ground elsewhere
FEW, HALF = 0.1, 0.5  # two-sided parts of a closed surface, and of one that mostly is
OPEN = 0.05  # net area over area above which a surface has an open side
OPAQUE = 0.5  # opacity of a capture's Gaussians that are taken for a surface
STEEPEST = 0.5  # cosine of the angle between a floor's normal and what is up in a depth image
EVEN = 0.99  # cosine of the angle between the normals of one floor
PERCENTS = range(5, 100, 5)  # of the heights
ALIKE = 0.05  # of the extent, by which heights differ of things that look alike
FLOOR = 0.15  # part of the area above which there is a floor
TRIED = 500  # normals that may be a floor's
STEEP = 0.3  # cosine of the slope below which what is on a flat thing is steep
RELIEF = 0.01, 0.3  # part of a facade's area that is steep
ALONG_AXES, ALONG_EACH = 0.7, 0.1  # parts of that area
NOTABLE = 0.02  # part of the area before or behind a wall

X, Y, Z = np.eye(3)
OF_SCANS, OF_CAPTURES = (Y, Z, 0 - Y, 0 - Z), (0 - Y, Y, Z, 0 - Z)  # what may be up, usual first


class Up(NamedTuple):
    axis: np.ndarray
    is_clear: bool  # else it is a guess
    is_usual: bool = False  # a guess that is right for most things of this kind
    is_alone: bool = True  # no other direction has about the same evidence


def _is_usual(index, ups):
    """Whether no opposite direction comes first."""
    return not any(up @ ups[index] < 0 for up in ups[:index])


def _thick_slices(samples, up, areas):
    """-> the part of all area that these areas have in each slice and the next ones, upwards"""
    height, low, high = heights_along(samples, up)
    share = np.clip((height - low) / max(high - low, 1e-300), 0, 1)
    slices = np.histogram(share, SLICES, (0, 1), weights=areas)[0]
    total = max(samples.sizes.sum(), 1e-300)
    return np.convolve(slices, np.ones(THICK), "valid") / total


def _near_ends(samples, up, areas):
    """-> the most of these areas that a slice near the lower and near the upper end has, over all
    area. Noise is on both sides of a ground, so that the very end has little."""
    slices = _thick_slices(samples, up, areas)
    return slices[:NEAR_END].max(), slices[-NEAR_END:].max()


@found_once
def _level_ends(samples, up):
    """-> the same of level area that faces up; area without a known outside faces both ways."""
    area = samples.sizes
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
    if ends[best][1] < FREE * ends[best][0]:  # walls are on opposite sides, and grounds are not
        scores = [min(score, low - high) for score, (low, high) in zip(scores, ends)]
    others = max([0.0, *scores[:best], *scores[best + 1:]])
    is_alone = scores[best] > CLEAR * others
    return Up(ups[best], is_alone and _is_usual(best, ups), is_alone=is_alone)


def _of_ground(samples, ups):
    """A guess if nothing stands on it: then it may be a wall, behind what is seen."""
    up = _most([_level_ends(samples, up) for up in ups], ups, GROUND)
    if up and up.is_clear:
        slices = _thick_slices(samples, up.axis, samples.sizes)
        up = up._replace(is_clear=not (slices[int(np.argmax(slices[:NEAR_END])):] < GAP).any())
    return up


def _has_trunk(samples, up):
    """Whether the lower end is as narrow as that of a tree"""
    height, low, _ = heights_along(samples, up)
    foot = samples.points[height <= low + FOOT * np.ptp(height)]
    across = np.eye(3)[np.abs(up) < 0.5]
    width = max(np.ptp(np.percentile(foot @ axis, PERCENTS)) for axis in across)
    return bool(width < NARROW * max(np.ptp(samples.points @ axis) for axis in across))


def _of_stem(samples, ups):
    """Trees, masts and towers stand, whose outside is not known everywhere; closed models of long
    things may lie. Wires along y lie, so that y is a guess."""
    if samples.two_sided.mean() <= FEW and not is_open(samples):
        return None
    depth, width, height = np.sort(samples.extent)
    longest = np.eye(3)[int(np.argmax(samples.extent))]
    along = [up for up in ups if up @ longest > 0]
    if not along or width >= ROUND * depth or height <= TALL * width:
        return None
    is_stem = height > SLENDER * width or _has_trunk(samples, along[0])
    return Up(along[0], bool(along[0] @ Z)) if is_stem else None


def _of_slab(samples, ups):
    """Most points of scenes are at the ground. Where noise hides what is level, this remains."""
    if samples.two_sided.mean() < 0.5:
        return None
    area = samples.sizes
    every = (*ups, X, 0 - X)
    up = _most([_near_ends(samples, up, area) for up in every], every, SLAB)
    return up if up and up.is_clear and up.axis @ X == 0 else None


def _of_openings(samples, ups):
    """Objects are rarely scanned from below, so the sum of the area vectors points up."""
    opening = samples.opening
    along = [direction @ opening for direction in ups]
    best = int(np.argmax(along))
    if along[best] < max(OPEN, np.abs(opening).max()):
        return None
    others = max([0.0, *(abs(x) for x, up in zip(along, ups) if up @ ups[best] == 0)])
    is_alone = along[best] > CLEAR * others
    return Up(ups[best], is_alone and _is_usual(best, ups), is_alone=is_alone)


@found_once
def _stance(samples, up):
    """-> the slope on which the surface would tip over: the distance of its centre from the nearest edge
    of what touches the ground, over the height of the centre; negative if it does not stand at all.
    And what is up in it once it has tipped over that edge, until more of it touches the ground."""
    area = samples.sizes
    center = area @ samples.points / max(area.sum(), 1e-300)
    height, low, high = heights_along(samples, up)
    across = unit(np.cross(up, X if abs(up[0]) < 0.5 else Y))
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)[:, None]
    edges = np.cos(angle) * across + np.sin(angle) * np.cross(up, across)
    feet = samples.points[height <= low + STANCE * (high - low)] - center
    reach = (feet @ edges.T).max(axis=0)
    nearest, edge, tipped = reach.min(), edges[int(np.argmin(reach))], up
    if nearest < 0:
        beyond = (samples.points - center) @ edge - nearest
        slopes = np.maximum(height - low, 0)[beyond > 0] / beyond[beyond > 0]
        tipped = unit(up - slopes.min(initial=FAR_OFF) * edge)
    return nearest / max(center @ up - low, 1e-300), tipped


def _stability(samples, up):
    return _stance(samples, up)[0]


def _settled_stability(samples, up):
    """The same once it has settled: what leans forward stands on two of four wheels, and tips over onto
    the others. Negative if it would turn far."""
    settled = up
    for _ in range(TIPS):
        stability, settled = _stance(samples, settled)
        if stability >= 0 or settled @ up < SETTLED:
            break
    return stability


def _of_stance(samples, ups):
    """Closed things stand in one of the usual directions. If they would in several, for example on
    their backs, this tells nothing, unless one is far more stable; nor if a more usual one is only
    a little off."""
    if samples.two_sided.mean() > HALF or is_open(samples):
        return None
    usual = [up for index, up in enumerate(ups) if _is_usual(index, ups)]
    stable = [_stability(samples, up) for up in usual]
    best = int(np.argmax(stable))
    stable[:best] = [_settled_stability(samples, up) for up in usual[:best]]
    others = max([0.0, *stable[:best], *stable[best + 1:]])
    return Up(usual[best], True) if stable[best] > max(STABLE, AGAINST_USAGE * others) else None


def _on_feet(samples):
    """-> Up of a figure that spreads its arms, so that it is thin: it stands on two feet, with nothing
    between them, and does not lie. So do animals, seen from their side. None for others."""
    thin = _thin_axis(samples, LEAN)
    if thin not in (1, 2) or samples.two_sided.mean() > HALF or is_open(samples):
        return None
    up = Z if thin == 1 else Y
    if _stability(samples, up) <= 0:
        return None
    height, low, high = heights_along(samples, up)
    places = samples.points[height <= low + STANCE * (high - low), 0]
    thirds = np.histogram(places, 3)[0]
    return Up(up, True) if thirds[1] == 0 else None


def _stands_on_base(samples, up):
    """Whether it stands as it is, on level area that it has at this end only; a car has two sides."""
    below, above = _level_ends(samples, 0 - up)[1], _level_ends(samples, up)[1]
    return below > max(GROUND, CLEAR * above) and _stability(samples, up) > STABLE


def _as_usual(samples, ups):
    """-> a guess where nothing tells: the first of the usual directions; or if it does not stand along
    that, one along which it stands on a base; or of scans one along which it stands, if it would tip
    over along the first."""
    first, *others = [up for index, up in enumerate(ups) if _is_usual(index, ups)]
    if samples.is_capture or samples.two_sided.mean() > HALF:
        return first
    some = samples.some
    if _stability(some, first) >= 0:
        return first
    based = next((up for up in others if _stands_on_base(some, up)), None)
    if based is not None:
        return based
    if samples.is_model or _settled_stability(some, first) >= 0:
        return first
    return next((up for up in others if _settled_stability(some, up) > STABLE), first)


def _upright(samples, found, ups):
    """What was found, unless it is a guess by which the surface would tip over, while it stands in one
    of the usual directions. Places, whose outside is mostly unknown, do not tip over."""
    if not found or found.is_clear or samples.two_sided.mean() > HALF:
        return found
    if _stability(samples, found.axis) >= 0:
        return found
    usual = [up for index, up in enumerate(ups) if _is_usual(index, ups)]
    stable = [_stability(samples, up) for up in usual]
    best = int(np.argmax(stable))
    return Up(usual[best], False) if stable[best] > STABLE else found


def _of_base(samples, ups):
    """Closed things stand on what is level, or have it on top; which of them, usage tells."""
    usual = [up for index, up in enumerate(ups) if _is_usual(index, ups)]
    outward = samples if not samples.two_sided.any() else Surface(
        samples.points, np.where(samples.two_sided[:, None], 0.0, samples.areas),
        np.zeros_like(samples.two_sided))
    base = [_level_ends(outward, 0 - up)[1] for up in usual]
    most = [low + _level_ends(outward, up)[1] for low, up in zip(base, usual)]
    best = int(np.argmax(most))
    others = max([0.0, *most[:best], *most[best + 1:]])
    if most[best] <= max(BASE, CLEAR * others):
        return None
    return Up(usual[best], base[best] > CLEAR * (most[best] - base[best]))


def _is_facade(samples, thin):
    """Whether a flat thing is a wall: the sides of its windows, and their sills and lintels, face
    along the other axes. Slopes of a terrain face everywhere; where rooms have no ceiling, most is
    steep."""
    area = samples.sizes
    cosines = np.abs(samples.areas) / np.maximum(area, 1e-300)[:, None]
    steep = cosines[:, thin] < STEEP
    relief = area[steep].sum()
    along = [area[steep & (cosines[:, axis] > LEVEL)].sum() for axis in {0, 1, 2} - {thin}]
    return bool(RELIEF[0] * area.sum() <= relief <= RELIEF[1] * area.sum()
                and sum(along) >= ALONG_AXES * relief and min(along) >= ALONG_EACH * relief)


def _has_two_sides(samples, thin):
    """Whether something is before most of a flat thing and something is behind it. Things stand on
    grounds, and few lie below."""
    area = samples.sizes
    slices = _thick_slices(samples, np.eye(3)[thin], area)
    most = int(np.argmax(slices))
    before, behind = slices[:max(0, most - THICK)], slices[most + THICK + 1:]
    return min(before.sum(), behind.sum()) > THICK * NOTABLE


def _of_facade(samples, thin):
    """A wall stands: along z, as in most scans, unless it is thin along z."""
    if thin is None or not _is_facade(samples, thin):
        return None
    has_two_sides = _has_two_sides(samples, thin)
    if thin == 2:
        return Up(Y, False) if has_two_sides else None
    return Up(Z, has_two_sides)


def _on_foot(samples, thin, found):
    """What was found; but if a flat place would lie upside down, and stands on level area that it has at
    its lower end only, it is a wall and the ground before it. Where cameras look, walls are far."""
    if found is None or found.is_clear or thin not in (1, 2) or found.axis[thin] >= 0:
        return found
    standing = Y if thin == 2 else Z
    low, high = _level_ends(samples, standing)
    is_wall = samples.two_sided.mean() > HALF and low > GROUND and high < FREE * low
    return Up(standing, False) if is_wall else found


def is_open(samples):
    """Whether the surface has an open side, through which its back would be seen."""
    return bool(np.linalg.norm(samples.opening) > OPEN)


def _is_model(samples):
    """Whether a surface is closed, does not tip over along y, and may stand on its lower end there as
    well as on that along z. Scans of places are open, and models of things have y up."""
    if samples.is_capture or samples.two_sided.mean() > HALF or is_open(samples.some):
        return False
    if _stability(samples.some, Y) < 0:
        return False
    along_y, along_z = samples.profiles[1:]
    return max(along_z.floor, along_z.ceiling) <= max(BASE, along_y.floor, along_y.ceiling)


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
    data = surfels.GetPointData()
    return Surface(to_numpy(surfels.GetPoints().GetData()).astype(float),
                   to_numpy(data.GetArray("SurfelAreaVector")).astype(float),
                   to_numpy(data.GetArray("SurfelTwoSided")).astype(bool))


def _is_alike_from(samples, ups):
    """Whether it does not matter which of these is up, as of balls: their heights are the same."""
    heights = [np.percentile(samples.some.points @ up, PERCENTS) - samples.center @ up for up in ups]
    return bool(np.ptp(heights, axis=0).max() <= ALIKE * samples.extent[1:].max())


def _thin_axis(samples, most=FLAT):
    thin = int(np.argmin(samples.extent))
    return thin if samples.extent[thin] < most * np.delete(samples.extent, thin).min() else None


def _of_kind(samples, thin):
    """-> Up of rooms and of walls, or None"""
    if is_room(samples) or may_be_room(samples):
        axis, is_clear = height_axis(samples)
        return Up(np.eye(3)[axis], is_clear)
    return _of_facade(samples.some, thin)


def _of_surface(samples, ups):
    """-> what the surface says, or None"""
    rules = (_of_ground, _of_openings, _of_base, _of_slab)
    if samples.is_capture:
        surface = _surface_of(samples)
    else:
        surface, rules = samples.some, (_of_stance, _of_stem, *rules)
    if surface is None:
        return None
    found = next(filter(None, (rule(surface, ups) for rule in rules)), None)
    if samples.is_capture:
        return found
    return _on_foot(surface, _thin_axis(samples), _upright(surface, found, ups))


def _turned_over(samples, up, ups):
    """The opposite, if a model would stand along it, as a cup on its base. Otherwise the opening is
    not at its top, and it may be a head with an open neck."""
    opposite = 0 - up.axis
    if _stability(samples.some, opposite) >= 0:
        return up._replace(axis=opposite)
    return Up(_as_usual(samples, ups), False)


def find_up(samples):
    """-> Up: what the file says; z in coordinates of a country, and of a volume, whose slices are
    stacked along it; along the walls of rooms and facades; a terrain's normal; as figures and closed
    things stand; as trees stand; up from a ground; away from an open bottom or a flat base; otherwise
    y, as is usual for models, or of a capture -y, as for the cameras of COLMAP, with which most are
    trained. A guess of the opposite is not taken for a model: a table looks like a ground with poles
    on it."""
    if samples.up is not None:
        return Up(samples.up, True)
    if samples.is_far or samples.is_volume:
        return Up(Z, True)
    thin = _thin_axis(samples)
    up = None if samples.is_capture else _of_kind(samples, thin)
    if up:
        return up
    up = None if samples.is_capture else _on_feet(samples.some)
    if up:
        return up
    ups = OF_CAPTURES if samples.is_capture else OF_SCANS
    if thin:
        ups = [up for up in ups if up[thin]]
    up = _of_surface(samples, ups)
    if samples.is_capture and up and not up.is_alone:
        up = None  # what is usual says more
    if not up and thin == 0 and not samples.is_capture:
        return Up(Z, False)  # a wall
    up = up or Up(_as_usual(samples, ups), thin == 2)  # what is thin along y may be a wall
    if samples.is_model and not up.is_clear and up.axis.sum() < 0:
        up = _turned_over(samples, up, ups)
    return up._replace(is_clear=up.is_clear or _is_alike_from(samples, OF_SCANS),
                       is_usual=bool(up.axis[1] > 0 and _is_model(samples)))


def floor_normal(samples, up):
    """The normal of a depth image's floor, or the direction that is up in the image if there is none:
    sensors look down at things. Walls are too steep, and ceilings face down."""
    area = samples.sizes
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

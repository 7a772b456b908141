# SPDX-License-Identifier: BSD-3-Clause
"""Rooms, which are scanned from inside: where their walls face inward, and where nothing tells."""

from typing import NamedTuple

import numpy as np

from .surfaces import heights_along

# As in Filters/Orientation/Rooms.cxx, which turns the walls of rooms inward: a surface that is a room
# there must be one here.
END = 0.05  # part of the height, at both ends, in which floor and ceiling are
WALL, LEVEL = 0.3, 0.95  # cosine of the slope
CLOSED = 0.15  # net area over area below which a surface is closed
LEAST = 0.06  # part of the area of a floor, and of a ceiling
UPRIGHT = 0.8  # least part of the area that is level or a wall
HEIGHTS = 1.8, 12.0  # of rooms, in metres or feet

STEPS = 0.05  # most of the area of an empty room that is flat between its ends
ONE_SIDED = 0.7  # least part of a room's area
TOPS, CLEAR = 0.01, 2.0  # least part of the area, and how many times as much as along another axis
FLAT = 0.7  # height over width below which it is no width


class Profile(NamedTuple):
    """Parts of the area of a surface along one axis."""

    floor: float  # level, at the lower end
    ceiling: float
    tops: float  # level, between the ends, and facing up, less what faces down
    upright: float  # walls and all that is level
    between: float  # level, between the ends

    @property
    def has_floor_and_ceiling(self):
        return min(self.floor, self.ceiling) >= LEAST and self.upright >= UPRIGHT


def profile_of(samples, axis):
    heights, low, high = heights_along(samples, np.eye(3)[axis])
    area = samples.sizes
    share = (heights - low) / max(high - low, 1e-300)
    cosine = samples.areas[:, axis] / np.maximum(area, 1e-300)
    total = max(area.sum(), 1e-300)

    def part(where):
        return float(area[where].sum() / total)

    level = np.abs(cosine) >= LEVEL
    between = level & (share > END) & (share < 1 - END)
    tops = between & ~samples.two_sided
    return Profile(part(level & (share <= END)), part(level & (share >= 1 - END)),
                   part(tops & (cosine > 0)) - part(tops & (cosine < 0)),
                   part(level | (np.abs(cosine) <= WALL)), part(between))


def facing_of(samples):
    """-> 1 if a closed surface faces outward, -1 inward, 0 if it is not closed"""
    one_sided = ~samples.two_sided
    areas = np.compress(one_sided, samples.areas, axis=0)
    total = samples.sizes[one_sided].sum()
    if (not total or total < ONE_SIDED * samples.sizes.sum()
            or np.linalg.norm(areas.sum(axis=0)) > CLOSED * total):
        return 0
    points = np.compress(one_sided, samples.points, axis=0)
    return int(np.sign(np.einsum("ij,ij", areas, points - points.mean(axis=0))))


def is_room(samples):
    """Whether what is seen is the inside of a closed surface."""
    return samples.facing < 0 and any(samples.profiles[axis].has_floor_and_ceiling
                                      for axis in (1, 2))


def may_be_room(samples):
    """Whether what faces outward, or has two sides, has the shape of an empty room, and its size in
    metres or feet: it ends in planes on two axes, or on all if it may be open, at a room's height. What
    faces outward and has steps is several boxes."""
    if samples.facing > 0 and sum(profile.between for profile in samples.profiles) > STEPS:
        return False
    axes = [axis for axis in range(3) if samples.profiles[axis].has_floor_and_ceiling]
    return bool(len(axes) >= (2 if samples.facing > 0 else 3) and samples.facing >= 0
                and any(HEIGHTS[0] <= samples.extent[axis] <= HEIGHTS[1] for axis in axes if axis))


def height_axis(samples):
    """-> 1 or 2, and whether that is clear: furniture has more tops than bottoms, and most rooms are
    wider than high. Else z, as in most scans."""
    if is_room(samples):
        y, z = (samples.profiles[axis].tops for axis in (1, 2))
        if max(y, z) > TOPS and max(y, z) > CLEAR * min(y, z):
            return (1 if y > z else 2), True
    x, y, z = samples.extent
    return (1 if y < FLAT * min(x, z) else 2), bool(min(y, z) < FLAT * min(x, max(y, z)))

# SPDX-License-Identifier: BSD-3-Clause
"""Depth images that were saved as a list of points: told by the pixels in which their points lie."""

import math

import numpy as np

# Where the sensor looks, and what is up for it: as for OpenCV, for OpenGL, for robots.
AXES = (((0, 0, 1), (0, -1, 0)), ((0, 0, -1), (0, 1, 0)), ((1, 0, 0), (0, 0, 1)),
        ((0, 1, 0), (0, 0, 1)))
SAMPLES = 200_000
FEWEST = 1000  # points
BINS = 50_000  # from side to side, many times as many as an image has columns
NARROWEST = 16  # columns, and rows
FILLED = 0.02  # part of the pixels that hold a point, at least; of points at random it is 0.001
SPREAD_OUT = 2  # times as many places along an axis as columns: a grid on a plane has as many
WIDEST = math.tan(math.radians(60))  # what is wider is no picture


def _occupied(values):
    """In how many of BINS, from the least to the largest of them, there are values"""
    low, high = values.min(), values.max()
    if not high > low:
        return 1
    numbers = np.round((values - low) * (BINS / (high - low))).astype(int)
    return np.count_nonzero(np.bincount(numbers))


def _is_image(across, along, depth):
    """Whether points lie in the columns and rows of the image that a sensor at the origin has."""
    count = len(depth)
    slopes = across / depth, along / depth
    if max(np.abs(slope).max() for slope in slopes) > WIDEST:
        return False
    columns, rows = map(_occupied, slopes)
    if min(columns, rows) < NARROWEST or count < FILLED * columns * rows:
        return False
    return (_occupied(across) > SPREAD_OUT * columns and _occupied(along) > SPREAD_OUT * rows)


def _some(points, most):
    """About so many, without invalid ones"""
    points = points[::max(1, len(points) // most)].astype(np.float64)
    with np.errstate(invalid="ignore"):
        return points[np.isfinite(points).all(axis=1) & (points != 0).any(axis=1)]


def image_axes(points):
    """-> the direction in which the sensor looked from the origin, and what was up for it, or None if
    the points are no depth image. Pixels are apart by the same slope, so that only these images have
    few slopes; points that were moved, mixed or thinned by cells have as many as points.

    points: [n, 3]
    """
    few = _some(points, FEWEST)  # of most clouds these tell that the origin is among them
    possible = [axes for axes in AXES if (few @ np.array(axes[0], np.float64)).min(initial=1.0) > 0]
    if not possible:
        return None
    points = _some(points, SAMPLES)
    if len(points) < FEWEST:
        return None
    for axes in possible:
        forward, up = np.array(axes, np.float64)
        depth = points @ forward
        if depth.min() > 0 and _is_image(points @ np.cross(forward, up), points @ up, depth):
            return forward, up
    return None

# SPDX-License-Identifier: BSD-3-Clause
"""Turns that fit a cloud."""

import copy
from dataclasses import replace

import numpy as np

from ..shapes.directions import unit
from ..shapes.samples import Samples
from .focus import fronts_of
from .framing import fit
from .paths import turntable

RINGS, RING_POINTS = 64, 64
BULK = 98  # percent of the samples, by their distance from the axis, that a turn shows all the time
PLACES = 32  # of the camera, from which the surface in the middle is looked for
HARMONICS = 4  # of the motion of the focus during a turn


def _middle(samples):
    """Of the bulk of the samples."""
    return np.percentile(samples.points, (100 - BULK, BULK), axis=0).mean(axis=0)


def _swept(samples, pivot, axis):
    """What the samples reach on their way around the axis: rings."""
    local = samples.points - pivot
    height = local @ axis
    radius = np.linalg.norm(local - np.outer(height, axis), axis=1)
    bulk = radius <= np.percentile(radius, BULK)
    height, radius = height[bulk], radius[bulk]
    low, step = height.min(), max(np.ptp(height), 1e-300) / RINGS
    ring = np.minimum(((height - low) / step).astype(int), RINGS - 1)
    largest = np.zeros(RINGS)
    np.maximum.at(largest, ring, radius)
    across = unit(np.cross(np.eye(3)[int(np.argmin(np.abs(axis)))], axis))
    turns = 2 * np.pi * np.arange(RING_POINTS) / RING_POINTS
    circle = np.outer(np.cos(turns), across) + np.outer(np.sin(turns), np.cross(axis, across))
    edges = low + step * np.arange(RINGS + 1)
    swept = copy.copy(samples)
    swept.points = pivot + np.concatenate(
        [largest[i] * circle + h * axis for i in range(RINGS) for h in edges[i:i + 2]])
    swept.low, swept.high = swept.points.min(axis=0), swept.points.max(axis=0)
    return swept


def _smooth(values, count):
    """A loop without its higher harmonics, in so many steps; within the range of the values."""
    waves = np.fft.rfft(values)[:HARMONICS + 1] / len(values)
    times = 2 * np.pi * np.arange(count) / count
    smooth = waves[0].real + sum(2 * (wave * np.exp(1j * times * (order + 1))).real
                                 for order, wave in enumerate(waves[1:]))
    return np.clip(smooth, values.min(), values.max())


def focused_in_the_middle(turn, frames, renderer):
    """-> the views of a turn, focused on the front of the surface in the middle of each picture, but
    without the quick part of its motion, so that the focus does not jump at edges.

    turn: gives the views of so many frames. renderer: has the scene and the size of the pictures.
    """
    views, fronts = turn(frames), fronts_of(turn(PLACES), renderer)
    if not fronts.any():
        return views
    fronts[fronts == 0] = np.median(fronts[fronts > 0])
    # Blur is linear in the reciprocal of the distance.
    return [replace(view, focal_distance=float(1 / near))
            for view, near in zip(views, _smooth(1 / fronts, frames))]


def whole_turn(view, axis, surfels, degrees):
    """-> a turntable around a cloud, from the side of a view: a function that gives the views of so
    many frames. The camera is where it sees the bulk of the cloud all the way around."""
    samples = Samples(surfels)
    pivot = _middle(samples)
    direction = unit(np.asarray(view.position) - np.asarray(view.focal_point))
    position, focal_point = fit(_swept(samples, pivot, axis), direction,
                                np.asarray(view.view_up), view)
    view = replace(view, position=tuple(map(float, position)),
                   focal_point=tuple(map(float, focal_point)))
    return lambda frames: turntable(view, pivot, axis, frames, degrees)

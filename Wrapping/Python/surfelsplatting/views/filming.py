# SPDX-License-Identifier: BSD-3-Clause
"""Turns that fit a cloud."""

import copy
from dataclasses import replace

import numpy as np

from .framing import Samples, fit, surface_in_the_middle
from .paths import turntable
from .turning import unit

RINGS, RING_POINTS = 64, 64
BULK = 98  # percent of the samples, by their distance from the axis, that a turn shows all the time
FRONTS = 32  # places of the camera from which the front of the surface is looked for
HARMONICS = 2  # of the motion of the focus during a turn


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


def _smooth_fronts(samples, views, frames):
    """The distances of the surface in the middle of the picture, without the higher harmonics of
    their motion, so that the focus does not jump at edges."""
    fronts = np.array([surface_in_the_middle(samples, np.asarray(v.position),
                                             np.asarray(v.focal_point), v) for v in views])
    if not fronts.any():
        return np.zeros(frames)
    fronts[fronts == 0] = np.median(fronts[fronts > 0])
    waves = np.fft.rfft(fronts)[:HARMONICS + 1] / len(fronts)
    times = 2 * np.pi * np.arange(frames) / frames
    smooth = waves[0].real + sum(2 * (wave * np.exp(1j * times * (order + 1))).real
                                 for order, wave in enumerate(waves[1:]))
    return np.clip(smooth, fronts.min(), fronts.max())


def turn(view, axis, surfels, frames, degrees):
    """-> the views of a turntable around a cloud, from the side of a view.

    The camera is where it sees the bulk of the cloud all the way around, and focused on the surface
    in the middle, unless the view has another focus.
    """
    samples = Samples(surfels)
    pivot = _middle(samples)
    direction = unit(np.asarray(view.position) - np.asarray(view.focal_point))
    position, focal_point = fit(_swept(samples, pivot, axis), direction,
                                np.asarray(view.view_up), view)
    view = replace(view, position=tuple(map(float, position)),
                   focal_point=tuple(map(float, focal_point)))
    views = turntable(view, pivot, axis, frames, degrees)
    if view.focal_distance or view.focus_point or view.wishes.focus_pixel:
        return views
    fronts = _smooth_fronts(samples, turntable(view, pivot, axis, FRONTS, degrees), frames)
    return [replace(v, focal_distance=float(distance)) for v, distance in zip(views, fronts)]

# SPDX-License-Identifier: BSD-3-Clause
"""Views into rooms."""

import numpy as np

from ..shapes.directions import lengths
from ..shapes.rooms import is_room
from ..shapes.surfaces import BULK
from .cameras import AXES

FEW = 4000  # points, of which the place inside is found
ROOMY = 0.8  # part of the largest space around a place that is enough
STEPS = 9  # places tried along each axis
EYES = 0.6  # of the height
WIDE = 75  # degrees, the view angle of a picture from inside


def name_of(axis):
    """The word for one of AXES, or None"""
    return next((word for word, vector in AXES.items() if vector == tuple(axis)), None)


def options_inside(samples, up):
    """-> options for a view into what is a room, or may be one: from where there is much space, as far
    as possible from the middle, at which it looks."""
    place = " ".join(f"{x:.10g}" for x in np.round(_place_inside(samples, up), 2))
    options = [f"--position {place} --view-angle {WIDE}"]
    if not is_room(samples) and samples.two_sided.mean() < 0.5:
        options.insert(0, "--sides two")
    if not is_room(samples) and name_of(up):
        options.insert(0, f"--up {name_of(up)}")
    return " ".join(options)


def _place_inside(samples, up):
    points = samples.points[::max(1, len(samples.points) // FEW)]
    low, high = np.percentile(points, BULK, axis=0)
    steps = [low[i] + (high[i] - low[i]) * (np.arange(STEPS) + 0.5) / STEPS for i in range(3)]
    axis = int(np.argmax(np.abs(up)))
    eyes = EYES if up[axis] > 0 else 1 - EYES
    steps[axis] = low[axis:axis + 1] + eyes * (high - low)[axis]
    places = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    spaces = np.array([_space_around(points - place) for place in places])
    wide = places[spaces >= ROOMY * spaces.max()]
    return wide[int(np.argmax(lengths(wide - samples.center)))]


def _space_around(rays):
    """-> the distance to the nearest point; 0 unless there are points in all eight octants"""
    octants = np.bincount((rays > 0) @ (1, 2, 4), minlength=8)
    return lengths(rays).min() if octants.min() > 0 else 0.0

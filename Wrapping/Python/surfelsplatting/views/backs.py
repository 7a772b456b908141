# SPDX-License-Identifier: BSD-3-Clause
"""Views that show the backs of surfaces, which are not drawn: from inside of a tunnel, or from behind."""

import math

import numpy as np

from ..shapes.directions import lengths
from ..shapes.up import is_open

MOST_AWAY = 0.6  # share of a surface; from outside of a closed one half of it faces away
MOST_ASKED = 24  # views of a film


def share_facing_away(samples, views):
    """The largest share of a surface that turns its back to the camera of a view, if that is more than
    what hides behind the rest, else 0. Of a closed surface it is that of the angles: half from outside,
    all inside."""
    some = samples.some
    views = views[::math.ceil(len(views) / MOST_ASKED)]
    share = max(_share_facing_away(some, view, not is_open(some)) for view in views)
    return share if share > MOST_AWAY else 0.0


def _share_facing_away(samples, view, by_angle):
    rays = samples.points - np.asarray(view.position)
    distance = np.maximum(lengths(rays), 1e-300)
    rays /= distance[:, None]
    if by_angle:
        rays /= np.maximum(distance, 0.1 * np.median(distance))[:, None] ** 2
    facing = np.einsum("ij,ij->i", samples.areas, rays)
    away = np.where(samples.two_sided, 0.0, np.maximum(facing, 0.0)).sum()
    return float(away / max(np.abs(facing).sum(), 1e-300))

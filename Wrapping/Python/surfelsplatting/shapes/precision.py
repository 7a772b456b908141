# SPDX-License-Identifier: BSD-3-Clause
"""Coordinates with too few digits for the points."""

import numpy as np

from ..problems import UserProblem, warn_user
from ..vtkarrays import to_numpy
from .samples import Samples

ASKED = 4096  # points, about
SEEN = 0.25  # of the spacing: larger steps are seen
LEAST_STEP = 1e-5  # of the size of a cloud, below which steps are not seen


def _step_of(data):
    """The distance between the numbers that a coordinate of the points can be, along the axis where it is
    longest: float32 has 24 bits, of which points far from the origin have few left. 0: not float32."""
    places = to_numpy(data.GetPoints().GetData())
    with np.errstate(all="ignore"):  # NaN that signal, as in damaged files, and what is beyond float32
        places = places[::max(1, len(places) // ASKED)].astype(float)
        places = places[np.isfinite(places).all(axis=1)]
        if not len(places):
            return 0.0
        are_single = (places.astype(np.float32) == places).all(axis=0)
        # Of most points: few of them may be far away.
        steps = np.spacing(np.median(np.abs(places), axis=0).astype(np.float32))
    return float(np.where(are_single, steps, 0).max())


def why_stepped(points, surfels):
    """-> a line about points whose coordinates are too coarse for their surfels, or None"""
    step = _step_of(points)
    if not step > LEAST_STEP * surfels.GetLength():
        return None
    spacing = Samples(surfels).spacing
    if not step > SEEN * spacing:
        return None
    return (f"the coordinates have steps of {step:.2g}, and the points are {spacing:.2g} apart; save them in "
            "double precision, or relative to a place near them")


def warn_of_steps(points, surfels):
    """A warning of the line of the user that is the reason."""
    try:
        why = why_stepped(points, surfels)
    except UserProblem:  # too far away for any view, which is for those who ask for one to say
        return
    if why:
        warn_user(why)

# SPDX-License-Identifier: BSD-3-Clause
"""Coordinates with too few digits for the points."""

import numpy as np

from ..vtkarrays import to_numpy

SAMPLES = 4096  # points that are asked, about
SEEN = 0.25  # of the spacing: larger steps are seen


def step_of(data):
    """The distance between the numbers that a coordinate of the points can be, along the axis where it is
    longest: float32 has 24 bits, of which points far from the origin have few left. 0: not float32."""
    places = to_numpy(data.GetPoints().GetData())
    places = places[::max(1, len(places) // SAMPLES)].astype(float)
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return 0.0
    with np.errstate(all="ignore"):  # beyond float32
        are_single = (places.astype(np.float32) == places).all(axis=0)
        # Of most points: few of them may be far away.
        steps = np.spacing(np.median(np.abs(places), axis=0).astype(np.float32))
    return float(np.where(are_single, steps, 0).max())


def why_stepped(step, spacing):
    """-> a line about points whose coordinates are too coarse, or None

    step: of the coordinates, step_of
    """
    if not step > SEEN * spacing:
        return None
    return (f"the coordinates have steps of {step:.2g}, and the points are {spacing:.2g} apart: surfaces "
            "become steps. Save the points in double precision, or relative to a place near them")

# SPDX-License-Identifier: BSD-3-Clause
"""Captures of which hardly anything is seen, and why."""

import math

import numpy as np

from ..vtkarrays import to_numpy
from .focus import LEAST_SEEN, one_sharp_picture, plane_of

BLOCK = 8  # px, of parts of a picture in which small Gaussians would be close to one another
WIDE = 0.5  # part of the picture over which what is seen spreads
HARDLY = 0.5  # of the light that the densest part stops, below which hardly anything is seen


def _densest(alpha):
    """The most light that a part of a picture stops"""
    rows, columns = (np.arange(0, size, BLOCK) for size in alpha.shape)
    sums, counts = (np.add.reduceat(np.add.reduceat(values, rows, 0), columns, 1)
                    for values in (alpha, np.ones_like(alpha)))
    return float((sums / counts).max())


def _width(capture, renderer):
    """Of the median Gaussian, px: two standard deviations along the axis with most, at the focal point"""
    covariances = to_numpy(capture.GetPointData().GetArray("GaussianCovariance"))
    deviation = math.sqrt(max(0.0, np.median(covariances[:, :3].max(axis=1))))
    camera = renderer.GetCamera()
    height = 2 * math.tan(math.radians(camera.GetViewAngle()) / 2) * camera.GetDistance()
    return 2 * deviation * renderer.GetSize()[1] / height


def why_faint(capture, renderer, update):
    """-> a line about a capture of which hardly anything is seen, or None

    update: updates the renderer, for example with progress.
    """
    opacities = capture.GetPointData().GetArray("GaussianOpacity")
    if not opacities:
        return None
    with one_sharp_picture(renderer):
        update(renderer)
        alpha = plane_of(renderer, "Color")
    seen = np.argwhere(alpha > LEAST_SEEN)
    if not len(seen) or (np.ptp(seen, axis=0) < WIDE * np.array(alpha.shape)).all():
        return None  # an empty picture has a line of its own, and small things are far away
    densest = _densest(alpha)
    if densest >= HARDLY:
        return None
    why = (f"half of its Gaussians have an opacity below {np.median(to_numpy(opacities)):.2g}"
           if alpha.max() < HARDLY else
           f"half of its Gaussians are less than {_width(capture, renderer):.2g} px wide, with gaps "
           "between them, as where points became Gaussians without training")
    return ("hardly anything of the capture is seen, which stops at most "
            f"{100 * densest:.0f} % of the light in any part of the picture: {why}")

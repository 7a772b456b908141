# SPDX-License-Identifier: BSD-3-Clause
"""Whether a cloud's colours need a light: photographs have the light of the day in them."""

import numpy as np

from .backend import vtk

# Half of a cloud with labels or a colour map has so few colours, or grey levels; the borders
# between them, where surfels mix them, have others. Half of a photograph has thousands.
MOST_COLORS, MOST_GREYS = 256, 32
SAMPLES = 100_000


def are_photographs(colors):
    """Whether colours, n x 3 or n x 4 bytes, are as varied as those of photographs."""
    sampled = colors[::-(-len(colors) // SAMPLES) or 1, :3].astype(np.uint32)
    counts = np.unique(sampled @ np.array([65536, 256, 1], np.uint32), return_counts=True)[1]
    is_grey = (sampled == sampled[:, :1]).all()
    most_frequent = np.sort(counts)[::-1][:MOST_GREYS if is_grey else MOST_COLORS]
    return bool(most_frequent.sum() < 0.5 * len(sampled))


def needs_light(surfels):
    """Whether surfels are lit unless somebody says otherwise: all but those whose own colours are
    those of photographs. Shaded volumes are lit."""
    data = surfels.GetPointData()
    colors = data.GetScalars()
    if (colors is None or colors.GetDataTypeAsString() != "unsigned char"
            or colors.GetNumberOfComponents() not in (3, 4) or data.HasArray("GaussianNormal")):
        return True
    return not are_photographs(vtk("util.numpy_support").vtk_to_numpy(colors))

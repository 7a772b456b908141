# SPDX-License-Identifier: BSD-3-Clause
"""Whether a cloud's colours need a light: photographs have the light of the day in them."""

import numpy as np

from .backend import vtk

MOST_LABELS = 256  # different colours of labels, grey values or a colour map; photographs have more
SAMPLES = 100_000


def are_photographs(colors):
    """Whether colours, n x 3 or n x 4 bytes, are as varied as those of photographs."""
    sampled = colors[::-(-len(colors) // SAMPLES) or 1, :3].astype(np.uint32)
    return len(np.unique(sampled @ np.array([65536, 256, 1], np.uint32))) > MOST_LABELS


def needs_light(surfels):
    """Whether surfels are lit unless somebody says otherwise: all but those whose own colours are
    those of photographs. Shaded volumes are lit."""
    data = surfels.GetPointData()
    colors = data.GetScalars()
    if (colors is None or colors.GetDataTypeAsString() != "unsigned char"
            or colors.GetNumberOfComponents() not in (3, 4) or data.HasArray("GaussianNormal")):
        return True
    return not are_photographs(vtk("util.numpy_support").vtk_to_numpy(colors))

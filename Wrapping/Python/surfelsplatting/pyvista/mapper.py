# SPDX-License-Identifier: BSD-3-Clause
"""vtkSurfelMapper with the properties of PyVista's mappers."""

from typing import Any

import pyvista as pv

from ..vtkSurfelRendering import vtkSurfelMapper

# The class that PyVista's mappers of data sets have in common has another name in each release.
_DataSetMapperBase: Any = pv.DataSetMapper.__bases__[0]


class SurfelMapper(_DataSetMapperBase, vtkSurfelMapper):
    """Draws surfels as an actor."""

    @classmethod
    def like(cls, other):
        """Draws the points of another mapper in the same colours."""
        mapper = cls()
        mapper.ShallowCopy(other)  # lookup table, visibility
        mapper.scalar_range = other.scalar_range  # first: what follows keeps a range that was set
        mapper.dataset = other.dataset
        if other.scalar_visibility:
            mapper.set_active_scalars(other.array_name)
        return mapper

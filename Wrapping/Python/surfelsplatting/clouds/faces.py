# SPDX-License-Identifier: BSD-3-Clause
"""Points on the faces of meshes whose vertices do not tell the surface, by vtkPointsOnFaces."""

from typing import NamedTuple, Optional

import numpy as np

from ..vtkarrays import to_numpy
from ..vtkSurfelFilters import vtkPointsOnFaces

MOST_VERTICES = vtkPointsOnFaces.GetMaximumNumberOfVertices()  # of more, faces are not read


class Sampled(NamedTuple):
    data: object  # vtkPolyData with points on the faces of one
    why: str
    parts: Optional[np.ndarray]  # [n] as vtkPointsOnFaces.GetParts; None if nothing tells their sides
    is_model: bool  # whether the mesh is one as modelling programs make


def on_faces(data):
    """-> Sampled, or None if the vertices of a vtkPolyData tell the surface, or there are no faces"""
    faces = vtkPointsOnFaces()
    faces.SetInputData(data)
    faces.Update()
    if faces.GetLack() == faces.NO_LACK:
        return None
    lacks = "few" if faces.GetLack() == faces.TOO_FEW_VERTICES else "uneven"
    parts = faces.GetParts()
    return Sampled(
        faces.GetOutput(), "points on the faces of its meshes, since its "
        f"{data.GetNumberOfPoints()} vertices are too {lacks} to tell the surface",
        None if parts is None else to_numpy(parts), faces.GetIsModel())

# SPDX-License-Identifier: BSD-3-Clause
"""Normals that are not those of the points, as where only one of both was turned."""

import numpy as np

from ..backend import vtk
from ..vtkarrays import to_numpy

ASKED = 1000  # points, about
NEIGHBORS = 16


def median_lean(data, normals):
    """-> degrees by which the median of the normals leans on the surface of their points, which the nearest
    points tell; 0 where too few have a normal. Of random directions it is 60.

    data: vtkPolyData. normals: its array of them
    """
    points, normals = to_numpy(data.GetPoints().GetData()), to_numpy(normals)
    if len(points) < NEIGHBORS:
        return 0.0
    locator, ids = vtk("vtkCommonDataModel").vtkStaticPointLocator(), vtk("vtkCommonCore").vtkIdList()
    locator.SetDataSet(data)
    locator.BuildLocator()
    cosines = []
    for number in range(0, len(points), max(1, len(points) // ASKED)):
        length = np.linalg.norm(normals[number].astype(float))
        if not 0 < length < np.inf:
            continue
        locator.FindClosestNPoints(NEIGHBORS, points[number], ids)
        near = points[[ids.GetId(i) for i in range(ids.GetNumberOfIds())]].astype(float)
        plane = np.linalg.eigh(np.cov(near, rowvar=False))[1][:, 0]
        cosines.append(abs(plane @ normals[number]) / length)
    return float(np.degrees(np.arccos(min(1.0, np.median(cosines))))) if len(cosines) >= NEIGHBORS else 0.0

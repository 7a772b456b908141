# SPDX-License-Identifier: BSD-3-Clause
"""Connected parts of clouds."""

from itertools import product

import numpy as np

from ..backend import vtk
from .polydata import cells_of, polydata_of
from ..vtkarrays import to_numpy


def _connected(pairs, count):
    """-> [count] numbers, from 0, of the parts that pairs join. pairs: [m, 2]"""
    graph = polydata_of(np.zeros((count, 3)), {"number": np.arange(count)})
    graph.SetVerts(cells_of(np.arange(count), np.arange(count + 1)))
    graph.SetLines(cells_of(pairs.ravel(), np.arange(0, pairs.size + 1, 2)))
    connected = vtk("vtkFiltersCore").vtkPolyDataConnectivityFilter()
    connected.SetInputData(graph)
    connected.SetExtractionModeToAllRegions()
    connected.ColorRegionsOn()
    connected.Update()
    arrays = connected.GetOutput().GetPointData()
    region, number = (to_numpy(arrays.GetArray(name))
                      for name in ("RegionId", "number"))
    parts = np.empty(count, np.int64)
    parts[number] = region  # its points are in the order in which it has found them
    return parts


def parts_of_points(places, size):
    """-> [n] numbers, from 0, of the parts between which there are gaps: points are of one part if their
    voxels are the same or touch. places: [n, 3]; size: of a voxel, the extent over a million at least"""
    # VTK's vtkConnectedPointsFilter is not in PyVista's build.
    cells = ((places - places.min(axis=0)) / size).astype(np.int64) + 1
    strides = np.cumprod([1, *(cells.max(axis=0)[:2] + 2)])
    voxels, numbers = np.unique(cells @ strides, return_inverse=True)
    pairs = []
    for step in product((-1, 0, 1), repeat=3):
        if step > (0, 0, 0):
            others = voxels + np.dot(step, strides)
            nearest = np.minimum(np.searchsorted(voxels, others), len(voxels) - 1)
            touching = np.flatnonzero(voxels[nearest] == others)
            pairs.append(np.column_stack([touching, nearest[touching]]))
    return _connected(np.concatenate(pairs), len(voxels))[numbers.ravel()]

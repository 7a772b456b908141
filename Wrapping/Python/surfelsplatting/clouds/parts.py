# SPDX-License-Identifier: BSD-3-Clause
"""Connected parts of meshes whose faces agree on their sides."""

import numpy as np

from ..backend import vtk
from .polydata import cells_of, polydata_of


def _agreeing(corners):
    """-> [m, 2] triangles that share an edge with no third one, and pass it in opposite directions"""
    begin, end = corners.ravel().astype(np.int64), np.roll(corners, -1, axis=1).ravel()
    edges = np.minimum(begin, end) * (corners.max() + 1) + np.maximum(begin, end)
    order = np.argsort(edges, kind="stable")
    edges = edges[order]
    firsts = np.flatnonzero(np.append(True, edges[1:] != edges[:-1]))
    firsts = firsts[np.diff(np.append(firsts, len(edges))) == 2]
    first, second = order[firsts], order[firsts + 1]
    agree = (begin[first] < end[first]) != (begin[second] < end[second])
    return np.column_stack([first[agree], second[agree]]) // 3


def parts_of(corners):
    """-> [n] numbers, from 0, of the parts that triangles belong to. corners: [n, 3] numbers of places
    in their order as seen from outside"""
    pairs, count = _agreeing(corners), len(corners)
    graph = polydata_of(np.zeros((count, 3)), {})
    graph.SetVerts(cells_of(np.arange(count), np.arange(count + 1)))
    graph.SetLines(cells_of(pairs.ravel(), np.arange(0, pairs.size + 1, 2)))
    connected = vtk("vtkFiltersCore").vtkPolyDataConnectivityFilter()
    connected.SetInputData(graph)
    connected.SetExtractionModeToAllRegions()
    connected.ColorRegionsOn()
    connected.Update()
    regions = connected.GetOutput().GetPointData().GetArray("RegionId")
    return vtk("util.numpy_support").vtk_to_numpy(regions).astype(np.int64)

# SPDX-License-Identifier: BSD-3-Clause
"""A part of a large cloud's points, to see it soon."""

from dataclasses import replace

import numpy as np

from ..backend import vtk
from ..vtkarrays import named_array, to_numpy

SEED = 1


def may_be_thinned(cloud):
    """Whether it is of points; those of depth images know their neighbours by their rows."""
    return not (cloud.is_volume or cloud.is_drawable or cloud.columns or cloud.image)


def _chosen(count, every):
    """[n] indices, rising: one at random of each run of points. A fixed one would leave whole rows
    of a scan out, where their length is a multiple of the run's."""
    first = np.arange(0, count, every)
    return np.minimum(first + np.random.default_rng(SEED).integers(0, every, len(first)), count - 1)


def _rows_of(array, chosen):
    """-> array of the chosen rows, under the same name"""
    if array.IsNumeric():
        return named_array(array.GetName(), to_numpy(array)[chosen])
    rows = array.NewInstance()
    rows.SetName(array.GetName())
    rows.SetNumberOfComponents(array.GetNumberOfComponents())
    rows.SetNumberOfTuples(len(chosen))
    for row, point in enumerate(chosen.tolist()):
        rows.SetTuple(row, point, array)
    return rows


def copy_rows(source, target, chosen):
    """Gives a vtkPolyData the values that chosen points of another have, under the same names."""
    data, copies = source.GetPointData(), target.GetPointData()
    active = ((data.GetScalars(), copies.SetActiveScalars),
              (data.GetNormals(), copies.SetActiveNormals),
              (data.GetVectors(), copies.SetActiveVectors))
    for index in range(data.GetNumberOfArrays()):
        array = data.GetAbstractArray(index)
        if array.GetName() is None:
            continue
        copies.AddArray(_rows_of(array, chosen))
        for one, activate in active:
            if one is array:
                activate(array.GetName())


def one_of(every, cloud):
    """-> Cloud with one point of each `every` that follow one another, in their order"""
    data = cloud.data
    chosen = _chosen(data.GetNumberOfPoints(), every)
    points = vtk("vtkCommonCore").vtkPoints()
    points.SetData(named_array("Points", to_numpy(data.GetPoints().GetData())[chosen]))
    thinned = vtk("vtkCommonDataModel").vtkPolyData()
    thinned.SetPoints(points)
    thinned.GetFieldData().ShallowCopy(data.GetFieldData())
    copy_rows(data, thinned, chosen)
    return replace(cloud, data=thinned, parts=None if cloud.parts is None else cloud.parts[chosen],
                   how="; ".join(filter(None, (cloud.how, f"one of every {every} points"))))

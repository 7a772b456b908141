# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of VTK as arrays of numpy, and numpy's as VTK's."""

import numpy as np

from .backend import vtk


def to_numpy(array):
    """-> the numbers of an array of VTK, [n] or [n, components], in the same memory"""
    return vtk("util.numpy_support").vtk_to_numpy(array)


def named_array(name, values, kind=None):
    """-> a copy of numbers [n] or [n, components] as an array of VTK; kind: dtype, or as they are"""
    values = np.ascontiguousarray(values, dtype=kind)
    array = vtk("util.numpy_support").numpy_to_vtk(values, deep=True)
    array.SetName(name)
    return array

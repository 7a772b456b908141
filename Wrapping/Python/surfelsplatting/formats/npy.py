# SPDX-License-Identifier: BSD-3-Clause
"""Point clouds in numpy's .npy files: rows of numbers, or records with names."""

import math

import numpy as np

from ..clouds.degrees import cloud_of_degrees
from ..clouds.polydata import polydata_of
from ..problems import UserProblem
from .columns import arrays_of_columns, by_names, by_values


def _table_of(array):
    """-> [rows, columns], float64, and the names of the columns or None; ValueError if it is no table"""
    names = array.dtype.names
    columns = [array[name] for name in names] if names else [array]
    if any(column.dtype.kind not in "fiu" for column in columns):
        raise ValueError(f"it has values of the type {array.dtype}, which are no real numbers")
    if names:  # a field may hold x y z of a point
        columns = [column.reshape(array.size, math.prod(column.shape[array.ndim:])) for column in columns]
        names = [f"{name}:{i}" if column.shape[1] > 1 else name
                 for name, column in zip(names, columns) for i in range(column.shape[1])]
        if len(names) < 3:
            raise ValueError(f"its records have the fields {', '.join(names)}; a point has at least x y z")
        return np.hstack(columns).astype(float), names
    if array.ndim < 2 or array.shape[-1] < 3:
        raise ValueError(f"its shape is {array.shape}; the last axis has x y z, and perhaps more, of a point")
    table = array.reshape(-1, array.shape[-1]).astype(float)
    if table.shape[1] > max(table.shape[0], 9):
        raise ValueError(f"its shape is {array.shape}; each point needs a row, so save its transpose")
    return table, None


def read_npy_cloud(path):
    """-> vtkPolyData with double points, and the Columns that it was read from."""
    try:
        with open(path, "rb") as file:
            table, names = _table_of(np.lib.format.read_array(file, allow_pickle=False))
    except Exception as problem:  # numpy passes on those of Python's tokenizer
        raise UserProblem(f"{path} is not a .npy file of points: {problem}") from problem
    columns = by_names(list(names), table) if names else by_values(path, table)
    make = cloud_of_degrees if columns.are_degrees else polydata_of
    return make(*arrays_of_columns(table, columns)), columns

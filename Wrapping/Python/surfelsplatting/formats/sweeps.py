# SPDX-License-Identifier: BSD-3-Clause
"""Reads .bin files: sweeps of lidars, as data sets for driving have them."""

import os

import numpy as np

from ..clouds.polydata import polydata_of
from ..problems import UserProblem

# Numbers in a row: KITTI x y z intensity; nuScenes the ring, too; others the time as well.
ROWS = {4: ("intensity",), 5: ("intensity", "ring"), 6: ("intensity", "ring", "time")}
FARTHEST = 1e4  # m, of a lidar
MOSTLY = 0.9  # part of the rows that are places


def _are_places(rows):
    with np.errstate(invalid="ignore"):
        return np.mean((np.abs(rows[:, :3]) < FARTHEST).all(axis=1)) > MOSTLY


def _step(rows):
    """What is between a point and the next one of a sweep, mostly"""
    return np.median(np.abs(np.diff(rows[:, :3], axis=0)), axis=0).sum()


def read_sweep(path):
    """-> vtkPolyData with double points and intensities, and what the numbers of a row are.

    Nothing in such a file tells how many belong to a point: points that come after one another in a
    sweep are near each other, but not if the rows are taken for longer or shorter ones.
    """
    values = np.fromfile(path, "<f4")
    fitting = [values.reshape(-1, count) for count in ROWS if len(values) % count == 0]
    fitting = [rows for rows in fitting if len(rows) and _are_places(rows)]
    if os.path.getsize(path) % 4 or not fitting:
        raise UserProblem(f"{path} does not hold rows of 4 to 6 floats, x y z intensity, as lidar data "
                          "sets have them; save it as .ply or .pcd")
    rows = min(fitting, key=_step) if len(fitting[0]) > 1 else fitting[0]
    names = ROWS[rows.shape[1]]
    arrays = {name: rows[:, 3 + number] for number, name in enumerate(names)}
    return polydata_of(rows[:, :3], arrays), f"rows of floats: x, y, z, {', '.join(names)}"

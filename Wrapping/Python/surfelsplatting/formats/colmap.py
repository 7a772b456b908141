# SPDX-License-Identifier: BSD-3-Clause
"""Reads the points of COLMAP, points3D.bin and points3D.txt. Behind each are the images that see it."""

import os
import struct
from itertools import chain

import numpy as np

from ..clouds.polydata import polydata_of
from ..problems import UserProblem
from .columns import RGB, XYZ, Columns, arrays_of_columns

NAME = "points3d"
HEAD = "POINT3D_ID, X, Y, Z"  # of a text file
RECORD = struct.Struct("<Q3d3BdQ")  # number, x y z, r g b, error, how many images follow
IMAGE = 8  # bytes
HOW = "the points of COLMAP"


def is_colmap(path):
    stem, extension = os.path.splitext(os.path.basename(path).lower())
    if stem != NAME:
        return False
    if extension == ".bin":
        return True
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        return HEAD in file.read(1000)


def _columns(file, path):
    """The lines without what is behind the colours"""
    for line in file:
        words = line.split()
        if words and not words[0].startswith("#"):
            if len(words) < 7:
                raise UserProblem(f"{path}: its points do not all have a number, X Y Z and R G B; export "
                                  "it from COLMAP again")
            yield " ".join(words[1:7])


def _read_text(path):
    """-> [n, 6]"""
    try:
        with open(path, encoding="utf-8-sig") as file:
            lines = _columns(file, path)
            first = next(lines, None)
            return np.loadtxt(chain([first], lines), ndmin=2) if first else np.zeros((0, 6))
    except (ValueError, UnicodeDecodeError) as problem:
        raise UserProblem(f"{path}: its points are not numbers: {problem}") from problem


def _read_binary(path):
    """-> [n, 6]"""
    with open(path, "rb") as file:
        content = file.read()
    count, at = int.from_bytes(content[:8], "little"), 8
    table = []
    for _ in range(count):
        if at + RECORD.size > len(content):
            raise UserProblem(f"{path} is not whole: it says {count} points, and holds {len(table)}")
        record = RECORD.unpack_from(content, at)
        table.append(record[1:7])
        at += RECORD.size + IMAGE * record[8]
    return np.array(table, float).reshape(-1, 6)


def read_colmap_cloud(path):
    """-> vtkPolyData with double points and colours"""
    table = (_read_binary if path.lower().endswith(".bin") else _read_text)(path)
    return polydata_of(*arrays_of_columns(table, Columns([*XYZ, *RGB], "by the format")))

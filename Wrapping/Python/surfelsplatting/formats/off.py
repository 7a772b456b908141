# SPDX-License-Identifier: BSD-3-Clause
"""Reads .off files, meshes and clouds of Geomview, of which libraries for geometry write many kinds."""

import re
from array import array
from itertools import islice

import numpy as np

from ..clouds.faces import MOST_VERTICES
from ..clouds.polydata import cells_of, polydata_of
from ..problems import UserProblem, no_points
from .columns import NORMALS, RGB, XYZ, Columns, arrays_of_columns

# ST: texture coordinates, C: colours, N: normals, 4 and n: more dimensions. The first number may follow
# without a blank.
KEYWORD = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF(\s+BINARY)?", re.ASCII)
COLORS = {3: RGB, 4: (*RGB, "alpha")}


def _lines(file):
    """The lines that say something."""
    for line in file:
        line = line.partition("#")[0].strip()
        if line:
            yield line


def _head(lines, path):
    """-> the match of KEYWORD, and the numbers of vertices and faces"""
    first = next(lines, "")
    keyword = KEYWORD.match(first)
    if not keyword:
        raise UserProblem(f"{path} is not an .off file: it begins with {first[:20]!r}, not with OFF")
    if any(keyword.group(4, 5, 6)):
        raise UserProblem(f"{path} is of the kind {keyword.group()}, which is not read; save it as text "
                          "with x y z")
    words = (first[keyword.end():] or next(lines, "")).split()
    if len(words) < 2 or not all(word.isdecimal() for word in words[:2]):
        raise UserProblem(f"{path}: the numbers of its vertices and faces are missing")
    return keyword, *map(int, words[:2])


def _columns(count, keyword, path):
    """-> Columns of the vertices: normals before colours; the rest are coordinates of textures"""
    names = [*XYZ, *(NORMALS if keyword.group(3) else ())]
    left = count - len(names) - (2 if keyword.group(1) else 0)
    names += COLORS.get(left, ())  # also without the C
    if len(names) > count:
        raise UserProblem(f"{path}: its vertices have {count} values, too few for {keyword.group()}")
    names += [f"column {number + 1}" for number in range(len(names), count)]
    return Columns(names, "by the format")


def _faces(lines, count):
    """-> vtkCellArray; what follows the corners are colours"""
    corners, ends = array("q"), array("q", [0])
    for line in islice(lines, count):
        words = line.split()
        try:
            numbers = [int(word) for word in words[1:1 + int(words[0])]]
        except ValueError:
            continue
        corners.extend(n if 0 <= n < MOST_VERTICES else -1 for n in numbers)
        ends.append(len(corners))
    return cells_of(corners, ends)


def read_off_cloud(path):
    """-> vtkPolyData with double points, colours and normals, and faces."""
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        lines = _lines(file)
        keyword, vertices, faces = _head(lines, path)
        if vertices == 0:
            raise no_points(path)
        try:
            table = np.loadtxt(islice(lines, vertices), ndmin=2)
        except ValueError as problem:
            reason = str(problem).split(";")[0].rstrip(".")
            raise UserProblem(f"{path}: its vertices are not numbers: {reason}") from problem
        if len(table) < vertices:
            raise UserProblem(f"{path} is not whole: it says {vertices} vertices, and holds "
                              f"{len(table)}")
        cells = _faces(lines, faces) if faces and vertices <= MOST_VERTICES else None
    places, arrays = arrays_of_columns(table, _columns(table.shape[1], keyword, path))
    return polydata_of(places, {name: arrays[name] for name in arrays if name in ("RGB", "Normals")},
                       cells)

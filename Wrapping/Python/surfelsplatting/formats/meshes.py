# SPDX-License-Identifier: BSD-3-Clause
"""Reads meshes: .obj and .stl files. VTK's readers would round their vertices to floats."""

from array import array
from codecs import BOM_UTF8

import numpy as np

from ..clouds.faces import MOST_VERTICES
from ..clouds.polydata import cells_of, polydata_of
from ..problems import UserProblem
from .columns import RGB, XYZ, Columns, arrays_of_columns

STL_HEADER = 84  # bytes; the last four are the number of triangles
TRIANGLE = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
# What may follow `v` in an .obj file, by the number of values; w is a weight of splines.
OBJ_COLUMNS = {3: XYZ, 4: (*XYZ, "w"), 6: (*XYZ, *RGB), 7: (*XYZ, *RGB, "alpha")}


def _table(path, *keywords):
    """-> [rows, columns] of the lines that begin with one of the keywords; x y z if not all have as many"""
    def lines(file):
        for line in file:
            words = line.split(maxsplit=1)
            if len(words) == 2 and words[0] in keywords:
                yield words[1]

    problem = None
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        if next(lines(file), None) is None:
            raise UserProblem(f"{path} holds no vertices: no line begins with {keywords[0]!r}")
        for columns in (None, range(3)):  # of several meshes only some may have colours
            file.seek(0)
            try:
                return np.loadtxt(lines(file), ndmin=2, usecols=columns)
            except ValueError as found:
                problem = problem or found
    reason = str(problem).split(";")[0].rstrip(".")
    raise UserProblem(f"{path}: its lines {keywords[0]!r} are not numbers: {reason}") from problem


def _obj_corners(words, vertices):
    """-> numbers of vertices, from 1; 0 for those that are none.

    words: v, v/vt, v//vn or v/vt/vn each; negative ones count back from the vertices so far
    """
    try:
        numbers = [int(word.partition("/")[0]) for word in words]
    except ValueError:
        return [0]
    if min(numbers) < 0 or max(numbers) > MOST_VERTICES:
        numbers = [n if n >= 0 else max(vertices + 1 + n, 0) for n in numbers]
        numbers = [n if n <= MOST_VERTICES else 0 for n in numbers]
    return numbers


def _obj_faces(path):
    """-> vtkCellArray of the lines `f`"""
    corners, ends, vertices = array("q"), array("q", [0]), 0
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        for line in file:
            keyword = line[:2] if line[:1] in "vf" else line.lstrip()[:2]
            if keyword in ("v ", "v\t"):
                vertices += 1
            elif keyword in ("f ", "f\t"):
                words = line.split()[1:]
                if words:
                    corners.extend(_obj_corners(words, vertices))
                    ends.append(len(corners))
    return cells_of(np.array(corners) - 1, ends)


def read_obj_cloud(path):
    """-> vtkPolyData with double points, and faces."""
    table = _table(path, "v")
    if table.shape[1] not in OBJ_COLUMNS:
        raise UserProblem(f"{path}: its vertices have {table.shape[1]} values; expected x y z or "
                          "x y z r g b")
    columns = Columns(list(OBJ_COLUMNS[table.shape[1]]), "by the format")
    places, arrays = arrays_of_columns(table, columns)
    return polydata_of(places, {name: arrays[name] for name in arrays if name == "RGB"},
                       _obj_faces(path) if len(places) <= MOST_VERTICES else None)


def _binary_triangles(path):
    """-> [n, 3, 3] vertices, or None if the file is not binary."""
    with open(path, "rb") as file:
        content = file.read()
    count = int.from_bytes(content[STL_HEADER - 4:STL_HEADER], "little")
    size = STL_HEADER + count * TRIANGLE.itemsize
    start = content[:1000]
    is_text = start.removeprefix(BOM_UTF8).lstrip()[:5].lower() == b"solid" and b"\0" not in start
    if is_text and size != len(content):
        return None
    if size > len(content) or len(content) < STL_HEADER:
        there = max(0, len(content) - STL_HEADER) // TRIANGLE.itemsize
        raise UserProblem(f"{path} is not a whole .stl file: its header says {count} triangles, "
                          f"and it holds {there}")
    return np.frombuffer(content, TRIANGLE, count, STL_HEADER)["vertices"]


def read_stl_cloud(path):
    """-> vtkPolyData with double points: each vertex once, although triangles repeat them; faces."""
    triangles = _binary_triangles(path)
    if triangles is None:
        vertices = _table(path, "vertex", "VERTEX")
        if vertices.shape[1] != 3:
            raise UserProblem(f"{path}: its vertices have {vertices.shape[1]} values; x y z are "
                              "expected")
        if len(vertices) % 3:
            raise UserProblem(f"{path} is not a whole .stl file: its last triangle has {len(vertices) % 3} of 3 "
                              "vertices; copy or export it again")
    else:
        vertices = triangles.reshape(-1, 3).astype(float)
    places, corners = np.unique(vertices, axis=0, return_inverse=True)
    return polydata_of(places, {}, cells_of(corners.ravel(), np.arange(0, len(vertices) + 1, 3)))

# SPDX-License-Identifier: BSD-3-Clause
"""Point clouds in columns of text: .xyz and .txt."""

import itertools
import re

import numpy as np

from .arrayclouds import polydata_of
from .problems import UserProblem

COMMENTS = ("#", "//")


def _words(line):
    return re.split(r"[\s,;]+", line.strip(" \t\r\n,;"))


def _is_numbers(words):
    try:
        [float(word) for word in words]
    except ValueError:
        return False
    return True


def _find_layout(path):
    """-> lines to skip at the top, delimiter."""
    with open(path, encoding="utf-8", errors="replace") as file:
        head = list(itertools.islice(file, 1000))
    without_comments = [re.split("|".join(COMMENTS), line)[0] for line in head]
    rows = [(number, line) for number, line in enumerate(without_comments) if line.strip()]
    if not rows:
        raise UserProblem(f"{path} holds no points")
    skip = 0
    first = _words(rows[0][1])
    # The first line may be the number of points or the names of the columns.
    is_count = len(first) == 1 and first[0].isdigit()
    if (is_count or not _is_numbers(first)) and len(rows) > 1 and _is_numbers(_words(rows[1][1])):
        skip = rows[0][0] + 1
        del rows[0]
    delimiter = next((mark for mark in ",;" if mark in rows[0][1]), None)
    return skip, delimiter


def _read_columns(path):
    skip, delimiter = _find_layout(path)
    try:
        with open(path, encoding="utf-8") as file:
            # loadtxt's skiprows does not count blank lines, so the lines are skipped here.
            lines = itertools.islice(file, skip, None)
            columns = np.loadtxt(lines, ndmin=2, comments=COMMENTS, delimiter=delimiter)
    except (ValueError, UnicodeDecodeError) as problem:
        reason = str(problem).split(";")[0].rstrip(".")
        raise UserProblem(f"{path} is not a table of numbers: {reason}") from problem
    return columns


def _are_normals(triple):
    length = np.linalg.norm(triple, axis=1)
    return np.mean(np.abs(length - 1) < 0.02) > 0.99


def _are_colors(triple):
    in_range = triple.min() >= 0 and triple.max() <= 255
    return in_range and not _are_normals(triple)


def _as_bytes(triple):
    # No scan is as dark as 1 of 255: values up to 1 are fractions, whole numbers too.
    scale = 1.0 if triple.max() > 1 else 255.0
    return np.round(triple * scale).astype(np.uint8)


def _name_columns(path, columns):
    """-> {name: array} of the columns after x y z."""
    finite = columns[np.isfinite(columns).all(axis=1)]
    count = columns.shape[1]

    def colors_at(first):
        return len(finite) > 0 and _are_colors(finite[:, first:first + 3])

    def triple(first):
        values = np.nan_to_num(columns[:, first:first + 3], posinf=0.0, neginf=0.0)
        return ("RGB", _as_bytes(values)) if colors_at(first) else ("Normals", values)

    if count == 3:
        return {}
    if count == 4:
        return {"intensity": columns[:, 3]}
    if count == 6:
        return dict([triple(3)])
    if count == 7 and colors_at(4) and not colors_at(3):
        return dict([("intensity", columns[:, 3]), triple(4)])
    if count == 7:
        return dict([triple(3), ("intensity", columns[:, 6])])
    if count == 9 and colors_at(3) != colors_at(6):
        return dict([triple(3), triple(6)])
    raise UserProblem(
        f"{path} has {count} columns in an unknown layout; expected x y z, then nothing, "
        "intensity, r g b, nx ny nz, intensity with either, or r g b and nx ny nz")


def read_text_cloud(path):
    """-> vtkPolyData with double points."""
    columns = _read_columns(path)
    if columns.shape[0] == 0:
        raise UserProblem(f"{path} holds no points")
    if columns.shape[1] < 3:
        raise UserProblem(f"{path} has {columns.shape[1]} columns; a point has at least x y z")
    arrays = _name_columns(path, columns)
    return polydata_of(columns[:, :3], arrays)

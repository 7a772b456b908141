# SPDX-License-Identifier: BSD-3-Clause
"""Reads .ptx files of laser scanners: scans one after the other, each with its place, as text."""

import itertools
import re

import numpy as np

from ..clouds.polydata import polydata_of
from ..clouds.stations import trusted_places, ways_of
from ..problems import UserProblem, no_points
from .columns import RGB, XYZ, Columns, arrays_of_columns

# Columns and rows of the scan, place and axes of the scanner, then the matrix by whose rows its points
# are multiplied from the left.
HEADER = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)
WITHOUT_COLORS, WITH_COLORS = 4, 7  # columns of the points: x y z intensity, r g b


class _Lines:
    """The lines that are not blank, and where in the file the last one is"""

    def __init__(self, file):
        self.number = 0
        self.scan = 0  # from 1
        self.points_so_far = self.promised = 0  # of the scan
        self.is_cut = False  # whether the file ends within a header
        self._line = ""
        self._lines = self._numbered(file)
        self._next = None

    def _numbered(self, file):
        for self.number, self._line in enumerate(file, 1):
            if self._line.strip():
                yield self._line

    def next_is_header(self):
        self._next = self._next or next(self._lines, None)
        return self._next is not None and len(self._next.split()) == 1

    def header(self):
        """-> [10 lists of numbers]"""
        lines = list(itertools.islice(self.points(False), len(HEADER)))
        self.scan, self.points_so_far, self.promised = self.scan + 1, 0, 0
        header = [[float(word) for word in line.split()] for line in lines]
        sizes = tuple(map(len, header))
        if sizes != HEADER:
            self.is_cut = 0 < len(sizes) < len(HEADER) and sizes == HEADER[:len(sizes)]
            raise ValueError("a scan begins with its columns, its rows, the place and three axes of the "
                             "scanner, and a matrix of 4 x 4 numbers")
        self.promised = header[0][0] * header[1][0]
        return header

    def points(self, up_to_header=True):
        """Lines up to the next scan, or all; a scan may hold less than its columns and rows say"""
        while True:
            line, self._next = self._next or next(self._lines, None), None
            if line is None:
                return
            # What ends within a line has none behind it.
            if up_to_header and len(line.split()) == 1 and line.endswith("\n"):
                self._next = line
                return
            self.points_so_far += 1
            yield line

    def missing(self):
        """-> what the last scan lacks, as a file that was cut between two lines does, or nothing"""
        if not self.points_so_far < self.promised:
            return ""
        return f"its last scan has {self.points_so_far} of the {self.promised:.10g} points that its header says"

    def why(self, problem):
        """-> what is wrong where, and what to do, as the end of a sentence"""
        if self.is_cut or not self._line.endswith("\n"):
            where = f"point {self.points_so_far} of {self.promised:.10g}" if self.points_so_far else "the header"
            return (f"is cut short: it ends at line {self.number}, in {where} of scan {max(1, self.scan)}; copy or "
                    "export it again")
        reason = re.sub(r" to float64.*| at row \d+.*", "", str(problem).split(";")[0])
        return f"is not a readable .ptx file: {reason}, line {self.number}"


def _read_scan(lines):
    """-> [n, 4 or 7] of the points that were seen, in the coordinates of all scans; the place of the
    scanner, or None if it is not known"""
    header = lines.header()
    axes, matrix = np.array(header[3:6]), np.array(header[6:])
    points = lines.points()
    first = next(points, None)
    if first is None:
        return np.zeros((0, WITH_COLORS)), None
    width = len(first.split())
    if width not in (WITHOUT_COLORS, WITH_COLORS):
        raise ValueError(f"its points have {width} numbers instead of {WITHOUT_COLORS} or {WITH_COLORS}")
    table = np.loadtxt(itertools.chain([first], points), ndmin=2)
    table = table[(table[:, :3] != 0).any(axis=1)]  # what was not seen has zeros
    table[:, :3] = table[:, :3] @ matrix[:3, :3] + matrix[3, :3]
    # Programs that only convert points write zeros.
    is_known = np.allclose(axes @ axes.T, np.eye(3), atol=1e-3)
    return table, tuple(map(float, matrix[3, :3])) if is_known else None


def read_ptx_cloud(path):
    """-> vtkPolyData with double points, which know their scanners; the place of the scanner if it was
    one scan; what is missing at the end, or nothing."""
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        lines = _Lines(file)
        scans = []
        try:
            while lines.next_is_header() or not scans:
                scans.append(_read_scan(lines))
        except ValueError as problem:
            raise UserProblem(f"{path} {lines.why(problem)}") from problem
    tables = [table for table, _ in scans if len(table)]
    if not tables:
        raise no_points(path)
    # What one of the scans lacks cannot be shown for all.
    width = min(table.shape[1] for table in tables)
    scanners = trusted_places([place for table, place in scans if len(table)])
    ways = ways_of([table[:, :3] for table in tables], scanners)
    table = np.concatenate([table[:, :width] for table in tables])
    columns = Columns([*XYZ, "intensity", *(RGB if width == WITH_COLORS else ())], "of the file")
    places, arrays = arrays_of_columns(table, columns)
    scanner = scanners[0] if len(scans) == 1 else None
    return polydata_of(places, {**arrays, **ways}), scanner, lines.missing()

# SPDX-License-Identifier: BSD-3-Clause
"""What a cloud knows of its origin, in field arrays (Documentation/DataContract.md): where it was scanned
from, what is up, whether it was a mesh."""

from .backend import vtk
from .vtkarrays import named_array
from .vtkSurfelFilters import vtkPointsToSurfels

MODEL = "ModelUp"  # a field array
SHEET = "ModelIsSheet"  # a field array


def scan(points):
    """-> place of the sensor or None, columns of a depth image or 0: what the reader knew, unless the
    points were moved or selected since."""
    viewpoint = [0.0, 0.0, 0.0]
    known = vtkPointsToSurfels.FindViewpoint(points, viewpoint)
    return tuple(viewpoint) if known else None, vtkPointsToSurfels.FindColumns(points)


def find_scanners(points):
    """Gives the points the array ToScanner if their order tells from where they were scanned, as the
    filters find it. -> whether it does"""
    ways = vtk("vtkCommonCore").vtkFloatArray()
    found = vtkPointsToSurfels.FindScannersByOrder(points, ways)
    if found:
        points.GetPointData().AddArray(ways)
    return found


def note_scan(points, viewpoint):
    """Stores the place of the sensor where `scan` and the filters find it; None is not stored."""
    if viewpoint is not None:
        _note(points, "ScanViewpoint", viewpoint)
        _note(points, "ScanBounds", points.GetBounds())


def note_up(points, up):
    """Stores the direction that is up, a unit vector; surfels of the points have it, too."""
    _note(points, "ScanUp", up)


def note_model(points, is_one=True):
    """Stores of a mesh whether it is one as modelling programs make: y or z is up, and not the
    opposite."""
    _note(points, MODEL, (float(is_one),))


def is_model(points):
    """Whether note_model has stored that it is one."""
    array = points.GetFieldData().GetArray(MODEL)
    return bool(array and array.GetNumberOfTuples() and array.GetTuple(0)[0])


def note_sheet(points):
    """Stores of a mesh that it is a sheet, which has no outside: it is seen from both sides."""
    _note(points, SHEET, (1.0,))


def is_sheet(points):
    """Whether note_sheet has stored that it is one."""
    return bool(points.GetFieldData().HasArray(SHEET))


def _note(points, name, values):
    points.GetFieldData().AddArray(named_array(name, [values], float))

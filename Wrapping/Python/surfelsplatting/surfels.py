# SPDX-License-Identifier: BSD-3-Clause
"""Points to surfels in one call, with Python's exceptions and warnings instead of VTK's messages."""

from contextlib import nullcontext

import numpy as np

from .backend import vtk
from .checks import finite_triple, one_of, whole_number_in
from .notes import is_sheet
from .problems import warn_user
from .vtkarrays import named_array, to_numpy
from .vtkmessages import update
from .vtkSurfelFilters import vtkPartitionedSurfelEstimation, vtkPointsToSurfels, vtkSurfelHierarchy

SURFEL_ARRAYS = ("SurfelCovariance", "SurfelAreaVector")
PLACES, MARKED = "SurfelPlaces", "SurfelMarks"  # field arrays
# Points, of which more go in parts (4.2 GB each), and are drawn by a hierarchy if sharp, too
HUGE = vtkPartitionedSurfelEstimation().GetPointsPerPart()
MARKS = 1024  # surfels of which places and kernels are noted
FEW = 8  # of them tell too little
CLEANING = ("off", "outliers", "full")
SIDES = ("auto", "two", "given")


def holds_gaussians(data):
    """Whether a vtkDataSet is a cloud of Gaussians in space, such as a capture."""
    return bool(data.GetPointData().HasArray("GaussianCovariance"))


def is_surfels(data):
    """Whether a vtkDataSet holds surfels, or Gaussians in space with their hierarchy, of its points as
    they are."""
    if not _are_current(data):
        return False
    points = data.GetPointData()
    if holds_gaussians(data):
        return bool(data.GetFieldData().HasArray("SurfelLeaves"))
    return all(points.HasArray(name) for name in SURFEL_ARRAYS)


def _places(data):
    """What changes when points are moved or selected: their number and bounds."""
    return data.GetNumberOfPoints(), *data.GetBounds()


def _rows(data):
    """[n] of point and area vector, or of point and variances"""
    arrays = data.GetPointData()
    kernels = arrays.GetArray("GaussianCovariance") or arrays.GetArray("SurfelAreaVector")
    return to_numpy(data.GetPoints().GetData()), to_numpy(kernels)[:, :3]


def _note_places(surfels):
    points, kernels = _rows(surfels)
    some = slice(None, None, max(1, len(points) // MARKS))
    for name, rows in ((PLACES, [_places(surfels)]),
                       (MARKED, np.hstack([points[some], kernels[some]], dtype=float))):
        surfels.GetFieldData().AddArray(named_array(name, rows, float))
    return surfels


def _are_current(data):
    """Whether the points are where _note_places saw them, if it did. The mapper finds out where all
    Gaussians were moved to."""
    array = data.GetFieldData().GetArray(PLACES)
    if not array:
        return True
    was, now = array.GetTuple(0), _places(data)
    return was[0] == now[0] if holds_gaussians(data) else was == now


def _are_selected(data):
    """Whether the points are a part, and not a small one, of those that _note_places saw, and where it
    saw them: their kernels hold."""
    fields = data.GetFieldData()
    if not (fields.HasArray(PLACES) and fields.HasArray(MARKED)):
        return False
    marked = to_numpy(fields.GetArray(MARKED))
    expected = len(marked) * data.GetNumberOfPoints() / fields.GetArray(PLACES).GetTuple(0)[0]
    if not FEW < expected < len(marked):
        return False
    points, kernels = _rows(data)
    if len(points) != len(kernels):
        return False
    near = np.isin(points[:, 0], marked[:, 0])
    found = set(map(tuple, np.hstack([points[near], kernels[near]], dtype=float).tolist()))
    return sum(row in found for row in map(tuple, marked.tolist())) > expected / 2


def in_the_world(surfels):
    """The surfels with points in the world, in double, where they are relative to an origin of their
    own: other filters find them in place then. The mapper finds out how the nodes of a hierarchy, which
    stay where they are, lie to the points."""
    origin = surfels.GetFieldData().GetArray("SurfelOrigin")
    if not origin or not any(origin.GetTuple(0)):
        return surfels
    local = to_numpy(surfels.GetPoints().GetData())
    points = vtk("vtkCommonCore").vtkPoints()
    points.SetData(named_array("Points", local + np.array(origin.GetTuple(0))))
    moved = surfels.NewInstance()
    moved.ShallowCopy(surfels)
    moved.SetPoints(points)
    moved.GetFieldData().RemoveArray("SurfelOrigin")
    return _note_places(moved)


def _without_surfels(data):
    """The points without what was found out about them before they were moved or selected."""
    data = in_the_world(data)
    points = data.NewInstance()
    points.ShallowCopy(data)
    for arrays in (points.GetPointData(), points.GetFieldData()):
        for name in [arrays.GetArrayName(i) for i in range(arrays.GetNumberOfArrays())]:
            if name and name.startswith(("Surfel", "ScanSensor")):
                arrays.RemoveArray(name)
    return points


def has_normals(data):
    points = data.GetPointData()
    return points.GetNormals() is not None or bool(points.HasArray("Normals"))


def set_filters(filters, points, *, cleaning, sides, neighbors, viewpoint=None):
    """Gives a vtkPointsToSurfelsBase the points and what make_surfels was asked for; what a file says of
    its sensor is for the filters to use."""
    filters.SetInputData(points)
    filters.SetCleanPoints(cleaning != "off")
    filters.GetCleaning().SetSmoothing(cleaning == "full")
    filters.SetNumberOfNeighbors(neighbors or 0)
    estimation = filters.GetEstimation()
    if sides == "two" or (sides == "auto" and viewpoint is None and is_sheet(points)):
        estimation.SetOrientationModeToTwoSided()
    elif sides == "given":
        estimation.SetOrientationModeToAsGiven()
    elif viewpoint is not None:
        estimation.SetOrientationModeToViewpoint()
        estimation.SetViewpoint(viewpoint)


def _with_hierarchy(surfels):
    """Of surfels or Gaussians, whatever data set holds them."""
    points = vtk("vtkCommonDataModel").vtkPolyData()
    points.SetPoints(surfels.GetPoints())
    points.GetPointData().ShallowCopy(surfels.GetPointData())
    points.GetFieldData().ShallowCopy(surfels.GetFieldData())
    filters = vtkSurfelHierarchy()
    filters.SetInputData(points)
    update(filters, "level of detail")
    return _note_places(filters.GetOutput())


def _has_faults(filters):
    """Whether the input of a vtkPointsToSurfels has what nobody expects of a scan. That stray points and
    noise are gone is what cleaning is for."""
    estimation = filters.GetEstimation()
    return any((filters.GetCleaning().GetNumberOfNonFinitePoints(), estimation.GetNormalsProblem(),
                estimation.GetNumberOfNonFinitePoints(), estimation.GetNumberOfInvalidNormals(),
                estimation.GetNumberOfDegeneratePoints()))


def needs_hierarchy(points, has_lens):
    """Whether one picture of points needs level of detail. A sharp one is drawn before a hierarchy
    would be made, but of huge clouds all splats would take more memory than nodes."""
    return has_lens or points.GetNumberOfPoints() > HUGE


def make_surfels(points, *, cleaning="full", sides="auto", viewpoint=None, neighbors=None,
                 hierarchy=True, watch=None):
    """A vtkPolyData of surfels from the points of a vtkPointSet; of Gaussians in space, they
    themselves with a hierarchy.

    The parameters are those of `SurfelAccessor.estimate` in surfelsplatting/pyvista, and
    watch: a function of the filter that gives a context in which it runs
    """
    count = points.GetNumberOfPoints()
    if count == 0:
        raise ValueError("the dataset has no points (0); surfels need the points of a surface")
    if _are_selected(points):
        return _with_hierarchy(points)
    if not _are_current(points):
        warn_user("the points were moved, or few of them selected, since they became surfels, which "
                  "are made anew")
        points = _without_surfels(points)
    if holds_gaussians(points):
        return _with_hierarchy(points) if hierarchy and not is_surfels(points) else points
    one_of(cleaning, CLEANING, "cleaning")
    if one_of(sides, SIDES, "sides") == "given" and not has_normals(points):
        raise ValueError("sides is 'given', but the points have no normals; give normals, or use "
                         "'auto' or 'two'")
    if viewpoint is not None:
        viewpoint = finite_triple(viewpoint, "viewpoint")
    if neighbors is not None:
        neighbors = whole_number_in(neighbors, 4, 256, "neighbors")
    filters = vtkPointsToSurfels()
    filters.SetBuildHierarchy(bool(hierarchy))
    set_filters(filters, points, cleaning=cleaning, sides=sides, neighbors=neighbors, viewpoint=viewpoint)
    with watch(filters) if watch else nullcontext():
        update(filters, "estimation of surfels", warns=lambda: _has_faults(filters))
    if filters.GetAbortExecute():
        raise KeyboardInterrupt
    surfels = filters.GetOutput()
    if surfels.GetNumberOfPoints() == 0:
        raise ValueError(f"none of the {count} points gives a surfel; are the coordinates finite, and "
                         "up to 1e15?")
    return _note_places(surfels)

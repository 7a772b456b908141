# SPDX-License-Identifier: BSD-3-Clause
"""A cloud to surfels and their hierarchy, as the options say."""

from ..clouds.cloud import is_hierarchy
from ..clouds.thinning import may_be_thinned
from ..problems import UserProblem
from ..surfels import sides_of, what_normals_lack
from ..vtkSurfelFilters import (vtkPartitionedSurfelEstimation, vtkPointsToSurfels,
                                vtkSurfelHierarchy)


def _set_filters(filters, cloud, arguments):
    """The options; what the file says of the sensor is for the filters to use."""
    filters.SetInputData(cloud.data)
    filters.SetCleanPoints(arguments.cleaning != "off")
    filters.GetCleaning().SetSmoothing(arguments.cleaning == "full")
    filters.SetNumberOfNeighbors(arguments.neighbors or 0)
    sides = sides_of(cloud.data, arguments.sides)
    if sides == "two":
        filters.GetEstimation().SetOrientationModeToTwoSided()
    elif sides == "given":
        if not cloud.normals:
            raise UserProblem(f"{arguments.cloud} has no normals, so --sides given cannot tell "
                              "which side is outside; use --sides auto or --sides two")
        filters.GetEstimation().SetOrientationModeToAsGiven()


def _update(algorithm, stage, path, messages, progress, run):
    with run.stage(stage):
        progress.update(algorithm, stage)
    messages.check(f"{path}: ")


def _whole_cloud(cloud, arguments, with_hierarchy, *reporters):
    """-> vtkPolyData"""
    filters = vtkPointsToSurfels()
    _set_filters(filters, cloud, arguments)
    filters.SetBuildHierarchy(with_hierarchy)
    run = reporters[-1]
    filters.GetHierarchy().AddObserver("StartEvent",
                                       lambda _caller, _event: run.begin("hierarchy"))
    _update(filters, "surfels", arguments.cloud, *reporters)
    run.note_cleaning(filters.GetCleaning())
    run.note_estimation(filters.GetEstimation())
    run.normals_lack = what_normals_lack(filters.GetEstimation())
    return filters.GetOutput()


def _cloud_in_parts(cloud, arguments, *reporters):
    """-> vtkPolyData"""
    partitioned = vtkPartitionedSurfelEstimation()
    _set_filters(partitioned, cloud, arguments)
    partitioned.SetPointsPerPart(arguments.points_per_part)
    _update(partitioned, "surfels", arguments.cloud, *reporters)
    run = reporters[-1]
    run.note_cleaning(partitioned.GetCleaning())
    run.note_estimation(partitioned)
    return partitioned.GetOutput()


def check_memory(cloud, arguments):
    """Refuses a cloud that is too large before the estimation, which may take minutes."""
    if not is_hierarchy(cloud.data):
        problem = vtkSurfelHierarchy.CheckMemory(cloud.data.GetNumberOfPoints(),
                                                 not cloud.is_drawable)
        if problem:
            advice = " --every N uses one of every N points." if may_be_thinned(cloud) else ""
            raise UserProblem(f"{arguments.cloud}: {problem}{advice}")


def make_surfels(cloud, arguments, with_hierarchy, *reporters):
    """-> vtkPolyData with the arrays of the data contract: surfels, or the cloud's Gaussians.

    with_hierarchy: whether those of a whole cloud come with their hierarchy, which takes less time
    than after them
    """
    if cloud.is_drawable:
        return cloud.data
    if cloud.data.GetNumberOfPoints() > arguments.points_per_part:
        surfels = _cloud_in_parts(cloud, arguments, *reporters)
    else:
        surfels = _whole_cloud(cloud, arguments, with_hierarchy, *reporters)
    if surfels.GetNumberOfPoints() == 0:
        raise UserProblem(f"{arguments.cloud}: none of its points gives a surfel; are the coordinates "
                          "finite, and up to 1e17?")
    return surfels


def without_unused_arrays(data, *kept):
    """Drops point arrays that the picture does not need; the hierarchy would sort them all.

    kept: names of some that it does need.
    """
    lean = data.NewInstance()
    lean.ShallowCopy(data)
    points = lean.GetPointData()
    scalars = points.GetScalars()
    drawn = {*kept} | ({scalars.GetName()} if scalars is not None else set())
    for name in [points.GetArrayName(i) for i in range(points.GetNumberOfArrays())]:
        if name not in drawn and not name.startswith(("Surfel", "Gaussian")):
            points.RemoveArray(name)
    return lean


def make_hierarchy(surfels, messages, progress, run):
    """-> vtkPolyData"""
    if is_hierarchy(surfels):
        return surfels
    hierarchy = vtkSurfelHierarchy()
    hierarchy.SetInputData(surfels)
    with run.stage("hierarchy"):
        progress.update(hierarchy, "hierarchy")
    messages.check()
    return hierarchy.GetOutput()

# SPDX-License-Identifier: BSD-3-Clause
"""A cloud to surfels and their hierarchy, as the options say."""

from ..clouds.cloud import is_hierarchy
from ..clouds.thinning import may_be_thinned
from ..problems import UserProblem
from ..surfels import has_normals, set_filters
from ..vtkSurfelFilters import (vtkPartitionedSurfelEstimation, vtkPointsToSurfels,
                                vtkSurfelHierarchy)


def _filters_of_whole(with_hierarchy, run):
    filters = vtkPointsToSurfels()
    filters.SetBuildHierarchy(with_hierarchy)
    filters.GetHierarchy().AddObserver("StartEvent",
                                       lambda _caller, _event: run.begin("hierarchy"))
    return filters


def _filters_of_parts(size):
    filters = vtkPartitionedSurfelEstimation()
    filters.SetPointsPerPart(size)
    return filters


def check_memory(cloud, arguments):
    """Refuses a cloud that is too large before the estimation, which may take minutes."""
    if not is_hierarchy(cloud.data):
        problem = vtkSurfelHierarchy.CheckMemory(cloud.data.GetNumberOfPoints(),
                                                 not cloud.is_drawable)
        if problem:
            advice = " --every N uses one of every N points." if may_be_thinned(cloud) else ""
            raise UserProblem(f"{arguments.cloud}: {problem}{advice}")


def make_surfels(cloud, arguments, with_hierarchy, messages, progress, run):
    """-> vtkPolyData with the arrays of the data contract: surfels, or the cloud's Gaussians.

    with_hierarchy: whether those of a whole cloud come with their hierarchy, which takes less time
    than after them
    """
    if cloud.is_drawable:
        return cloud.data
    if arguments.sides == "given" and not has_normals(cloud.data):
        raise UserProblem(f"{arguments.cloud} has no normals, so --sides given cannot tell "
                          "which side is outside; use --sides auto or --sides two")
    is_whole = cloud.data.GetNumberOfPoints() <= arguments.points_per_part
    filters = (_filters_of_whole(with_hierarchy, run) if is_whole
               else _filters_of_parts(arguments.points_per_part))
    set_filters(filters, cloud.data, cleaning=arguments.cleaning, sides=arguments.sides,
                neighbors=arguments.neighbors)
    with run.stage("surfels"):
        progress.update(filters, "surfels")
    messages.check(f"{arguments.cloud}: ")
    run.note_cleaning(filters.GetCleaning())
    run.note_estimation(filters.GetEstimation() if is_whole else filters)
    run.normals_problem = filters.GetEstimation().GetNormalsProblem()
    surfels = filters.GetOutput()
    if surfels.GetNumberOfPoints() == 0:
        raise UserProblem(f"{arguments.cloud}: none of its points gives a surfel; are the coordinates "
                          "finite, and up to 1e15?")
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

# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat render: cloud -> surfels -> picture."""

import os
import sys

from ..backend import vtk
from ..vtkSurfelFilters import (vtkPartitionedSurfelEstimation, vtkPointsToSurfels,
                                vtkSurfelHierarchy)
from ..vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelMapper, vtkSurfelSplatter
from .cameras import asked_view, camera_files
from .clouds import is_hierarchy, read_cloud
from .framing import complete_view
from .interrupts import Interrupts
from .outputs import (PICTURES, check_distinct, check_output, write_json, write_picture,
                      write_surfels)
from .problems import UserProblem
from .progress import Progress
from .runstatistics import RunStatistics
from .vtkmessages import VtkMessages

LIGHT_GREY = (0.8, 0.8, 0.8)  # the colour of clouds without colours
BACKDROP = (0.16, 0.17, 0.19)  # the background of lit .png pictures


def _check_outputs(arguments):
    check_distinct((arguments.cloud, *camera_files(arguments.camera)),
                   (arguments.output, arguments.surfels, arguments.hierarchy, arguments.stats))
    check_output(arguments.output, PICTURES)
    for path in filter(None, (arguments.surfels, arguments.hierarchy)):
        check_output(path, (".vtp",))
    if arguments.stats:
        check_output(arguments.stats, (".json",))


CHANNEL_BITS = {"normal": vtkSurfelSplatter.CHANNEL_NORMAL,
                "coc": vtkSurfelSplatter.CHANNEL_CIRCLE_OF_CONFUSION,
                "coverage": vtkSurfelSplatter.CHANNEL_COVERAGE,
                "fragments": vtkSurfelSplatter.CHANNEL_FRAGMENTS,
                "level": vtkSurfelSplatter.CHANNEL_LEVEL}


def _has_colors(surfels):
    scalars = surfels.GetPointData().GetScalars()
    return (scalars is not None and scalars.GetDataTypeAsString() == "unsigned char"
            and scalars.GetNumberOfComponents() in (3, 4))


# Depth images are noisy and quantised along the line of sight, so normals need more neighbours. In
# other scans more neighbours would blur fine detail.
DEPTH_IMAGE_NEIGHBORS = 30


def _set_estimation(estimation, cloud, arguments):
    if arguments.neighbors or cloud.columns:
        estimation.SetNumberOfNeighbors(arguments.neighbors or DEPTH_IMAGE_NEIGHBORS)
    if arguments.sides == "two":
        estimation.SetOrientationModeToTwoSided()
    elif arguments.sides == "given":
        if not cloud.has_normals:
            raise UserProblem(f"{arguments.cloud} has no normals, so --sides given cannot tell "
                              "which side is outside; use --sides auto or --sides two")
        estimation.SetOrientationModeToAsGiven()
    elif cloud.viewpoint:
        estimation.SetOrientationModeToViewpoint()
        estimation.SetViewpoint(cloud.viewpoint)


def _update(algorithm, stage, path, messages, progress, run):
    with run.stage(stage):
        progress.update(algorithm, stage)
    messages.check(f"{path}: ")


def _set_cleaning(cleaning, cloud, arguments):
    cleaning.SetSmoothing(arguments.cleaning == "full")
    if cloud.columns:
        cleaning.SetColumns(cloud.columns)
        cleaning.SetViewpoint(cloud.viewpoint or (0.0, 0.0, 0.0))


def _whole_cloud(cloud, arguments, *reporters):
    """-> vtkPolyData"""
    filters = vtkPointsToSurfels()
    filters.SetInputData(cloud.data)
    filters.SetCleanPoints(arguments.cleaning != "off")
    _set_cleaning(filters.GetCleaning(), cloud, arguments)
    filters.BuildHierarchyOff()
    _set_estimation(filters.GetEstimation(), cloud, arguments)
    _update(filters, "surfels", arguments.cloud, *reporters)
    run = reporters[-1]
    run.note_cleaning(filters.GetCleaning())
    run.note_estimation(filters.GetEstimation())
    return filters.GetOutput()


def _cloud_in_parts(cloud, arguments, *reporters):
    """-> vtkPolyData"""
    partitioned = vtkPartitionedSurfelEstimation()
    partitioned.SetInputData(cloud.data)
    partitioned.SetCleanPoints(arguments.cleaning != "off")
    _set_cleaning(partitioned.GetCleaning(), cloud, arguments)
    partitioned.SetPointsPerPart(arguments.points_per_part)
    _set_estimation(partitioned.GetEstimation(), cloud, arguments)
    _update(partitioned, "surfels", arguments.cloud, *reporters)
    run = reporters[-1]
    run.note_cleaning(partitioned.GetCleaning())
    run.note_estimation(partitioned)
    return partitioned.GetOutput()


def _check_memory(cloud, arguments):
    """Refuses a cloud that is too large before the estimation, which may take minutes."""
    if not arguments.no_lod and not is_hierarchy(cloud.data):
        problem = vtkSurfelHierarchy.CheckMemory(cloud.data.GetNumberOfPoints(),
                                                 not cloud.is_surfels)
        if problem:
            raise UserProblem(f"{arguments.cloud}: {problem}")


def _make_surfels(cloud, arguments, messages, progress, run):
    """-> vtkPolyData with the arrays of the data contract."""
    if cloud.is_surfels:
        return cloud.data
    in_parts = cloud.data.GetNumberOfPoints() > arguments.points_per_part
    make = _cloud_in_parts if in_parts else _whole_cloud
    surfels = make(cloud, arguments, messages, progress, run)
    if surfels.GetNumberOfPoints() == 0:
        raise UserProblem(f"{arguments.cloud}: none of its {cloud.data.GetNumberOfPoints()} points "
                          "gives a surfel; are the coordinates finite and not all the same?")
    return surfels


def _without_unused_arrays(surfels):
    """Drops point arrays that the picture does not need; the hierarchy would sort them all."""
    lean = surfels.NewInstance()
    lean.ShallowCopy(surfels)
    points = lean.GetPointData()
    scalars = points.GetScalars()
    drawn = {scalars.GetName()} if scalars is not None else set()
    for name in [points.GetArrayName(i) for i in range(points.GetNumberOfArrays())]:
        if name not in drawn and not name.startswith("Surfel"):
            points.RemoveArray(name)
    return lean


def _make_hierarchy(surfels, messages, progress, run):
    if is_hierarchy(surfels):
        return surfels
    hierarchy = vtkSurfelHierarchy()
    hierarchy.SetInputData(surfels)
    with run.stage("hierarchy"):
        progress.update(hierarchy, "hierarchy")
    messages.check()
    return hierarchy.GetOutput()


def _make_actor(surfels, arguments):
    mapper = vtkSurfelMapper()
    mapper.SetInputData(surfels)
    mapper.SetScalarVisibility(_has_colors(surfels))
    actor = vtk("vtkRenderingCore").vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(LIGHT_GREY)
    actor.GetProperty().SetLighting(not arguments.unlit)
    return actor


def _make_camera(view):
    camera = vtk("vtkRenderingCore").vtkCamera()
    camera.SetPosition(view.position)
    camera.SetFocalPoint(view.focal_point)
    camera.SetViewUp(view.view_up)
    camera.SetViewAngle(view.view_angle)
    camera.SetFocalDisk(view.focal_disk)
    camera.SetFocalDistance(view.focal_distance)
    return camera


def _set_background(renderer, arguments):
    background = arguments.background
    if background is None and arguments.output.lower().endswith(".png"):
        background = (0.0, 0.0, 0.0) if arguments.unlit else BACKDROP
    if background is not None:
        renderer.SetBackground(background)
        renderer.SetBackgroundAlpha(1.0)


def _make_renderer(surfels, view, arguments):
    renderer = vtkSurfelImageRenderer()
    renderer.AddActor(_make_actor(surfels, arguments))
    renderer.SetCamera(_make_camera(view))
    renderer.SetSize(*view.size)
    _set_background(renderer, arguments)
    splatter = renderer.GetSplatter()
    if view.circle_of_confusion is not None:
        splatter.SetLensModeToCircleOfConfusion()
        splatter.SetCircleOfConfusion(view.circle_of_confusion)
    elif view.focal_disk == 0:
        splatter.SetLensModeToPinhole()
    splatter.SetLensCells(arguments.reference or arguments.lens_cells)
    splatter.SetLensPinholes(arguments.reference is not None)
    splatter.SetDeepSamples(arguments.deep)
    splatter.SetLinearLight(arguments.linear_light)
    splatter.SetChannels(sum({CHANNEL_BITS[name] for name in arguments.channels or ()}))
    if arguments.kernel == "gaussian":
        splatter.SetKernelToGaussian()
    if arguments.cutoff is not None:
        splatter.SetCutoff(arguments.cutoff)
    _set_detail(splatter, arguments)
    return renderer


def _set_detail(splatter, arguments):
    splatter.FrameReuseOff()  # render again for --repeat
    if arguments.no_lod:
        splatter.SetLODModeToOff()
    elif arguments.lod == "paper":
        splatter.SetLODModeToPaper()
    if arguments.lod_error is not None:
        splatter.SetLODError(arguments.lod_error)
    splatter.SetColorByLevel(arguments.color_by == "level")


def _render_frames(renderer, count, messages, progress, run):
    for number in range(count):
        progress.show("rendering", number / count)
        renderer.Modified()  # render every frame, although nothing has changed
        progress.update(renderer, "rendering")
        messages.check()
        run.note_frame(renderer.GetSplatter())


def render(arguments):
    messages = VtkMessages(arguments.verbose)
    progress = Progress(Interrupts())
    view = asked_view(arguments)
    _check_outputs(arguments)
    smp_tools = vtk("vtkCommonCore").vtkSMPTools
    if arguments.threads:
        # TBB warns about more threads than cores.
        smp_tools.Initialize(min(arguments.threads, len(os.sched_getaffinity(0))))
    run = RunStatistics(smp_tools.GetEstimatedNumberOfThreads())

    def say(text):
        progress.clear()
        if arguments.verbose:
            print("surfelsplat: " + text, file=sys.stderr)

    try:
        with run.stage("read"):
            cloud = read_cloud(arguments.cloud, messages, progress)
        points = cloud.data.GetNumberOfPoints()
        say(f"{arguments.cloud}: {points} points")
        _check_memory(cloud, arguments)
        surfels = _make_surfels(cloud, arguments, messages, progress, run)
        view = complete_view(view, cloud, surfels)
        del cloud  # frees the memory of a large cloud
        count = surfels.GetNumberOfPoints()
        say(f"{count} surfels; {view}")
        drawn = surfels if arguments.hierarchy else _without_unused_arrays(surfels)
        surfels = surfels if arguments.surfels else None
        if not arguments.no_lod:
            drawn = _make_hierarchy(drawn, messages, progress, run)
        renderer = _make_renderer(drawn, view, arguments)
        _render_frames(renderer, arguments.repeat, messages, progress, run)
    finally:
        progress.clear()
    if run.is_empty():
        print("surfelsplat: warning: the camera sees nothing of the cloud; check its position and "
              "focal point", file=sys.stderr)

    with run.stage("write"):
        write_picture(renderer.GetOutput(), arguments.output, arguments.deep,
                      arguments.linear_light, messages)
        if arguments.surfels:
            write_surfels(surfels, arguments.surfels, messages)
        if arguments.hierarchy:
            write_surfels(drawn, arguments.hierarchy, messages)
    if arguments.stats:
        write_json(run.summary(points, count, view), arguments.stats)
    say(f"{arguments.output} written")

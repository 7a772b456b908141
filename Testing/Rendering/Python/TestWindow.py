#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The pass and the mapper in a window, from Python: picture, posters, pickers."""
import sys

import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersSources import vtkCubeSource
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkCellPicker, vtkPointPicker, vtkPolyDataMapper, vtkPropPicker, vtkRenderer,
    vtkRenderWindow, vtkWindowToImageFilter, vtkWorldPointPicker)

from surfelsplatting.vtkSurfelRendering import vtkSurfelMapper, vtkSurfelSplattingPass

from surfeltesting import Surfels, check_baseline, difference, run, strict_error


def surfel_actor(data, lit=False):
    mapper = vtkSurfelMapper()
    mapper.SetInputData(data)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetLighting(lit)
    return actor


def cube_actor(bounds):
    cube = vtkCubeSource()
    cube.SetBounds(bounds)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(cube.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.9, 0.75, 0.3)
    return actor


def make_window(actors, size=(160, 120), with_pass=True):
    window = vtkRenderWindow()
    window.OffScreenRenderingOn()
    window.SetMultiSamples(0)
    window.SetSize(size)
    renderer = vtkRenderer()
    window.AddRenderer(renderer)
    for actor in actors:
        renderer.AddActor(actor)
    if with_pass:
        renderer.SetPass(vtkSurfelSplattingPass())
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0, 0, 6)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetFocalDisk(0)
    renderer.ResetCameraClippingRange()
    return window, renderer


def grab(window, scale=1):
    window.Render()
    grabber = vtkWindowToImageFilter()
    grabber.SetInput(window)
    grabber.SetScale(scale)
    grabber.ReadFrontBufferOff()
    grabber.FixBoundaryOff()
    grabber.SetShouldRerender(scale > 1)
    grabber.Update()
    picture = vtkImageData()
    picture.DeepCopy(grabber.GetOutput())
    return picture


def pixel(picture, x, y):
    return [picture.GetScalarComponentAsDouble(x, y, 0, c) for c in range(3)]


def test_baseline():
    """A ring of tube through a box, the lens focused on the box."""
    tube = Surfels().tube(0.35, -5, 5, 48, 200, lambda p: (
        (225, 80, 60) if int(p[0] + 100) % 2 else (240, 225, 200)))
    actor = surfel_actor(tube.data(), lit=True)
    actor.SetOrientation(0, 35, 12)
    window, renderer = make_window([actor, cube_actor((-0.8, 0.8, -0.6, 0.6, -0.6, 0.6))])
    renderer.GradientBackgroundOn()
    renderer.SetBackground(0.15, 0.17, 0.2)
    renderer.SetBackground2(0.45, 0.5, 0.6)
    camera = renderer.GetActiveCamera()
    camera.Elevation(15)
    camera.SetFocalDisk(0.5)
    renderer.ResetCameraClippingRange()
    picture = grab(window)
    # The box's edges are the graphics driver's: 100 of 19200 px may be another colour.
    baseline = check_baseline(picture, "TubeThroughBox", 255, 0.3)
    if baseline is not None:
        shifted = vtkImageData()
        shifted.DeepCopy(baseline)
        values = memoryview(shifted.GetPointData().GetScalars()).cast("B")
        for i in range(len(values)):
            values[i] = min(255, values[i] + 3)
        # The comparison sees what must not pass.
        assert difference(picture, shifted)[1] > 2
        assert strict_error(picture, shifted) > 10 * (strict_error(picture, baseline) + 1)


def test_dots_are_warned_of_once():
    """A renderer without the pass; a selection in one is no mistake."""
    heard = []

    def hear(caller, event, text):
        heard.append(text)

    hear.CallDataType = "string0"
    for with_pass, expected in ((True, 0), (False, 1)):
        actor = surfel_actor(Surfels().sphere(500).data())
        actor.GetMapper().AddObserver("WarningEvent", hear)
        window, renderer = make_window([actor], with_pass=with_pass)
        vtkPropPicker().Pick(80, 60, 0, renderer)
        if with_pass:
            assert not heard, heard
        for _ in range(3):
            window.Render()
        assert len(heard) == expected, heard
        heard and heard.pop()


def test_poster():
    actors = [surfel_actor(Surfels().sphere(3000).data()),
              cube_actor((-1.4, 0, -1.4, 0, -0.3, 0.3))]
    window, renderer = make_window(actors, (70, 50))
    camera = renderer.GetActiveCamera()
    camera.SetFocalDisk(0.5)
    camera.SetFocalDistance(4.5)
    poster = grab(window, 3)
    large, other = make_window(actors, (210, 150))
    other.SetActiveCamera(camera)
    # One level where a value rounds the other way; an edge of the box may cover another pixel.
    assert difference(poster, grab(large))[1] < 0.1


def test_pickers():
    for with_pass in (True, False):
        sphere = surfel_actor(Surfels().sphere(4000).data())
        cube = cube_actor((-2.2, -1.4, -0.4, 0.4, -0.4, 0.4))
        window, renderer = make_window([sphere, cube], (160, 120), with_pass)
        window.Render()
        picker = vtkPointPicker()
        picker.SetTolerance(0.01)
        assert picker.Pick(80, 70, 0, renderer)
        assert picker.GetActor() is sphere
        p = sphere.GetMapper().GetInput().GetPoint(picker.GetPointId())
        # 37 px per unit: the point is within the tolerance of 1 % of the window's diagonal, 2 px.
        assert abs(p[0]) < 0.1 and abs(p[1] - 0.23) < 0.1 and p[2] > 0, p
        world = vtkWorldPointPicker()
        world.Pick(80, 60, 0, renderer)
        # The window's depth is the surfels', or the dots': a dot stands off by its size.
        assert abs(world.GetPickPosition()[2] - 1) < 0.06, world.GetPickPosition()
        prop = vtkPropPicker()
        assert prop.Pick(80, 60, 0, renderer) and prop.GetActor() is sphere
        assert prop.Pick(24, 60, 0, renderer) and prop.GetActor() is cube
        assert not prop.Pick(150, 110, 0, renderer)
        cells = vtkCellPicker()
        assert cells.Pick(24, 60, 0, renderer) and cells.GetActor() is cube


def test_reset_camera():
    sphere = surfel_actor(Surfels().sphere(4000, center=(30, -20, 7), radius=5).data())
    window, renderer = make_window([sphere])
    renderer.ResetCamera()
    picture = grab(window)
    assert min(pixel(picture, 80, 60)) > 240
    assert max(pixel(picture, 2, 2)) == 0
    focus = renderer.GetActiveCamera().GetFocalPoint()
    assert max(abs(a - b) for a, b in zip(focus, (30, -20, 7))) < 0.2, focus


def test_settings_redraw():
    """A script that changes a setting and renders sees it."""
    window, renderer = make_window([surfel_actor(Surfels().sphere(3000).data())])
    splatter = renderer.GetPass().GetSplatter()
    splatter.SetLensModeToCircleOfConfusion()
    sharp_time = renderer.GetPass().GetMTime()
    splatter.SetCircleOfConfusion(0)
    assert renderer.GetPass().GetMTime() > sharp_time
    sharp = grab(window)
    renderer.GetActiveCamera().SetFocalDistance(2)
    splatter.SetCircleOfConfusion(30)
    assert difference(sharp, grab(window))[1] > 3
    assert splatter.GetNumberOfSurfels() == 3000
    assert 1000 < splatter.GetNumberOfSplats() < 2000
    assert splatter.GetNumberOfFragments() > 100000
    stages = [splatter.GetStageName(i) for i in range(splatter.GetNumberOfStages())]
    assert stages == ["scene", "selection", "setup", "coarse", "binning", "sort", "raster"]
    total = sum(splatter.GetStageMilliseconds(i) for i in range(len(stages)))
    assert 0 < total <= splatter.GetFrameMilliseconds()
    assert splatter.GetStageName(9) is None
    print(renderer.GetPass())


def test_focus_on_what_is_picked():
    """A sphere of surfels and a box: what is seen in a pixel is in focus afterwards."""
    surfels = Surfels().sphere(4000, center=(-1.0, 0, 0.5), radius=0.5)
    window, renderer = make_window(
        [surfel_actor(surfels.data()), cube_actor((0.6, 1.4, -0.4, 0.4, -1.2, -0.4))])
    camera = renderer.GetActiveCamera()
    camera.SetFocalDistance(3.0)
    for disk in (0.0, 0.2):
        camera.SetFocalDisk(disk)
        window.Render()
        for point, depth, tolerance in (((-1.0, 0, 1.0), 5.0, 0.05), ((1.0, 0, -0.4), 6.4, 0.01)):
            renderer.SetWorldPoint(*point, 1.0)
            renderer.WorldToDisplay()
            x, y, _ = (int(value) for value in renderer.GetDisplayPoint())
            assert vtkSurfelSplattingPass.FocusAt(renderer, x, y)
            assert abs(camera.GetFocalDistance() - depth) < tolerance, camera.GetFocalDistance()
            window.Render()
    before = camera.GetFocalDistance()
    assert not vtkSurfelSplattingPass.FocusAt(renderer, 2, 2)  # nothing there
    unseen = vtkRenderer()
    waiting = vtkRenderWindow()
    waiting.OffScreenRenderingOn()
    waiting.AddRenderer(unseen)
    assert not vtkSurfelSplattingPass.FocusAt(unseen, 2, 2)  # nothing was drawn yet
    assert not vtkSurfelSplattingPass.FocusAt(renderer, 5000, 5000)
    camera.ParallelProjectionOn()
    assert not vtkSurfelSplattingPass.FocusAt(renderer, 80, 60)
    assert camera.GetFocalDistance() == before


if __name__ == "__main__":
    run(sys.modules["__main__"])

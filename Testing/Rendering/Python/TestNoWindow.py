#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pictures without a window or display, from Python."""
import os
import sys

from vtkmodules.vtkCommonCore import vtkFloatArray
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkActor, vtkCamera

from surfelsplatting.vtkSurfelFilters import vtkSurfelHierarchy
from surfelsplatting.vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelMapper

from surfeltesting import Surfels, run, values


def camera():
    result = vtkCamera()
    result.SetPosition(0, 0, 5)
    result.SetFocalPoint(0, 0, 0)
    result.SetFocalDisk(0.3)
    return result


def test_picture():
    assert not os.environ.get("DISPLAY")
    renderer = vtkSurfelImageRenderer()
    renderer.SetInputData(Surfels().sphere(3000, color=lambda p: (255, 0, 51)).data())
    renderer.SetCamera(camera())
    renderer.SetSize(90, 70)
    renderer.Update()
    picture = renderer.GetOutput()
    assert picture.GetDimensions() == (90, 70, 1)
    rgba = values(picture.GetPointData().GetArray("Color"))
    middle = rgba[4 * (35 * 90 + 45):][:4]
    assert middle[3] > 0.97 and abs(middle[0] - middle[3]) < 1e-5
    assert abs(middle[2] - 0.2 * middle[3]) < 1e-5 and middle[1] == 0  # float arithmetic
    assert rgba[:4] == [0, 0, 0, 0]
    depth = values(picture.GetPointData().GetArray("Depth"))
    assert abs(depth[35 * 90 + 45] - 4) < 0.01  # the sphere curves by 1e-3 within a splat
    print(renderer)


def test_bytes():
    """The second output: what VTK's writers take, with and without linear light."""
    renderer = vtkSurfelImageRenderer()
    renderer.SetInputData(Surfels().sphere(3000, color=lambda p: (255, 128, 51)).data())
    renderer.SetCamera(camera())
    renderer.SetSize(90, 70)
    for linear in (False, True):
        renderer.GetSplatter().SetLinearLight(linear)
        for alpha in (0, 1):
            renderer.SetBackground(0.1, 0.2, 0.31)
            renderer.SetBackgroundAlpha(alpha)
            writer = vtkPNGWriter()
            writer.SetInputConnection(renderer.GetOutputPort(1))
            writer.WriteToMemoryOn()
            writer.Write()
            assert bytes(memoryview(writer.GetResult()))[1:4] == b"PNG"
            codes = values(renderer.GetOutput(1).GetPointData().GetScalars())
            rgba = values(renderer.GetOutput().GetPointData().GetArray("Color"))
            light = [value for i, value in enumerate(rgba) if i % 4 < 3]
            for value, code in zip(light, codes):
                if linear:
                    value = (12.92 * value if value <= 0.0031308
                             else 1.055 * value ** (1 / 2.4) - 0.055)
                assert abs(255 * value - code) <= 0.5001, (linear, alpha, value, code)
            under = [int(255 * c * alpha + 0.5) for c in (0.1, 0.2, 0.31)]
            assert codes[:3] == under, (codes[:3], under)
    renderer.SetSize(30, 20)
    renderer.Update()
    assert renderer.GetOutput(1).GetDimensions() == (30, 20, 1)


def test_bytes_are_made_if_asked_for():
    renderer = vtkSurfelImageRenderer()
    renderer.SetInputData(Surfels().sphere(300).data())
    renderer.SetCamera(camera())
    renderer.SetSize(30, 20)
    renderer.Update()
    picture, codes = renderer.GetOutput(), renderer.GetOutput(1)
    assert picture.GetDimensions() == (30, 20, 1) and codes.GetNumberOfPoints() == 0
    drawn = picture.GetMTime()
    renderer.Update(1)
    assert codes.GetDimensions() == (30, 20, 1) and picture.GetMTime() == drawn, "one frame for both"
    renderer.Update(0)
    renderer.Update(1)
    assert codes.GetDimensions() == (30, 20, 1) and picture.GetMTime() == drawn
    renderer.SetSize(40, 20)
    renderer.Update()
    assert codes.GetNumberOfPoints() == 0, "not those of the last picture"
    writer = vtkPNGWriter()
    writer.SetInputConnection(renderer.GetOutputPort(1))
    renderer.SetSize(50, 20)
    renderer.Update()
    assert codes.GetDimensions() == (50, 20, 1)


def test_error_is_heard():
    """An observer hears the error; nothing is raised and nothing crashes."""
    heard = []
    renderer = vtkSurfelImageRenderer()

    def hear(caller, event, text):
        heard.append(text)

    hear.CallDataType = "string0"
    renderer.AddObserver("ErrorEvent", hear)
    renderer.GetExecutive().AddObserver("ErrorEvent", hear)
    renderer.GetSplatter().AddObserver("ErrorEvent", hear)
    renderer.Update()
    assert any("no camera" in text for text in heard), heard
    heard.clear()
    data = Surfels().sphere(100).data()
    data.GetPointData().RemoveArray("SurfelAreaVector")
    mapper = vtkSurfelMapper()
    mapper.SetInputData(data)
    actor = vtkActor()
    actor.SetMapper(mapper)
    renderer.AddActor(actor)
    renderer.SetCamera(camera())
    renderer.SetSize(20, 20)
    renderer.Update()
    assert any("SurfelAreaVector" in text for text in heard), heard
    assert max(values(renderer.GetOutput().GetPointData().GetScalars())) == 0


def test_colors_above_one():
    """A highlight of 40 among surfels of 0.2: it survives, in focus and blurred to a disc, of each
    surfel alone and through a hierarchy; what is not a direct colour is mapped to bytes."""
    surfels = Surfels().sphere(20000).data()
    sums = {}
    for components in (3, 4):
        colors = vtkFloatArray()
        colors.SetName("Radiance")
        colors.SetNumberOfComponents(components)
        for i in range(surfels.GetNumberOfPoints()):
            x, y, z = surfels.GetPoint(i)
            bright = 40.0 if z > 0 and x * x + y * y < 0.01 else 0.2
            colors.InsertNextTuple((bright, 0.2, 0.1, 1.0)[:components])
        surfels.GetPointData().SetScalars(colors)
        hierarchy = vtkSurfelHierarchy()
        hierarchy.SetInputData(surfels)
        for source in (None, hierarchy):
            for disk in (0.0, 0.6):
                mapper = vtkSurfelMapper()
                if source:
                    mapper.SetInputConnection(source.GetOutputPort())
                else:
                    mapper.SetInputData(surfels)
                mapper.SetColorModeToDirectScalars()
                actor = vtkActor()
                actor.SetMapper(mapper)
                actor.GetProperty().LightingOff()
                renderer = vtkSurfelImageRenderer()
                renderer.AddActor(actor)
                view = camera()
                view.SetFocalDisk(disk)
                view.SetFocalDistance(5.5)
                renderer.SetCamera(view)
                renderer.SetSize(90, 70)
                renderer.Update()
                red = values(renderer.GetOutput().GetPointData().GetArray("Color"))[0::4]
                sums[components, source is None, disk] = sum(red)
                assert max(red) > (35 if disk == 0 else 3), max(red)
                assert max(red) <= 40.001 and min(red) >= 0
    sharp = sums[3, True, 0.0]
    assert all(abs(s / sharp - 1) < 0.03 for s in sums.values()), sums
    mapper.SetColorModeToDefault()
    renderer.Update()
    # Shares of layers that leak are rounded one by one.
    assert max(values(renderer.GetOutput().GetPointData().GetArray("Color"))) <= 1.0 + 1e-6


if __name__ == "__main__":
    run(sys.modules["__main__"])

# SPDX-License-Identifier: BSD-3-Clause
"""Planes of mesh and of surfels before a camera with a lens, and pictures of them."""
import functools
import math

import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkFiltersSources import vtkPlaneSource
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter)

from surfelsplatting.vtkSurfelRendering import (
    vtkLensAccumulationPass, vtkSurfelMapper, vtkSurfelSplattingPass)

from surfeltesting import Surfels, values

SIZE = 160


def actor_of(mapper, color=None):
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().LightingOff()
    if color:
        actor.GetProperty().SetColor(color)
    return actor


def cloud_actor(surfels):
    mapper = vtkSurfelMapper()
    mapper.SetInputData(surfels.data())
    return actor_of(mapper)


def mesh_actor(source, color=None):
    source.Update()
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(source.GetOutput())
    return actor_of(mapper, color)


def plane(z, half):
    source = vtkPlaneSource()
    source.SetOrigin(-half, -half, z)
    source.SetPoint1(half, -half, z)
    source.SetPoint2(-half, half, z)
    return source


@functools.lru_cache(maxsize=None)  # of tens of thousands, each by Python, for several pictures
def plane_of_surfels(z, half, count, color):
    surfels, step = Surfels(), 2 * half / count
    for i in range(count):
        for j in range(count):
            p = (-half + (i + 0.5) * step, -half + (j + 0.5) * step, z)
            surfels.add(p, (0, 0, 1), step * step, color)
    return surfels


def lens_pass(blur, through=True, cells=1):
    splatting = vtkSurfelSplattingPass()
    splatting.SetOtherPropsThroughLens(through)
    splatter = splatting.GetSplatter()
    splatter.SetLensModeToCircleOfConfusion()
    splatter.SetCircleOfConfusion(blur)
    splatter.SetLensCells(cells)
    return splatting


def accumulation(blur, focus, views, size=SIZE):
    """The mean of sharp views: the reference. -> pass, diameter of its lens"""
    accumulating = vtkLensAccumulationPass()
    accumulating.SetNumberOfLensPoints(views)
    focal_length = 0.5 * size / math.tan(math.radians(15))
    return accumulating, 2 * blur * focus / focal_length


def picture(actors, focus, blur, through=True, background=(0.0, 0.0, 0.0), cells=1, views=0,
            size=SIZE, samples=0, linear=False):
    """-> rows of RGB tuples, the lowest first"""
    window, renderer = vtkRenderWindow(), vtkRenderer()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(samples)
    window.SetSize(size, size)
    window.AddRenderer(renderer)
    renderer.SetBackground(background)
    for actor in actors:
        renderer.AddViewProp(actor)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0, 0, 5)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetFocalDistance(focus)
    # Pixels are as wide in every size.
    camera.SetViewAngle(2 * math.degrees(math.atan(size / SIZE * math.tan(math.radians(15)))))
    if views:
        accumulating, disk = accumulation(blur, focus, views)
        camera.SetFocalDisk(disk)
        accumulating.SetLinearLight(linear)
        accumulating.GetDelegatePass().GetSplatter().SetLinearLight(linear)
        renderer.SetPass(accumulating)
    else:
        renderer.SetPass(lens_pass(blur, through, cells))
        renderer.GetPass().GetSplatter().SetLinearLight(linear)
    renderer.ResetCameraClippingRange()
    for _ in range(1 if views else 2):  # the second frame is kept from the first
        window.Render()
    grabbed = vtkWindowToImageFilter()
    grabbed.SetInput(window)
    grabbed.ReadFrontBufferOff()
    grabbed.Update()
    flat = values(grabbed.GetOutput().GetPointData().GetScalars())
    pixels = [tuple(flat[3 * i:3 * i + 3]) for i in range(size * size)]
    return [pixels[size * y:size * (y + 1)] for y in range(size)]


def psnr(a, b):
    squares = [(x - y) ** 2 for row, other in zip(a, b)
               for p, q in zip(row, other) for x, y in zip(p, q)]
    return 10 * math.log10(255 ** 2 / max(1e-9, sum(squares) / len(squares)))

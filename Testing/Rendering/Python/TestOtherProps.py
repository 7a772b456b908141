#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Meshes through the lens: as blurred as the surfels of the same surface, and nothing leaks, between
clouds and meshes both ways."""
import math
import sys

import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkFiltersSources import vtkPlaneSource, vtkSphereSource
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter)

from surfelsplatting.vtkSurfelRendering import vtkSurfelMapper, vtkSurfelSplattingPass

from surfeltesting import Surfels, run, values

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


def plane_of_surfels(z, half, count, color):
    surfels, step = Surfels(), 2 * half / count
    for i in range(count):
        for j in range(count):
            p = (-half + (i + 0.5) * step, -half + (j + 0.5) * step, z)
            surfels.add(p, (0, 0, 1), step * step, color)
    return surfels


def stripes(p):
    return (230, 120, 60) if math.sin(7 * p[0]) * math.sin(7 * p[1]) > 0 else (60, 110, 200)


def picture(actors, focus, blur, through=True, background=(0.0, 0.0, 0.0)):
    """-> rows of RGB tuples, the lowest first"""
    window, renderer, splatting = vtkRenderWindow(), vtkRenderer(), vtkSurfelSplattingPass()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(SIZE, SIZE)
    window.AddRenderer(renderer)
    renderer.SetPass(splatting)
    renderer.SetBackground(background)
    for actor in actors:
        renderer.AddActor(actor)
    splatting.SetOtherPropsThroughLens(through)
    splatter = splatting.GetSplatter()
    splatter.SetLensModeToCircleOfConfusion()
    splatter.SetCircleOfConfusion(blur)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0, 0, 5)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetFocalDistance(focus)
    renderer.ResetCameraClippingRange()
    for _ in range(2):  # the second frame is kept from the first
        window.Render()
    grabbed = vtkWindowToImageFilter()
    grabbed.SetInput(window)
    grabbed.ReadFrontBufferOff()
    grabbed.Update()
    flat = values(grabbed.GetOutput().GetPointData().GetScalars())
    pixels = [tuple(flat[3 * i:3 * i + 3]) for i in range(SIZE * SIZE)]
    return [pixels[SIZE * y:SIZE * (y + 1)] for y in range(SIZE)]


def psnr(a, b):
    squares = [(x - y) ** 2 for row, other in zip(a, b)
               for p, q in zip(row, other) for x, y in zip(p, q)]
    return 10 * math.log10(255 ** 2 / max(1e-9, sum(squares) / len(squares)))


def sphere_mesh():
    source = vtkSphereSource()
    source.SetRadius(1.0)
    source.SetThetaResolution(400)
    source.SetPhiResolution(200)
    source.Update()
    colors = vtkUnsignedCharArray()
    colors.SetNumberOfComponents(3)
    points = source.GetOutput().GetPoints()
    for i in range(points.GetNumberOfPoints()):
        colors.InsertNextTuple(stripes(points.GetPoint(i)))
    source.GetOutput().GetPointData().SetScalars(colors)
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(source.GetOutput())
    return actor_of(mapper)


def test_mesh_and_cloud_of_one_surface():
    cloud = cloud_actor(Surfels().sphere(40000, color=stripes))
    for blur in (6, 12):
        for focus in (3.0, 9.0):  # in focus a mesh is sharper than surfels, which a pixel filters
            a = picture([sphere_mesh()], focus, blur)
            b = picture([cloud], focus, blur)
            assert psnr(a, b) > 30, (blur, focus, psnr(a, b))
            sharp = picture([sphere_mesh()], focus, blur, through=False)
            assert psnr(a, sharp) < psnr(a, b) - 3, (blur, focus, psnr(a, sharp))


def test_nothing_leaks_over_a_sharp_prop():
    """A dark sharp square before a bright blurred wall: cloud or mesh, all four ways."""
    half, wall_z = 0.5, -6.0
    squares = {"mesh": lambda: mesh_actor(plane(0.0, half), (0, 1, 0)),
               "cloud": lambda: cloud_actor(plane_of_surfels(0.0, half, 100, (0, 255, 0)))}
    walls = {"mesh": lambda: mesh_actor(plane(wall_z, 6.0), (1, 0, 0)),
             "cloud": lambda: cloud_actor(plane_of_surfels(wall_z, 6.0, 150, (255, 0, 0)))}
    # Of its silhouette: 0.5 / 5 / tan(15 degrees) of half the picture.
    reach = int(SIZE / 2 * half / 5 / math.tan(math.radians(15)))
    for square, make_square in squares.items():
        for wall, make_wall in walls.items():
            seen = picture([make_square(), make_wall()], 5.0, 10)
            # Surfels in focus are filtered by a pixel.
            inside = range(SIZE // 2 - reach + 4, SIZE // 2 + reach - 4)
            leak = max(seen[y][x][0] for y in inside for x in inside)
            assert leak <= (0 if square == "mesh" else 2), (square, wall, leak)
            assert min(seen[y][x][1] for y in inside for x in inside) >= 250, (square, wall)
            assert seen[SIZE // 2][8][0] > 240, (square, wall)  # the wall is there


def test_blurred_prop_lets_a_sharp_one_through():
    """A blurred square before a sharp wall: half of it at its edge."""
    wall = cloud_actor(plane_of_surfels(-2.0, 3.0, 150, (255, 0, 0)))
    seen = picture([mesh_actor(plane(2.0, 0.3), (0, 1, 0)), wall], 7.0, 10)
    middle, edge = SIZE // 2, int(SIZE / 2 * (1 + 0.3 / 3 / math.tan(math.radians(15))))
    assert seen[middle][middle][1] > 250 and seen[middle][middle][0] < 5
    for x in (edge - 1, edge):
        red, green, _ = seen[middle][x]
        assert 90 < green < 165, seen[middle][x]
    assert seen[middle][edge + 4][0] > seen[middle][edge][0] > seen[middle][edge - 4][0]
    assert seen[middle][SIZE - 4][1] == 0


def test_sharp_without_a_lens():
    actors = [sphere_mesh()]
    assert picture(actors, 5.0, 0) == picture(actors, 5.0, 0, through=False)


if __name__ == "__main__":
    run(sys.modules[__name__])

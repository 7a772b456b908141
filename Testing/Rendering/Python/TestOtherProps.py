#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Meshes through the lens: as blurred as the surfels of the same surface, and nothing leaks, between
clouds and meshes both ways."""
import functools
import math
import sys

import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkRenderingVolumeOpenGL2
from vtkmodules.vtkCommonCore import VTK_UNSIGNED_CHAR, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkFiltersSources import vtkLineSource, vtkSphereSource
from vtkmodules.vtkRenderingCore import (
    vtkColorTransferFunction, vtkPolyDataMapper, vtkSkybox, vtkTextActor, vtkTexture, vtkVolume)
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkSmartVolumeMapper

from lensscene import SIZE, actor_of, cloud_actor, mesh_actor, picture, plane, plane_of_surfels, psnr
from surfeltesting import Surfels, run


def stripes(p):
    return (230, 120, 60) if math.sin(7 * p[0]) * math.sin(7 * p[1]) > 0 else (60, 110, 200)


@functools.lru_cache(maxsize=None)
def colored_sphere(color):
    source = vtkSphereSource()
    source.SetRadius(1.0)
    source.SetThetaResolution(400)
    source.SetPhiResolution(200)
    source.Update()
    colors = vtkUnsignedCharArray()
    colors.SetNumberOfComponents(3)
    points = source.GetOutput().GetPoints()
    for i in range(points.GetNumberOfPoints()):
        colors.InsertNextTuple(color(points.GetPoint(i)))
    source.GetOutput().GetPointData().SetScalars(colors)
    return source.GetOutput()


def sphere_mesh(color=stripes):
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(colored_sphere(color))
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
    # Half-width of its silhouette: 0.5 / 5 / tan(15 degrees) of half the picture.
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


def mesh_line():
    line = vtkLineSource()
    line.SetPoint1(0.003, -0.5, 2.0)
    line.SetPoint2(0.003, 0.5, 2.0)
    return mesh_actor(line, (0, 1, 0))


def mesh_points():
    source = plane(2.0, 0.5)
    source.SetResolution(9, 9)
    actor = mesh_actor(source, (0, 1, 0))
    actor.GetProperty().SetRepresentationToPoints()
    return actor


def test_a_wall_goes_on_behind_a_blurred_edge():
    """Green before red, sharp or blurred less: no background between them."""
    middle, edge = SIZE // 2, int(SIZE / 2 * (1 + 0.3 / 3 / math.tan(math.radians(15))))
    for focus in (7.0, 12.0):
        for cells in (1, 7):
            actors = [mesh_actor(plane(2.0, 0.3), (0, 1, 0)), mesh_actor(plane(-2.0, 3.0), (1, 0, 0))]
            row = picture(actors, focus, 10, cells=cells)[middle]
            assert min(sum(row[x]) for x in range(SIZE // 2, SIZE - 20)) > 250, (focus, cells)
            assert 90 < row[edge][1] < 165, (focus, cells, row[edge])


def test_white_before_white():
    """No background in the edges, whichever of the two is in front of the focus or behind it."""
    for wall in (1.5, -2.0, -20.0):
        for focus in (2.5, 3.5, 5.0, 7.0, 12.0):
            actors = [mesh_actor(plane(2.0, 0.3), (1, 1, 1)), mesh_actor(plane(wall, 30.0), (1, 1, 1))]
            seen = picture(actors, focus, 10)
            darkest = min(p[0] for row in seen for p in row)
            assert darkest >= 245, (wall, focus, darkest)


def test_round_things_have_no_lumps():
    """A ball's rim is steep: where depth steps there were taken for edges, its colour was drawn behind
    the rest of the ball, 21 to 31 dB."""
    def dark_rim(p):
        return (255, 0, 0) if p[2] < 0.3 else (255, 255, 255)
    cloud = cloud_actor(Surfels().sphere(40000, color=dark_rim))
    for focus in (6.0, 12.0):
        for blur in (25, 40):
            a, b = (picture([actor], focus, blur) for actor in (sphere_mesh(dark_rim), cloud))
            assert psnr(a, b) > 38, (focus, blur, psnr(a, b))


def test_lines_and_points_before_a_wall():
    """One pixel wide, they have no slope, and about as much light as many views show of them: lone
    pixels are raised by up to a seventh against ripples."""
    for make in (mesh_line, mesh_points):
        for focus in (11.0, 5.6):
            for cells in (1, 7):
                actors = [make(), mesh_actor(plane(-6.0, 6.0), (1, 0, 0))]
                found, many = (sum(p[1] for row in picture(actors, focus, 8, cells=cells, views=views)
                                   for p in row) for views in (0, 60))
                assert abs(found - many) < 0.2 * many, (make, focus, cells, found, many)


def test_cells_see_what_is_hidden():
    """A blue dot behind a blurred square, 4 px from its edge: not in the picture from the middle of
    the lens, but in those from its border."""
    middle, edge = SIZE // 2, 0.3 / 3 * 7 - 0.1
    blue = {}
    for cells in (1, 7):
        dot = mesh_actor(plane(-2.0, 0.06), (0, 0, 1))
        dot.SetPosition(edge, 0, 0)
        actors = [mesh_actor(plane(2.0, 0.3), (0, 1, 0)), dot, mesh_actor(plane(-2.1, 3.0), (1, 0, 0))]
        blue[cells] = max(p[2] for p in picture(actors, 7.0, 10, cells=cells)[middle])
    assert blue[1] == 0 and blue[7] > 25, blue


def cube_of_light():
    """A translucent volume: no depth, so cells alone can blur it."""
    image = vtkImageData()
    image.SetDimensions(20, 20, 20)
    image.SetSpacing(0.05, 0.05, 0.05)
    image.SetOrigin(-0.5, -0.5, 0.5)
    image.AllocateScalars(VTK_UNSIGNED_CHAR, 1)
    image.GetPointData().GetScalars().Fill(200)
    mapper = vtkSmartVolumeMapper()
    mapper.SetInputData(image)
    volume = vtkVolume()
    volume.SetMapper(mapper)
    opacity, color = vtkPiecewiseFunction(), vtkColorTransferFunction()
    opacity.AddPoint(0, 0.2)
    opacity.AddPoint(255, 0.2)
    color.AddRGBPoint(0, 0.9, 0.7, 0.2)
    volume.GetProperty().SetScalarOpacity(opacity)
    volume.GetProperty().SetScalarOpacityUnitDistance(0.2)
    volume.GetProperty().SetColor(color)
    return volume


def test_cells_converge_to_many_views():
    """Meshes, a translucent one and a volume, against the mean of 40 sharp views."""
    def actors():
        glass = mesh_actor(plane(3.0, 0.25), (0.3, 0.6, 1.0))
        glass.GetProperty().SetOpacity(0.5)
        return [sphere_mesh(), mesh_actor(plane(-4.0, 1.2), (0.2, 0.7, 0.4)), glass, cube_of_light()]
    truth = picture(actors(), 5.6, 10, views=40)
    quality = {cells: psnr(picture(actors(), 5.6, 10, cells=cells), truth) for cells in (1, 7, 19)}
    assert quality[7] > quality[1] + 2 and quality[19] > quality[7] and quality[19] > 32, quality


def test_volumes_are_drawn_in_cells():
    """The cells' own framebuffers are like that of the window, from which VTK copies depths."""
    for samples in (0, 4):
        covered = [sum(max(p) > 20 for row in picture([cube_of_light()], 5.0, 6, samples=samples, **options)
                       for p in row) for options in ({"cells": 1}, {"cells": 7}, {"views": 7})]
        assert covered[0] > 5000 and max(covered) < 1.1 * min(covered), (samples, covered)


def test_text_stays_sharp():
    def actors():
        text = vtkTextActor()
        text.SetInput("focus")
        text.SetPosition(10, 10)
        text.GetTextProperty().SetFontSize(24)
        text.GetTextProperty().SetColor(1, 1, 0)
        return [mesh_actor(plane(-4.0, 4.0), (0.1, 0.2, 0.7)), text]
    sharp = picture(actors(), 5.0, 0)
    assert sum(p[0] > 200 for row in sharp for p in row) > 100
    for cells in (1, 7):
        blurred = picture(actors(), 5.0, 10, cells=cells)
        # Behind its letters the wall is the same blurred or not.
        worst = max(abs(a - b) for row, other in zip(sharp, blurred) for p, q in zip(row, other)
                    for a, b in zip(p, q))
        assert worst <= 1, (cells, worst)


def test_a_picture_is_part_of_a_larger_one():
    """What is beyond the border blurs into the picture, also where VTK culls it."""
    margin = 24
    for samples in (0, 4):
        def actors():
            beyond = mesh_actor(plane(1.0, 0.2), (1.0, 0.9, 0.1))
            beyond.SetPosition(1.32, 0.2, 0)  # its edge is 8 px outside
            return [sphere_mesh(), mesh_actor(plane(-3.0, 5.0), (0.1, 0.2, 0.7)), beyond]
        small = picture(actors(), 8.0, 20, samples=samples)
        large = picture(actors(), 8.0, 20, samples=samples, size=SIZE + 2 * margin)
        cropped = [row[margin:-margin] for row in large[margin:-margin]]
        # Rounding; the mesh's edges may be a pixel off.
        different = sum(max(abs(a - b) for a, b in zip(p, q)) > 2
                        for row, other in zip(small, cropped) for p, q in zip(row, other))
        assert different <= 20, (samples, different)
        assert max(small[y][SIZE - 1][0] for y in range(SIZE)) > 80  # it does reach in


def skybox(color):
    texture = vtkTexture()
    texture.CubeMapOn()
    for face in range(6):
        image = vtkImageData()
        image.SetDimensions(4, 4, 1)
        image.AllocateScalars(VTK_UNSIGNED_CHAR, 3)
        for c in range(3):
            image.GetPointData().GetScalars().FillComponent(c, color[c])
        texture.SetInputDataObject(face, image)
    sky = vtkSkybox()
    sky.SetTexture(texture)
    return sky


def test_a_sky_without_depth_goes_on_behind():
    """White before magenta: blue everywhere, and not the background's black in the edge."""
    for samples in (0, 8):
        seen = picture([skybox((255, 80, 255)), mesh_actor(plane(2.0, 0.35), (1, 1, 1))], 7.0, 12,
                       samples=samples)
        assert min(p[2] for row in seen for p in row) >= 250, samples
        assert {seen[80][2][1], seen[80][80][1]} == {80, 255}, samples


def test_antialiased_edges_before_bright_backgrounds():
    """A background is seen although its alpha is 0, and edges before it are not brighter than both."""
    def dark():
        actor = mesh_actor(plane(0.0, 0.7), (0.1, 0.1, 0.1))
        actor.RotateZ(17)
        return [actor]
    for linear in (False, True):
        options = dict(background=(0.6, 0.6, 0.6), samples=8, linear=linear)
        seen, truth = picture(dark(), 3.5, 12, **options), picture(dark(), 3.5, 12, views=60, **options)
        assert max(p[0] for row in seen for p in row) == 153, linear
        assert psnr(seen, truth) > 44, (linear, psnr(seen, truth))


def test_forced_opaque_before_bright_backgrounds():
    """What VTK has blended with a background whose alpha is 0 has the colour of both."""
    def film():
        actor = mesh_actor(plane(0.0, 0.7), (0.1, 0.1, 0.1))
        actor.GetProperty().SetOpacity(0.4)
        actor.ForceOpaqueOn()
        return [actor]
    for samples in (0, 8):
        seen = picture(film(), 3.5, 12, background=(0.6, 0.6, 0.6), samples=samples)
        assert seen[80][80] == (102, 102, 102), (samples, seen[80][80])  # 0.4 * 0.1 + 0.6 * 0.6
        assert max(p[0] for row in seen for p in row) == 153, samples


def light(code):
    return code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4


def code(value):
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


def test_light_is_mixed_where_wanted():
    """The edge of a blurred half plane before another colour, one picture and cells, meshes, surfels
    and the mean of many views: half of each one's light, or of its code."""
    low, high = (64, 128, 0), (250, 128, 255)
    makers = {"mesh": lambda z, color: mesh_actor(plane(z, 4.0), [c / 255 for c in color]),
              "cloud": lambda z, color: cloud_actor(plane_of_surfels(z, 4.0, 200, color))}
    for kind, make in makers.items():
        for linear in (False, True):
            for cells, views in ((1, 0), (7, 0), (1, 100)):
                near = make(2.0, high)
                near.SetPosition(4.0, 0, 0)
                row = picture([near, make(-2.0, low)], 7.0, 8, cells=cells, views=views,
                              linear=linear)[SIZE // 2]
                middle = [(a + b) / 2 for a, b in zip(row[SIZE // 2 - 1], row[SIZE // 2])]
                for c, (a, b) in enumerate(zip(low, high)):
                    mean = (a + b) / 2
                    if linear:
                        mean = 255 * code((light(a / 255) + light(b / 255)) / 2)
                    # Cells and views are steps of a stair.
                    tolerance = 14 if views else 10 if cells > 1 else 6
                    assert abs(middle[c] - mean) < tolerance, (kind, linear, cells, views, middle,
                                                               mean)
                    assert abs(row[4][c] - a) <= 2 and abs(row[SIZE - 5][c] - b) <= 2, (
                        kind, linear, cells, views, row[4], row[SIZE - 5])


def test_antialiased_edges_leave_no_line():
    """Pixels at a blurred mesh's edge, half its colour, stay behind as a line where they are kept."""
    def actors():
        square = mesh_actor(plane(2.0, 0.35), (1, 1, 1))
        square.SetOrientation(0, 0, 20)
        return [square]
    one, eight = (picture(actors(), 6.0, 12, samples=samples) for samples in (0, 8))
    # The edge is up to half a pixel elsewhere; over 12 px of blur it falls by at most 27 a pixel.
    worst = max(abs(p[0] - q[0]) for row, other in zip(one, eight) for p, q in zip(row, other))
    assert worst < 27, worst


def test_sharp_without_a_lens():
    actors = [sphere_mesh()]
    assert picture(actors, 5.0, 0) == picture(actors, 5.0, 0, through=False)


if __name__ == "__main__":
    run(sys.modules[__name__])

#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Translucent surfels: opacity from wherever VTK takes it, layers in any order, in focus and out,
before, behind and through meshes."""
import itertools
import sys

from vtkmodules.vtkCommonCore import vtkFloatArray, vtkLookupTable

from lensscene import SIZE, cloud_actor, mesh_actor, picture, plane, plane_of_surfels
from surfeltesting import run

GREEN, RED, BLUE, GREY = (0, 255, 0), (255, 0, 0), (0, 0, 255), (120, 120, 120)


def by_actor(z, color, opacity):
    actor = cloud_actor(plane_of_surfels(z, 3.0, 90, color))
    actor.GetProperty().SetOpacity(opacity)
    return actor


def by_point(z, color, opacity):
    actor = cloud_actor(plane_of_surfels(z, 3.0, 90, color))
    opacities = vtkFloatArray()
    opacities.SetName("SurfelOpacity")
    opacities.SetNumberOfTuples(90 * 90)
    opacities.Fill(opacity)
    actor.GetMapper().GetInput().GetPointData().AddArray(opacities)
    return actor


def by_lookup_table(z, color, opacity):
    actor = cloud_actor(plane_of_surfels(z, 3.0, 90, color))
    scalars = vtkFloatArray()
    scalars.SetName("Value")
    scalars.SetNumberOfTuples(90 * 90)
    scalars.Fill(0.7)
    table = vtkLookupTable()
    table.SetNumberOfTableValues(2)
    table.SetTableValue(0, 1, 1, 1, 0.1)
    table.SetTableValue(1, *(c / 255 for c in color), opacity)
    mapper = actor.GetMapper()
    mapper.GetInput().GetPointData().SetScalars(scalars)
    mapper.SetLookupTable(table)
    mapper.SetScalarRange(0, 1)
    return actor


def over(layers):
    """(color, opacity), nearest first -> the colour that they have together, on black"""
    through, seen = 1.0, [0.0, 0.0, 0.0]
    for color, opacity in layers:
        seen = [s + through * opacity * c for s, c in zip(seen, color)]
        through *= 1 - opacity
    return seen


def assert_color(found, expected, about, tolerance=3):
    assert max(abs(f - e) for f, e in zip(found, expected)) <= tolerance, (about, found, expected)


def test_layers_in_any_order():
    layers = [(2.0, GREEN, 0.5), (0.5, RED, 0.4), (-2.0, BLUE, 1.0)]
    expected = over([(color, opacity) for _, color, opacity in layers])
    for make in (by_actor, by_point, by_lookup_table):
        for order in itertools.permutations(range(3)):
            for focus in (3.0, 4.5, 12.0):
                actors = [make(*layers[i]) for i in order]
                seen = picture(actors, focus, 10)
                for x, y in ((80, 80), (50, 110)):
                    assert_color(seen[y][x], expected, (make.__name__, order, focus))


def test_before_and_behind_meshes():
    """Sharp and blurred, one picture and cells."""
    for mesh_z, surfels_z in ((-2.0, 1.0), (1.0, -2.0), (-2.0, -1.0)):
        before = surfels_z > mesh_z
        expected = over([(GREEN, 0.4), (GREY, 1.0)] if before else [(GREY, 1.0)])
        for focus, cells in itertools.product((4.0, 7.0, 14.0), (1, 7)):
            actors = [mesh_actor(plane(mesh_z, 3.0), [c / 255 for c in GREY]),
                      by_actor(surfels_z, GREEN, 0.4)]
            seen = picture(actors, focus, 10, cells=cells)
            assert_color(seen[80][80], expected, (mesh_z, surfels_z, focus, cells))


def test_through_a_mesh():
    """Surfels that cut a mesh are seen before it on one side of the line, hidden on the other."""
    for focus, cells in itertools.product((5.0, 8.0), (1, 7)):
        surfels = by_actor(0.0, GREEN, 0.4)
        surfels.SetOrientation(0, 45, 0)  # its left side comes forward
        seen = picture([mesh_actor(plane(0.0, 3.0), [c / 255 for c in GREY]), surfels], focus, 8,
                       cells=cells)
        assert_color(seen[80][SIZE // 2 - 25], over([(GREEN, 0.4), (GREY, 1.0)]), (focus, cells))
        assert_color(seen[80][SIZE // 2 + 25], GREY, (focus, cells))


def test_glass_before_a_blurred_edge():
    """What is seen through a sharp translucent layer is as blurred as without it."""
    def edge(*more):
        wall = mesh_actor(plane(-3.0, 3.0), (1, 0, 0))
        wall.SetPosition(3.0, 0, 0)
        return [p[0] for p in picture([wall, *more], 4.0, 10)[80]]
    bare, glazed = edge(), edge(by_actor(1.0, GREEN, 0.5))
    assert max(abs(0.5 * b - g) for b, g in zip(bare, glazed)) <= 3, (bare, glazed)
    assert sum(20 < b < 235 for b in bare) > 5


if __name__ == "__main__":
    run(sys.modules[__name__])

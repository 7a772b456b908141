# SPDX-License-Identifier: BSD-3-Clause
"""Sheets of points close to one another that cover one another, as in foliage and before walls. In focus
the nearest one hides the others; blurred together they must not count twice (SurfelOverlap)."""

import unittest

import numpy as np

from clouds import color_array, points_of, surfels_of
from renderers import view_camera
from scenes import DEFAULT, Drawing, Way, multisampling
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkPolyData

VIEW = {"position": (0, 0, 8), "focalPoint": (0, 0, 0), "viewUp": (0, 1, 0), "viewAngle": 20,
        "focalDistance": 4.0}
SIZE, BLUR = 256, 24


def foliage(leaves=60, points=400, noise=1.0):
    """Small discs in a ball, with noise of `noise` spacings along their normals."""
    rng = np.random.default_rng(7)
    centres = rng.normal(size=(leaves, 3))
    centres *= (rng.uniform(size=leaves) ** (1 / 3) / np.linalg.norm(centres, axis=1))[:, None]
    frames = np.linalg.qr(rng.normal(size=(leaves, 3, 3)))[0]
    radius = np.sqrt(rng.uniform(size=(leaves, points)))
    angle = rng.uniform(0, 2 * np.pi, (leaves, points))
    spacing = 0.15 * np.sqrt(np.pi / points)
    discs = np.stack([0.15 * radius * np.cos(angle), 0.15 * radius * np.sin(angle),
                      noise * spacing * rng.normal(size=(leaves, points))], axis=-1)
    cloud = vtkPolyData()
    cloud.SetPoints(points_of((centres[:, None] + discs @ frames).reshape(-1, 3)))
    cloud.GetPointData().SetScalars(color_array(np.full((leaves * points, 3), (0.4, 0.7, 0.2))))
    return cloud


def without_overlap(surfels):
    plain = vtkPolyData()
    plain.ShallowCopy(surfels)
    plain.GetPointData().RemoveArray("SurfelOverlap")
    return plain


def errors(surfels):
    """PSNR of one picture and of seven cells against pinholes, and the light over theirs."""
    drawing = Drawing("foliage", surfels, view_camera(VIEW), lit=False)
    reference = drawing.frame(multisampling(200), SIZE, BLUR).picture
    pictures = [drawing.frame(way, SIZE, BLUR).picture for way in (DEFAULT, Way(cells=7))]
    decibels = [-10 * np.log10(np.mean((picture - reference) ** 2)) for picture in pictures]
    return (*decibels, pictures[0].sum() / reference.sum())


def posters(spacing=0.01, gap=2.0):
    """A wall, and squares in front of it, `gap` spacings away: all face the camera."""
    rng = np.random.default_rng(3)
    wall = np.column_stack([rng.uniform(-1, 1, (int(4 / spacing ** 2), 2)),
                            np.zeros(int(4 / spacing ** 2))])
    front = wall[(np.floor(3 * wall[:, 0]) + np.floor(3 * wall[:, 1])) % 2 > 0].copy()
    front[:, :2] += spacing * rng.uniform(-1, 1, front[:, :2].shape)
    front[:, 2] = gap * spacing
    colors = np.full((len(wall) + len(front), 3), (0.7, 0.3, 0.2))
    colors[len(wall):] = (0.2, 0.3, 0.6)
    cloud = vtkPolyData()
    cloud.SetPoints(points_of(np.vstack([wall, front])))
    cloud.GetPointData().SetScalars(color_array(colors))
    normals = numpy_to_vtk(np.tile(np.float32([0, 0, 1]), (len(colors), 1)), deep=True)
    cloud.GetPointData().SetNormals(normals)
    return cloud


class TestFoliage(unittest.TestCase):
    def test_blurred_together(self):
        surfels = surfels_of(foliage())
        one, seven, light = errors(surfels)
        plain_one, plain_seven, plain_light = errors(without_overlap(surfels))
        print(f"one picture {plain_one:.2f} -> {one:.2f} dB, seven cells {plain_seven:.2f} -> "
              f"{seven:.2f}, light over that of pinholes {plain_light:.3f} -> {light:.3f}")
        self.assertGreater(one, plain_one + 2.5)
        self.assertGreater(seven, plain_seven + 1.5)
        self.assertLess(abs(light - 1), 0.035)

    def test_sheets_in_front_of_sheets(self):
        """What is behind a poster does not shine through it."""
        one, seven, light = errors(surfels_of(posters()))
        print(f"posters: one picture {one:.2f} dB, seven cells {seven:.2f}, light {light:.3f}")
        self.assertGreater(min(one, seven), 36)  # 25 if the sheets, or nodes of both, are mixed


if __name__ == "__main__":
    unittest.main()

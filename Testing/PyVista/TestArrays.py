# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplatting.render: arrays to pictures, and its errors."""

import doctest
import os
from pathlib import Path
import tempfile
import unittest
from unittest import mock
import warnings

import numpy as np
from surfelsplatting import (Camera, Lens, arraypictures, lens, render, surfels, vtkSurfelImageRenderer,
                             write_png)
from surfelsplatting.backend import vtk

NAN = float("nan")
FRONT = Camera(position=(0, 0, 6), focal_point=(0, 0, 0), view_up=(0, 1, 0))


def sphere(count=20000):
    points = np.random.default_rng(1).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def detail(picture):
    """Mean difference of neighbouring pixels."""
    return np.abs(np.diff(picture.astype(int), axis=1)).mean()


class TestRender(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.points = sphere()
        cls.stripes = np.where(np.sin(60 * cls.points[:, :1]) > 0, 255, 40) * np.ones(
            (1, 3), np.uint8)

    def picture(self, **options):
        options = {"camera": FRONT, "size": (240, 180), **options}
        return render(self.points, **options)

    def test_a_picture(self):
        picture = self.picture(background=(0, 0, 0))
        self.assertEqual((picture.shape, picture.dtype), ((180, 240, 3), np.uint8))
        # 0.785 of the light falls on what faces the camera; the cloud's grey is 204.
        np.testing.assert_allclose(picture[90, 120], 160, atol=4)
        self.assertEqual(picture[:, :20].max(), 0)
        # The brightest light comes from the left.
        self.assertGreater(picture[90, 120, 0], picture[90, 170, 0] + 20)
        self.assertGreater(picture[90, 100, 0], picture[90, 140, 0] + 20)

    def test_top_row_first_and_right_to_the_right(self):
        colors = np.zeros_like(self.points)
        colors[self.points[:, 1] > 0, 0] = 1  # above: red
        colors[self.points[:, 0] > 0, 2] = 1  # right: blue
        picture = self.picture(colors=colors, lighting=False, background=(0, 0, 0))
        np.testing.assert_array_equal(picture[70, 100] > 200, [True, False, False])
        np.testing.assert_array_equal(picture[110, 140] > 200, [False, False, True])

    def test_alpha(self):
        picture = self.picture(background=None, lighting=False, colors=[[1, 0.5, 0]] * 20000)
        self.assertEqual(picture.shape, (180, 240, 4))
        self.assertEqual(picture[0, 0, 3], 0)
        self.assertGreaterEqual(picture[90, 120, 3], 254)
        edge = (picture[..., 3] > 60) & (picture[..., 3] < 200)
        self.assertGreater(edge.sum(), 50)
        self.assertTrue((abs(picture[edge].astype(int)[:, :2] - [255, 128]) <= 3).all())

    def test_both_sides_from_inside(self):
        inside = {"camera": [(0, 0, 0), (0, 0, 1), (0, 1, 0)], "background": None}
        self.assertGreater(self.picture(**inside)[..., 3].min(), 240)  # points at random
        self.assertTrue((self.picture(**inside, viewpoint=(0, 0, 9))[..., 3] == 0).any())

    def test_bytes_and_floats_are_the_same_colors(self):
        floats = self.picture(colors=(self.stripes / 255).astype(np.float32)).astype(int)
        of_bytes = self.picture(colors=self.stripes)
        self.assertLessEqual(np.abs(floats - of_bytes).max(), 1)

    def test_photographs_are_not_lit_again(self):
        photographs = np.abs(self.points)  # 20000 colors
        np.testing.assert_array_equal(self.picture(colors=photographs),
                                      self.picture(colors=photographs, lighting=False))
        np.testing.assert_array_equal(self.picture(colors=self.stripes),
                                      self.picture(colors=self.stripes, lighting=True))
        lit = self.picture(colors=photographs, lighting=True).astype(int)
        self.assertGreater(np.abs(lit - self.picture(colors=photographs)).max(), 20)

    def test_lens(self):
        sharp = self.picture(colors=self.stripes)
        near = self.picture(colors=self.stripes, lens=Lens(coc=60, focus=(0, 0, 1)))
        off = self.picture(colors=self.stripes, lens=Lens(coc=60, focus=(0, 0, -30)))
        middle = (slice(80, 100), slice(110, 130))
        self.assertGreater(detail(near[middle]), 0.8 * detail(sharp[middle]))
        self.assertLess(detail(off[middle]), 0.4 * detail(sharp[middle]))
        np.testing.assert_array_equal(self.picture(colors=self.stripes, lens=0), sharp)

    def test_huge_clouds_get_a_hierarchy(self):
        with mock.patch.object(arraypictures, "make_surfels", wraps=surfels.make_surfels) as made:
            made.__kwdefaults__ = surfels.make_surfels.__kwdefaults__
            for limit, options in ((len(self.points), {}), (len(self.points) - 1, {}),
                                   (len(self.points) - 1, {"hierarchy": False})):
                with mock.patch.object(surfels, "HUGE", limit):
                    self.picture(**options)
        self.assertEqual([call.kwargs["hierarchy"] for call in made.call_args_list],
                         [False, True, False])

    def test_scalars(self):
        """They have the colours of the map between the limits, with and without level of detail."""
        height = self.points[:, 1].copy()
        height[0] = NAN
        for lens in (None, 10):
            by_map = self.picture(scalars=height, cmap="gray", clim=(-1, 1), lighting=False, lens=lens,
                                  background=(0, 0, 0))
            middle = by_map[:, 120].astype(int)
            seen = middle[middle.any(axis=1)]
            np.testing.assert_allclose(seen.max(axis=1), seen.min(axis=1), atol=1)  # grey
            self.assertGreater(seen[5:30].mean(), seen[-30:-5].mean() + 100)
        spread = self.picture(scalars=3 * height + 7, cmap="gray", lighting=False)
        same = self.picture(scalars=height, cmap="gray", lighting=False)
        self.assertLess(np.abs(spread.astype(int) - same).max(), 3)
        for options, text in (({"scalars": height[1:]}, "for each of the 20000"),
                              ({"scalars": height, "colors": self.stripes}, "both scalars and colors"),
                              ({"scalars": height, "clim": (1, 1)}, "two numbers that differ"),
                              ({"scalars": height, "cmap": "virids"}, "colour map 'virids'")):
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                self.picture(**options)

    def test_focus_on_a_pixel(self):
        """Pixels count from below: the lower half is near."""
        points = self.points * [1, 1, 0]
        points = np.concatenate([points - [0, 1.1, -3], points + [0, 1.1, -3]])
        colors = np.concatenate([self.stripes] * 2)

        def picture(focus):
            return render(points, colors=colors, camera=FRONT, size=(240, 180),
                          lens=Lens(coc=40, focus=focus))

        below = picture((120, 30))
        self.assertGreater(detail(below[130:160, 100:140]), 2 * detail(below[40:60, 100:140]))
        np.testing.assert_allclose(below.astype(int), picture((0, 0, 3)), atol=2)

    def test_diameter(self):
        """A lens of diameter D in front of a far background blurs by f D / (2 z_f)."""
        focal_length = 0.5 * 180 / np.tan(np.radians(15))  # px
        coc = focal_length * 0.4 / 2 / 5
        focus = (0, 0, 1)
        np.testing.assert_allclose(
            self.picture(colors=self.stripes, lens=Lens(diameter=0.4, focus=focus)).astype(int),
            self.picture(colors=self.stripes, lens=Lens(coc=coc, focus=focus)), atol=1)

    def test_cameras(self):
        picture = self.picture()
        np.testing.assert_array_equal(
            picture, self.picture(camera=[(0, 0, 6), (0, 0, 0), (0, 1, 0)]))
        whole = self.picture(camera=None, background=None)
        self.assertEqual(whole[0].max(), 0)
        self.assertGreater((whole[..., 3] > 127).mean(), 0.4)

    def test_normals_decide_the_outside(self):
        """A plane whose normals point away is not seen."""
        grid = np.stack(np.meshgrid(np.linspace(-1, 1, 80), np.linspace(-1, 1, 80)), -1)
        points = np.pad(grid.reshape(-1, 2), ((0, 0), (0, 1)))

        def coverage(z):
            normals = np.broadcast_to([0, 0, z], points.shape)
            return (render(points, normals=normals, sides="given", camera=FRONT,
                           background=None)[..., 3] > 127).mean()

        self.assertGreater(coverage(1.0), 0.2)
        self.assertEqual(coverage(-1.0), 0)

    def test_large_coordinates(self):
        near = self.picture(colors=self.stripes)
        offset = np.array([4.5e5, 5.4e6, 300])
        camera = Camera(offset + [0, 0, 6], offset, (0, 1, 0))
        far = render(self.points + offset, colors=self.stripes, camera=camera, size=(240, 180))
        self.assertLess(np.abs(near.astype(int) - far).mean(), 0.5)

    def test_invalid_points_are_dropped_with_a_warning(self):
        points = self.points.copy()
        points[::2] = NAN
        with self.assertWarnsRegex(UserWarning, "10000 points with NaN") as caught:
            picture = render(points, camera=FRONT, size=(240, 180))
        self.assertNotIn("0x", str(caught.warning))  # no addresses
        self.assertGreater(picture[90, 120].min(), 150)

    def test_coordinates_of_too_few_digits(self):
        points = (self.points + [691000, 5334000, 500]).astype(np.float32)
        with self.assertWarnsRegex(UserWarning, "the coordinates have steps of 0.5"):
            render(points, size=(240, 180))

    def test_cleaning_is_logged(self):
        """It is what was asked for, and no reason to warn."""
        stray = [[3, 3, 3], [-3, 2, 1]]
        with warnings.catch_warnings(), self.assertLogs("surfelsplatting", "INFO") as caught:
            warnings.simplefilter("error")
            render(np.concatenate([self.points, stray, stray]), camera=FRONT, size=(240, 180))
        [text] = caught.output
        self.assertRegex(text, "estimation of surfels: 2 duplicates dropped; 2 stray points removed")

    def test_repeatable(self):
        smp = vtk("vtkCommonCore").vtkSMPTools
        pictures = []
        for threads in (1, 2, 2):
            smp.Initialize(threads)
            pictures.append(self.picture(colors=self.stripes, lens=20))
        np.testing.assert_array_equal(pictures[0], pictures[1])
        np.testing.assert_array_equal(pictures[1], pictures[2])

    def test_write_png_says_why_not(self):
        with self.assertRaisesRegex(RuntimeError, "rendering: .*camera"):
            write_png(vtkSurfelImageRenderer(), "never.png")

    def test_write_png_of_arrays(self):
        """The pictures of render, as they are."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "picture.png"
            for background in ((0.1, 0.2, 0.3), None):
                picture = self.picture(background=background)
                write_png(picture, path)
                reader = vtk("vtkIOImage").vtkPNGReader()
                reader.SetFileName(str(path))
                reader.Update()
                rows = vtk("util.numpy_support").vtk_to_numpy(
                    reader.GetOutput().GetPointData().GetScalars())
                np.testing.assert_array_equal(rows.reshape(picture.shape)[::-1], picture)
            with self.assertRaisesRegex(FileNotFoundError, "No such file or directory: .*nowhere"):
                write_png(picture, Path(folder) / "nowhere" / "picture.png")
            with self.assertRaisesRegex(IsADirectoryError, "Is a directory"):
                write_png(picture, folder)
            for path in (f"{folder}/a.bmp", Path(folder) / "a.JPG"):
                with self.assertRaisesRegex(ValueError, "what is written is a PNG file; let its name end in"):
                    write_png(picture, path)
            self.assertEqual(os.listdir(folder), ["picture.png"])
        for is_array in (True, False):
            with self.assertRaisesRegex(TypeError, "path is None; give the name of a file"):
                write_png(picture if is_array else vtkSurfelImageRenderer(), None)
        for wrong in (None, picture / 255.0, picture[..., 0], picture[:0]):
            with self.assertRaisesRegex(TypeError, "give a vtkSurfelImageRenderer, its output, or uint8"):
                write_png(wrong, "never.png")

    def test_one_color_for_all(self):
        for color in ((255, 0, 0), (1.0, 0.0, 0.0), np.array([255, 0, 0, 255], np.uint8)):
            every = self.picture(colors=np.tile(color, (len(self.points), 1)))
            np.testing.assert_array_equal(self.picture(colors=color), every)
        self.assertEqual(every[90, 120, 1:].max(), 0)

    def test_masked_points_are_left_out(self):
        half = self.points[:, :1] > 0
        masked = np.ma.array(self.points, mask=np.repeat(half, 3, axis=1))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            np.testing.assert_array_equal(
                render(masked, camera=FRONT, size=(240, 180)),
                render(np.where(half, NAN, self.points), camera=FRONT, size=(240, 180)))

    def test_few_points(self):
        """One, two, and many on a line are seen, also in numpy's numbers for a lens."""
        line = np.outer(np.linspace(0, 1, 50), (1.0, 2.0, 3.0))
        for points in (line[:1], line[:2], line, line * (0, 1, 0)):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                picture = render(points, size=(64, 48), lens=np.float32(2))
            self.assertGreater(np.ptp(picture), 10)

    def test_hidden_things_are_not_in_focus(self):
        """A sparse panel before a dense wall, from where the wall is hidden."""
        rng = np.random.default_rng(1)
        panel, wall = (np.column_stack([*rng.uniform(-1, 1, (2, count)), np.full(count, z)])
                       for count, z in ((4000, 1.0), (60_000, -1.0)))
        points = np.vstack([panel, wall])
        options = {"size": (64, 48), "camera": Camera(position=(0, 0, 9), view_up=(0, 1, 0))}
        default, panel = (render(points, lens=Lens(coc=20, focus=focus), **options)
                          for focus in (None, (0, 0, 1)))
        self.assertLess(np.abs(default.astype(int) - panel).max(), 3)

    def test_errors_say_what_to_do(self):
        points = sphere(2000)
        cases = [
            (ValueError, r"points have the shape \(2000, 2\); it must be \(n, 3\)",
             lambda: render(points[:, :2])),
            (ValueError, r"has no points \(0\)", lambda: render(np.zeros((0, 3)))),
            (ValueError, "none of the 2000 points gives a surfel", lambda: render(points * NAN)),
            (TypeError, "points have the type <U1", lambda: render([["a", "b", "c"]])),
            (ValueError, "colors have 10 rows, but there are 2000 points; give one row",
             lambda: render(points, colors=points[:10])),
            (ValueError, "colors are from 300 to 300; integers must be from 0 to 255",
             lambda: render(points, colors=np.full((2000, 3), 300))),
            (ValueError, r"normals have 3 rows", lambda: render(points, normals=points[:3])),
            (ValueError, r"camera's position is \(nan, 0, 1\); it must be three finite numbers",
             lambda: render(points, camera=Camera(position=(NAN, 0, 1)))),
            (ValueError, "camera's view_angle is 180",
             lambda: render(points, camera=Camera(view_angle=180))),
            (ValueError, "position and focal point are the same point 0 0 5",
             lambda: render(points, camera=[(0, 0, 5), (0, 0, 5), (0, 1, 0)])),
            (ValueError, "camera is .*; it must be a surfelsplatting.Camera",
             lambda: render(points, camera=[(0, 0, 5)])),
            (ValueError, "camera is 3; it must be", lambda: render(points, camera=3)),
            (TypeError, r"no argument 'coc'; give lens=surfelsplatting.Lens\(coc=...\)",
             lambda: render(points, coc=3)),
            (ValueError, r"the pixel \(0, 0\) sees nothing, so the lens cannot focus on it",
             lambda: render(points, lens=Lens(coc=3, focus=(0, 0)))),
            (ValueError, r"\(0, 900\) is no pixel of a picture of 800 x 600",
             lambda: render(points, lens=Lens(coc=3, focus=(0, 900)))),
            (ValueError, r"is 44 behind the camera at \(0.0, 0.0, 6.0\)",
             lambda: render(points, camera=FRONT, lens=Lens(coc=3, focus=(0, 0, 50)))),
            (ValueError, "coc is nan", lambda: render(points, lens=NAN)),
            (ValueError, "both a coc .3. and a diameter .1.",
             lambda: render(points, lens=Lens(coc=3, diameter=1))),
            (ValueError, "number of cells is 0", lambda: render(points, lens=Lens(coc=3, cells=0))),
            (ValueError, r"focus is \(1, 2, 3, 4\)",
             lambda: render(points, lens=Lens(coc=3, focus=(1, 2, 3, 4)))),
            (TypeError, "lens is 'wide'", lambda: render(points, lens="wide")),
            (ValueError, r"size is \(0, 9\)", lambda: render(points, size=(0, 9))),
            (ValueError, "sides is 'given', but the points have no normals",
             lambda: render(points, sides="given")),
            (ValueError, "cleaning is 'much'; it must be one of 'off', 'outliers', 'full'",
             lambda: render(points, cleaning="much")),
            (ValueError, "size is 300; it must be width and height", lambda: render(points, size=300)),
            (ValueError, "size is .*'b'", lambda: render(points, size=("a", "b"))),
            (ValueError, "size is .nan", lambda: render(points, size=(NAN, 3))),
            (ValueError, "neighbors is 2; it must be a number from 4 to 256",
             lambda: render(points, neighbors=2)),
            (ValueError, "neighbors is 'x'", lambda: render(points, neighbors="x")),
            (ValueError, "neighbors is 8.5; it must be a whole number",
             lambda: render(points, neighbors=8.5)),
            (ValueError, r"focus is \('a', 'b'\); it must be a point",
             lambda: Lens(coc=3, focus=("a", "b"))),
            (ValueError, "coc is '5'", lambda: Lens(coc="5")),
            (ValueError, "view_angle is '30'", lambda: Camera(view_angle="30")),
            (TypeError, "Lens has no argument 'blur'; it has coc, diameter, focus, cells", lambda: Lens(blur=3)),
            (TypeError, "Camera has no argument 'viewup'; did you mean 'view_up'", lambda: Camera(viewup=(0, 0, 1))),
            (TypeError, "render has no argument 'color'; did you mean 'colors'",
             lambda: render(points, color="red")),
            (TypeError, r"render has no argument 'blur'; give lens=surfelsplatting.Lens\(coc=",
             lambda: render(points, blur=10)),
            (TypeError, "points are 'scan.ply'; give an array", lambda: render("scan.ply")),
            (ValueError, "background is", lambda: render(points, background=(1, 0))),
            (ValueError, "255.0; it must be a number from 0 to 1",
             lambda: render(points, background=(255, 255, 255))),
            (ValueError, "viewpoint is", lambda: render(points, viewpoint=(1, 0))),
        ]
        for kind, text, call in cases:
            with self.subTest(text), self.assertRaisesRegex(kind, text), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                call()

    def test_examples_of_the_docstrings(self):
        for module in (arraypictures, lens):
            result = doctest.testmod(module)
            self.assertEqual(result.failed, 0)
            self.assertGreater(result.attempted, 0)


if __name__ == "__main__":
    unittest.main()

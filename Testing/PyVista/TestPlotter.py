# SPDX-License-Identifier: BSD-3-Clause
"""plotter.surfels: surfels, meshes and lenses in the subplots of a plotter."""

import subprocess
import sys
import time
import unittest
import warnings

import numpy as np
import pyvista as pv
from surfelsplatting import vtkSurfelMapper, vtkSurfelSplattingPass

from plottercase import FRONT, PlotterCase, detail

MIDDLE = (slice(80, 100), slice(110, 130))


class TestAdd(PlotterCase):
    def drawn(self, *args, **options):
        pl = self.plotter()
        pl.surfels.add(*args, show_scalar_bar=False, **options)
        return self.picture(pl)

    def test_scalars_and_color_map(self):
        """Red above, blue below."""
        for scalars in ("height", self.surfels["height"]):
            picture = self.drawn(self.surfels, scalars, cmap="bwr", lighting=False)
            for row, channel in ((50, 0), (130, 2)):
                pixel = picture[row, 120].astype(int)
                self.assertGreater(pixel[channel], pixel[2 - channel] + 60)

    def test_scalars_of_points(self):
        """Follow their points through the estimation."""
        named = self.drawn(self.cloud, "height", cmap="bwr")
        np.testing.assert_array_equal(self.drawn(self.cloud, self.cloud["height"], cmap="bwr"),
                                      named)
        np.testing.assert_array_equal(self.drawn(self.surfels, "height", cmap="bwr"), named)

    def test_range(self):
        low = self.drawn(self.surfels, "height", cmap="gray", clim=(2, 3), lighting=False)
        self.assertLess(low[90, 120].max(), 10)

    def test_colors(self):
        for options in ({"scalars": "RGB"}, {"scalars": "RGB", "rgb": True}):
            picture = self.drawn(self.surfels, lighting=False, **options)
            np.testing.assert_allclose(picture[90, 90], (30, 60, 230), atol=3)
            np.testing.assert_allclose(picture[90, 150], (230, 60, 30), atol=3)
        active = self.cloud.copy()
        active.set_active_scalars("RGB")
        np.testing.assert_array_equal(self.drawn(active, lighting=False), picture)

    def test_photographs_are_not_lit_again(self):
        noisy = self.surfels.copy()
        noise = np.random.default_rng(2).integers(0, 9, (noisy.n_points, 3))
        noisy["RGB"] = (noisy["RGB"] + noise).astype(np.uint8)
        np.testing.assert_array_equal(self.drawn(noisy, "RGB"),
                                      self.drawn(noisy, "RGB", lighting=False))
        lit = self.drawn(noisy, "RGB", lighting=True).astype(int)
        self.assertGreater(np.abs(lit - self.drawn(noisy, "RGB")).max(), 50)
        np.testing.assert_array_equal(self.drawn(self.surfels, "RGB"),
                                      self.drawn(self.surfels, "RGB", lighting=True))

    def test_blocks(self):
        """Are one cloud, also within others, and also of stock VTK's class."""
        half = self.cloud.points[:, 0] > 0
        parts = [pv.PolyData(self.cloud.points[which]) for which in (half, ~half)]
        blocks = pv.MultiBlock([parts[0], None, pv.MultiBlock([parts[1]])])
        whole = self.drawn(np.concatenate([part.points for part in parts]))
        np.testing.assert_array_equal(self.drawn(blocks), whole)
        plain = pv._vtk.vtkMultiBlockDataSet()
        plain.ShallowCopy(blocks)
        np.testing.assert_array_equal(self.drawn(plain), whole)
        self.assertEqual(blocks.surfels.estimate().n_points, self.cloud.n_points)

    def test_colors_have_no_scalar_bar(self):
        for name in ("rgb", "rgba"):
            pl = self.plotter()
            pl.surfels.add(self.surfels, np.abs(self.surfels.points), **{name: True})
            self.assertEqual(len(pl.scalar_bars), 0, name)

    def test_one_color(self):
        picture = self.drawn(self.surfels, color="lime", lighting=False, opacity=0.5)
        np.testing.assert_allclose(picture[90, 120], (0, 128, 0), atol=3)

    def test_opacity_of_points(self):
        """An array is in the order of the points, which surfels do not keep."""
        is_above = (self.cloud.points[:, 1] > 0).astype(float)
        for cloud, opacity in ((self.cloud, is_above),
                               (self.surfels, (self.surfels.points[:, 1] > 0).astype(float))):
            pl = self.plotter()
            pl.surfels.add(cloud, "height", opacity=opacity, show_scalar_bar=False)
            picture = self.picture(pl)
            self.assertGreater(picture[60:80, 110:130].max(axis=2).min(), 60)
            self.assertLess(picture[100:120, 110:130].max(), 10)

    def test_arrays_of_points(self):
        uncolored = pv.PolyData(self.cloud.points)  # colours would steer the kernels
        np.testing.assert_array_equal(self.drawn(self.cloud.points, color="tan"),
                                      self.drawn(uncolored, color="tan"))

    def test_scalar_bar_comes_and_goes_with_the_actor(self):
        pl = self.plotter()
        actor = pl.surfels.add(self.surfels, "height", scalar_bar_args={"title": "h"})
        self.assertEqual(list(pl.scalar_bars.keys()), ["h"])
        pl.update_scalar_bar_range((5, 6), "h")
        self.assertEqual(actor.mapper.scalar_range, (5, 6))
        pl.remove_actor(actor)
        self.assertEqual(list(pl.scalar_bars.keys()), [])
        self.assertEqual(self.picture(pl).max(), 0)

    def test_actor_is_one_of_pyvista(self):
        pl = self.plotter()
        actor = pl.surfels.add(self.surfels, "height", cmap="viridis", name="scan")
        self.assertIsInstance(actor, pv.Actor)
        self.assertIsInstance(actor.mapper, vtkSurfelMapper)
        self.assertEqual(actor.mapper.dataset.n_points, self.surfels.n_points)
        self.assertEqual(actor.mapper.array_name, "height")
        before = self.picture(pl)
        actor.mapper.lookup_table.cmap = "gray"
        self.assertGreater(np.abs(before.astype(int) - self.picture(pl)).max(), 50)
        actor.prop.opacity = 0
        actor.position = (9, 0, 0)
        pl.surfels.add(self.surfels, "height", cmap="viridis", name="scan")  # replaces the actor
        self.assertEqual(list(pl.actors).count("scan"), 1)
        np.testing.assert_array_equal(self.picture(pl), before)

    def test_camera_shows_all(self):
        pl = pv.Plotter(window_size=(240, 180))
        self.addCleanup(pl.close)
        far = self.cloud.copy()
        far.points = far.points.astype(float) + [4.5e5, 5.4e6, 300]
        pl.surfels.add(far)
        covered = self.picture(pl).max(axis=2) > 0
        self.assertTrue(covered[90, 120])
        self.assertFalse(covered[0].any() or covered[:, 0].any())

    def test_errors_say_what_to_do(self):
        pl = self.plotter()
        add = pl.surfels.add
        cases = [
            (ValueError, r"scalars have the shape \(7,\), but there are 10000 points",
             lambda: add(self.cloud, np.zeros(7))),
            (ValueError, "there is no point array 'heat'", lambda: add(self.cloud, "heat")),
            (ValueError, r"no points \(0\)", lambda: add(pv.PolyData())),
            (ValueError, r"points have the shape \(2, 2\)", lambda: add(np.zeros((2, 2)))),
            (TypeError, "surfels.add has no argument 'pbr'; surfels have no pbr; leave it out", lambda: add(self.cloud, pbr=True)),
            (TypeError, "^surfels.add has no argument 'tasty'", lambda: add(self.cloud, tasty=True)),
            (TypeError, "no argument 'colour'; did you mean 'color'", lambda: add(self.cloud, colour="r")),
            (TypeError, r"no argument 'sides'; cloud.surfels.estimate\(sides=...\) makes surfels",
             lambda: add(self.cloud, sides="two")),
            (TypeError, r"no argument 'coc'; pl.surfels.lens\(coc=...\)", lambda: add(self.cloud, coc=3)),
            (TypeError, "surfels.lens has no argument 'blur'; coc is the blur", lambda: pl.surfels.lens(blur=3)),
            (TypeError, "surfels.lens has no argument 'stop'; it has coc, focus, diameter, cells, render$",
             lambda: pl.surfels.lens(stop=3)),
            (TypeError, "cloud is of the type Table, which has no points", lambda: add(pv.Table({"x": np.ones(3)}))),
            (TypeError, "cloud is of the type Actor, which has no points", lambda: add(pv.Actor())),
            (ValueError, "component must be nonnegative and less", lambda: add(self.cloud, "RGB", component=5)),
        ]
        for kind, text, call in cases:
            with self.subTest(text), self.assertRaisesRegex(kind, text):
                call()

    def test_closed_plotter(self):
        pl = self.plotter()
        component = pl.surfels
        component.add(self.surfels)
        pl.close()
        with self.assertRaisesRegex(RuntimeError, "the plotter is closed"):
            component.add(self.surfels)

    def test_another_vtk(self):
        code = ("import numpy as np, pyvista as pv\n"
                "from vtkmodules.vtkCommonDataModel import vtkPolyData\n"
                "try: pv.Plotter(off_screen=True).surfels.add(vtkPolyData())\n"
                "except TypeError as problem: print(problem)\n")
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                              check=False)
        if "No module named 'vtkmodules" in done.stderr:
            self.skipTest("only one VTK is installed")
        self.assertIn("vtkPolyData of vtkmodules, which PyVista does not use",
                      done.stdout, done.stderr)


class TestLens(PlotterCase):
    def striped(self, **options):
        pl = self.plotter(**options)
        pl.surfels.add(self.surfels, "stripes", cmap="gray", show_scalar_bar=False)
        return pl

    def test_on_and_off(self):
        pl = self.striped()
        sharp = self.picture(pl)
        pl.surfels.lens(coc=60, focus=(0, 0, -30))
        self.assertLess(detail(self.picture(pl)[MIDDLE]), 0.4 * detail(sharp[MIDDLE]))
        pl.surfels.lens(focus=(0, 0, 1))  # the size stays
        focused = self.picture(pl)
        self.assertGreater(detail(focused[MIDDLE]), 0.8 * detail(sharp[MIDDLE]))
        self.assertGreater(np.abs(focused.astype(int) - sharp).max(), 20)
        pl.surfels.lens(diameter=3)  # the focus stays
        self.assertGreater(detail(self.picture(pl)[MIDDLE]), 0.6 * detail(sharp[MIDDLE]))
        pl.surfels.lens(coc=0)
        np.testing.assert_array_equal(self.picture(pl), sharp)

    def test_before_there_is_anything(self):
        """The camera is placed as if the lens had been set after the cloud, and the focus is the same."""
        pictures = []
        for is_first in (True, False):
            pl = pv.Plotter(window_size=(240, 180))
            self.addCleanup(pl.close)
            if is_first:
                pl.surfels.lens(coc=30, focus=(0, 0, 1))
            pl.surfels.add(self.surfels, "stripes", cmap="gray", show_scalar_bar=False)
            if not is_first:
                pl.surfels.lens(coc=30, focus=(0, 0, 1))
            pictures.append(self.picture(pl))
        np.testing.assert_array_equal(pictures[0], pictures[1])

    def test_focus_by_pixel(self):
        """The point that the pixel sees; it stays in focus when the camera moves."""
        by_point, by_pixel = self.striped(), self.striped()
        by_point.surfels.lens(coc=60, focus=(0, 0, 1))
        by_pixel.surfels.lens(coc=60, focus=(120, 90))
        np.testing.assert_allclose(by_pixel.surfels.splatter.GetFocusPoint(), (0, 0, 1), atol=0.03)
        for pl in (by_point, by_pixel):
            pl.camera.position = (0, 0, 9)
            pl.reset_camera_clipping_range()
        np.testing.assert_allclose(self.picture(by_pixel).astype(int), self.picture(by_point),
                                   atol=12)
        # Pixels count from the lower left corner: the lower right quarter of the window.
        by_pixel.camera_position = FRONT
        by_pixel.surfels.lens(focus=(150, 60))
        x, y, z = by_pixel.surfels.splatter.GetFocusPoint()
        self.assertTrue(x > 0.3 and y < -0.3 and z > 0.5, (x, y, z))
        self.assertAlmostEqual(np.linalg.norm((x, y, z)), 1, delta=0.03)

    def test_focus_on_the_surface_in_the_middle(self):
        """Not the middle of the sphere, at which the camera looks. It is found in the first frame, of the
        camera that this has, and of an actor where it was moved to."""
        pl = self.plotter()
        actor = pl.surfels.add(self.surfels)
        actor.position = (0, 0, -1)
        pl.surfels.lens(coc=60)
        pl.camera_position = [(0, 6, -1), (0, 0, -1), (0, 0, 1)]
        self.picture(pl)
        np.testing.assert_allclose(pl.surfels.splatter.GetFocusPoint(), (0, 1, -1), atol=0.03)
        pl.camera_position = FRONT
        pl.surfels.lens(coc=30)
        self.picture(pl)  # as it was
        np.testing.assert_allclose(pl.surfels.splatter.GetFocusPoint(), (0, 1, -1), atol=0.03)

    def test_focus_on_a_mesh_in_the_middle(self):
        """Where it hides the surfels, and not where they hide it or something is beside it."""
        for center, z in (((0, 0, 2), 2.5), ((0, 0, -3), 1), ((2, 0, 2), 1)):
            pl = self.plotter()
            pl.surfels.add(self.surfels)
            pl.add_mesh(pv.Cube(center=center, x_length=0.8, y_length=0.8))
            pl.surfels.lens(coc=60)
            self.picture(pl)
            np.testing.assert_allclose(pl.surfels.splatter.GetFocusPoint(), (0, 0, z), atol=0.03)

    def test_focus_of_a_camera(self):
        """A focal distance of the camera stays; of nothing but meshes its focal point is in focus."""
        for prepare in (lambda pl: pl.surfels.add(self.surfels) and pl.camera.SetFocalDistance(3),
                        lambda pl: pl.add_mesh(pv.Sphere())):
            pl = self.plotter()
            prepare(pl)
            pl.surfels.lens(coc=60)
            self.picture(pl)
            self.assertEqual(pl.surfels.splatter.GetFocusMode(), pl.surfels.splatter.FOCUS_CAMERA)

    def test_subplots_have_their_own(self):
        pl = pv.Plotter(shape=(1, 2), window_size=(480, 180))
        self.addCleanup(pl.close)
        for column, coc in ((0, 0), (1, 60)):
            pl.subplot(0, column)
            pl.camera_position = FRONT
            pl.surfels.add(self.surfels, "stripes", cmap="gray", show_scalar_bar=False)
            pl.surfels.lens(coc=coc, focus=(0, 0, -30))
        picture = self.picture(pl)
        left, right = picture[80:100, 110:130], picture[80:100, 350:370]
        self.assertLess(detail(right), 0.4 * detail(left))
        pl.surfels.lens(focus=(360, 90))
        np.testing.assert_allclose(pl.surfels.splatter.GetFocusPoint(), (0, 0, 1), atol=0.03)
        with self.assertRaisesRegex(ValueError, r"\(120, 90\) is no pixel of the active subplot"):
            pl.surfels.lens(focus=(120, 90))

    def test_a_button_stops_the_cells(self):
        """A still picture on a screen does not let who presses a button wait. Pictures that are only
        saved are whole."""
        pl = self.plotter()
        before = 0.3 * self.cloud.points + (0.3, 0.1, 2)
        pl.surfels.add(np.concatenate([self.cloud.points, before]))
        self.picture(pl)
        window, splatter = pl.render_window, pl.surfels.splatter
        splats = []
        for is_off_screen, is_pressed in ((True, False), (False, False), (False, True), (True, True)):
            window.GetOffScreenRendering = lambda: is_off_screen
            window.GetEventPending = lambda: is_pressed
            pl.surfels.lens(coc=0)  # the picture that is there would do
            time.sleep(0.25)  # VTK looks for events five times a second
            pl.surfels.lens(coc=60, focus=(0, 0, 1))
            splats.append(splatter.GetNumberOfSplats())
        whole, shown, stopped, saved = splats
        self.assertEqual([shown, saved], [whole, whole])
        self.assertLess(stopped, whole / 2)

    def test_meshes_are_seen_through_it(self):
        pl = self.striped()
        pl.add_mesh(pv.Cube(center=(0, 0, 3), x_length=0.4, y_length=0.4, z_length=0.1), color="white", lighting=False)
        sharp = self.picture(pl)
        pl.surfels.lens(coc=60, focus=(0, 0, 1))
        picture = self.picture(pl).astype(int)
        row = slice(95, 145)  # across the right edge of the cube
        self.assertGreater(np.abs(np.diff(sharp[90, row].astype(int), axis=0)).max(), 60)
        self.assertLess(np.abs(np.diff(picture[90, row], axis=0)).max(), 60)

    def test_meshes_have_no_edge_of_background(self):
        """With multisampling the background would shine through at the edges of meshes."""
        pl = self.plotter()
        pl.set_background("white")
        pl.surfels.add(self.surfels, color="red", lighting=False)
        pl.add_mesh(pv.Disc(center=(0, 0, 2), inner=0, outer=0.3, c_res=60), color="red", lighting=False)
        self.assertLess(self.picture(pl)[60:120, 90:150, 1:].max(), 10)

    def test_errors_say_what_to_do(self):
        pl = self.striped()
        lens = pl.surfels.lens
        cases = [
            (r"the pixel \(3, 3\) sees nothing, so the lens cannot focus on it; choose",
             lambda: lens(coc=9, focus=(3, 3))),
            (r"\(500, 3\) is no pixel of the active subplot in a window of 240 x 180",
             lambda: lens(focus=(500, 3))),
            ("is 3 behind the camera", lambda: lens(focus=(0, 0, 9))),
            ("coc is -1", lambda: lens(coc=-1)),
            (r"focus is \(nan, 0, 0\)", lambda: lens(focus=(np.nan, 0, 0))),
        ]
        for text, call in cases:
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                call()
        pl.enable_parallel_projection()
        with self.assertRaisesRegex(ValueError, "the camera has a parallel projection"):
            lens(focus=(120, 90))
        pl.disable_parallel_projection()
        pl.camera.position = (np.nan, 0, 6)
        with self.assertRaisesRegex(ValueError, r"the camera's position is \(nan, 0.0, 6.0\)"):
            lens(coc=9)

    def test_passes_of_pyvista(self):
        """Enabled before or after, they give way to that of the surfels."""
        pl = self.plotter()
        pl.enable_eye_dome_lighting()
        with self.assertWarnsRegex(UserWarning, "surfels replace the vtkEDLShading"):
            pl.surfels.add(self.surfels)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            pl.surfels.add(self.surfels)
            picture = self.picture(pl)
        pl.enable_shadows()
        with self.assertWarnsRegex(UserWarning, "surfels replace the vtkEDLShading"):
            np.testing.assert_array_equal(self.picture(pl), picture)
        self.assertIsInstance(pl.renderer.GetPass(), vtkSurfelSplattingPass)

    def test_depth_of_field_of_pyvista(self):
        pl = self.plotter()
        pl.enable_depth_of_field()
        with self.assertWarnsRegex(UserWarning, r"replace the vtkDepthOfFieldPass .*surfels.lens\(coc=20\)"):
            pl.surfels.add(self.surfels)

    def test_scalars_of_every_kind(self):
        """What add_mesh takes; the logarithm's range is that of clim."""
        height = self.surfels["height"]
        for name, options in {
                "logarithm": {"scalars": height + 1, "log_scale": True, "clim": (0.01, 2)},
                "steps": {"scalars": "height", "n_colors": 4},
                "booleans": {"scalars": height > 0},
                "integers": {"scalars": (5 * height).astype(int)},
                "a component": {"scalars": self.surfels.points, "component": 1},
                "NaN": {"scalars": np.where(height > 0, height, np.nan), "nan_color": "red"},
                "colors": {"scalars": np.abs(self.surfels.points), "rgb": True},
                "opacities": {"scalars": "height", "opacity": (height + 1) / 2},
                "a transfer function": {"scalars": "height", "opacity": "linear"}}.items():
            with self.subTest(name):
                pl = self.plotter()
                pl.surfels.add(self.surfels, show_scalar_bar=False, **options)
                self.assertGreater(self.picture(pl)[MIDDLE].max(), 30)
                pl.close()


if __name__ == "__main__":
    unittest.main()

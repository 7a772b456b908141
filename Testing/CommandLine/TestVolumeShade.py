# SPDX-License-Identifier: BSD-3-Clause
"""Volumes under light: --shade."""

import unittest

import numpy as np
from vtkmodules.vtkRenderingCore import vtkVolumeProperty

from surfelsplatting.clouds.volumes import add_smoothed, are_labels
from surfelsplatting.commandline.outputs import write_surfels
from surfelsplatting.transfer import MOST_OPACITY, QUIET, surface_look
from surfelsplatting.vtkmessages import VtkMessages
from toolcase import SMALL, ToolCase, arrays_of
from volumefiles import add, ball, make_image, write_image


class TestVolumeShade(ToolCase):
    def draw(self, *words):
        self.assertEqual(self.tool("render", *words, *SMALL, "-o", "out.exr"), "")

    def test_shade(self):
        """A ball is brightest where it faces the lamp at the camera: its material is that of
        vtkVolumeProperty. Hierarchies in files keep it, and nothing else is lit."""
        write_image("ball.vti", make_image(ball(61)))
        look = ("--opacity", "0.45:0,0.5:0.95", "--colormap", "gray", "--range", -1, 0.5)
        self.draw("ball.vti", *look)
        plain = self.read_rgba("out.exr")
        self.draw("ball.vti", *look, "--shade", "--hierarchy", "ball.vtp")
        shaded = self.read_rgba("out.exr")
        np.testing.assert_array_equal(shaded[..., 3], plain[..., 3])
        seen = plain[..., 3] > 0.9
        brightness = shaded[seen][:, 0] / plain[seen][:, 0]
        material = vtkVolumeProperty()
        most = material.GetAmbient() + material.GetDiffuse() + material.GetSpecular()
        self.assertAlmostEqual(shaded[24, 32, 0] / plain[24, 32, 0], most, delta=0.03)
        self.assertLess(brightness.max(), most + 0.01)
        self.assertLess(brightness.min(), 0.6)
        self.assertGreater(brightness.min(), material.GetAmbient())
        self.draw("ball.vtp")
        np.testing.assert_array_equal(self.read_rgba("out.exr"), shaded)
        self.assertIn("--shade has no effect with --unlit",
                      self.tool("render", "ball.vti", *look, "--shade", "--unlit", *SMALL, "-o",
                                "out.exr"))
        np.testing.assert_array_equal(self.read_rgba("out.exr"), plain)
        # The file has the normals.
        self.assertEqual(self.tool("render", "ball.vti", *look, "--shade", "--unlit", *SMALL,
                                   "--hierarchy", "ball.vtp", "-o", "out.exr"), "")
        self.draw("ball.vtp")
        np.testing.assert_array_equal(self.read_rgba("out.exr"), shaded)
        self.assertIn("--shade has no effect on ball.vtp, which is no volume",
                      self.tool("render", "ball.vtp", "--shade", *SMALL, "-o", "out.exr"))

    def test_normals_that_came_later(self):
        """Nodes have the normals that their leaves have now."""
        write_image("ball.vti", make_image(ball(31)))
        for options in ((), ("--shade",)):
            self.draw("ball.vti", *options, "--hierarchy", "ball.vtp")
            surfels = self.read_vtp("ball.vtp")
            add(surfels.GetPointData(), "GaussianNormal",
                np.tile(np.float32([0, 0, 1]), (surfels.GetNumberOfPoints(), 1)))
            write_surfels(surfels, "changed.vtp", VtkMessages())
            self.draw("changed.vtp")
            drawn = self.read_rgba("out.exr")
            for name in ("SurfelNodes", "SurfelLeaves"):
                surfels.GetFieldData().RemoveArray(name)
            write_surfels(surfels, "leaves.vtp", VtkMessages())
            self.draw("leaves.vtp")
            wanted = self.read_rgba("out.exr")
            self.assertGreater(wanted[..., :3].max(), 0.1)
            self.assertLess(np.abs(drawn - wanted).max(), 0.1, options)

    def test_shade_is_well_lit(self):
        """What the lamp at the camera faces is as bright as without light, or brighter: things whose
        scalars hardly change inside, with noise, and translucent ones. A shade that is chosen by
        --opacity stays as it is."""
        rng = np.random.default_rng(1)
        solid = np.clip(3 * ball(41), 0, 1)
        for values in (ball(41), 1000 * solid - 1000 + rng.normal(0, 10, solid.shape), 1 - solid,
                       np.hypot(*np.indices((41, 41, 41))[:2] - 20.0)):
            write_image("ball.vti", make_image(values))
            view = ("--view", "front", "--colormap", "gray")
            self.draw("ball.vti", *view, "--unlit")
            dim = self.read_rgba("out.exr")[24, 32]
            self.draw("ball.vti", *view, "--shade")
            lit = self.read_rgba("out.exr")
            self.assertGreater(lit[24, 32, 3], 0.95)
            self.assertGreater(lit[24, 32, 0], max(0.45, 0.95 * dim[0]))
            seen = lit[..., 3] > 0.9
            self.assertGreater(np.median(lit[seen][:, 0]), 0.3)

    def test_shade_of_a_cut(self):
        """What the volume's box cuts is as bright as a face, though it is the same inside but for
        noise."""
        rng = np.random.default_rng(1)
        solid = 1000 * np.clip(3 * ball(41), 0, 1) - 1000
        write_image("cut.vti", make_image((solid + rng.normal(0, 10, solid.shape))[:, 20:]))
        self.draw("cut.vti", "--view", "front", "--colormap", "gray", "--range", -2000, 0, "--shade")
        face = self.read_rgba("out.exr")[20:29, 28:37, 0]
        self.assertGreater(face.min(), 0.9)
        self.assertLess(np.ptp(face), 0.06)  # 0.19 to 0.43 by differences inside

    def test_shade_of_masks(self):
        """Steps of voxels are not lit, and the opacity is that of the data."""
        mask = (ball(61) > 0.1).astype(np.uint8)
        look = ("--view", "front", "--colormap", "gray", "--range", -1, 1, "--opacity", "0.1:0,0.5:0.99",
                *SMALL, "-o", "out.exr")
        write_image("soft.vti", make_image(np.clip(10 * (ball(61) - 0.05), 0, 1)))
        write_image("mask.vti", make_image(mask))
        pictures = {}
        for name, shade in (("soft", True), ("mask", True), ("mask", False)):
            said = self.tool("render", name + ".vti", *look, *(["--shade"] if shade else ["--unlit"]))
            self.assertEqual("the light takes them smoothed" in said, name == "mask" and shade, said)
            pictures[name, shade] = self.read_rgba("out.exr")
        lit, plain, soft = (pictures[key] for key in (("mask", True), ("mask", False), ("soft", True)))
        np.testing.assert_array_equal(lit[..., 3], plain[..., 3])
        seen = (plain[..., 3] > 0.99) & (soft[..., 3] > 0.99)
        light = lit[seen][:, 0] / plain[seen][:, 0]
        expected = soft[seen][:, 0] / soft[24, 32, 0]
        self.assertLess(np.std(light - expected * light.max()), 0.025)  # 0.058 with steps

    def test_labels(self):
        """Few values, all of them known."""
        random = np.random.default_rng(1)
        self.assertTrue(are_labels(random.integers(0, 16, 20000)))
        self.assertFalse(are_labels(random.integers(0, 17, 20000)))
        self.assertFalse(are_labels(np.append(np.zeros(15000), np.arange(30))))
        values = np.zeros((5, 5, 5))
        values[:, :, 2:] = 7
        image = make_image(values)
        name = add_smoothed(image)
        smoothed = arrays_of(image)[name].reshape(values.shape)
        self.assertEqual(name, "density smoothed")
        self.assertTrue((np.diff(smoothed) > 0.5).all())
        np.testing.assert_allclose(smoothed, np.broadcast_to(smoothed[0, 0], values.shape), rtol=1e-5)
        colors = make_image(values)
        four = np.zeros((125, 4), np.uint8)
        four[:, 3] = values.ravel()
        colors.GetPointData().SetScalars(add(colors.GetPointData(), "rgba", four))
        name = add_smoothed(colors)
        np.testing.assert_array_equal(arrays_of(colors)[name], smoothed.ravel())
        add(image.GetPointData(), "vtkGhostType", np.zeros(125, np.uint8))
        self.assertIsNone(add_smoothed(image))
        values[0, 0, 0] = np.nan
        self.assertIsNone(add_smoothed(make_image(values)))

    def test_surfaces_for_shade(self):
        """From the background's end to the border, whichever side the things are on."""
        random = np.random.default_rng(1)
        air, bone = random.normal(-1000, 10, 5000), random.normal(1000, 10, 2000)
        for sign in (1, -1):
            values = sign * np.concatenate([air, bone])
            limits = values.min(), values.max()
            points, colors = surface_look(values, limits)
            (begin, nothing), (end, most) = points[::sign]
            self.assertEqual((nothing, most), (0, MOST_OPACITY))
            self.assertAlmostEqual(sign * begin, -1000 + QUIET * 2080, delta=2080 / 64)
            self.assertAlmostEqual(sign * end, 0, delta=2080 / 64)
            # The background has the colour in the middle.
            self.assertAlmostEqual(sign * np.mean(colors), -1000, delta=2080 / 64)
            self.assertAlmostEqual(sign * colors[1], 1000, delta=50)
        self.assertEqual(surface_look(np.full(9, 7.0), (7.0, 7.0)), ([(7, MOST_OPACITY)], (7, 7)))


if __name__ == "__main__":
    unittest.main()

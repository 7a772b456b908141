# SPDX-License-Identifier: BSD-3-Clause
"""An option that changes nothing says so, and only then."""

import os
import subprocess
import tempfile
import unittest
from types import SimpleNamespace

from vtkmodules.vtkCommonCore import vtkFloatArray
from vtkmodules.vtkCommonDataModel import vtkPolyData

from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.commandline.noeffect import without_effect, without_effect_on
from surfelsplatting.views.cameras import asked_view
from toolcase import SMALL, TOOL, ToolCase, sphere, write_ply

NO_LENS = "without a lens; add one, for example --blur 10"
# Option, the other options, what stderr says after "OPTION has no effect "; None: nothing.
ON_A_HIERARCHY = (
    ("--focal-distance 3", "", NO_LENS),
    ("--focus-point 0 0 0.5", "--blur 0", NO_LENS),
    ("--focus-pixel 30 20", "--circle-of-confusion 0", NO_LENS),
    ("--focus-pixel 30 20", "--save-camera out.json", None),
    ("--lens-cells 7", "--blur 0", NO_LENS),
    ("--lens-cells 7", "--save-camera out.json", NO_LENS),
    ("--lens-cells 7", "--blur 4", None),
    ("--reference 4", "", NO_LENS),
    ("--reference 4", "--f-number 0.01", None),
    ("--colormap gray", "--unlit", "without --scalars"),
    ("--range 0 1", "", "without --scalars"),
    ("--range 0 1", "--scalars x", None),
    ("--opacity 0:0.5", "", "on ball.vtp, which is no volume"),
    ("--unit-distance 2", "", "on ball.vtp, which is no volume"),
    ("--capture-filter antialiased", "", "on ball.vtp, which is no capture"),
    ("--cleaning off", "", "on ball.vtp, which holds surfels already"),
    ("--sides two", "", "on ball.vtp, which holds surfels already"),
    ("--neighbors 20", "", "on ball.vtp, which holds surfels already"),
    ("--every 2", "", "on ball.vtp, which holds surfels already"),
)
ON_POINTS = (
    ("--cleaning off", "", None),
    ("--sides two", "", None),
    ("--every 2", "", None),
    ("--neighbors 20", "--blur 4 --lens-cells 2 --kernel gaussian", None),
)
ON_GAUSSIANS = tuple(
    (option, "", "on ball.vtp, which holds Gaussians in space")
    for option in ("--every 2", "--cleaning off", "--sides two", "--neighbors 20",
                   "--points-per-part 2000"))
ON_GAUSSIANS += (("--linear-light", "", "on ball.vtp, whose colours are harmonics"),
                 ("--linear-light", "--scalars x", None),
                 ("--lit", "", "on ball.vtp, whose colours are harmonics"),
                 ("--capture-filter classic", "", None),
                 ("--opacity 0:0.5", "", "on ball.vtp, which is no volume"))
ON_A_VOLUME = tuple(
    (option, "", "on ball.vtp, which is a volume")
    for option in ("--every 2", "--cleaning off", "--sides two", "--neighbors 20",
                   "--points-per-part 2000"))
ON_A_DEPTH_IMAGE = (("--every 2", "", "on ball.vtp, which is a depth image"),
                    ("--neighbors 20", "", None))
ON_A_VOLUME += (("--opacity 0:0.5", "--unit-distance 2 --range 0 1 --colormap gray", None),
                ("--scalars x", "", None),
                ("--lit", "", "without --shade"),
                ("--lit", "--shade", None),
                ("--capture-filter antialiased", "", "on ball.vtp, which is no capture"))


class TestEffects(ToolCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        write_ply(os.path.join(cls.folder, "ball.ply"), *sphere())
        subprocess.run([TOOL, "render", "ball.ply", "-o", "out.png", "--hierarchy", "ball.vtp"],
                       check=True, cwd=cls.folder)

    def setUp(self):
        super().setUp()
        for name in ("ball.ply", "ball.vtp"):
            os.symlink(os.path.join(self.folder, name), name)

    def check(self, holds, option, others, reason):
        data = vtkPolyData()
        if holds == "Gaussians":
            for name in ("GaussianHarmonics", "GaussianOpacity"):
                array = vtkFloatArray()
                array.SetName(name)
                data.GetPointData().AddArray(array)
        cloud = SimpleNamespace(is_surfels=holds == "surfels", is_gaussians=holds == "Gaussians",
                                is_volume=holds == "a volume", data=data,
                                is_drawable=holds in ("surfels", "Gaussians"),
                                columns=640 if holds == "a depth image" else 0, image=None)
        arguments = parse_arguments(["render", "ball.vtp", *option.split(), *others.split(),
                                     "-o", "out.png"])
        texts = without_effect(arguments, asked_view(arguments))
        texts += without_effect_on(cloud, arguments)
        self.assertEqual(len(texts), 0 if reason is None else 1, (texts, option, others))
        for text in texts:
            self.assertIn(f"{option.split()[0]} has no effect {reason}", text, others)

    def test_on_a_hierarchy(self):
        for option, others, reason in ON_A_HIERARCHY:
            self.check("surfels", option, others, reason)

    def test_on_points(self):
        for option, others, reason in ON_POINTS:
            self.check("points", option, others, reason)

    def test_on_gaussians(self):
        for option, others, reason in ON_GAUSSIANS:
            self.check("Gaussians", option, others, reason)

    def test_on_a_depth_image(self):
        for option, others, reason in ON_A_DEPTH_IMAGE:
            self.check("a depth image", option, others, reason)

    def test_on_a_volume(self):
        for option, others, reason in ON_A_VOLUME:
            self.check("a volume", option, others, reason)

    def test_they_are_printed(self):
        said = self.tool("render", "ball.vtp", *SMALL, "--sides", "two", "--lens-cells", "3",
                         "-o", "out.png")
        self.assertEqual(self.code, 0)
        self.assertEqual(said.splitlines(), [
            f"surfelsplat: warning: --lens-cells has no effect {NO_LENS}",
            "surfelsplat: warning: --sides has no effect on ball.vtp, which holds surfels already; "
            "give the points that they were made of"])

    def test_several_at_once(self):
        said = self.tool("render", "ball.vtp", *SMALL, "--sides", "two", "--cleaning", "off",
                         "-o", "out.png")
        self.assertIn("--cleaning and --sides have no effect on ball.vtp", said)

    def test_lens_that_blurs_nothing(self):
        """A lens of 2 px at infinity blurs a ball by a fraction of that."""
        said = self.tool("render", "ball.vtp", *SMALL, "--circle-of-confusion", "2",
                         "-o", "out.png")
        self.assertRegex(said, r"warning: the lens blurs nothing .* more than 0\.\d+ px; .* needs$")
        said = self.tool("render", "ball.vtp", *SMALL, "--f-number", "2.8", "-o", "out.png")
        self.assertRegex(said, "blurs nothing .*; --f-number takes the units of the cloud for metres$")


if __name__ == "__main__":
    unittest.main()

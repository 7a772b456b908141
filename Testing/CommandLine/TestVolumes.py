# SPDX-License-Identifier: BSD-3-Clause
"""Volumes: from .vti and other images to pictures."""

import os
import unittest
import unittest.mock

import numpy as np
from vtkmodules.vtkCommonDataModel import vtkImageData

from surfelsplatting.clouds.cloud import Cloud
from surfelsplatting.clouds.volumes import coarsened, volume_of
from surfelsplatting.commandline.commands import parse_arguments
from surfelsplatting.commandline.scan import Scan
from surfelsplatting.commandline.volume import classify
from surfelsplatting.problems import UserProblem
from surfelsplatting.transfer import DEPTH, QUIET, automatic_opacity
from toolcase import BUSY, IN_MIDDLE, SMALL, ToolCase, arrays_of, caught, read_json, wait_for, write
from volumefiles import META, NRRD, add, ball, make_image, write_image, write_raw


def classified(image, *options):
    arguments = parse_arguments(["render", "a.vti", "-o", "out.png", *options])
    arguments.volume_scalars = arguments.scalars
    return classify(Cloud(image), arguments)


class TestVolumes(ToolCase):
    def draw(self, *words):
        self.assertEqual(self.tool("render", *words, *SMALL, "-o", "out.exr"), "")

    def test_raw_data_cut_short(self):
        """VTK fills up what is missing, with no word or one of its own."""
        values = ball().ravel()
        detached = META.replace("LOCAL", "ball.raw"), NRRD.replace("raw\n", "raw\ndata file: ball.raw\n")
        for path, header in (("a.mha", META), ("b.nrrd", NRRD), ("c.mhd", detached[0]),
                             ("d.nhdr", detached[1]), ("e.nrrd", NRRD.replace("\n", "\r\n"))):
            with self.subTest(path):
                write_raw(path, header, values[:0 if "ball.raw" in header else None])
                write_raw("ball.raw", "", values)
                self.draw(path)
                data = "ball.raw" if "ball.raw" in header else path
                with open(data, "r+b") as file:
                    file.truncate(os.path.getsize(data) - 100)
                self.refuse("render", path, "-o", "out.png",
                            says=f"{path} promises 8788 bytes of scalars, but {data} has 8688")

    def test_damaged_headers(self):
        """One line of ours, and nothing from the library, whose words are in it."""
        values = ball().ravel()
        zipped = META.replace("ElementData", "CompressedData = True\nElementData")
        for header, says in ((META.replace("13 13 13", "13 x 13"), "ElementType required"),
                             (META.replace("NDims = 3\n", ""), "DimSize defined prior"),
                             (META.replace("LOCAL", "none.raw"), "Cannot open data file"),
                             (META.replace("LOCAL", "LIST\na.raw\nb.raw"), "cannot open slice"),
                             (META.replace("MET_FLOAT", "MET_NONE"), "Unknown data type"),
                             ("hello\n", "NDims required"), (zipped, "Uncompress failed")):
            write_raw("a.mha", header, values)
            self.refuse("render", "a.mha", "-o", "out.png", says=("a.mha is", says))

    def test_numbers_as_text(self):
        """The last one may end the file."""
        text = " ".join(f"{value:.9g}" for value in ball().ravel())
        for end in ("", "\n"):
            write("a.mha", META.replace("ElementData", "BinaryData = False\nElementData", 1) + text + end)
            self.draw("a.mha")
        write("a.mha", META.replace("ElementData", "BinaryData = False\nElementData", 1)
                       + text.rsplit(maxsplit=10)[0])
        said = self.tool("render", "a.mha", "-o", "out.png")
        self.assertIn("a.mha promises 2197 scalars, but a.mha has 2187: it was cut short", said)

    def test_coarse_colours_at_a_border(self):
        """What is transparent does not make them darker."""
        image = vtkImageData()
        image.SetDimensions(4, 2, 2)
        colors = np.tile(np.uint8([200, 100, 40, 255]), (16, 1))
        colors[1::4] = 0
        add(image.GetPointData(), "RGBA", colors)
        image.GetPointData().SetActiveScalars("RGBA")
        coarse = arrays_of(coarsened(volume_of(image), 2))["RGBA"]
        np.testing.assert_allclose(coarse[:, :3], np.tile([[200, 100, 40]], (2, 1)) / 255, atol=1e-6)
        np.testing.assert_allclose(coarse[:, 3], [127.5, 255])

    def test_picture_without_options(self):
        """Whatever the file: the ball in the middle, and its surroundings transparent."""
        image = make_image(ball())
        pictures = []
        values = arrays_of(image)["density"]
        write_image("ball.vti", image)
        write_image("ball.vtk", image)
        write_raw("ball.mha", META, values)
        write_raw("ball.nrrd", NRRD, values)
        for path in ("ball.vti", "ball.vtk", "ball.mha", "ball.nrrd"):
            self.draw(path)
            pictures.append(self.read_rgba("out.exr"))
            np.testing.assert_array_equal(pictures[-1], pictures[0])
        alpha = pictures[0][..., 3]
        self.assertGreater(alpha[24, 32], 0.7)
        self.assertEqual(alpha[:, :8].max(), 0)
        # The camera sees the ball, not the empty box around it.
        self.assertGreater((alpha > 0.05).any(axis=1).sum(), 30)

    def test_opacity_and_colours(self):
        """A homogeneous cube has the opacity 1 - (1 - o)^(way / unit distance), within the 4.4 % that
        the Gaussians of vtkVolumeSplatting add up to."""
        write_image("cube.vti", make_image(np.full((9, 9, 9), 7, np.int16), 0.5))
        self.draw("cube.vti", "--position", 2, -60, 2, "--focal-point", 2, 2, 2, "--view-up", 0, 0, 1,
                  "--view-angle", 6, "--opacity", "0:0,14:0.4", "--unit-distance", 2, "--range", 0,
                  10, "--colormap", "gray")
        red, green, blue, alpha = self.read_rgba("out.exr")[24, 32]
        self.assertAlmostEqual(np.log(1 - alpha), 2 * np.log(0.8), delta=0.044 * 2 * -np.log(0.8))
        for color in (red, green, blue):
            self.assertAlmostEqual(color / alpha, 0.7, delta=0.5 / 255 + 1e-6)  # stored in bytes

    def test_automatic_opacity(self):
        """The background is transparent, both sides of it are not, and the optical depth is DEPTH."""
        random = np.random.default_rng(1)
        values = np.concatenate([np.full(5000, 100.0), random.uniform(0, 400, 3000)])
        points = automatic_opacity(values, (0.0, 400.0), 20)
        scalars, opacities = np.transpose(points)
        self.assertTrue((np.diff(scalars) > 0).all())
        self.assertEqual(list(opacities == 0), [False, True, True, False])
        self.assertTrue(scalars[1] < 100 < scalars[2])
        self.assertAlmostEqual(scalars[2] - scalars[1], 2 * QUIET * 400)
        self.assertGreater(opacities[3], opacities[0])
        depth = 20 * -np.log1p(-np.interp(values, scalars, opacities)).mean()
        self.assertAlmostEqual(depth, DEPTH, delta=0.02 * DEPTH)  # bins of the histogram
        # It is the same at another resolution and in other units.
        finer = np.transpose(automatic_opacity(values * 10, (0.0, 4000.0), 40))
        np.testing.assert_allclose(finer[0], scalars * 10)
        depth = 40 * -np.log1p(-np.interp(values * 10, *finer)).mean()
        self.assertAlmostEqual(depth, DEPTH, delta=0.02 * DEPTH)

    def test_automatic_opacity_of_odd_scalars(self):
        (scalar, opacity), = automatic_opacity(np.full(10, 7.0), (7.0, 7.0), 30)
        self.assertEqual(scalar, 7)
        self.assertAlmostEqual(-30 * np.log1p(-opacity), DEPTH, delta=0.002)  # three digits
        for low, high in ((-1e308, 1e308), (0.0, 5e-324), (1e9, 1e9 + 1e-6)):
            points = np.array(automatic_opacity(np.array([low, low, high]), (low, high), 30))
            self.assertTrue(np.isfinite(points).all())
            self.assertTrue((points[:, 1] >= 0).all() and (points[:, 1] < 1).all())

    def test_round_opacities(self):
        """They are to be read and typed."""
        wavelet = 40 + 130.7 * ball(31).ravel()
        for values in (wavelet, wavelet * 1e-9, wavelet + 5e6, -wavelet):
            image = make_image(values.reshape(31, 31, 31).astype("f8"))
            for options in ((), ("--shade",)):
                found = classified(image, *options)
                self.assertNotIn("e-1", found.opacity_text)
                for (scalar, opacity), text in zip(found.opacities, found.opacity_text.split(",")):
                    self.assertEqual(text.split(":")[1], f"{opacity:.3g}")
                    self.assertEqual(float(text.split(":")[0]), scalar)
                    self.assertLess(len(text), 18)
                self.assertTrue(any(opacity == 0 for _, opacity in found.opacities))

    def test_colours_of_the_image(self):
        """Three components and an opacity, three alone, and as fractions by name."""
        n = 21
        axis = np.linspace(-1, 1, n)
        z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
        inside = x * x + y * y + z * z < 0.6
        colors = np.stack([np.full(x.shape, 220), np.where(x > 0, 200, 20), np.full(x.shape, 30)],
                          axis=-1)
        rgba = np.concatenate([colors, np.where(inside, 180, 0)[..., None]], axis=-1)
        black = np.where(inside[..., None], colors, 0)
        header = NRRD.replace("float", "unsigned char").replace("dimension: 3", "dimension: 4")
        write("rgba.nrrd", header.replace("13", f"{n}").replace("sizes:", "sizes: 4").encode()
                       + rgba.astype(np.uint8).tobytes())
        for path, name, values in (("rgba.vti", "ImageScalars", rgba.astype(np.uint8)),
                                   ("rgb.vti", "ImageScalars", black.astype(np.uint8)),
                                   ("real.vti", "RGBA", rgba / 255)):
            image = vtkImageData()
            image.SetDimensions(n, n, n)
            add(image.GetPointData(), name, values.reshape(n**3, -1))
            image.GetPointData().SetActiveScalars(name)
            write_image(path, image)
        for path in ("rgba.vti", "rgba.nrrd", "rgb.vti", "real.vti"):
            with self.subTest(path):
                self.draw(path, "--view", "front", "--opacity", "70:0,75:0.9")
                picture = self.read_rgba("out.exr")
                for column, color in ((24, (220, 20, 30)), (40, (220, 200, 30))):
                    seen = picture[24, column]
                    self.assertGreater(seen[3], 0.98)
                    # Those of rgb.vti go over into black.
                    np.testing.assert_allclose(seen[:3] / seen[:3].max(),
                                               np.array(color) / max(color), atol=0.06)
                    self.assertGreater(seen[0], 0.6)
                self.assertEqual(picture[2, 2, 3], 0)
                self.draw(path, "--view", "front")  # without options it is seen, too
                self.assertGreater(self.read_rgba("out.exr")[24, 32, 3], 0.5)
        said = self.tool("render", "rgba.vti", *SMALL, "--colormap", "gray", "-o", "out.png")
        self.assertIn("--colormap has no effect on rgba.vti, which has colours", said)
        said = self.tool("render", "rgba.vti", *SMALL, "--range", 0, 9, "--opacity", "0:0,9:1", "-o",
                         "out.png")
        self.assertIn("--range has no effect on rgba.vti, which has colours", said)
        # What is coarser keeps its colours.
        with unittest.mock.patch("surfelsplatting.commandline.volume.MOST_GAUSSIANS", 500):
            self.tool("render", "rgba.vti", "--view", "front", *SMALL, "-o", "out.exr")
        red, green, blue, alpha = self.read_rgba("out.exr")[24, 40]
        np.testing.assert_allclose(np.array([red, green, blue]) / alpha,
                                   np.array([220, 200, 30]) / 255, atol=0.06)

    def test_opacities_of_colours(self):
        """Without opacity the luminance tells the background; an opacity of 0 is the background
        however rare it is, and one of 0 everywhere shows nothing."""
        values = np.full((5, 5, 5, 4), 200, np.uint8)
        values[0, 0, 0, 3] = 0
        image = make_image(np.zeros((5, 5, 5)))
        image.GetPointData().SetScalars(add(image.GetPointData(), "c", values.reshape(-1, 4)))
        found = classified(image)
        self.assertEqual((found.limits, found.opacities[0]), ((0, 200), (0, 0)))
        self.assertGreater(found.opacities[-1][1], 0.1)
        values[..., 3] = 0
        image.GetPointData().SetScalars(add(image.GetPointData(), "c", values.reshape(-1, 4)))
        self.assertIn("all of it is transparent: the fourth component of 'c' is from 0 to 0",
                      self.tool("render", write_image("a.vti", image), "-o", "out.png"))
        values[:2] = 0, 250, 0, 0
        image.GetPointData().SetScalars(add(image.GetPointData(), "c", values[..., :3].reshape(-1, 3)))
        self.assertEqual(classified(image).limits, (round(250 * 0.59), 200))

    def test_focus(self):
        """Where half of what is seen has been gathered, however translucent it is."""
        fog = np.zeros((9, 9, 41))
        fog[...] = 1
        write_image("fog.vti", make_image(fog))
        camera = ("--position", -100, 4, 4, "--focal-point", 20, 4, 4, "--view-up", 0, 0, 1,
                  "--view-angle", 3)
        for depth in (0.3, 4.0):
            # T falls as exp(-depth x / 40): half of 1 - T(40) at this x.
            half = -40 / depth * np.log(1 - (1 - np.exp(-depth)) / 2)
            look = ("--opacity", f"0:0,1:{1 - np.exp(-depth / 40)}", "--unit-distance", 1)
            self.assertEqual(self.tool("render", "fog.vti", *camera, *look, *SMALL, "--focus-pixel", 32,
                                       24, "--blur", 3, "--save-camera", "a.json", "-o", "out.png"), "")
            view = read_json("a.json")
            self.assertAlmostEqual(view["focusPoint"][0], half, delta=1.5)
            self.assertGreater(view["circleOfConfusion"], 3)
            self.render("fog.vti", *look, "--view", "left", *SMALL, "--blur", 3, "--save-camera", "a.json",
                        "-o", "out.png")
            view = read_json("a.json")
            self.assertAlmostEqual(view["position"][0] + view["focalDistance"], half, delta=2)
        said = self.tool("render", "fog.vti", *camera, *SMALL, "--opacity", "0:0,1:3e-4", "--blur", 3,
                         "--focus-pixel", 32, 24, "-o", "out.png")
        self.assertIn("the camera sees nothing", said)

    def test_which_array(self):
        image = vtkImageData()
        image.SetDimensions(3, 4, 5)
        vectors = np.arange(180, dtype=float).reshape(60, 3)
        add(image.GetPointData(), "flow", vectors)
        add(image.GetPointData(), "heat", np.arange(60))
        add(image.GetCellData(), "facies", np.arange(24))
        self.assertEqual(classified(image).scalars, "heat")
        flow = classified(image, "--scalars", "flow")
        self.assertEqual(flow.limits, (np.linalg.norm(vectors[0]), np.linalg.norm(vectors[-1])))
        # Cells become points at their centres.
        facies = classified(image, "--scalars", "facies")
        self.assertEqual((facies.limits, facies.volume.GetDimensions()), ((0, 23), (2, 3, 4)))
        self.assertEqual(facies.volume.GetBounds(), (0.5, 1.5, 0.5, 2.5, 0.5, 3.5))
        with self.assertRaisesRegex(UserProblem, "no scalars 'x'; there are heat, flow, facies"):
            volume_of(image, "x")
        self.assertEqual(self.tool("render", write_image("a.vti", image), *SMALL, "-o", "out.png"), (
            "surfelsplat: a.vti: shows 'heat' of heat, flow, facies; --scalars chooses another\n"))

    def test_hidden_and_invalid_values_do_not_count(self):
        values = ball()
        values[0, 0, :2] = np.nan, np.inf
        image = make_image(values)
        hidden = np.zeros(values.shape, np.uint8)
        hidden[:, :, 6:] = 2
        values[:, :, 6:] = -9999
        add(image.GetPointData(), "vtkGhostType", hidden.ravel())
        self.assertEqual(classified(image).limits, (0, values[6, 6, 5]))
        cells = make_image(values)
        blank = np.zeros((12, 12, 12), np.uint8)
        blank[:, :, 5:] = 32
        add(cells.GetCellData(), "vtkGhostType", blank.ravel())
        self.assertEqual(classified(cells).limits, (0, values[6, 6, 5]))
        found = {}
        for name, data in (("points", image), ("cells", cells)):
            arguments = parse_arguments(["view", write_image(name + ".vti", data)])
            found[name] = Scan(arguments).viewer.actor.GetBounds()
            self.assertLess(found[name][1], 5.5)
        np.testing.assert_allclose(found["points"], found["cells"])

    def test_errors(self):
        nan = make_image(np.full((3, 3, 3), np.nan))
        empty = vtkImageData()
        empty.SetDimensions(3, 3, 3)
        flat = make_image(ball(5))
        flat.SetSpacing(1, 0, 1)
        for image, options, says in (
                (nan, (), "no scalar of 'density' is finite and not hidden"),
                (empty, (), "the volume has no scalars"),
                (flat, (), "a.vti: The cells of the image have no volume"),
                (make_image(ball(5)), ("--opacity", "0:0"), "all of it is transparent")):
            self.refuse("render", write_image("a.vti", image), *options, "-o", "out.png", says=says)
        for text, says in (("1", "is not SCALAR:OPACITY"), ("1:2", "not from 0 to 1"),
                           ("1:nan", "is not SCALAR:OPACITY"), ("1:0,1:1", "two opacities")):
            with self.assertRaisesRegex(UserProblem, says):
                parse_arguments(["render", "a.vti", "-o", "out.png", "--opacity", text])

    def test_coarser(self):
        """Means of what can be seen, at the same places."""
        values = np.arange(7 * 6 * 5, dtype=np.int16).reshape(7, 6, 5)
        image = make_image(values, 0.5)
        image.SetExtent(2, 6, 0, 5, 1, 7)
        hidden = np.zeros(values.shape, np.uint8)
        hidden[:2, :2, :2] = 2
        hidden[0, 2, 0] = 2
        add(image.GetCellData(), "vtkGhostType", np.zeros(7))  # damaged, and ignored
        add(image.GetPointData(), "vtkGhostType", hidden.ravel())
        coarse = coarsened(volume_of(image), 2)
        self.assertEqual(coarse.GetDimensions(), (3, 3, 4))
        self.assertEqual(coarse.GetBounds(), (1.25, 3.25, 0.25, 2.25, 0.75, 3.75))
        means = arrays_of(coarse)["density"].reshape(4, 3, 3)
        self.assertTrue(np.isnan(means[0, 0, 0]))
        self.assertEqual(means[1, 1, 1], values[2:4, 2:4, 2:4].mean())
        self.assertEqual(means[3, 2, 2], values[6:, 4:, 4:].mean())
        self.assertEqual(means[0, 1, 0], values[:2, 2:4, :2].ravel()[1:].mean())

    def test_large(self):
        """It is drawn coarser, and says so."""
        write_image("a.vti", make_image(np.indices((12, 12, 12))[2].astype(float)))
        with unittest.mock.patch("surfelsplatting.commandline.volume.MOST_GAUSSIANS", 200):
            said = self.tool("render", "a.vti", "--position", 6, -40, 6, *SMALL, "-o", "out.exr")
        self.assertIn("a.vti: is large and drawn as 6 x 6 x 6, the means of 2 x 2 x 2 points", said)
        coarse = self.read_rgba("out.exr")[..., 3].sum()
        self.draw("a.vti", "--position", 6, -40, 6)
        # Half a block is lost at each border: (10 / 11)^2 = 0.83 of the area.
        ratio = coarse / self.read_rgba("out.exr")[..., 3].sum()
        self.assertTrue(0.8 < ratio < 0.9, ratio)

    def test_info(self):
        image = make_image(np.where(ball() > 0.9, 1e6, ball()), 0.25)
        report = self.report(write_image("a.vti", image))
        self.assertEqual((report["holds"], report["points"], report["scalars"]),
                         ("volume", 13**3, "density"))
        self.assertEqual(report["bounds"]["z"], [0, 3])
        self.assertAlmostEqual(report["unit_distance"], 0.25 * 3**0.5)
        tries = [suggestion["options"] for suggestion in report["suggestions"]]
        self.assertTrue(any(text.startswith("--range 0 ") for text in tries), tries)
        # What it suggests is what is done.
        text, = (text.split()[1] for text in tries if text.startswith("--opacity"))
        np.testing.assert_allclose(classified(image, "--opacity", text).opacities,
                                   report["opacity"], rtol=5e-3)  # digits of the text
        self.assertIn("a volume of 13 x 13 x 13", self.info("a.vti"))

    def test_film(self):
        write_image("ball.vti", make_image(ball()))
        said = self.tool("film", "ball.vti", "-o", "frames", "--frames", "2", *SMALL, "--blur", "3")
        self.assertRegex(said, rf"\A{IN_MIDDLE.pattern}\Z")
        self.assertGreater(np.ptp(self.read_png("frames/0001.png").astype(int)), 100)

    def test_window_and_page(self):
        """They show the Gaussians at once, and the hierarchy that another process makes of them."""
        image = make_image(ball())
        add(image.GetPointData(), "other", np.zeros(13**3))
        image.GetPointData().SetActiveScalars(None)
        write_image("ball.vti", image)
        for options in ((), ("--scalars", "density")):
            with caught(2) as said:
                scan = Scan(parse_arguments(["web", "ball.vti", *options]))
            self.assertEqual("shows 'density'" in said[0], not options)
            self.check_estimation(scan)

    def check_estimation(self, scan):
        shown = scan.viewer.actor.GetMapper().GetInput()
        self.assertFalse(scan.viewer.is_preview)
        found = []

        def is_done():
            found.append(estimation.poll())
            return found[-1] is not None

        with caught(2) as said:
            estimation = scan.start_estimation()
            self.addCleanup(estimation.close)
            wait_for(is_done, "the hierarchy")
        self.assertEqual(BUSY.sub("", said[0]), "")  # this process has said it
        scan.viewer.show_surfels(found[-1])
        self.assertEqual(sorted(map(tuple, arrays_of(found[-1])["RGB"])),
                         sorted(map(tuple, arrays_of(shown)["RGB"])))


if __name__ == "__main__":
    unittest.main()

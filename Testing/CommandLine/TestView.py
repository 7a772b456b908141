# SPDX-License-Identifier: BSD-3-Clause
"""surfelsplat view: a window with a real mouse and real keys, in a display of its own."""

import math
import os
import shutil
import signal
import subprocess
import sys
import time
import unittest
from dataclasses import replace

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter

import captures
from toolcase import PATIENCE, TOOL, ToolCase, content_of, read_json, sphere, wait_for, write_ply

WIDTH, HEIGHT = 400, 300
LOOK = ["--position", "0", "0", "6", "--focal-point", "0", "0", "0", "--view-up", "0", "1", "0"]


def estimations():
    """Numbers of this test's processes that estimate surfels: those in its folder."""
    found = []
    for number in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{number}/cmdline", "rb") as file:
                if (b"surfelsplatting.commandline.estimationprocess" in file.read()
                        and os.path.samefile(f"/proc/{number}/cwd", os.curdir)):
                    found.append(int(number))
        except OSError:
            pass  # it has just ended
    return found


def xdotool(*words):
    subprocess.run(["xdotool", *map(str, words)], check=True, capture_output=True)


class Window:
    """A running surfelsplat view."""

    def __init__(self, *words):
        self.log = open("view.log", "w+", encoding="utf-8")
        self.process = subprocess.Popen([TOOL, "view", *words, "-v"], stderr=self.log)
        wait_for(lambda: "is open" in self.read_log() or self.process.poll() is not None,
                 "the window")
        if self.process.poll() is None:
            found = subprocess.run(["xdotool", "search", "--sync", "--name", "surfelsplat"],
                                   check=True, capture_output=True, text=True, timeout=PATIENCE)
            self.name = found.stdout.split()[0]
            self.move_to(5, 5)  # without a window manager the keys go where the mouse is

    def read_log(self):
        with open("view.log", encoding="utf-8") as file:
            return file.read()

    def wait_for_surfels(self):
        wait_for(lambda: "surfels are shown" in self.read_log() or self.process.poll() is not None,
                 "the surfels")

    def move_to(self, x, y):
        xdotool("mousemove", "--window", self.name, x, y)

    def click(self, x, y):
        self.move_to(x, y)
        xdotool("click", 1)

    def drag(self, button, right, down):
        self.move_to(WIDTH // 2, HEIGHT // 2)
        # No movement follows the release: VTK takes the last of several for the only one.
        xdotool("mousedown", button)
        for part in (1, 2, 3, 4):
            self.move_to(WIDTH // 2 + right * part // 4, HEIGHT // 2 + down * part // 4)
        xdotool("mouseup", button)

    def key(self, *names):
        for name in names:
            xdotool("key", name)

    def save(self, number):
        """Presses s. -> the camera file's content"""
        self.key("s")
        wait_for(lambda: f"scan-{number}.camera.json saved" in self.read_log(), "saving")
        return read_json(f"scan-{number}.camera.json")

    def wait(self):
        return self.process.wait(PATIENCE)


def unlike(one, two):
    """The keys that differ."""
    return {key for key in {*one, *two} if one.get(key) != two.get(key)}


class ViewCase(ToolCase):
    def setUp(self):
        super().setUp()
        points, colors = sphere(20_000)
        write_ply("scan.ply", points, colors)

    def open(self, *words):
        window = Window("scan.ply", *LOOK, "--size", str(WIDTH), str(HEIGHT), *words)
        self.addCleanup(window.log.close)
        self.addCleanup(window.process.kill)
        return window

    def render(self, *words):
        super().render("scan.ply", *words, "-o", "rendered.png")
        return content_of("rendered.png")

    def check_saved(self, number):
        """The picture is what render makes of the camera file, to the last byte."""
        self.assertEqual(content_of(f"scan-{number}.png"),
                         self.render("--camera", f"scan-{number}.camera.json"))


class TestWindow(ViewCase):
    def test_focus_and_aperture(self):
        window = self.open()
        window.wait_for_surfels()
        first = window.save(1)
        self.assertEqual((first["size"], first["circleOfConfusion"]), ([WIDTH, HEIGHT], 0))
        self.check_saved(1)
        window.click(160, 110)
        window.key(*["Up"] * 5)
        second = window.save(2)
        self.assertEqual(unlike(first, second), {"focusPoint", "circleOfConfusion"})
        self.assertEqual(second["circleOfConfusion"], 16)
        self.assertAlmostEqual(math.hypot(*second["focusPoint"]), 1, delta=0.02)
        self.check_saved(2)
        # As --focus-pixel puts it, to the last bit.
        focused = self.render("--camera", "scan-1.camera.json", "--focus-pixel", "160", "110",
                              "--circle-of-confusion", "16")
        self.assertEqual(content_of("scan-2.png"), focused)
        window.click(5, 5)  # sees nothing
        window.key("Down", "l")
        third = window.save(3)
        self.assertEqual(unlike(second, third), {"circleOfConfusion"})
        self.assertEqual(third["circleOfConfusion"], 0)
        window.key("l")  # as open as it was
        self.assertEqual(window.save(4)["circleOfConfusion"], 11)
        window.key("q")
        self.assertEqual(window.wait(), 0)
        self.assertEqual(sorted(os.listdir(".")), sorted(
            ["rendered.png", "scan.ply", "view.log"]
            + [f"scan-{number}{end}" for number in (1, 2, 3, 4)
               for end in (".camera.json", ".png")]))

    def test_blur(self):
        """It is that of the surfels, not of the points that are shown before, unless the aperture was
        changed meanwhile."""
        window = self.open("--blur", "30")  # 150 px of infinity, which is beyond the key Up
        window.wait_for_surfels()
        super().render("scan.ply", *LOOK, "--size", WIDTH, HEIGHT, "--blur", "30", "-o", "asked.png",
                       "--save-camera", "asked.json")
        self.assertAlmostEqual(window.save(1)["circleOfConfusion"],
                               read_json("asked.json")["circleOfConfusion"], places=3)
        window.key("l", "l")
        self.assertAlmostEqual(window.save(2)["circleOfConfusion"],
                               read_json("asked.json")["circleOfConfusion"], places=3)
        window.key("q")
        self.assertEqual(window.wait(), 0)  # no other test finds it

    def test_moving(self):
        window = self.open()
        window.wait_for_surfels()
        window.click(200, 100)
        start = window.save(1)
        window.drag(1, 80, 40)
        turned = window.save(2)
        self.assertEqual(unlike(start, turned), {"position"})  # the plane stays with the point
        self.assertAlmostEqual(math.hypot(*turned["position"]), 6, delta=1e-6)
        # The mouse takes the front with it: to the right, so that the camera goes to the left.
        self.assertLess(turned["position"][0], -1)
        self.assertGreater(turned["position"][1], 1)
        self.check_saved(2)
        window.drag(2, 50, 0)
        moved = window.save(3)
        self.assertEqual(unlike(turned, moved), {"position", "focalPoint"})
        window.move_to(200, 150)
        xdotool("click", 4)
        nearer = window.save(4)
        self.assertEqual(unlike(moved, nearer), {"position"})
        arms = [math.dist(view["position"], view["focalPoint"]) for view in (moved, nearer)]
        self.assertLess(arms[1], 0.95 * arms[0])
        window.key("r")
        self.assertEqual(unlike(window.save(5), start), {"focusPoint"})
        window.key("q")
        self.assertEqual(window.wait(), 0)

    def test_capture(self):
        captures.write_ply("scan.ply", captures.torus(3000))
        window = self.open()
        wait_for(lambda: "3000 Gaussians are shown" in window.read_log(), "the hierarchy")
        window.click(200, 250)  # 1 below the middle, at the front of the torus, which is 0.4 thick
        window.key(*6 * ["Up"])
        saved = window.save(1)
        self.assertGreater(saved["circleOfConfusion"], 0)
        self.assertAlmostEqual(saved["focusPoint"][2], 0.4, delta=0.05)
        self.check_saved(1)
        window.key("q")
        self.assertEqual(window.wait(), 0)

    def test_points_are_there_before_the_surfels(self):
        points, colors = sphere(1_000_000)
        write_ply("scan.ply", points, colors)
        window = self.open()
        self.assertNotIn("surfels are shown", window.read_log())
        self.assertEqual(len(estimations()), 1)
        window.click(200, 150)
        window.drag(1, 60, 0)
        moved = window.save(1)
        self.assertNotIn("surfels are shown", window.read_log())
        self.assertLess(moved["position"][0], -1)
        self.assertAlmostEqual(math.hypot(*moved["focusPoint"]), 1, delta=0.05)
        picture = self.read_png("scan-1.png")
        self.assertGreater(picture[110:190, 160:240].astype(int).max(axis=2).min(), 60)  # no holes
        window.wait_for_surfels()
        self.assertEqual(unlike(window.save(2), moved), set())  # what was turned stays
        self.assertEqual(estimations(), [])
        window.key("q")
        self.assertEqual(window.wait(), 0)


class TestScreen(ViewCase):
    """A window of this process."""

    def make(self, *words):
        from surfelsplatting.commandline.commands import parse_arguments
        from surfelsplatting.commandline.scan import Scan
        from surfelsplatting.viewer.window import Window as RealWindow

        self.render("--hierarchy", "scan.vtp")
        self.addCleanup(signal.signal, signal.SIGINT, signal.getsignal(signal.SIGINT))
        scan = Scan(parse_arguments(["view", "scan.vtp", *LOOK, "--size", str(WIDTH), str(HEIGHT),
                                     *words]))
        self.assertIsNone(scan.start_estimation())
        window = RealWindow(scan.viewer, None, scan.say)
        self.addCleanup(window._window.Finalize)
        window._draw()
        return scan.viewer, window

    def test_screen_is_the_saved_picture(self):
        """But for rounding: OpenGL blends the picture over the background in 8 bits."""
        viewer, window = self.make("--circle-of-confusion", "60", "--focus-pixel", "200", "100")
        self.rest(window)
        grab = vtkWindowToImageFilter()
        grab.SetInput(window._window)
        grab.Update()
        screen = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
        screen = screen.reshape(HEIGHT, WIDTH, 3)[::-1].astype(int)
        viewer.save()
        saved = self.read_png("scan-1.png").astype(int)
        above = slice(0, HEIGHT - 40)  # the state is written below
        self.assertGreater(saved[above].std(), 20)
        self.assertLessEqual(abs(screen - saved)[above].max(), 2)
        self.assertGreater(abs(screen - saved)[HEIGHT - 40:].max(), 50)

    def test_inside(self):
        """One flies into the ball, and out of it."""
        viewer, window = self.make()
        outside = viewer.view
        for view, shows_backs in ((replace(outside, position=(0.0, 0.0, 0.1)), 1), (outside, 0)):
            viewer.view = view
            window._draw()
            self.assertEqual(viewer.actor.GetMapper().GetShowBacks(), shows_backs)
            viewer.save()
        self.assertGreater(self.covered("scan-1.png"), 0.99)
        self.assertLess(self.covered("scan-2.png"), 0.7)

    def test_largest_blur(self):
        """Of what faces the camera in the picture: a ball of radius 1 from 6, whose horizon is 1/6 nearer
        than its centre."""
        viewer, _ = self.make("--focal-distance", "5", "--circle-of-confusion", "60")
        horizon = 6 - 1 / 6
        self.assertAlmostEqual(viewer.largest_blur(), 60 * (1 - 5 / horizon), delta=0.3)
        viewer.zoom(6 / 1.5)  # the horizon is beside the picture, in whose corners the ball is
        blurs = []
        for tangent in (1, 5 / 3):  # of the upper end, and of the corner
            angle = math.atan(tangent * math.tan(math.radians(15)))
            cosine, sine = math.cos(angle), math.sin(angle)
            depth = cosine * (1.5 * cosine - math.sqrt(1 - (1.5 * sine) ** 2))
            blurs.append(60 * (1 - 0.5 / depth))
        self.assertGreater(viewer.largest_blur(), blurs[0])
        self.assertLess(viewer.largest_blur(), blurs[1])

    def test_finer_at_rest(self):
        points, colors = sphere(10_000)
        ball = 0.3 * points + (0.5, 0.1, 2.0)  # before the other one
        write_ply("scan.ply", np.concatenate([points, ball]), np.concatenate([colors, 255 - colors]))
        viewer, window = self.make("--circle-of-confusion", "60")
        splatter = window._pass.GetSplatter()
        self.assertEqual(splatter.GetLensCells(), 1)
        window._on_timer()  # at once it may still be moved
        self.assertEqual(splatter.GetLensCells(), 1)
        self.rest(window)
        self.assertEqual(splatter.GetLensCells(), 7)
        self.assertFalse(window._may_be_finer())
        splats = splatter.GetNumberOfSplats()
        window._window.GetEventPending = lambda: True
        viewer.aperture = 61  # another picture
        time.sleep(0.25)  # VTK looks for events five times a second
        window._draw(7)
        self.assertTrue(window._must_draw)  # a button is pressed: not all cells are drawn
        self.assertLess(splatter.GetNumberOfSplats(), splats)
        window._mouse.press("Left", False, (200, 150))
        window._mouse.move((250, 150))
        window._on_timer()
        self.assertEqual(splatter.GetLensCells(), 1)
        window._mouse.release()
        viewer.aperture = 0
        self.rest(window)
        self.assertEqual(splatter.GetLensCells(), 1)  # without a lens there is nothing to divide

    def test_finer_page_at_rest(self):
        from surfelsplatting.viewer.web import Area

        viewer, _ = self.make("--circle-of-confusion", "60")
        area, splatter = Area(viewer, None, False), viewer.renderer.GetSplatter()
        cells = []
        for change in (lambda: None, lambda: None, lambda: viewer.orbit(9, 0), lambda: None,
                       lambda: viewer.color_by("z"), lambda: None):
            change()
            pixels, *size = area.img_cols_rows
            self.assertEqual((pixels.shape, size), ((HEIGHT, WIDTH, 3), [WIDTH, HEIGHT]))
            cells.append(splatter.GetLensCells())
        self.assertEqual(cells, [1, 7, 1, 7, 1, 7])

    @staticmethod
    def rest(window):
        window._draw()
        window._drawn_at -= 1  # s
        window._on_timer()

    def test_tells_when_it_coarsens(self):
        viewer, window = self.make()
        self.assertEqual(list(window._news()), [])
        window._rate = 10_000  # frames a second, which no machine holds
        window._mouse.press("Left", False, (200, 150))
        news = []
        for place in range(200, 220):
            window._mouse.move((place, 150))
            window._draw()
            news += window._news()  # not always: if coarser is no faster, it draws in full again
        self.assertRegex(news[0], r"drawn \d+\.\d times coarser to hold 10000 frames a second")
        window._mouse.release()
        window._draw()  # at rest
        self.assertEqual(list(window._news()), [])


class TestEnds(ViewCase):
    """Nothing is left, however it ends."""

    def test_while_estimating(self):
        points, colors = sphere(400_000)
        write_ply("scan.ply", points, colors)
        for end, code in ((lambda window: window.key("q"), 0),
                          (lambda window: window.process.send_signal(signal.SIGINT), 130),
                          (lambda window: window.process.kill(), -signal.SIGKILL)):
            window = self.open()
            self.assertEqual(len(estimations()), 1)
            end(window)
            self.assertEqual(window.wait(), code, window.read_log())
            self.assertNotIn("Traceback", window.read_log())
            wait_for(lambda: not estimations(), "the end of the estimation")
        self.assertEqual(sorted(os.listdir(".")), ["scan.ply", "view.log"])

    def test_estimation_fails(self):
        result = subprocess.run([TOOL, "view", "scan.ply", "--sides", "given"], check=False,
                                capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(result.returncode, 2)
        self.assertIn("scan.ply has no normals, so --sides given", result.stderr)

    def test_display(self):
        for display, says in ((None, "there is no display"), (":987", ":987 does not answer")):
            environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
            if display:
                environment["DISPLAY"] = display
            result = subprocess.run([TOOL, "view", "scan.ply"], capture_output=True, text=True,
                                    env=environment, timeout=PATIENCE, check=False)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(says, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1)


if __name__ == "__main__":
    if not shutil.which("xdotool"):
        print("SKIPPED: there is no xdotool")
        sys.exit(77)
    unittest.main()

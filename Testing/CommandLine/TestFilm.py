# SPDX-License-Identifier: BSD-3-Clause
"""Films: paths of the camera, pictures, resumed runs, and .mp4 files."""

import json
import math
import os
import shutil
import signal
import subprocess
import time
import unittest
from dataclasses import replace

import numpy as np

from surfelsplatting.problems import UserProblem
from surfelsplatting.views import paths
from surfelsplatting.views.cameras import View
from surfelsplatting.views.focus import distance_in_focus
from TestFormats import pcd_columns
from TestReader import write_pcd
from toolcase import IN_MIDDLE, SMALL, TOOL, ToolCase, content_of, sphere, write, write_ply

Z = (0.0, 0.0, 1.0)
UTM = np.array([691000.123, 5334000.456, 512.789])
LEVEL = View(position=(0.0, -5.0, 1.0), focal_point=(0.0, 0.0, 0.0), view_up=(0.0, 0.0, 1.0),
             view_angle=30.0, focal_disk=0.1)


def moved(view, shift):
    return replace(view, position=tuple(np.array(view.position) + shift),
                   focal_point=tuple(np.array(view.focal_point) + shift))


def places(views):
    return np.array([view.position for view in views])


class TestPaths(unittest.TestCase):
    def test_turntable_is_a_loop_without_a_jump(self):
        positions = places(paths.turntable(LEVEL, (0, 0, 0), Z, 60))
        steps = np.linalg.norm(np.roll(positions, -1, axis=0) - positions, axis=1)
        np.testing.assert_allclose(steps, 2 * 5 * math.sin(math.pi / 60), rtol=1e-12)
        np.testing.assert_allclose(positions[:, 2], 1, atol=1e-12)
        np.testing.assert_allclose(positions[15], [5, 0, 1], atol=1e-12)  # counterclockwise

    def test_swing_is_a_loop_without_a_jump(self):
        positions = places(paths.turntable(LEVEL, (0, 0, 0), Z, 60, 40))
        angles = np.degrees(np.arctan2(positions[:, 0], -positions[:, 1]))
        np.testing.assert_allclose([angles.min(), angles.max()], [-20, 20], atol=1e-9)
        steps = np.abs(np.roll(angles, -1) - angles)
        self.assertLess(steps.max(), 40 * math.pi / 60)
        self.assertAlmostEqual(steps[-1], steps[0], delta=1e-9)

    def test_far_from_the_origin(self):
        near = paths.turntable(LEVEL, (0, 0, 0), Z, 7)
        far = paths.turntable(moved(LEVEL, UTM), UTM, Z, 7)
        np.testing.assert_allclose(places(far) - UTM, places(near), atol=2e-9)
        keys = [LEVEL, replace(LEVEL, position=(7.0, 0.0, 3.0))]
        np.testing.assert_allclose(
            places(paths.through([moved(key, UTM) for key in keys], 7)) - UTM,
            places(paths.through(keys, 7)), atol=2e-9)

    def test_focus_pull(self):
        views = paths.focus_pull(LEVEL, 2, 8, 31)
        distances = np.array([view.focal_distance for view in views])
        np.testing.assert_allclose(distances[[0, 15, 30]], [2, 3.2, 8])  # 1 / 3.2 is the mean
        self.assertTrue((np.diff(distances) > 0).all())
        speed = np.abs(np.diff(1 / distances))
        self.assertLess(max(speed[0], speed[-1]), 0.1 * speed[15])

    def test_dolly(self):
        end = replace(LEVEL, position=(0.0, -1.25, 0.25), view_angle=60.0, focal_disk=0.3,
                      focal_distance=1.0)
        views = paths.through([LEVEL, end], 31)
        self.assertEqual((views[0], views[-1]), (LEVEL, end))
        # In a straight line, since both ends look along it, and with a level horizon.
        positions = places(views)
        np.testing.assert_allclose(positions[:, 0], 0, atol=1e-12)
        np.testing.assert_allclose(positions[:, 2], -0.2 * positions[:, 1], atol=1e-12)
        for view in views:
            self.assertAlmostEqual(view.view_up[0], 0, delta=1e-12)
        steps = np.diff(np.log(-positions[:, 1]))
        self.assertLess(abs(steps[0]), 0.2 * abs(steps[15]))
        self.assertTrue((steps < 0).all())

    def test_keys_are_met_and_passed_smoothly(self):
        keys = [LEVEL, replace(LEVEL, position=(5.0, 0.0, 1.0)),
                replace(LEVEL, position=(0.0, 5.0, 3.0)),
                replace(LEVEL, position=(0.0, 0.0, 6.0), view_up=(0.0, -1.0, 0.0))]
        views = paths.through(keys, 91)
        for number, key in enumerate(keys):
            self.assertEqual(views[30 * number], key)
        positions = places(views)
        self.assertGreater(np.linalg.norm(positions[:, :2], axis=1)[:60].min(), 3)  # around it
        speeds = np.diff(positions, axis=0)
        change = np.linalg.norm(np.diff(speeds, axis=0), axis=1)
        self.assertLess(change.max(), 0.2 * np.linalg.norm(speeds, axis=1).max())

    def test_what_stays_in_focus(self):
        keys = [replace(LEVEL, focus_point=(0.0, 0.0, 1.0)),
                replace(LEVEL, position=(5.0, 0.0, 1.0), focus_point=(0.0, 0.0, 1.0))]
        for view in paths.through(keys, 5):
            self.assertEqual((view.focus_point, view.focal_distance), ((0, 0, 1), 0))
        keys[1] = replace(keys[1], focus_point=(1.0, 0.0, 0.0))
        distances = [distance_in_focus(view) for view in paths.through(keys, 5)]
        np.testing.assert_allclose(distances[::4], [distance_in_focus(key) for key in keys])
        self.assertTrue((np.diff(distances) < 0).all())

    def test_lenses_that_do_not_mix(self):
        pixels = replace(LEVEL, focal_disk=0.0, circle_of_confusion=9.0)
        with self.assertRaisesRegex(UserProblem, "--circle-of-confusion"):
            paths.through([LEVEL, pixels], 5)

    def test_a_frame_that_cannot_be_drawn(self):
        views = paths.turntable(replace(LEVEL, focus_point=(0.0, -3.9, 1.0)), (0, -4.5, 0), Z, 4)
        with self.assertRaisesRegex(UserProblem, "frame 3 of 4: .* behind the camera"):
            paths.check_views(views)


class FilmCase(ToolCase):
    def setUp(self):
        super().setUp()
        write_ply("ball.ply", *sphere(2000))

    def film(self, *words):
        self.make("ball.ply", *words)

    def make(self, cloud, *words):
        said = IN_MIDDLE.sub("", self.tool("film", cloud, *SMALL, *words))
        self.assertEqual((self.code, said, self.printed), (0, "", ""), words)

    def refuse_film(self, says, *words):
        self.refuse("film", "ball.ply", *SMALL, *words, says=says)

    @staticmethod
    def contents(folder):
        return {name: content_of(os.path.join(folder, name)) for name in sorted(os.listdir(folder))}

    def stopped(self, end, *words):
        """A run that gets a signal after its first pictures."""
        words = [TOOL, "film", "ball.ply", *SMALL, "--frames", "400", *words]
        folder = words[-1].replace(".mp4", ".frames")
        with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
            while not os.path.exists(os.path.join(folder, "0003.png")):
                self.assertIsNone(process.poll())
                time.sleep(0.01)
            process.send_signal(end)
            return process.communicate()[1], process.returncode


class TestFilm(FilmCase):
    def test_turntable(self):
        self.film("--frames", "12", "-o", "out")
        self.assertEqual(sorted(os.listdir(".")), ["ball.ply", "out"])
        self.assertEqual(sorted(os.listdir("out")),
                         [*(f"{k:04}.png" for k in range(12)), "film.json"])
        covered = []
        for number in range(12):
            self.assertEqual(self.read_png(f"out/{number:04}.png").shape, (48, 64, 3))
            covered.append(self.covered(f"out/{number:04}.png"))
        # A ball stays where it is and as large as it is, and fills the picture's height.
        self.assertLess(np.ptp(covered), 0.02)
        self.assertGreater(min(covered), 0.35)

    def test_backs(self):
        """A depth image is seen from its front; of other open scans a film says when they are not."""
        x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1, 1, 80), np.linspace(-0.75, 0.75, 60)))
        points = np.stack([x, y, 2 - 0.3 * np.cos(2 * x) * np.cos(2 * y)], axis=1).astype("f4")
        colors = np.full((len(x), 3), 200, np.uint8)
        write_pcd("depth.pcd", pcd_columns(points, colors), "binary", 80, 60)
        for words in (("-o", "default"), ("-o", "turn", "--turn", "40")):
            self.make("depth.pcd", "--frames", "3", *words)
        self.render("depth.pcd", *SMALL, "-o", "one.png", "--hierarchy", "depth.surfels")
        self.make("depth.surfels", "--frames", "3", "-o", "kept")
        np.testing.assert_array_equal(self.read_png("kept/0001.png"),
                                      self.read_png("default/0001.png"))
        # The first frame is what the sensor saw.
        np.testing.assert_array_equal(self.read_png("default/0000.png"), self.read_png("one.png"))
        for name, picture in self.contents("turn").items():
            if name.endswith(".png"):
                self.assertEqual(picture, self.contents("default")[name])
        points, colors = sphere()
        points, colors = points[points[:, 0] > 0], colors[points[:, 0] > 0]
        write_ply("half.ply", points, colors, normals=points)
        said = self.tool("film", "half.ply", *SMALL, "--frames", "4", "-o", "half")
        self.assertIn("turns its back to the camera in a frame, so that both sides are drawn", said)
        for number in range(4):
            self.assertGreater(self.covered(f"half/{number:04}.png"), 0.1)

    def test_a_view_of_the_user_is_the_first_frame(self):
        camera = ["--position", "0", "-6", "1", "--focal-point", "0", "0", "0",
                  "--view-up", "0", "0", "1", "--circle-of-confusion", "9"]
        self.film("--frames", "2", "-o", "out", *camera)
        self.render("ball.ply", *SMALL, *camera, "-o", "one.png")
        np.testing.assert_array_equal(self.read_png("out/0000.png"), self.read_png("one.png"))

    def test_turn_stays_in_focus(self):
        """An egg with stripes, whose tip comes nearer than its side: the middle is always sharp, also
        with a camera of the user's, unless the user says what is."""
        points, _ = sphere(20000)
        stripes = np.where(np.sin(16 * points[:, 2:]) > 0, 255, 0) * np.ones((1, 3))
        write_ply("ball.ply", points * [2.5, 1, 1], stripes.astype(np.uint8))
        placed = ["--position", "0,-8,0", "--view-up", "0,0,1"]

        def contrasts(*words):
            self.film(*words, "--frames", "4", "--size", "160x120", "--unlit", "-o", "out")
            found = [self.read_png(f"out/{k:04}.png")[50:70, 70:90].std() for k in range(4)]
            shutil.rmtree("out")
            return np.array(found)

        for words in ([], placed):
            shares = contrasts(*words, "--circle-of-confusion", "40") / contrasts(*words)
            self.assertGreater(shares.min(), 0.9, words)
        fixed = contrasts(*placed, "--circle-of-confusion", "40", "--focal-distance", "7")
        self.assertGreater(fixed[0], 3 * fixed[1])

    def test_focus_pull(self):
        self.film("--focus-pull", "--frames", "3", "-o", "out")  # with a lens of its own
        self.film("--focus-pull", "1", "9", "--focal-disk", "0.4", "--frames", "3", "-o", "two")
        for folder in ("out", "two"):
            pictures = [self.read_png(f"{folder}/{k:04}.png").astype(int) for k in range(3)]
            self.assertGreater(np.abs(pictures[0] - pictures[2]).max(), 4)

    def test_through_camera_files(self):
        self.keys = [{"position": [0, -6, 1], "focalPoint": [0, 0, 0], "viewUp": [0, 0, 1]},
                     {"position": [4, 0, 1], "focalPoint": [0, 0, 0], "viewUp": [0, 0, 1]}]
        for number, key in enumerate(self.keys):
            write(f"{number}.json", json.dumps(key))
        write("both.json", json.dumps({"views": self.keys}))
        self.film("--through", "0.json", "1.json", "--frames", "3", "-o", "out")
        self.film("--through", "both.json", "--frames", "3", "-o", "two")
        first, second = self.contents("out"), self.contents("two")
        self.assertEqual([first[f"000{k}.png"] for k in range(3)],
                         [second[f"000{k}.png"] for k in range(3)])
        self.render("ball.ply", *SMALL, "--camera", "1.json", "-o", "one.png")
        np.testing.assert_array_equal(self.read_png("out/0002.png"), self.read_png("one.png"))
        self.refuse_film("0.json is one view", "--through", "0.json", "-o", "three")
        self.refuse_film("--through and --position", "--through", "both.json", "--position", "1", "2",
                    "3", "-o", "three")

    def test_killed_run_leaves_whole_pictures(self):
        self.stopped(signal.SIGKILL, "-o", "out")
        done = {name: content for name, content in self.contents("out").items()
                if name.endswith(".png") and ".part" not in name}
        self.assertIn(len(done), range(4, 400))
        for name, content in done.items():
            self.assertEqual(content[-8:-4], b"IEND", name)
        self.refuse_film("frames differs", "--frames", "399", "-o", "out", "--resume")

    def test_resumed_run_makes_the_same_bytes(self):
        self.film("--frames", "9", "-o", "out")
        whole = self.contents("out")
        for name in ("0004.png", "0008.png"):
            os.remove(f"out/{name}")
        with open("out/0002.png", "r+b") as file:  # as after a power failure
            file.truncate(100)
        write("out/0007.12345.part.png", b"begun")
        os.utime("out/0003.png", (1, 1))
        self.film("--frames", "9", "-o", "out", "--resume")
        self.assertEqual(self.contents("out"), whole)
        self.assertEqual(os.stat("out/0003.png").st_mtime, 1)  # is not drawn again

    def test_interrupt_keeps_what_is_done(self):
        said, code = self.stopped(signal.SIGINT, "-o", "out")
        self.assertEqual(code, 130, said)
        done = [name for name in os.listdir("out") if name.endswith(".png")]
        self.assertGreater(len(done), 3)
        self.assertFalse([name for name in done if "part" in name])
        self.assertEqual(said, f"surfelsplat: interrupted; {len(done)} of 400 pictures are in out; "
                               "the same command with --resume makes the others\n")

    def test_another_film_is_kept(self):
        """With --resume and without it; the same film may be made once more."""
        self.film("--frames", "2", "-o", "out")
        made = self.contents("out")
        for resume in ([], ["--resume"]):
            self.refuse_film("out holds another film: circle_of_confusion differs; remove it, or give "
                        "another OUT", "--frames", "2", "-o", "out", "--circle-of-confusion", "9",
                        *resume)
            self.refuse_film("frames differs", "--frames", "3", "-o", "out", *resume)
            self.assertEqual(self.contents("out"), made)
            self.film("--frames", "2", "-o", "out", *resume)
            self.assertEqual(self.contents("out"), made)
        os.utime("ball.ply", (1, 1))
        self.refuse_film("files differs", "--frames", "2", "-o", "out", "--resume")
        for name in ("0000.png", "0001.png"):
            os.remove(f"out/{name}")
        self.film("--frames", "1", "-o", "out")  # nothing is lost
        self.assertEqual(sorted(os.listdir("out")), ["0000.png", "film.json"])

    def test_folders(self):
        os.mkdir("mine")
        write("mine/0000.png", "a picture of mine")
        self.refuse_film("mine holds other files", "-o", "mine")
        self.refuse_film("'.ply' is no film", "-o", "ball.ply")
        self.refuse_film("does not exist", "-o", "no/folder")
        for extension in (".avi", ".webp", ".jpeg"):
            self.refuse_film(f"'{extension}'", "-o", "out" + extension)
        self.refuse_film("--focus-pull and --blur 0 cannot be combined", "--focus-pull", "--blur", "0", "-o", "out")
        self.refuse_film("takes no distance or two", "--focus-pull", "3", "-o", "out")
        self.assertEqual(self.contents("mine"), {"0000.png": b"a picture of mine"})
        write("empty.xyz", "")
        self.refuse("film", "empty.xyz", "-o", "out", says="empty")


class TestMovie(FilmCase):
    @unittest.skipUnless(shutil.which("ffmpeg"), "ffmpeg is needed")
    def test_movie(self):
        self.film("--frames", "9", "-o", "whole.mp4", "--rate", "25", "--size", "61", "47")
        words = ["ffprobe", "-v", "error", "-show_entries",
                 "stream=width,height,nb_frames,r_frame_rate,pix_fmt", "-of", "csv=p=0"]
        probed = subprocess.run([*words, "whole.mp4"], capture_output=True, text=True, check=True)
        self.assertEqual(probed.stdout.strip(), "62,48,yuv420p,25/1,9")  # even sizes
        self.film("--frames", "9", "-o", "again.mp4")
        self.film("--frames", "9", "-o", "out.frames")
        os.remove("out.frames/0005.png")
        self.film("--frames", "9", "-o", "out.mp4", "--resume")
        self.assertEqual(content_of("again.mp4"), content_of("out.mp4"))
        self.assertEqual(sorted(os.listdir(".")),
                         ["again.mp4", "ball.ply", "out.mp4", "whole.mp4"])
        said, _ = self.stopped(signal.SIGINT, "-o", "stopped.mp4")
        self.assertIn("pictures are in stopped.frames", said)

    @unittest.skipUnless(shutil.which("ffmpeg"), "ffmpeg is needed")
    def test_gif(self):
        """Close to the pictures in spite of its 256 colours; it plays again and again."""
        words = "--frames", "9", "--rate", "20", "--size", "61", "47", "-o"
        self.film(*words, "out.gif")
        self.film(*words, "again.gif")
        self.film(*words, "pictures")
        self.assertEqual(content_of("out.gif"), content_of("again.gif"))
        self.assertIn(b"NETSCAPE2.0\x03\x01\0\0", content_of("out.gif"))
        films = [np.frombuffer(subprocess.run(
            ["ffmpeg", "-v", "error", "-i", name, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
            capture_output=True, check=True).stdout, np.uint8).reshape(-1, 47, 61, 3).astype(float)
            for name in ("out.gif", "pictures/%04d.png")]
        self.assertEqual([len(film) for film in films], [9, 9])
        self.assertLess(np.abs(films[0] - films[1]).mean(), 3)
        self.assertEqual(sorted(os.listdir(".")), ["again.gif", "ball.ply", "out.gif", "pictures"])

    @unittest.skipUnless(shutil.which("ffmpeg"), "there is no ffmpeg")
    def test_name_of_its_own(self):
        said = self.tool("film", "ball.ply", *SMALL, "--frames", "3")
        self.assertEqual((self.code, said), (0, "surfelsplat: ball.ply.mp4 written\n"))
        self.assertEqual(sorted(os.listdir(".")), ["ball.ply", "ball.ply.mp4"])

    def test_without_ffmpeg(self):
        words = [TOOL, "film", "ball.ply", "-o", "out.mp4"]
        result = subprocess.run(words, capture_output=True, text=True, check=False,
                                env={**os.environ, "PATH": "/nowhere"})
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("apt install ffmpeg", result.stderr)
        self.assertEqual(os.listdir("."), ["ball.ply"])


if __name__ == "__main__":
    unittest.main()

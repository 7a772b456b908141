# SPDX-License-Identifier: BSD-3-Clause
"""Runs what README.md shows, as a reader would paste it into a new shell in the checkout. Its script for
PyVista is run by Testing/Wheel/TestWheel.py."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from TestInstall import read_png

SOURCE, BUILD = os.environ["SOURCE"], os.environ["BUILD"]
CLOSE_AND_SAVE = """
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
def close(caller, _event):
    pixels = vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, 511, 511, 1, pixels)
    open("window.raw", "wb").write(bytes(memoryview(pixels)))
    caller.TerminateApp()
interactor.Initialize(); interactor.AddObserver("TimerEvent", close); interactor.CreateOneShotTimer(100)
interactor.Start()"""


with open(os.path.join(SOURCE, "README.md"), encoding="utf-8") as readme:
    TEXT = readme.read()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.S)


def link_entries(folder, target, leave_out=()):
    os.mkdir(target)
    for name in set(os.listdir(folder)) - set(leave_out):
        os.symlink(os.path.join(folder, name), os.path.join(target, name))


class TestReadme(unittest.TestCase):
    def setUp(self):
        """A checkout of links, so that what the commands write goes into a temporary folder."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.checkout = os.path.join(folder.name, "checkout")
        link_entries(SOURCE, self.checkout, leave_out=["build", os.path.basename(BUILD)])
        link_entries(BUILD, self.path("build"), leave_out=["demo", "example", "installed"])

    def path(self, name):
        return os.path.join(self.checkout, name)

    def run_shell(self, commands, display=()):
        """In a new bash, without a display unless one is given."""
        environment = {name: value for name, value in os.environ.items()
                       if name not in ("PYTHONPATH", *(() if display else ("DISPLAY",)))}
        result = subprocess.run([*display, "bash", "-e", "-c", commands], cwd=self.checkout,
                                env=environment, capture_output=True, text=True, check=False)
        # Stages that take longer than 10 s, as on a busy machine, write their progress.
        errors = re.sub(r"^surfelsplat: .* % .*after \d+:\d\d\n", "", result.stderr, flags=re.M)
        errors = re.sub(r"^surfelsplat: in focus.* the middle of the picture .*\n", "", errors, flags=re.M)
        self.assertEqual((result.returncode, errors), (0, ""), result.stdout)

    def run_python(self, script, display=()):
        [export] = re.findall(r"`(export PYTHONPATH=[^`]*)`", TEXT)
        self.run_shell(f"{export}; {sys.executable} -s {script}", display)

    def check_picture(self, picture, covered):
        """Many shades, on a part of the picture."""
        self.assertGreater((picture.max(axis=2) > 30).mean(), covered)
        self.assertGreater(len(np.unique(picture.reshape(-1, picture.shape[2]), axis=0)), 100)

    def test_python_without_a_display(self):
        self.assertIn("(Examples/Python/hills.py)", TEXT)
        self.run_python("Examples/Python/hills.py")
        picture = read_png(self.path("hills.png"))
        self.assertEqual(picture.shape, (512, 512, 3))
        self.check_picture(picture, 0.25)

    def test_python_in_a_window(self):
        display = ["env"] if os.environ.get("DISPLAY") else [
            "xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset"]
        if not shutil.which(display[0]):
            self.skipTest("no X display")
        with open(self.path("Examples/Python/hills.py"), encoding="utf-8") as file:
            code = file.read()
        self.assertEqual(code.count("interactor.Start()"), 1)
        with open(self.path("hills.py"), "w", encoding="utf-8") as file:
            file.write(code.replace("interactor.Start()", CLOSE_AND_SAVE))
        self.run_python("hills.py --window", display)
        window = np.fromfile(self.path("window.raw"), np.uint8).reshape(512, 512, 4)[..., :3]
        self.check_picture(window, 0.25)
        saved = read_png(self.path("hills.png"))
        self.assertLessEqual(np.abs(window.astype(int) - saved).max(), 1)

    def test_command_line(self):
        """But for view and web, which TestView and TestWeb run."""
        [block] = [block for block in blocks("sh") if "surfelsplat render" in block]
        commands = [line for line in block.splitlines()
                    if not re.search("surfelsplat (view|web)", line)]
        self.assertEqual(len(commands), 3)
        with open(self.path("scan.ply"), "w") as file:
            file.write("ply\nformat ascii 1.0\nelement vertex 1600\n"
                       + "".join(f"property float {name}\n" for name in "xyz") + "end_header\n")
            file.writelines(f"{i % 40} {i // 40} {i % 40 / 3}\n" for i in range(1600))
        if not shutil.which("ffmpeg"):
            commands[-1] = commands[-1].replace("scan.mp4", "scan")
        for command in commands:
            self.run_shell(command)
        self.check_picture(read_png(self.path("scan.png")), 0.2)

    def test_cpp_package(self):
        [commands] = [block for block in blocks("sh") if "cmake --install" in block]
        self.run_shell(commands)
        picture = read_png(self.path("example.png"))
        self.assertEqual(picture.shape[:2], (512, 512))
        self.assertGreater(picture[256, 256, 0], 180)
        self.assertEqual(picture[2, 2].max(), 0)

    def test_scripts(self):
        scripts = [word for block in blocks("sh") for word in re.findall(r"^bash (\S+)", block, re.M)]
        self.assertEqual(scripts, ["Examples/demo.sh", "Testing/test.sh"])
        for script in scripts:
            self.run_shell(f"bash -n {script}")

    def test_length(self):
        self.assertLessEqual(len(TEXT.splitlines()), 100)


if __name__ == "__main__":
    program = unittest.main(exit=False)
    ran = program.result
    sys.exit(77 if ran.wasSuccessful() and ran.skipped else not ran.wasSuccessful())

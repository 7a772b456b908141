# SPDX-License-Identifier: BSD-3-Clause
"""What the README shows is run: its Python, and its C++ as part of the example that is built
elsewhere."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.environ["SOURCE"]
SAVE = """
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
pixels = vtkUnsignedCharArray()
width, height = window.GetSize()
window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 1, pixels)
print(max(pixels.GetRange(0)))
"""


def blocks(language):
    with open(os.path.join(SOURCE, "README.md"), encoding="utf-8") as file:
        return re.findall(rf"```{language}\n(.*?)```", file.read(), re.S)


class Readme(unittest.TestCase):
    def test_python_draws_something(self):
        display = [] if os.environ.get("DISPLAY") else [
            "xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset"]
        if display and not shutil.which("xvfb-run"):
            self.skipTest("no X display")
        [code] = blocks("python")
        with tempfile.TemporaryDirectory() as folder:
            script = os.path.join(folder, "readme.py")
            with open(script, "w", encoding="utf-8") as file:
                file.write(code + SAVE)
            result = subprocess.run([*display, sys.executable, "-s", script], cwd=folder,
                                    capture_output=True, text=True)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertGreater(float(result.stdout), 100)

    def test_cpp_is_the_example(self):
        [code] = blocks("cpp")
        with open(os.path.join(SOURCE, "Examples", "Cxx", "main.cxx"), encoding="utf-8") as file:
            example = [line.strip() for line in file]
        for line in code.splitlines():
            self.assertIn(line.strip(), example)

    def test_files_exist(self):
        with open(os.path.join(SOURCE, "README.md"), encoding="utf-8") as file:
            links = re.findall(r"\]\(([^)#:]+)\)", file.read())
        self.assertTrue(links)
        for link in links:
            self.assertTrue(os.path.exists(os.path.join(SOURCE, link)), link)


if __name__ == "__main__":
    program = unittest.main(exit=False)
    ran = program.result
    sys.exit(77 if ran.wasSuccessful() and ran.skipped else not ran.wasSuccessful())

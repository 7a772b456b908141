# SPDX-License-Identifier: BSD-3-Clause
"""Installs into a temporary prefix, moves it, and uses it from there as a stranger would."""

import os
import subprocess
import sys
import tempfile
import unittest

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader

ENV = os.environ


def run(*words, **more):
    """Without a display, and without the build tree's Python path."""
    environment = {k: v for k, v in ENV.items() if k not in ("DISPLAY", "PYTHONPATH")}
    environment.update(more)
    result = subprocess.run(words, capture_output=True, text=True, env=environment, check=False)
    if result.returncode != 0:
        raise AssertionError(f"{words} failed:\n{result.stdout}\n{result.stderr}")
    return result.stdout


def read_png(path):
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    picture = reader.GetOutput()
    width, height, _ = picture.GetDimensions()
    return vtk_to_numpy(picture.GetPointData().GetScalars()).reshape(height, width, -1)


class TestInstall(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        first = os.path.join(cls.folder.name, "first")
        cls.prefix = os.path.join(cls.folder.name, "moved")
        run(ENV["CMAKE"], "--install", ENV["BUILD"], "--prefix", first)
        os.rename(first, cls.prefix)
        cls.python_path = os.path.join(cls.prefix, ENV["LIBDIR"], "python3", "dist-packages")

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def test_example_project(self):
        source = os.path.join(ENV["SOURCE"], "Examples", "Cxx")
        run(ENV["CMAKE"], "-S", source, "-B", self.path("ex"), "-G", ENV["GENERATOR"],
            "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        with open(self.path("ex/CMakeCache.txt")) as cache:
            self.assertIn(f"SurfelSplatting_DIR:PATH={self.prefix}/", cache.read())
        run(ENV["CMAKE"], "--build", self.path("ex"))
        run(self.path("ex/example"), self.path("example.png"))
        picture = read_png(self.path("example.png"))
        self.assertEqual(picture.shape[:2], (512, 512))
        # The sphere's colour in the middle, nothing in the corner.
        red, green, blue = picture[256, 256, :3].astype(int)
        self.assertTrue(red > 180 and red > green + 20 > blue + 40, picture[256, 256])
        self.assertEqual(picture[2, 2].max(), 0)

    def test_python_package(self):
        where = run(sys.executable, "-s", "-c", "import surfelsplatting as s\n"
                    "s.vtkSurfelEstimation(), s.vtkSurfelSplattingPass(), s.vtkSurfelEXRWriter()\n"
                    "print(s.__file__)", PYTHONPATH=self.python_path)
        self.assertEqual(where.strip(),
                         os.path.join(self.python_path, "surfelsplatting/__init__.py"))

    def test_libraries_come_from_the_prefix(self):
        loaded = run(sys.executable, "-s", "-c", "import surfelsplatting\n"
                     "print(open('/proc/self/maps').read())", PYTHONPATH=self.python_path)
        ours = {line.split()[-1] for line in loaded.splitlines() if "vtkSurfel" in line}
        self.assertGreaterEqual(len(ours), 8)
        self.assertTrue(all(path.startswith(self.prefix) for path in ours), ours)

    def test_tool(self):
        with open(self.path("cloud.xyz"), "w") as file:
            file.writelines(f"{i % 40} {i // 40} 0 200 100 50\n" for i in range(1600))
        tool = os.path.join(self.prefix, ENV["BINDIR"], "surfelsplat")
        run(tool, "render", self.path("cloud.xyz"), "--unlit", "-o", self.path("cloud.png"))
        picture = read_png(self.path("cloud.png"))
        self.assertGreater((picture[..., 0] > 190).mean(), 0.15)


if __name__ == "__main__":
    unittest.main()

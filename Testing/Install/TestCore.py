# SPDX-License-Identifier: BSD-3-Clause
"""The core for those who have no VTK: builds it alone, for a processor without targets of its own,
installs it, and builds its example against the installed package; then the same against the package of
the whole project."""

import json
import os
import shlex
import subprocess
import tempfile
import unittest

ENV = os.environ
NO_VTK = "-DCMAKE_DISABLE_FIND_PACKAGE_VTK=ON"
# Quick to compile: how fast it is when optimized is another matter.
PORTABLE = ("-DCMAKE_SYSTEM_NAME=Linux", "-DCMAKE_SYSTEM_PROCESSOR=portable", "-DCMAKE_BUILD_TYPE=Debug",
            "-DCMAKE_CXX_FLAGS_DEBUG=-O0", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=32")


def run(*words, **more):
    result = subprocess.run(words, capture_output=True, text=True, check=False, **more)
    if result.returncode != 0:
        raise AssertionError(f"{words} failed:\n{result.stdout}\n{result.stderr}")
    return result.stdout


def read_ppm(path):
    """-> width, height, RGB bytes, top row first"""
    with open(path, "rb") as file:
        magic, width, height, largest = file.readline().split()
        pixels = file.read()
    assert (magic, largest) == (b"P6", b"255")
    return int(width), int(height), pixels


class TestCore(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def configure(self, source, name, *settings):
        run(ENV["CMAKE"], "-S", os.path.join(ENV["SOURCE"], source), "-B", self.path(name),
            "-G", ENV["GENERATOR"], NO_VTK, *settings)

    def build_example(self, name, prefix):
        """-> the picture of the example that finds the package in prefix."""
        self.configure("Examples/Core", name, f"-DCMAKE_PREFIX_PATH={prefix}",
                       "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
        run(ENV["CMAKE"], "--build", self.path(name))
        self.check_headers(name, prefix)
        splat, picture = self.path(f"{name}/splat"), self.path(f"{name}.ppm")
        self.assertNotIn("vtk", run("ldd", splat).lower())
        run(splat, picture)
        return read_ppm(picture)

    def check_headers(self, name, prefix):
        """All headers come from the prefix or the system, none from VTK."""
        with open(self.path(f"{name}/compile_commands.json"), encoding="utf-8") as file:
            [command] = json.load(file)
        words = shlex.split(command["command"])
        words = words[:words.index("-o")] + ["-M", command["file"]]
        headers = run(*words, cwd=command["directory"]).replace("\\\n", " ").split()[2:]
        ours = [path for path in headers if "/Core/" in path]
        self.assertGreater(len(ours), 20)
        for path in ours:
            self.assertTrue(path.startswith(prefix + "/"), path)
        for path in headers:
            self.assertNotIn("vtk", os.path.relpath(path, prefix).lower())

    def test_example(self):
        alone = self.path("alone")
        self.configure(".", "build", "-DSURFELSPLATTING_BUILD_CORE=ON", *PORTABLE,
                       f"-DCMAKE_CXX_COMPILER={ENV['CXX']}", f"-DCMAKE_INSTALL_PREFIX={alone}")
        run(ENV["CMAKE"], "--build", self.path("build"), "--target", "install")
        width, height, pixels = picture = self.build_example("example", alone)

        def at(x, y):
            return tuple(pixels[3 * (y * width + x):][:3])

        self.assertEqual((width, height, len(pixels)), (640, 360, 3 * 640 * 360))
        red, green, blue = at(320, 180)  # the front of the middle sphere
        self.assertTrue(green > 150 > blue > red, at(320, 180))
        self.assertEqual(at(2, 2), (0, 0, 0))

        whole = self.path("whole")
        run(ENV["CMAKE"], "--install", ENV["BUILD"], "--prefix", whole)
        # Other instructions round differently: a value between two bytes may become either.
        again = self.build_example("again", whole)
        self.assertEqual(again[:2], picture[:2])
        steps = [abs(a - b) for a, b in zip(again[2], pixels)]
        self.assertLessEqual(max(steps), 1)
        self.assertLess(sum(steps), len(steps) // 10_000)


if __name__ == "__main__":
    unittest.main()

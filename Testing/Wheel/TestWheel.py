# SPDX-License-Identifier: BSD-3-Clause
"""The wheel in a fresh environment: what is in it, README's script, the pictures of Debian's build, and
what users read who mix two VTKs.

Run by the environment's interpreter. SOURCE: the checkout; NATIVE_TOOL: surfelsplat of Debian's build.
"""

import glob
import os
import re
import subprocess
import sys
import tempfile
import unittest
import zipfile

import numpy as np
import pyvista as pv

SOURCE = os.environ["SOURCE"]
[WHEEL] = glob.glob(os.path.join(SOURCE, "dist", "surfelsplatting-*.whl"))
LARGEST = 15e6  # bytes
SERVER = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "PYTHONPATH")}


def run(*words, **variables):
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=200,
                          env={**SERVER, **variables})


def run_python(code, **variables):
    return run(sys.executable, "-c", code, **variables)


def read_readme():
    with open(os.path.join(SOURCE, "README.md"), encoding="utf-8") as readme:
        return readme.read()


def write_scan(path):
    """20 000 points of a coloured torus."""
    points = pv.ParametricTorus(u_res=200, v_res=100)
    colors = (127.5 + 127.5 * points.points / abs(points.points).max()).astype(np.uint8)
    points["RGB"] = colors
    points.save(path, texture="RGB")


class WheelCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def fails_with(self, result, *texts):
        """The last line on stderr is a Python exception, and says these words."""
        self.assertEqual(result.returncode, 1, result.stderr)
        for text in texts:
            self.assertIn(text, result.stderr.splitlines()[-1])


class TestContents(WheelCase):
    def test_size_and_tag(self):
        self.assertLess(os.path.getsize(WHEEL), LARGEST)
        tag = re.search(r"-cp312-abi3-manylinux_2_(\d\d)_x86_64\.whl$", os.path.basename(WHEEL))
        self.assertIsNotNone(tag, WHEEL)
        # pip would refuse the wheel on a system that README names.
        [promised] = re.findall(r"glibc 2\.(\d\d) or newer", read_readme())
        self.assertEqual(tag[1], promised)

    def test_libraries_need_no_other_vtk(self):
        with zipfile.ZipFile(WHEEL) as wheel:
            libraries = [name for name in wheel.namelist() if ".so" in name]
            wheel.extractall(members=libraries)
        self.assertGreater(len(libraries), 7)
        for library in libraries:
            listing = run("readelf", "-d", library).stdout
            for needed in re.findall(r"\(NEEDED\).*\[(.*)\]", listing):
                if needed.startswith("libvtk"):
                    self.assertRegex(needed, r"^libvtkSurfel\w+\.so$|-cvista\.so$", library)

    def test_process_has_one_vtk(self):
        write_scan("scan.ply")
        code = ("from surfelsplatting import *\n"
                "reader = vtkPointCloudReader(); reader.SetFileName('scan.ply')\n"
                "surfels = vtkPointsToSurfels(); surfels.SetInputConnection(reader.GetOutputPort())\n"
                "surfels.Update(); vtkSurfelEXRWriter(); vtkSurfelSplattingPass()\n"
                "print(open('/proc/self/maps').read())\n")
        result = run_python(code)
        self.assertEqual(result.returncode, 0, result.stderr)
        names = set(re.findall(r"/(lib(?:vtk|pcl|OpenEXR|flann)[^/\n]*)$", result.stdout, re.M))
        self.assertIn("libvtkCommon-cvista.so", names)
        for name in names:
            if name.startswith("libvtk"):
                self.assertRegex(name, r"^libvtkSurfel\w+\.so$|-cvista\.so$")
        for path in re.findall(r"\S*/lib(?:pcl|OpenEXR|flann)\S*", result.stdout):
            self.assertIn("/surfelsplatting.libs/", path)


class TestPictures(WheelCase):
    def test_readme(self):
        blocks = re.findall(r"```python\n(.*?)```", read_readme(), re.S)
        [script] = [block for block in blocks if "import pyvista" in block]
        self.assertLessEqual(len(script.splitlines()), 10)
        write_scan("scan.ply")
        result = run_python(script)
        # VTK looks for an X server before it renders without one.
        said = re.sub(r".*bad X server connection.*\n?", "", result.stderr)
        self.assertEqual((result.returncode, said), (0, ""))
        picture = pv.read("scan.png")
        self.assertGreater(len(np.unique(picture.active_scalars, axis=0)), 1000)
        self.assertGreater((picture.active_scalars.max(axis=1) > 30).mean(), 0.1)

    def test_equal_those_of_debians_build(self):
        """Layers with float colours and depths, bit by bit. The camera is given: one that is chosen
        depends on the last bits of numpy's functions."""
        write_scan("scan.ply")
        options = ["--position", "0", "-4", "2.5", "--focal-point", "0", "0", "0", "--view-up", "0",
                   "0", "1", "--size", "300", "200", "--circle-of-confusion", "12", "--deep"]
        pictures = []
        for tool in (os.environ["SURFELSPLAT"], os.environ["NATIVE_TOOL"]):
            result = run(tool, "render", "scan.ply", *options, "-o", "scan.exr")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            with open("scan.exr", "rb") as file:
                pictures.append(file.read())
        self.assertGreater(len(pictures[0]), 300_000)
        self.assertEqual(pictures[0], pictures[1])


class TestTwoVTKs(WheelCase):
    """pip installs stock VTK too, since PyVista requires it."""

    def test_objects_of_the_other(self):
        start = ("from vtkmodules.vtkCommonDataModel import vtkPolyData\n"
                 "from vtkmodules.vtkFiltersSources import vtkSphereSource\n"
                 "from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLCamera\n"
                 "from vtkmodules.vtkRenderingCore import vtkActor, vtkCamera\n"
                 "from surfelsplatting import *\n")
        for call, name in (("vtkPointsToSurfels().SetInputData(vtkPolyData())", "vtkPolyData"),
                           ("vtkSurfelMapper().SetInputConnection(vtkSphereSource().GetOutputPort())",
                            "vtkAlgorithmOutput"),
                           ("vtkSurfelImageRenderer().AddActor(vtkActor())", "vtkActor"),
                           ("vtkSurfelImageRenderer().SetCamera(vtkCamera())", "vtkCamera")):
            self.fails_with(run_python(start + call), "TypeError", f"the {name} is an object of vtkmodules",
                            "from cvista.")

    def test_other_wrong_arguments_are_as_before(self):
        code = "from surfelsplatting import *\nvtkPointsToSurfels().SetInputData({})"
        for value in ("3", "'scan.ply'", "vtkSurfelMapper()"):
            self.fails_with(run_python(code.format(value)), "TypeError: SetInputData")

    def test_pyvista_is_told_to_work_with_the_other(self):
        for code in ("import surfelsplatting", "import pyvista, surfelsplatting"):
            self.fails_with(run_python(code, PYVISTA_VTK_BACKEND="vtk"), "ImportError",
                            "PYVISTA_VTK_BACKEND=cvista before Python starts")
        self.assertEqual(run_python("import surfelsplatting", PYVISTA_VTK_BACKEND="cvista").stderr, "")

    def test_only_the_other_is_installed(self):
        for first in ("sys", "pyvista"):
            code = f"import sys; sys.modules['cvista'] = None; import {first}; import surfelsplatting"
            self.fails_with(run_python(code), "ImportError", "cvista 9.7", "there is no cvista",
                            "pip install 'cvista[io,rendering]==9.7.0.5.*'")

    def test_other_version(self):
        code = ("import cvista.vtkCommonCore as c\n"
                "c.vtkVersion = type('v', (), {'GetVTKVersion': lambda: '9.9.1'})\n"
                "import surfelsplatting")
        self.fails_with(run_python(code), "ImportError", "9.9.1", "pip install 'cvista[")

    def test_other_platform(self):
        code = ("import platform, sys; platform.machine = lambda: 'aarch64'\n"
                "sys.modules['surfelsplatting.vtkSurfelFilters'] = None\n"
                "import surfelsplatting")
        self.fails_with(run_python(code), "ImportError", "for Linux x86_64; this is Linux aarch64",
                        "Build it from source")


if __name__ == "__main__":
    unittest.main()

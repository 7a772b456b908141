# SPDX-License-Identifier: BSD-3-Clause
"""The Python package: every class, from a fresh interpreter, whatever was imported before."""

import os
import subprocess
import sys
import unittest

import numpy as np

from toolcase import TOOL, ToolCase, write

CLASSES = ["vtkDeepEXRWriter", "vtkLensAccumulationPass", "vtkPartitionedSurfelEstimation",
           "vtkPointCloudReader", "vtkSurfelEXRReader", "vtkSurfelEXRWriter",
           "vtkSurfelEstimation", "vtkSurfelHierarchy", "vtkSurfelHierarchyReader",
           "vtkSurfelHierarchyWriter", "vtkSurfelImageRenderer", "vtkSurfelMapper",
           "vtkSurfelNormalization", "vtkSurfelSplatter", "vtkSurfelSplattingPass",
           "vtkVolumeSplatting"]


class TestPackage(ToolCase):
    def run_python(self, code):
        environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
        return subprocess.run([sys.executable, "-s", "-c", code], capture_output=True, text=True,
                              env=environment, check=True).stdout

    def test_every_class_in_one_namespace(self):
        """It is described there, and prints itself."""
        code = (f"import surfelsplatting as s\nprint(s.__doc__)\nfor name in {CLASSES}:\n"
                "    print('made', getattr(s, name)().GetClassName(), getattr(s, name)())\n")
        described, made = self.run_python(code).split("\nmade ", 1)
        for name in CLASSES:
            self.assertIn(name, described)
            self.assertIn(f"{name} {name} (0x", made)

    def test_classes_derive_from_those_of_vtk(self):
        made = self.run_python(
            "from surfelsplatting import *\n"
            "from vtkmodules.vtkRenderingCore import vtkPolyDataMapper, vtkRenderPass\n"
            "from vtkmodules.vtkIOImage import vtkImageWriter\n"
            "from vtkmodules.vtkCommonExecutionModel import vtkPolyDataAlgorithm as a\n"
            "print(isinstance(vtkSurfelMapper(), vtkPolyDataMapper),\n"
            "      isinstance(vtkSurfelSplattingPass(), vtkRenderPass),\n"
            "      isinstance(vtkSurfelEXRWriter(), vtkImageWriter),\n"
            "      isinstance(vtkSurfelEstimation(), a))\n")
        self.assertEqual(made.split(), ["True"] * 4)

    def test_write_png(self):
        """0, half and more than full light; half is 188 of 255 in sRGB."""
        self.run_python(
            "from surfelsplatting import vtkSurfelImageRenderer, write_png\n"
            "from vtkmodules.vtkCommonDataModel import vtkImageData\n"
            "from vtkmodules.vtkRenderingCore import vtkCamera\n"
            "image = vtkImageData(); image.SetDimensions(3, 1, 1); image.AllocateScalars(10, 4)\n"
            "for x, value in enumerate((0, 0.5, 1.5)):\n"
            "    for c in range(4): image.SetScalarComponentFromFloat(x, 0, 0, c, value)\n"
            "write_png(image, 'codes.png'); write_png(image, 'light.png', linear_light=True)\n"
            "renderer = vtkSurfelImageRenderer(); renderer.SetCamera(vtkCamera())\n"
            "renderer.SetSize(2, 1); renderer.SetBackground(0.2, 0.4, 1)\n"
            "renderer.SetBackgroundAlpha(1); write_png(renderer, 'renderer.png')\n"
            "renderer.Update(1); write_png(renderer.GetOutput(1), 'bytes.png')\n")
        for name, expected in (("codes.png", [0, 128, 255]), ("light.png", [0, 188, 255])):
            self.assertEqual(self.read_png(name)[0].tolist(), [[value] * 3 for value in expected])
        for name in ("renderer.png", "bytes.png"):
            self.assertEqual(self.read_png(name)[0].tolist(), [[51, 102, 255]] * 2)

    def test_png_of_any_size(self):
        """Strips of 64 rows are compressed by different threads."""
        files = {}
        for threads in (1, 2):
            self.run_python(
                "import numpy as np\n"
                "from surfelsplatting import write_png\n"
                "from vtkmodules.util.numpy_support import numpy_to_vtk\n"
                "from vtkmodules.vtkCommonCore import vtkSMPTools\n"
                "from vtkmodules.vtkCommonDataModel import vtkImageData\n"
                f"vtkSMPTools.Initialize({threads})\n"
                "for height in (1, 64, 65, 200):\n"
                "    pixels = np.random.default_rng(height).integers(0, 256, (height, 7, 4))\n"
                "    image = vtkImageData(); image.SetDimensions(7, height, 1)\n"
                "    colors = np.float32(pixels[::-1].reshape(-1, 4) / 255)\n"
                "    image.GetPointData().SetScalars(numpy_to_vtk(colors, deep=True))\n"
                "    write_png(image, f'{height}.png'); np.save(f'{height}.npy', pixels)\n")
            for height in (1, 64, 65, 200):
                expected = np.load(f"{height}.npy")[:, :, :3]
                self.assertEqual(self.read_png(f"{height}.png").tolist(), expected.tolist())
                with open(f"{height}.png", "rb") as file:
                    content = file.read()
                self.assertEqual(files.setdefault(height, content), content, threads)

    def test_module_runs_the_tool(self):
        result = subprocess.run([sys.executable, "-s", "-m", "surfelsplatting",
                                 "--version"], capture_output=True, text=True, check=True)
        self.assertRegex(result.stdout, r"\Asurfelsplat \d+\.\d+\.\d+\n\Z")

    def test_launcher_through_a_link_and_a_foreign_python(self):
        os.symlink(TOOL, "link")
        os.mkdir("bin")
        write("bin/python3", "#!/bin/sh\nexit 99\n")
        os.chmod("bin/python3", 0o755)
        result = subprocess.run(["./link", "render", "--help", "all"], capture_output=True, text=True,
                                env={"PATH": os.path.abspath("bin") + ":/usr/bin:/bin"}, check=True)
        for option in ("--camera", "--focal-disk", "--background", "0.16 0.17 0.19", "--stats"):
            self.assertIn(option, result.stdout)
        self.assertEqual(result.stderr, "")


if __name__ == "__main__":
    unittest.main()

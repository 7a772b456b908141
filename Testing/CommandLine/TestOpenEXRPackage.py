# SPDX-License-Identifier: BSD-3-Clause
"""A deep file through OpenEXR's public Python package, which is fetched where it is missing.

    TestOpenEXRPackage.py FOLDER

FOLDER keeps the package from run to run. Without a network the test is skipped.
"""

import os
import subprocess
import sys
import unittest

import numpy as np

VERSION = "3.5.3"
SKIPPED = 77


def fetch_package(folder):
    if not os.path.isdir(os.path.join(folder, "OpenEXR-" + VERSION + ".done")):
        fetched = subprocess.run(
            [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--upgrade",
             "--target", folder, "OpenEXR==" + VERSION], capture_output=True, text=True, check=False)
        if fetched.returncode:
            print("SKIPPED: pip cannot fetch OpenEXR " + VERSION + ":\n" + fetched.stderr)
            sys.exit(SKIPPED)
        os.mkdir(os.path.join(folder, "OpenEXR-" + VERSION + ".done"))
    sys.path.insert(0, folder)


class TestOpenEXRPackage(unittest.TestCase):
    def test_deep_file(self):
        import tempfile

        import OpenEXR

        from deepfiles import check_tidy, flatten
        from surfelsplatting import vtkDeepEXRWriter, vtkSurfelImageRenderer
        from toolcase import sphere
        from vtkmodules.util.numpy_support import vtk_to_numpy

        renderer = render_sphere(vtkSurfelImageRenderer(), sphere()[0])
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "deep.exr")
            writer = vtkDeepEXRWriter()
            writer.SetInputConnection(renderer.GetOutputPort())
            writer.SetFileName(path)
            writer.DeepImageStateOff()  # which the package cannot read
            writer.Write()
            with OpenEXR.File(path, separate_channels=True) as file:
                self.assertEqual(file.header()["type"], OpenEXR.deepscanline)
                self.assertAlmostEqual(file.header()["focus"], 4.2, places=5)
                planes = {name: file.channels()[name].pixels for name in "RGBAZ"}
        height, width = planes["A"].shape
        lists = [planes["A"][y, x] for y in range(height) for x in range(width)]
        counts = np.array([0 if a is None else len(a) for a in lists]).reshape(height, width)
        samples = {name: np.concatenate([a for a in plane.ravel() if a is not None and len(a)])
                   for name, plane in planes.items()}
        check_tidy(self, counts, samples)
        picture = vtk_to_numpy(renderer.GetOutput().GetPointData().GetScalars())
        picture = picture.reshape(height, width, 4)[::-1]
        self.assertGreater(picture[..., 3].max(), 0.99)
        np.testing.assert_allclose(flatten(counts, samples), picture, atol=1.0 / 255.0)


def render_sphere(renderer, points):
    from surfelsplatting import vtkSurfelEstimation
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkRenderingCore import vtkCamera

    cloud, positions = vtkPolyData(), vtkPoints()
    positions.SetData(numpy_to_vtk(points, deep=True))
    cloud.SetPoints(positions)
    estimation = vtkSurfelEstimation()
    estimation.SetInputData(cloud)
    camera = vtkCamera()
    camera.SetPosition(0, 0, 5)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetFocalDistance(4.2)
    camera.SetFocalDisk(0.3)
    renderer.SetInputConnection(estimation.GetOutputPort())
    renderer.SetCamera(camera)
    renderer.SetSize(60, 45)
    renderer.GetSplatter().SetLensCells(4)
    renderer.GetSplatter().DeepSamplesOn()
    return renderer


if __name__ == "__main__":
    fetch_package(sys.argv.pop(1))
    unittest.main()

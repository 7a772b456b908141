# SPDX-License-Identifier: BSD-3-Clause
"""Files through OpenEXR's public Python package, which is fetched where it is missing.

The folder $OPENEXR_PACKAGE keeps it from run to run. Without a network the test is skipped.
"""

import os
import subprocess
import sys
import tempfile
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
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, "picture.exr")

    def read(self):
        """The picture that our reader makes of the file."""
        from surfelsplatting import vtkSurfelEXRReader

        reader = vtkSurfelEXRReader()
        reader.SetFileName(self.path)
        reader.Update()
        self.assertEqual(reader.GetErrorCode(), 0)
        return reader.GetOutput()

    def test_flat_files_of_any_compression(self):
        import OpenEXR

        from toolcase import arrays_of

        y, x = np.mgrid[0:70, 0:43]
        planes = {c: (1.5 + np.sin(0.1 * x + 0.07 * i * y)).astype(np.float16)
                  for i, c in enumerate("RGBA")}
        planes["Z"] = np.random.default_rng(8).uniform(1, 9, (70, 43)).astype(np.float32)
        colors = np.stack([planes[c] for c in "RGBA"], axis=-1).astype(np.float32)
        # What colours lose; of floats only PXR24 takes something away.
        losses = {"NO": 0, "RLE": 0, "ZIPS": 0, "ZIP": 0, "PIZ": 0, "PXR24": 0, "B44": 0.05,
                  "B44A": 0.05, "DWAA": 0.05, "DWAB": 0.05}
        for name, loss in losses.items():
            header = {"compression": getattr(OpenEXR, name + "_COMPRESSION"),
                      "type": OpenEXR.scanlineimage}
            OpenEXR.File(header, dict(planes)).write(self.path)
            arrays = {array: values.reshape(70, 43, -1)[::-1]
                      for array, values in arrays_of(self.read()).items()}
            self.assertEqual(set(arrays), {"Color", "Depth"})
            np.testing.assert_allclose(arrays["Color"], colors, rtol=0, atol=loss, err_msg=name)
            np.testing.assert_allclose(arrays["Depth"][..., 0], planes["Z"], rtol=0,
                                       atol=1e-3 if name == "PXR24" else 0, err_msg=name)

    def test_deep_file_of_theirs(self):
        import OpenEXR

        from toolcase import arrays_of
        from vtkmodules.util.numpy_support import vtk_to_numpy

        rng = np.random.default_rng(9)
        counts = rng.integers(1, 4, (6, 5))
        planes = {c: np.empty((6, 5), object) for c in "RGBAZ"}
        for y, x in np.ndindex(6, 5):
            for c in "RGBA":
                planes[c][y, x] = rng.uniform(0, 1, counts[y, x]).astype(np.float16)
            planes["Z"][y, x] = np.sort(rng.uniform(1, 9, counts[y, x])).astype(np.float32)
        header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.deepscanline}
        OpenEXR.File(header, dict(planes)).write(self.path)
        picture = self.read()
        np.testing.assert_array_equal(arrays_of(picture)["SampleCount"], counts[::-1].ravel())
        samples = vtk_to_numpy(picture.GetFieldData().GetArray("DeepSamples"))
        for i, c in enumerate("RGBAZ"):
            expected = np.concatenate(planes[c][::-1].ravel()).astype(np.float32)
            np.testing.assert_array_equal(samples[:, i], expected)

    def test_deep_file(self):
        import OpenEXR

        from deepfiles import check_tidy, flatten, sphere_renderer
        from surfelsplatting import vtkDeepEXRWriter
        from toolcase import sphere
        from vtkmodules.util.numpy_support import vtk_to_numpy

        renderer = sphere_renderer(sphere()[0])
        writer = vtkDeepEXRWriter()
        writer.SetInputConnection(renderer.GetOutputPort())
        writer.SetFileName(self.path)
        writer.Write()
        with OpenEXR.File(self.path, separate_channels=True) as file:
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


if __name__ == "__main__":
    fetch_package(os.environ["OPENEXR_PACKAGE"])
    unittest.main()

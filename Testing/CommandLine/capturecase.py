# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of vtkGaussianSplatReader share."""

import numpy as np

from surfelsplatting import vtkGaussianSplatReader
from toolcase import ToolCase, arrays_of, places_of

EPSILON = np.finfo(np.float32).eps


def symmetric(matrices):
    """[n, 6] XX YY ZZ XY YZ XZ of [n, 3, 3]"""
    return matrices[:, (0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)]


def covariance_error(found, expected):
    """The largest of [n, 6], relative to the largest variance of each Gaussian"""
    return (np.abs(found - expected) / expected[:, :3].max(axis=1)[:, None]).max()


class CaptureCase(ToolCase):
    def reader(self, path):
        reader = vtkGaussianSplatReader()
        self.note_errors(reader)
        reader.SetFileName(path)
        return reader

    def read(self, path):
        """-> reader, points, point arrays"""
        reader = self.reader(path)
        reader.Update()
        self.assertEqual((reader.GetErrorCode(), self.errors), (0, []))
        output = reader.GetOutput()
        self.assertEqual(output.GetNumberOfVerts(), 1)
        return reader, places_of(output), arrays_of(output)

    def failure(self, path):
        reader = self.reader(path)
        reader.Update()
        self.assertNotEqual(reader.GetErrorCode(), 0)
        self.assertEqual(len(self.errors), 1, self.errors)
        self.assertIn(path, self.errors[0])
        output = reader.GetOutput()
        self.assertEqual((output.GetNumberOfPoints(), output.GetPointData().GetNumberOfArrays()),
                         (0, 0))
        return self.errors[0]

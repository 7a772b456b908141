# SPDX-License-Identifier: BSD-3-Clause
"""Runs the notebook of Examples/PyVista, and looks at its pictures."""

import base64
import io
import os
import unittest

import numpy as np

from plottercase import SOURCE, run_notebook

try:
    import ipykernel  # noqa: F401
    import nbclient  # noqa: F401
    import nbformat
    from PIL import Image
except ImportError as missing:
    raise unittest.SkipTest(f"{missing.name} is not installed") from None

NOTEBOOK = os.path.join(SOURCE, "Examples", "PyVista", "lens.ipynb")


def pictures(notebook):
    """-> RGB arrays"""
    data = [output["data"]["image/png"] for cell in notebook.cells
            for output in cell.get("outputs", []) if "image/png" in output.get("data", {})]
    return [np.asarray(Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB"))
            for png in data]


def covered(picture):
    """Share of the lower half that is not as bright and blue as the sky."""
    lower = picture[len(picture) // 2:].astype(int)
    return (lower[..., 2] < lower[..., 1] + 5).mean()


class TestNotebook(unittest.TestCase):
    def test_pictures(self):
        points, surfels, lenses, scalars, array = pictures(run_notebook(nbformat.read(NOTEBOOK, 4)))
        for picture in (points, surfels, scalars, array):
            self.assertEqual(picture.shape, (560, 900, 3))
        # Points leave holes that surfels close.
        self.assertLess(covered(points), 0.7)
        self.assertGreater(covered(surfels), 0.97)
        self.assertGreater(covered(array), 0.97)
        # Each lens focuses on another rock: the near one at the left, the far one at the right.
        near, far = lenses[:560].astype(int), lenses[560:].astype(int)

        def detail(picture, rows, columns):
            return np.abs(np.diff(picture[rows, columns], axis=1)).mean()

        rock, back = (slice(400, 540), slice(140, 320)), (slice(80, 210), slice(710, 880))
        self.assertGreater(detail(near, *rock), 1.5 * detail(far, *rock))
        self.assertGreater(detail(far, *back), 1.5 * detail(near, *back))

    def test_kept_without_outputs(self):
        for cell in nbformat.read(NOTEBOOK, 4).cells:
            self.assertFalse(cell.get("outputs"))


if __name__ == "__main__":
    unittest.main()

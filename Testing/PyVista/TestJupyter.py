# SPDX-License-Identifier: BSD-3-Clause
"""The backends for notebooks: static pictures, and trame, which sends pictures from the server."""

import base64
import io
import itertools
import json
import unittest
import zipfile

import numpy as np
from surfelsplatting.backend import vtk

from plottercase import PlotterCase, run_notebook

TRAME = """
import numpy as np
import pyvista as pv

points = np.random.default_rng(1).normal(size=(2000, 3))
for name in ("trame", "server"):
    pl = pv.Plotter(notebook=True, window_size=(240, 180))
    pl.surfels.add(points / np.linalg.norm(points, axis=1)[:, None], color="tan")
    pl.surfels.lens(coc=20, focus=(0, 0, 1))
    widget = pl.show(jupyter_backend=name, return_viewer=True)
    print("iframe" in widget.value)
    pl.close()
"""


class TestJupyter(PlotterCase):
    def test_static(self):
        picture = self.surfels.surfels.plot(scalars="RGB", jupyter_backend="static", notebook=True,
                                            window_size=(240, 180), return_viewer=True)
        self.assertEqual(picture.size, (240, 180))
        self.assertGreater(np.asarray(picture).max(axis=2).astype(bool).mean(), 0.2)

    def test_pictures_of_a_server(self):
        """What trame sends to the browser is what a screenshot shows, with less quality."""
        try:
            from PIL import Image
            application = vtk("vtkWebCore").vtkWebApplication()
        except ImportError as missing:
            self.skipTest(f"{missing.name} is not installed")
        pl = self.plotter()
        pl.surfels.add(self.surfels, "stripes", cmap="gray", show_scalar_bar=False)
        pl.surfels.lens(coc=40, focus=(0, 0, 1))
        shot = self.picture(pl)
        sent = bytes(memoryview(application.StillRender(pl.render_window, 100)))
        jpeg = np.asarray(Image.open(io.BytesIO(base64.b64decode(sent))).convert("RGB"))
        self.assertLess(np.abs(jpeg.astype(int) - shot).mean(), 2)

    def test_files_for_browsers(self):
        """Have the points, since browsers have no surfels; they were left out without a word."""
        try:
            import trame_pyvista  # noqa: F401
        except ImportError as missing:
            self.skipTest(f"{missing.name} is not installed")
        pl = self.plotter()
        pl.surfels.add(self.surfels, "RGB")
        pl.surfels.lens(coc=20)
        content = io.BytesIO(pl.trame.export_vtksz(None))
        with zipfile.ZipFile(content) as archive:
            scene = json.loads(archive.read("index.json"))["scene"]

        def parts(part):
            return [part, *itertools.chain.from_iterable(map(parts, part.get("dependencies", [])))]

        [data] = [part["properties"] for part in parts(scene) if part["type"] == "vtkPolyData"]
        self.assertEqual(data["points"]["size"], 3 * self.surfels.n_points)
        self.assertEqual([field["name"] for field in data["fields"] if field["numberOfComponents"] == 3
                          and field["dataType"] == "Uint8Array"], ["RGB"])

    def test_trame(self):
        try:
            import ipykernel  # noqa: F401
            import nbclient  # noqa: F401
            import nbformat
            import trame_pyvista  # noqa: F401
        except ImportError as missing:
            self.skipTest(f"{missing.name} is not installed")
        cell = nbformat.v4.new_code_cell(TRAME)
        run_notebook(nbformat.v4.new_notebook(cells=[cell]))
        printed = "".join(output.get("text", "") for output in cell.outputs
                          if output.get("name") == "stdout")
        self.assertEqual(printed.split(), ["True", "True"])


if __name__ == "__main__":
    unittest.main()

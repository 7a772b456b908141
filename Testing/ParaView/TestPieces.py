# SPDX-License-Identifier: BSD-3-Clause
"""Pieces of a partitioned data set are one cloud."""

import numpy as np
from paraview import simple
from paraview.numpy_support import numpy_to_vtk
from paraview.vtk.vtkCommonCore import vtkPoints
from paraview.vtk.vtkCommonDataModel import vtkPolyData
from paraview.vtk.vtkIOXML import vtkXMLPolyDataWriter

from plugincase import SIZE, PluginCase, screenshot, sphere


def write_points(path, points):
    data = vtkPolyData()
    data.SetPoints(vtkPoints())
    data.GetPoints().SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=1))
    writer = vtkXMLPolyDataWriter()
    writer.SetDataModeToAscii()  # Debian's libexpat cannot read what is appended
    writer.SetInputData(data)
    writer.SetFileName(path)
    writer.Write()


def write_pieces(name, pieces):
    for i, piece in enumerate(pieces):
        write_points(f"{name}_{i}.vtp", piece)
    with open(f"{name}.vtpd", "w") as file:
        file.write('<VTKFile type="vtkPartitionedDataSet" version="1.0" byte_order="LittleEndian">'
                   "<vtkPartitionedDataSet>")
        file.write("".join(f'<DataSet index="{i}" file="{name}_{i}.vtp"/>'
                           for i in range(len(pieces))))
        file.write("</vtkPartitionedDataSet></VTKFile>")


class Pieces(PluginCase):
    def setUp(self):
        super().setUp()
        self.cloud = sphere(4000, (0, 0, 0))  # from top to bottom
        write_points("whole.vtp", self.cloud)
        write_pieces("pieces", [self.cloud[:1500], np.empty((0, 3)), self.cloud[1500:]])
        self.view.CameraPosition = [0, -5, 0]  # the cut is in the middle
        self.view.CameraViewUp = [0, 0, 1]

    def draw(self, source):
        self.show(source)
        simple.Render(self.view)  # ParaView's first picture does not know how far away the data are
        seen = screenshot(self.view)
        simple.Hide(source, self.view)
        return seen

    def test_pieces_are_estimated_as_one_cloud(self):
        whole = self.draw(simple.XMLPolyDataReader(FileName=["whole.vtp"]))
        self.assertGreater(whole[SIZE // 2, SIZE // 2].min(), 100)
        pieces = simple.XMLPartitionedDatasetReader(FileName=["pieces.vtpd"])
        self.assertLess(np.abs(self.draw(pieces) - whole).max(), 2)

    def test_pieces_that_have_surfels(self):
        """Each has an origin of its own, where coordinates are large."""
        seen = []
        for corner in ([0, 0, 0], [5e6, 4e5, 100]):
            write_pieces("surfels", [half + corner for half in np.split(self.cloud, 2)])
            self.view.CameraPosition, self.view.CameraFocalPoint = np.add(
                [[0, -5, 0], [0, 0, 0]], corner)
            seen.append(self.draw(simple.SurfelNormalization(Input=simple.SurfelEstimation(
                Input=simple.XMLPartitionedDatasetReader(FileName=["surfels.vtpd"])))))
        self.assertGreater(seen[0][SIZE // 2, SIZE // 2].min(), 100)
        self.assertLess(np.abs(seen[1] - seen[0]).max(), 4)

    def test_selection_names_the_piece(self):
        pieces = simple.XMLPartitionedDatasetReader(FileName=["pieces.vtpd"])
        self.draw(pieces)
        self.show(pieces)
        # ParaView 5.13 counts the data set itself as well.
        first = 2 if simple.GetParaViewVersion().minor >= 13 else 1
        for below, index, piece in ((True, first + 2, self.cloud[1500:]),
                                    (False, first, self.cloud[:1500])):
            low = 90 if below else 190
            simple.SelectSurfacePoints(Rectangle=[140, low, 160, low + 20], View=self.view)
            ids = np.asarray(pieces.GetSelectionInput(0).Input[0].IDs).reshape(-1, 3)
            self.assertEqual(set(ids[:, 0]), {index})
            x, y, z = piece[ids[:, 2]].T
            self.assertGreater(len(x), 10)
            self.assertLess(np.abs(x).max(), 0.15)
            self.assertLess(y.max(), 0)
            self.assertTrue(np.all(z < 0) if below else np.all(z > 0))
            simple.ClearSelection(pieces)

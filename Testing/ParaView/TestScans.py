# SPDX-License-Identifier: BSD-3-Clause
"""Renders real scans with the example's functions, and writes the input of plainvtk.py."""

import json
import os
import sys
import unittest

import numpy as np
from paraview import simple
from paraview.vtk.vtkIOImage import vtkPNGReader
from paraview.numpy_support import vtk_to_numpy

sys.path.insert(0, os.environ["EXAMPLES"])
import depth_of_field

SCANS = os.environ.get("SCANS", "")
FOLDER = os.path.join(os.environ["FOLDER"], "scans")
SIZE = (900, 700)
SEEN = {  # name: direction, up, zoom, focus, blur in px
    "lion_takanawa_normals.ply": ((0.6, -1, 0.35), (0, 0, 1), 1.9, (0.48, 0.62), 40),
    "pcl_region_growing_rgb_tutorial.pcd": ((0.1, -0.15, -1), (0, -1, 0), 1.9, (0.55, 0.25), 40),
}


@unittest.skipUnless(SCANS, "no folder SCANS with scans")
class Scans(unittest.TestCase):
    def draw(self, name):
        seen_from, up, zoom, focus, blur = SEEN[name]
        view, display = depth_of_field.show(
            depth_of_field.open_scan(os.path.join(SCANS, name)), SIZE, seen_from, up, zoom)
        view.UseFXAA = 0
        view.UseColorPaletteForBackground = 0
        view.Background = [0.2, 0.2, 0.25]
        depth_of_field.focus_at(view, display, *focus)
        depth_of_field.blur(display, blur)
        picture = os.path.join(FOLDER, name + ".png")
        simple.SaveScreenshot(picture, view)
        with open(picture + ".json", "w") as file:
            json.dump({
                "scan": name, "size": SIZE, "background": list(view.Background),
                "position": list(view.CameraPosition),
                "focal_point": list(view.CameraFocalPoint), "up": list(view.CameraViewUp),
                "angle": view.CameraViewAngle, "focus": list(display.SurfelFocusPoint),
                "radius": display.SurfelCircleOfConfusion}, file)
        simple.Delete(view)
        reader = vtkPNGReader()
        reader.SetFileName(picture)
        reader.Update()
        return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())[:, :3].astype(float)

    def test_scans(self):
        os.makedirs(FOLDER, exist_ok=True)
        for name in SEEN:
            picture = self.draw(name)
            covered = np.abs(picture - np.array([51, 51, 64])).max(1) > 8
            self.assertGreater(covered.mean(), 0.25, name)

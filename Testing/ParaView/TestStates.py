# SPDX-License-Identifier: BSD-3-Clause
"""State files and traces bring the same picture back."""

import numpy as np
from paraview import simple, smstate, smtrace

from plugincase import SIZE, PluginCase, run, screenshot


class States(PluginCase):
    def change(self, display):
        display.Representation = "Surfel Splats"
        display.ColorArrayName = ["POINTS", ""]
        display.SurfelLensMode = "Circle of confusion"
        display.SurfelCircleOfConfusion = 20.0
        display.SurfelLODError = 2.0

    def change_view(self, view):
        view.CameraFocalDistance = 9.0
        if self.view_type == "SurfelRenderView":
            view.LensMode = "Circle of confusion"
            view.CircleOfConfusion = 30.0
            view.LensCells = 3

    def make(self):
        self.change(simple.Show(self.points, self.view))
        self.change_view(self.view)
        return screenshot(self.view)

    def picture_of_the_only_view(self):
        self.view = simple.GetViewsInLayout()[0] if not simple.GetRenderView() \
            else simple.GetRenderView()
        self.assertEqual(self.view.GetXMLName(), self.view_type)
        self.view.ViewSize = [SIZE, SIZE]
        return screenshot(self.view)

    def assert_same(self, before):
        self.assertLess(np.abs(self.picture_of_the_only_view() - before).max(), 2)

    def test_state_file(self):
        before = self.make()
        simple.SaveState("state.pvsm")
        simple.ResetSession()
        simple.LoadState("state.pvsm")
        self.assert_same(before)

    def test_state_as_python(self):
        before = self.make()
        script = smstate.get_state()
        simple.ResetSession()
        exec(script, {"__name__": "__main__"})
        self.assert_same(before)

    def test_trace(self):
        # As the panels do it: one proxy at a time. Plain assignments are not traced.
        before = self.make()
        simple.ResetSession()
        smtrace.start_trace()
        points = simple.LegacyVTKReader(FileNames=["sphere.vtk"])
        view = simple.CreateView(self.view_type)
        display = simple.Show(points, view)
        for proxy, change in ((display, self.change), (view, self.change_view)):
            item = smtrace.PropertiesModified(proxy.SMProxy)
            change(proxy)
            item.finalize()
        script = smtrace.stop_trace()
        for name in ("Surfel Splats", "SurfelLensMode", "SurfelCircleOfConfusion"):
            self.assertIn(name, script)
        simple.ResetSession()
        exec(script, {"__name__": "__main__"})
        view = simple.GetViews()[-1]
        display = view.Representations[0]
        self.assertEqual(display.Representation, "Surfel Splats")
        self.assertEqual(display.SurfelLensMode, "Circle of confusion")
        self.assertEqual(display.SurfelCircleOfConfusion, 20.0)
        for name in ("CameraPosition", "CameraFocalPoint", "CameraViewUp", "CameraFocalDistance"):
            setattr(view, name, {"CameraPosition": [0, 0, 5], "CameraFocalPoint": [0, 0, 0],
                                 "CameraViewUp": [0, 1, 0], "CameraFocalDistance": 9.0}[name])
        view.UseColorPaletteForBackground = 0
        view.Background = [0.0, 0.0, 0.0]
        view.OrientationAxesVisibility = 0
        view.UseFXAA = 0
        view.ViewSize = [SIZE, SIZE]
        self.view = view
        self.assertLess(np.abs(screenshot(view) - before).max(), 2)


class StatesOfSurfelRenderView(States):
    view_type = "SurfelRenderView"


if __name__ == "__main__":
    run(States, StatesOfSurfelRenderView)

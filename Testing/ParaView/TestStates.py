# SPDX-License-Identifier: BSD-3-Clause
"""State files and traces bring the same pictures back, in views of both kinds."""

import numpy as np
from paraview import simple, smstate, smtrace

from plugincase import SIZE, PluginCase, make_view, screenshot


class States(PluginCase):
    def setUp(self):
        super().setUp()
        self.views = [self.view, make_view("SurfelRenderView")]

    def change(self, display):
        display.Representation = "Surfel Splats"
        display.ColorArrayName = ["POINTS", ""]
        display.SurfelLensMode = "Circle of confusion"
        display.SurfelCircleOfConfusion = 20.0
        display.SurfelLODError = 2.0

    def change_view(self, view):
        view.CameraFocalDistance = 9.0
        if view.GetXMLName() == "SurfelRenderView":
            view.LensMode = "Circle of confusion"
            view.CircleOfConfusion = 30.0
            view.LensCells = 3

    def make(self):
        for view in self.views:
            self.change(simple.Show(self.points, view))
            self.change_view(view)
        return [screenshot(view) for view in self.views]

    def assert_same(self, before):
        self.assertEqual(len(simple.GetViews()), 2)  # none of the session before
        views = {view.GetXMLName(): view for view in simple.GetViews()}
        for kind, expected in zip(("RenderView", "SurfelRenderView"), before):
            views[kind].ViewSize = [SIZE, SIZE]
            self.assertLess(np.abs(screenshot(views[kind]) - expected).max(), 2, kind)

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
        for kind in ("RenderView", "SurfelRenderView"):
            view = simple.CreateView(kind)
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
        for view in simple.GetViews():
            display = view.Representations[0]
            self.assertEqual(display.Representation, "Surfel Splats")
            self.assertEqual(display.SurfelLensMode, "Circle of confusion")
            self.assertEqual(display.SurfelCircleOfConfusion, 20.0)
            view.CameraPosition, view.CameraFocalPoint = [0, 0, 5], [0, 0, 0]
            view.CameraViewUp, view.CameraFocalDistance = [0, 1, 0], 9.0
            view.UseColorPaletteForBackground = 0
            view.Background = [0.0, 0.0, 0.0]
            view.OrientationAxesVisibility = 0
            view.UseFXAA = 0
        self.assert_same(before)

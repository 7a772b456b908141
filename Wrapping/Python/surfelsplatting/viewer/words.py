# SPDX-License-Identifier: BSD-3-Clause
"""What is written over a window's picture: the state, messages, help and a colour bar."""

from ..backend import vtk
from ..views.focus import distance_in_focus

HELP = """\
click            focus on what is seen there
drag             turn
Shift + drag     move (or the middle button)
wheel            nearer, farther (or the right button)

Up, Down         open and close the aperture
l                lens on and off
c                next colours: own, scalars, x, y, z
+ -              more, less detail while moving
r                first view
s                save picture and camera file
h                this help
q                quit"""

MARGIN = 12  # px
FONT = 15  # px
LINE = 1.6 * FONT  # px, with the gap between lines
GREY = (0.93, 0.93, 0.93)
PANEL = (0.05, 0.05, 0.06)


def _padded(lines):
    return "\n".join(f" {line} " for line in lines)


class Words:
    """The words in a vtkRenderer."""

    def __init__(self, renderer):
        self.message = ""
        self.has_help = False
        self._renderer = renderer
        self._state = self._text(False)
        self._news = self._text(True)
        self._help = self._text(True)
        self._help.GetTextProperty().SetFontFamilyToCourier()
        self._help.SetInput(_padded(HELP.splitlines()))
        self._bar = self._color_bar()

    def _text(self, at_top):
        actor = vtk("vtkRenderingCore").vtkTextActor()
        style = actor.GetTextProperty()
        style.SetFontSize(FONT)
        style.SetColor(GREY)
        style.SetBackgroundColor(PANEL)
        style.SetBackgroundOpacity(0.6)
        style.SetLineSpacing(1.2)
        if at_top:
            style.SetVerticalJustificationToTop()
        actor.SetPosition(MARGIN, MARGIN)
        self._renderer.AddViewProp(actor)
        return actor

    def _color_bar(self):
        bar = vtk("vtkRenderingAnnotation").vtkScalarBarActor()
        bar.SetNumberOfLabels(5)
        bar.SetMaximumNumberOfColors(256)
        bar.SetLabelFormat("%.4g")
        bar.UnconstrainedFontSizeOn()
        for style in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
            style.SetFontSize(FONT)
            style.SetColor(GREY)
            style.ItalicOff()
            style.BoldOff()
            style.ShadowOff()
        bar.SetPosition(0.9, 0.25)
        bar.SetWidth(0.08)
        bar.SetHeight(0.5)
        self._renderer.AddViewProp(bar)
        return bar

    def show(self, viewer, news):
        """viewer: Viewer. news: lines to write first."""
        lines = [*news, *filter(None, [self.message])]
        top = viewer.view.size[1] - MARGIN
        self._set(self._state, [describe(viewer)])
        self._set(self._news, lines)
        self._news.SetPosition(MARGIN, top)
        self._help.SetVisibility(self.has_help)
        self._help.SetPosition(MARGIN, top - (len(lines) * LINE + MARGIN if lines else 0))
        self._bar.SetVisibility(viewer.scalars is not None)
        if viewer.scalars is not None:
            self._bar.SetLookupTable(viewer.actor.GetMapper().GetLookupTable())
            self._bar.SetTitle(viewer.scalars)

    @staticmethod
    def _set(actor, lines):
        actor.SetInput(_padded(lines))
        actor.SetVisibility(bool(lines))


def describe(viewer):
    """The state in one line."""
    lens = "pinhole"
    if viewer.aperture:
        lens = f"aperture {viewer.aperture:.3g} px, blur up to {viewer.largest_blur():.3g} px"
    return f"{lens}   focus at {distance_in_focus(viewer.view):.4g}   h: help"

# SPDX-License-Identifier: BSD-3-Clause
"""The layout of the page: the picture, and a panel with the lens, the colours and saving."""

from ..colormaps import colors_of
from .viewer import APERTURES

AREA = "scan"  # the name of the area that shows the pictures

HELP = (("click", "focus"), ("drag", "turn"), ("Shift + drag", "move"),
        ("wheel", "nearer, farther"), ("Up, Down", "aperture"), ("l", "lens on, off"),
        ("c", "next colours"), ("r", "first view"))

STYLE = """
body { margin: 0; overflow: hidden; background: #292b30; }
.all { position: fixed; inset: 0; font: 14px/1.5 system-ui, sans-serif; color: #eee; }
.all .remote-controlled-area { width: 100%; height: 100%; outline: none; }
.all .remote-controlled-area img { display: block; }
.panel { position: absolute; top: 12px; right: 12px; width: 230px; padding: 10px 14px;
  background: rgba(13, 13, 15, 0.72); border-radius: 6px; }
.panel label { display: block; margin-top: 8px; }
.panel input[type=range], .panel select { width: 100%; box-sizing: border-box; }
.panel .row { display: flex; gap: 6px; margin-top: 12px; }
.panel .row > * { flex: 1; text-align: center; padding: 3px 0; border-radius: 4px; color: #eee;
  border: 1px solid #777; background: #333; font: inherit; text-decoration: none; cursor: pointer; }
.panel table { margin-top: 10px; font-size: 12px; color: #bbb; border-spacing: 0; }
.panel td:first-child { padding-right: 10px; white-space: nowrap; }
.bar { height: 12px; margin-top: 6px; border-radius: 2px; }
.ends { display: flex; justify-content: space-between; font-size: 12px; }
.news { position: absolute; left: 12px; bottom: 12px; padding: 4px 10px; max-width: 60%;
  background: rgba(13, 13, 15, 0.72); border-radius: 6px; white-space: pre-line; }
"""


def gradient_of(colormap):
    """A colour map for CSS."""
    colors = colors_of(colormap)[::15]
    return "linear-gradient(to right, " + ", ".join(
        "rgb({:.0f} {:.0f} {:.0f})".format(*(255 * color)) for color in colors) + ")"


def build(server, title):
    """-> the area, whose pictures a handler sends."""
    from trame.ui.html import DivLayout
    from trame.widgets import client, html, rca

    server.state.trame__title = f"{title} - surfelsplat"
    with DivLayout(server, classes="all"):
        client.Style(STYLE)
        area = rca.RemoteControlledArea(name=AREA, display="image")
        with html.Div(classes="panel"):
            html.B(title)
            html.Label("{{ lens }}")
            html.Input(id="aperture", type="range", min=0, max=len(APERTURES) - 1,
                       value=("stop", 0), input="stop = Number($event.target.value)")
            html.Label("Colours", v_if="names.length")
            with html.Select(id="colors", value=("scalars", ""), v_if="names.length",
                             change="scalars = $event.target.value"):
                html.Option("its own", value="")
                html.Option("{{ name }}", v_for="name in names", key="name", value=("name",))
            html.Div(v_if="scalars", classes="bar", style=("{background: bar}",))
            with html.Div(v_if="scalars", classes="ends"):
                html.Span("{{ ends[0] }}")
                html.Span("{{ ends[1] }}")
            with html.Div(classes="row"):
                html.Button("First view", id="reset", click="trigger('reset')")
                html.A("Picture", id="picture", href="picture.png", download=True)
                html.A("Camera", id="camera", href="camera.json", download=True)
            with html.Table():
                for what, does in HELP:
                    with html.Tr():
                        html.Td(what)
                        html.Td(does)
        html.Div("{{ news }}", id="news", classes="news", v_if="news")
    return area

# SPDX-License-Identifier: BSD-3-Clause
"""A Viewer in a page: pictures are rendered here, and a browser shows them and sends the mouse.

Neither OpenGL nor a display is needed. The page sends numbers and names of scalars, never paths.
"""

import asyncio
import json
import logging
import math
import os
import socket
import sys
from urllib.parse import quote

from ..pictures import png_bytes, rgb_bytes
from ..problems import UserProblem, find_own_packages, how_to_install
from ..views.cameras import STILL_CELLS, view_values
from .access import PARAMETER, Gate, is_loopback, new_token
from .mouse import Mouse
from .page import AREA, build, gradient_of
from .viewer import APERTURES

POLL = 0.2  # s between looks at the estimation
SMALLEST, LARGEST = 16, 2048  # px, of a side, whatever a page asks for
FARTHEST = 10_000  # px, of a place
MOST_NOTCHES = 10  # of the wheel at once
FRAMES = 20  # a second, at most
QUALITY = {"interactive_quality": 75, "still_quality": 92}  # of JPEG
NAME = "surfelsplat"


def check_packages():
    find_own_packages()
    try:
        import trame.app  # noqa: F401
        import trame_rca  # noqa: F401
    except ImportError as error:
        raise UserProblem(f"surfelsplat web needs trame and trame-rca ({error}): "
                          + how_to_install("trame trame-rca")) from None


def _finite(value, largest):
    """A number of the page, cut off."""
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        raise UserProblem("the page sent no number")
    return min(max(value, -largest), largest)


class Area:
    """What trame-rca asks for a picture and tells about the mouse: a RemoteControlledArea."""

    def __init__(self, viewer, page, linear_light):
        self._viewer, self._page, self._linear_light = viewer, page, linear_light
        self._mouse = Mouse(viewer)
        self._shown = None

    @property
    def img_cols_rows(self):
        """trame-rca asks again for what does not change any more: that is drawn finely."""
        viewer = self._viewer
        width, height = viewer.view.size
        asked = viewer.view, viewer.actor
        cells = STILL_CELLS if asked == self._shown and not viewer.is_preview else 1
        self._shown = asked
        rgb = rgb_bytes(viewer.picture(cells), self._linear_light)
        return rgb.reshape(height, width, 3)[::-1].copy(), width, height

    def process_resize_event(self, width, height):
        self._viewer.resize(*(min(max(side, SMALLEST), LARGEST) for side in (width, height)))

    def process_interaction_event(self, event):
        """event: as vtk.js' RenderWindowInteractor sends it."""
        kind = str(event.get("type"))
        try:
            if kind in ("KeyPress", "KeyDown"):
                # Ctrl+R is the browser's.
                changed = not event.get("controlKey") and self._page.key(event.get("key"), kind)
            else:
                changed = self._mouse_event(kind, event)
        except UserProblem as problem:
            changed = True
            self._page.say(str(problem))
        if changed:
            self._page.show()

    def _mouse_event(self, kind, event):
        mouse = self._mouse
        if kind == "MouseWheel":
            mouse.wheel(-_finite(event["spinY"], MOST_NOTCHES))
            return True
        if kind == "MouseMove":
            return mouse.move(self._place(event))
        for button in ("Left", "Middle", "Right"):
            if kind == f"{button}ButtonPress":
                mouse.press(button, bool(event.get("shiftKey")), self._place(event))
            elif kind == f"{button}ButtonRelease":
                self._page.say(mouse.release())
                return True
        return False

    @staticmethod
    def _place(event):
        # vtk.js measures from the lower border; its first row is 1.
        return _finite(event["x"], FARTHEST), _finite(event["y"], FARTHEST) - 1


class Page:
    """viewer: Viewer. estimation: AwaitedSurfels of the scan, or None."""

    def __init__(self, viewer, estimation, arguments, say):
        from trame.app import get_server

        self._viewer, self._estimation, self._say = viewer, estimation, say
        self._arguments = arguments
        self._problem = None
        self._message = ""
        self._handler = None
        self._server = get_server(NAME, client_type="vue3")
        needs_token = arguments.token or not is_loopback(arguments.host)
        self._token = new_token() if needs_token else None
        self._make_state()
        self._make_layout()

    def _make_state(self):
        state, controller = self._server.state, self._server.controller
        self._tell()
        state.change("stop")(self._on_stop)
        state.change("scalars")(self._on_scalars)
        controller.trigger("reset")(self._on_reset)
        controller.on_server_bind.add(self._on_bind)
        controller.on_server_ready.add(self._on_ready)

    def _make_layout(self):
        self._area = build(self._server, os.path.basename(self._arguments.cloud))

    # What the page shows.

    def say(self, message):
        self._message = message

    def show(self):
        """Sends a new picture and state."""
        with self._server.state:
            self._tell()
        if self._handler:
            self._handler.schedule_render()

    def _tell(self):
        state, viewer = self._server.state, self._viewer
        state.stop = self._stop()
        state.lens = "Aperture: pinhole"
        if viewer.aperture:
            state.lens = (f"Aperture {viewer.aperture:.3g} px, blur up to "
                          f"{viewer.largest_blur():.3g} px")
        state.scalars = viewer.scalars or ""
        state.names = viewer.scalar_names()
        state.bar, state.ends = self._bar()
        state.news = self._news()

    def _stop(self):
        """Place of the slider: the first aperture of the scale that is as open, or the last."""
        return next((i for i, aperture in enumerate(APERTURES)
                     if aperture >= self._viewer.aperture - 1e-9), len(APERTURES) - 1)

    def _bar(self):
        if not self._viewer.scalars:
            return "", ["", ""]
        limits = self._viewer.actor.GetMapper().GetLookupTable().GetTableRange()
        return gradient_of(self._arguments.colormap or "viridis"), [f"{x:.4g}" for x in limits]

    def _news(self):
        problem = self._viewer.take_problem()
        if self._estimation:
            return f"{self._estimation.describe()}; points are shown until then"
        return problem or self._message

    # What the page says. Its values may be anything.

    def _on_stop(self, stop, **_):
        if isinstance(stop, int) and 0 <= stop < len(APERTURES) and stop != self._stop():
            self._viewer.aperture = APERTURES[stop]
            self.say("")
        self.show()

    def _on_scalars(self, scalars, **_):
        known = ["", *self._viewer.scalar_names()]
        if scalars in known and scalars != (self._viewer.scalars or ""):
            self._viewer.color_by(scalars or None)
        self.show()

    def _on_reset(self, *_, **__):
        self._viewer.reset()
        self.say("")
        self.show()

    def key(self, name, kind):
        """-> whether something has changed"""
        viewer = self._viewer
        keys = {"KeyPress": {"l": viewer.toggle_lens, "c": viewer.next_colors, "r": viewer.reset},
                "KeyDown": {"ArrowUp": lambda: viewer.step_aperture(1),
                            "ArrowDown": lambda: viewer.step_aperture(-1)}}
        action = keys[kind].get(name) if isinstance(name, str) else None
        if action:
            self.say("")
            action()
        return bool(action)

    # The server.

    def _on_bind(self, server):
        from aiohttp import web

        server.app.middlewares.append(Gate(self._token).middleware())
        server.app.add_routes([web.get("/picture.png", self._picture_file),
                               web.get("/camera.json", self._camera_file)])

    def _download(self, content, kind, name):
        from aiohttp import web

        return web.Response(body=bytes(content), content_type=kind, headers={
            "Content-Disposition": f"attachment; filename=\"{quote(name)}\"",
            "Cache-Control": "no-store"})

    async def _picture_file(self, _request):
        content = png_bytes(self._viewer.picture(), self._arguments.linear_light)
        return self._download(content, "image/png", f"{self._viewer.stem}.png")

    async def _camera_file(self, _request):
        content = json.dumps(view_values(self._viewer.view), indent=1) + "\n"
        return self._download(content.encode(), "application/json",
                              f"{self._viewer.stem}.camera.json")

    def _on_ready(self, **_):
        from trame.app import asynchronous
        from trame_rca.utils import RcaRenderScheduler, RcaViewAdapter

        area = Area(self._viewer, self, self._arguments.linear_light)
        scheduler = RcaRenderScheduler(area, target_fps=FRAMES, rca_encoder="jpeg", **QUALITY)
        self._handler = RcaViewAdapter(area, AREA, scheduler=scheduler,
                                       do_schedule_render_on_interaction=False)
        self._area.add_view_handler(self._handler)
        if self._estimation:
            asynchronous.create_task(self._poll())
        print(f"surfelsplat: open {self._address()} - Ctrl-C ends", flush=True)

    def _address(self):
        host = self._arguments.host
        if host in ("0.0.0.0", "::"):
            host = socket.gethostname()
        host = f"[{host}]" if ":" in host else host
        query = f"?{PARAMETER}={self._token}" if self._token else ""
        return f"http://{host}:{self._server.port}/{query}"

    async def _poll(self):
        surfels = None
        while not surfels:
            await asyncio.sleep(POLL)
            try:
                surfels = self._estimation.poll()
            except UserProblem as problem:
                self._problem = problem
                await self._handler.close()
                await self._server.stop()
                return
            with self._server.state:
                self._tell()
        self._estimation = None
        self._viewer.show_surfels(surfels)
        self._say(f"{surfels.GetNumberOfPoints()} {self._viewer.contents} are shown")
        self.show()

    def run(self):
        """Serves the page until Ctrl-C. UserProblem: what the estimation said."""
        words, sys.argv = sys.argv, sys.argv[:1]  # which trame would read
        arguments = self._arguments
        if not arguments.verbose:  # messages of pages that cannot be understood
            logging.getLogger("wslink").setLevel(logging.CRITICAL)
        try:
            self._server.start(host=arguments.host, port=arguments.port, open_browser=False,
                               show_connection_info=False, disable_logging=True, timeout=0)
        except OSError as error:
            raise UserProblem(f"no page at {arguments.host}, port {arguments.port}: "
                              f"{error.strerror or error}; choose others with --host and --port, "
                              "0 is any port") from error
        finally:
            sys.argv = words
            if self._estimation:
                self._estimation.close()
        if self._problem:
            raise self._problem

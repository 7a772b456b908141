# SPDX-License-Identifier: BSD-3-Clause
"""A Viewer in a window of VTK."""

import ctypes
import os
import signal
import time

from ..backend import vtk
from ..lighting import set_lights
from ..problems import UserProblem
from ..views.cameras import STILL_CELLS
from ..vtkSurfelRendering import vtkSurfelSplattingPass
from .mouse import Mouse
from .words import Words

BUTTONS = ("Left", "Middle", "Right")
TICK = 10  # ms between looks at what is to be done; VTK's loop takes all events in between
POLL = 0.3  # s between looks at the estimation
REST = 0.3  # s of rest until the picture is drawn in full, and then through the cells of the lens
STILL_RATE = 0.0001  # frames a second; below 1 the pass draws in full
RATES = (2, 4, 8, 15, 30, 60)  # frames a second to hold while moving, - raises and + lowers it
FIRST_RATE = 15


def check_display():
    """VTK ends the process if no X server answers."""
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return  # VTK finds out
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = x11.XOpenDisplay(None)
    if not display:
        name = os.environ.get("DISPLAY")
        why = f"the display {name} does not answer" if name else "there is no display"
        raise UserProblem(f"{why}, so no window can be opened; use surfelsplat web, whose page a "
                          "browser shows, or surfelsplat render")
    x11.XCloseDisplay(ctypes.c_void_p(display))


class Window:
    """viewer: Viewer. estimation: AwaitedSurfels of the scan, or None.
    say: a function that is called with news in a line.
    """

    def __init__(self, viewer, estimation, say):
        for module in ("vtkRenderingOpenGL2", "vtkRenderingFreeType", "vtkRenderingUI",
                       "vtkInteractionStyle"):
            vtk(module)  # the classes that the factories below choose from
        self._viewer, self._estimation, self._say = viewer, estimation, say
        self._problem = None
        self._rate = FIRST_RATE
        self._mouse = Mouse(viewer)
        self._rests_at = self._polls_at = 0.0  # times
        self._drawn_at = 0.0
        self._must_draw = self._is_drawn_moving = self._is_fine = False
        self._is_asked_to_end = False
        self._make_window()
        self._make_interactor()

    # The window.

    def _make_window(self):
        core = vtk("vtkRenderingCore")
        viewer = self._viewer
        self._renderer = core.vtkRenderer()
        self._renderer.SetBackground(viewer.look.background)
        self._actor = None
        self._show_actor()
        self._pass = vtkSurfelSplattingPass()
        viewer.look.set_splatter(self._pass.GetSplatter())
        self._renderer.SetPass(self._pass)
        self._camera = core.vtkCamera()
        self._renderer.SetActiveCamera(self._camera)
        self._window = core.vtkRenderWindow()
        self._window.SetMultiSamples(0)
        self._window.SetSize(*viewer.view.size)
        self._window.SetWindowName(f"{os.path.basename(viewer.look.path)} - surfelsplat")
        self._window.AddRenderer(self._renderer)
        self._window.AddObserver("AbortCheckEvent", lambda *_: self._stop_if_wanted())
        self._words = Words(self._renderer)

    def _make_interactor(self):
        interactor = vtk("vtkRenderingCore").vtkRenderWindowInteractor()
        interactor.SetRenderWindow(self._window)
        interactor.SetInteractorStyle(None)
        interactor.EnableRenderOff()
        for event, call in (
                *((f"{button}ButtonPressEvent", lambda button=button: self._press(button))
                  for button in BUTTONS),
                *((f"{button}ButtonReleaseEvent", self._release) for button in BUTTONS),
                ("MouseMoveEvent", self._move),
                ("MouseWheelForwardEvent", lambda: self._wheel(1)),
                ("MouseWheelBackwardEvent", lambda: self._wheel(-1)),
                ("KeyPressEvent", self._key),
                ("ConfigureEvent", self._draw_soon),
                ("ExposeEvent", self._draw_soon),
                ("TimerEvent", self._on_timer)):
            interactor.AddObserver(event, lambda _caller, _event, call=call: call())
        self._interactor = interactor

    def run(self):
        """Shows the window until it is closed. UserProblem: what the estimation said."""
        before = signal.signal(signal.SIGINT, self._on_interrupt)
        try:
            self._draw()
            self._interactor.Initialize()
            self._interactor.CreateRepeatingTimer(TICK)
            self._say("the window is open")
            self._interactor.Start()
        finally:
            signal.signal(signal.SIGINT, before)
            if self._estimation:
                self._estimation.close()
            self._window.Finalize()
        if self._problem:
            raise self._problem
        if self._is_asked_to_end:
            raise KeyboardInterrupt

    def _on_interrupt(self, _number, _frame):
        self._is_asked_to_end = True  # an exception in VTK's loop would end the process

    # Drawing.

    def _draw_soon(self):
        self._must_draw = True

    def _is_moving(self):
        return self._mouse.is_down or time.monotonic() < self._rests_at

    def _show_actor(self):
        actor = self._viewer.actor
        if actor is not self._actor:
            self._renderer.RemoveActor(self._actor)
            self._renderer.AddActor(actor)
            set_lights(self._renderer, actor)
            self._actor = actor

    def _draw(self, cells=1):
        """cells: of the lens"""
        viewer = self._viewer
        size = self._window.GetSize()
        if size != viewer.view.size:
            viewer.resize(*size)
        self._show_actor()
        self._is_drawn_moving = self._is_moving()
        self._window.SetDesiredUpdateRate(self._rate if self._is_drawn_moving else STILL_RATE)
        viewer.update(self._pass.GetSplatter(), self._camera, cells)
        self._renderer.ResetCameraClippingRange()
        self._words.show(viewer, self._news())
        self._must_draw, self._is_fine = False, cells > 1
        self._window.Render()
        self._drawn_at = time.monotonic()
        self._words.message = viewer.take_problem() or self._words.message

    def _may_be_finer(self):
        """Whether cells of the lens are worth their time: the picture has been at rest."""
        if self._is_fine or self._estimation or self._is_moving() or not self._viewer.aperture:
            return False
        return time.monotonic() > self._drawn_at + REST

    def _stop_if_wanted(self):
        """A button that is pressed does not wait for the other cells of the lens."""
        if self._is_fine and self._window.GetEventPending():
            self._window.SetAbortRender(True)
            self._draw_soon()

    def _news(self):
        if self._estimation:
            yield f"{self._estimation.describe()}; points are shown until then"
        coarsening = self._pass.GetCoarsening()
        if self._is_drawn_moving and coarsening > 1:
            yield f"drawn {coarsening:.1f} times coarser to hold {self._rate} frames a second"

    def _on_timer(self):
        if self._is_asked_to_end:
            self._interactor.TerminateApp()
            return
        self._poll()
        if self._must_draw or (self._is_drawn_moving and not self._is_moving()):
            self._draw()
        elif self._may_be_finer():
            self._draw(STILL_CELLS)

    def _poll(self):
        if not self._estimation or time.monotonic() < self._polls_at:
            return
        self._polls_at = time.monotonic() + POLL
        try:
            surfels = self._estimation.poll()
        except UserProblem as problem:
            self._problem = problem
            self._interactor.TerminateApp()
            return
        if surfels:
            self._estimation = None
            self._viewer.show_surfels(surfels)
            self._say(f"{surfels.GetNumberOfPoints()} {self._viewer.contents} are shown")
        self._must_draw = True

    # Mouse and keys.

    def _press(self, button):
        shift = bool(self._interactor.GetShiftKey())
        self._mouse.press(button, shift, self._interactor.GetEventPosition())

    def _move(self):
        if self._mouse.move(self._interactor.GetEventPosition()):
            self._must_draw = True

    def _release(self):
        self._try(lambda: self._tell(self._mouse.release()))

    def _wheel(self, notches):
        self._mouse.wheel(notches)
        self._rests_at = time.monotonic() + REST
        self._must_draw = True

    def _tell(self, message):
        self._words.message = message

    def _try(self, action):
        """What is wrong is written into the window."""
        try:
            action()
        except UserProblem as problem:
            self._tell(str(problem))
        self._must_draw = True

    def _key(self):
        viewer = self._viewer
        actions = {"Up": lambda: viewer.step_aperture(1), "Down": lambda: viewer.step_aperture(-1),
                   "l": viewer.toggle_lens, "c": self._next_colors,
                   "r": viewer.reset, "s": self._save,
                   "h": self._toggle_help, "q": self._interactor.TerminateApp,
                   **dict.fromkeys(("plus", "KP_Add", "equal"), lambda: self._step_rate(-1)),
                   **dict.fromkeys(("minus", "KP_Subtract"), lambda: self._step_rate(1))}
        action = actions.get(self._interactor.GetKeySym())
        if action:
            self._tell("")
            self._try(action)

    def _toggle_help(self):
        self._words.has_help = not self._words.has_help

    def _step_rate(self, step):
        index = RATES.index(self._rate) + step
        self._rate = RATES[min(max(index, 0), len(RATES) - 1)]
        self._tell(f"while moving, at least {self._rate} frames a second")

    def _next_colors(self):
        self._viewer.next_colors()
        self._tell(f"coloured by {self._viewer.scalars or 'its own colours'}")

    def _save(self):
        saved = " and ".join(self._viewer.save()) + " saved"
        if self._estimation:
            saved += " with points; save again when the surfels are there"
        self._tell(saved)
        self._say(saved)

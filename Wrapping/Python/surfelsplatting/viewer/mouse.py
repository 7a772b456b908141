# SPDX-License-Identifier: BSD-3-Clause
"""What a mouse does to a Viewer, in a window and in a page."""

import math

CLICK = 3  # px that a click may move
NOTCH = 1.15  # how much nearer a notch of the wheel brings the camera
PIXELS_PER_NOTCH = 15  # of a drag


class Mouse:
    """Places are pixels from the lower left corner, as in VTK."""

    def __init__(self, viewer):
        self._viewer = viewer
        self._drag = None  # the function that a drag calls
        self._is_click = False
        self._pressed = self._last = (0, 0)

    @property
    def is_down(self):
        return self._drag is not None

    def press(self, button, has_shift, place):
        """button: "Left", "Middle" or "Right". Of several that are down the last one counts: the
        release of another may have been outside of the page."""
        viewer = self._viewer
        self._drag = {"Left": viewer.pan if has_shift else viewer.orbit, "Middle": viewer.pan,
                      "Right": self._zoom}[button]
        self._is_click = button == "Left" and not has_shift
        self._pressed = self._last = place

    def move(self, place):
        """-> whether the view has changed"""
        if not self.is_down or (self._is_click and math.dist(place, self._pressed) <= CLICK):
            return False
        self._is_click = False
        self._drag(place[0] - self._last[0], place[1] - self._last[1])
        self._last = place
        return True

    def release(self):
        """A click focuses. UserProblem if nothing is seen there. -> what to tell about it"""
        self._drag = None
        if self._is_click:
            self._is_click = False
            x, y = self._pressed
            self._viewer.focus_at(int(x), self._viewer.view.size[1] - 1 - int(y))
            if not self._viewer.aperture:
                return "in focus; the rest blurs when the aperture opens: key Up"
        return ""

    def _zoom(self, _right, up):
        self.wheel(up / PIXELS_PER_NOTCH)

    def wheel(self, notches):
        self._viewer.zoom(NOTCH ** notches)

# SPDX-License-Identifier: BSD-3-Clause
"""What a window and a page have in common: the view, the lens, the colours, and saving."""

import itertools
import math
import os
from dataclasses import replace

from ..colormaps import scalar_names
from ..lighting import set_lights
from ..problems import UserProblem
from ..shapes.samples import ENOUGH, Samples
from ..surfels import holds_gaussians
from ..views.backs import share_facing_away
from ..views.cameras import STILL_CELLS
from ..views.focus import (distance_in_focus, focused_on_front, largest_blur, point_at_pixel,
                           settle_focus)
from ..views.framing import complete_view
from ..views.vtkcamera import make_camera, set_camera, set_lens
from ..vtkSurfelRendering import vtkSurfelImageRenderer
from . import motions
from .discs import discs_of, turn_discs

APERTURES = (0, 4, 6, 8, 11, 16, 22, 32, 45, 64, 80, 100)  # px, blur radius at infinity
FEW = 8000  # samples that tell in each frame which side is seen, in half a millisecond
FIRST_APERTURE = 32.0  # when the lens is turned on


def _in_pixels(view):
    """The view with its lens given by its blur at infinity, f R / z_f as in Core/Lens/Lens.h."""
    blur = view.circle_of_confusion or 0.0
    if view.focal_disk and not blur:
        focal_length = view.size[1] / 2 / math.tan(math.radians(view.view_angle) / 2)  # px
        blur = focal_length * view.focal_disk / 2 / distance_in_focus(view)
    return replace(view, circle_of_confusion=blur, focal_disk=0.0)


def _with_point_in_focus(view):
    """The view with a point in focus in its middle, so that the plane stays with it."""
    if view.focus_point:
        return view
    share = distance_in_focus(view) / math.dist(view.position, view.focal_point)
    point = tuple(p + share * (f - p) for p, f in zip(view.position, view.focal_point))
    return replace(view, focus_point=point, focal_distance=0.0)


class Viewer:
    """A scan, and how it is looked at.

    cloud: Cloud. view: View, what the options ask for. messages: a VtkMessages.
    look: has path, scalars, background, may_show_backs, and make_actor, set_splatter, write and hint;
    see commandline/scan.py.
    """

    def __init__(self, cloud, view, look, messages):
        self._cloud, self._asked = cloud, view
        self._messages = messages
        self._has_moved = False
        self._turned_to = None  # the direction that the discs face
        self.look = look
        self.scalars = look.scalars  # None: its own colours
        self.renderer = vtkSurfelImageRenderer()
        self.renderer.SetBackground(look.background)
        self.renderer.SetBackgroundAlpha(1.0)
        look.set_splatter(self.renderer.GetSplatter())
        self._surfels = self._samples = self._few = None
        self.is_preview = not cloud.is_drawable
        self._set_surfels(cloud.data if cloud.is_drawable else self._discs())
        self.view = self._first_view(view.size)
        self._aperture = self.view.circle_of_confusion or FIRST_APERTURE
        self.camera = make_camera(self.view)
        self.renderer.SetCamera(self.camera)

    def _discs(self):
        discs = discs_of(self._cloud.data)
        if discs.GetNumberOfPoints() == 0:
            raise UserProblem(f"{self.look.path}: none of its points has finite coordinates")
        return discs

    @property
    def contents(self):
        """What is shown, as a word of messages."""
        return "Gaussians" if holds_gaussians(self._surfels) else "surfels"

    def _set_surfels(self, surfels):
        if surfels is not self._surfels:
            self._surfels, self._samples, self._few = surfels, None, None
        self.renderer.RemoveAllActors()
        self.actor = self.look.make_actor(surfels, self.scalars)
        self.renderer.AddActor(self.actor)
        set_lights(self.renderer, self.actor)

    def _first_view(self, size):
        hint = None if self.is_preview else self.look.hint
        view = complete_view(replace(self._asked, size=size), self._cloud, self._surfels, hint)
        view = settle_focus(focused_on_front(self._asked, view, self.renderer), self.renderer)
        self._home = _with_point_in_focus(_in_pixels(view))
        return self._home

    def show_surfels(self, surfels):
        """Shows the surfels in place of the points. What was changed of view and aperture stays."""
        self.is_preview = False
        self._set_surfels(surfels)
        first, aperture = self._home.circle_of_confusion, self.aperture
        home = self._first_view(self.view.size)
        if not self._has_moved:
            self.view = home
        self._aperture = home.circle_of_confusion if self._aperture == first else self._aperture
        self.aperture = home.circle_of_confusion if aperture == first else aperture
        self.renderer.SetCamera(self.camera)
        self._cloud.data = None  # frees the memory of a large cloud

    # Moving. The mouse moves by pixels to the right and upwards.

    def orbit(self, right, up):
        self._change(motions.orbit(self.view, right, up))

    def pan(self, right, up):
        self._change(motions.pan(self.view, right, up))

    def zoom(self, factor):
        self._change(motions.zoom(self.view, factor, self.actor.GetLength()))

    def _change(self, view):
        self.view = view
        self._has_moved = True

    def resize(self, width, height):
        self.view = replace(self.view, size=(width, height))

    def reset(self):
        """The first view, with the lens as it is."""
        self.view = replace(self._home, size=self.view.size,
                            circle_of_confusion=self.view.circle_of_confusion)
        self._has_moved = False

    # The lens and the colours.

    @property
    def aperture(self):
        """Blur radius of very distant points, px; 0 is a pinhole."""
        return self.view.circle_of_confusion

    @aperture.setter
    def aperture(self, pixels):
        self.view = replace(self.view, circle_of_confusion=float(pixels))
        self._aperture = pixels or self._aperture

    def step_aperture(self, direction):
        """The next number of the scale: 1 opens, -1 closes."""
        following = [a for a in APERTURES[::direction] if direction * (a - self.aperture) > 1e-9]
        if following:
            self.aperture = following[0]

    def toggle_lens(self):
        self.aperture = 0 if self.aperture else self._aperture

    def focus_at(self, column, row):
        """Focuses on what is seen at a pixel, counted from the upper left corner. UserProblem if
        nothing is."""
        self.update(self.renderer.GetSplatter(), self.camera)
        point = point_at_pixel(self.renderer, (column, row))
        self._change(replace(self.view, focus_point=point))

    def largest_blur(self):
        """Radius of the blur at the end of what is seen that blurs more, px."""
        self._samples = self._samples or Samples(self._surfels, ENOUGH)
        return largest_blur(self.view, self._samples)

    def scalar_names(self):
        return scalar_names(self._surfels)

    def color_by(self, name):
        """Colours by one of the scalars, or with None by the cloud's own colours."""
        self.scalars = name
        self._set_surfels(self._surfels)

    def next_colors(self):
        names = [None, *self.scalar_names()]
        self.color_by(names[(names.index(self.scalars) + 1) % len(names)])

    # Drawing and saving.

    @property
    def stem(self):
        """The scan's name, for files that are saved."""
        return os.path.splitext(os.path.basename(self.look.path))[0]

    def take_problem(self):
        """-> what VTK's classes have said since, or None."""
        errors, self._messages.errors = self._messages.errors, []
        return errors[0] if errors else None

    def update(self, splatter, camera, cells=1):
        """Sets a splatter and a camera to the view. cells: of the lens"""
        set_camera(camera, self.view)
        set_lens(splatter, self.view)
        self.actor.GetMapper().SetShowBacks(self._shows_backs())
        splatter.SetLensCells(cells)
        self.renderer.SetSize(*self.view.size)
        direction = camera.GetDirectionOfProjection()
        if self.is_preview and direction != self._turned_to:
            turn_discs(self.actor.GetMapper().GetInput(), direction)
            self._turned_to = direction

    def _shows_backs(self):
        """Whether both sides are drawn: the camera would see backs only, as from inside of a tunnel."""
        if not self.look.may_show_backs:
            return False
        self._few = self._few or Samples(self._surfels, FEW)
        return share_facing_away(self._few, [self.view]) > 0

    def picture(self, cells=STILL_CELLS):
        """-> vtkImageData, float RGBA. cells: of the lens"""
        self.update(self.renderer.GetSplatter(), self.camera, cells)
        self.renderer.Update()
        return self.renderer.GetOutput()

    def save(self):
        """Writes a picture and its camera file to the current folder. -> their names, which are
        those of no other files."""
        for number in itertools.count(1):
            names = [f"{self.stem}-{number}{end}" for end in (".png", ".camera.json")]
            if not any(map(os.path.exists, names)):
                break
        self.look.write(self.picture(), self.view, *names)
        return names

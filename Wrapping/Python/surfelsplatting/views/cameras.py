# SPDX-License-Identifier: BSD-3-Clause
"""Views: read from camera files, overridden by options, and checked."""

import json
import math
import os
import sys
from dataclasses import dataclass, replace
from typing import Optional, Tuple

from ..problems import UserProblem

Vector = Tuple[float, float, float]
DEFAULT_SIZE = (800, 600)
DEFAULT_ANGLE = 30.0
LARGEST_SIDE = 65536  # px, vtkSurfelImageRenderer's
LARGEST_PICTURE = 1 << 28  # px; 4 GiB of float RGBA
LARGEST_FLOAT = sys.float_info.max  # JSON has larger integers
LARGEST = 1e17  # world units; as in the filters: sums of squares stay in float's range
SMALLEST_ANGLE = 1e-4  # degrees; below it a pixel is smaller than the camera's rounding errors
LARGEST_PHOTOGRAPH = 1600  # px, a side; the reference implementation trains with no larger ones
FILM = 24.0  # mm, the shorter side of a picture on 35 mm film
SIDES = ("front", "back", "left", "right", "top", "bottom", "iso")
AXES = {"x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0),
        "-y": (0.0, -1.0, 0.0), "z": (0.0, 0.0, 1.0), "-z": (0.0, 0.0, -1.0)}
LARGEST_BLUR = 1_000_000  # px, vtkSurfelSplatter's
STILL_CELLS = 7  # of the lens, in pictures that do not move; see CommandLine.md
PARALLEL = 1e-6  # sine of the angle below which two directions count as parallel


@dataclass(frozen=True)
class Wishes:
    """What a view shall become once the cloud is known. complete_view in framing.py grants all but
    the last two, which need a picture: settle_focus in focus.py."""

    side: Optional[str] = None  # from which the cloud is seen: one of SIDES
    azimuth: float = 0.0  # degrees that the camera goes to the right around what it looks at,
    elevation: float = 0.0  # upwards,
    roll: float = 0.0  # and turns clockwise about the view direction
    zoom: float = 1.0  # how much larger things become
    f_number: Optional[float] = None  # of the lens, for clouds in metres
    blur: Optional[float] = None  # px, at the end of the picture's depth that blurs most
    finds_focus: bool = False  # although there is a focal point: it was not placed on a surface
    focus_pixel: Optional[Tuple[int, int]] = None  # column and row from the upper left corner


@dataclass(frozen=True)
class View:
    """A camera with vtkCamera's names and units; framing.py fills in what is None."""

    position: Optional[Vector] = None
    focal_point: Optional[Vector] = None
    view_up: Optional[Vector] = None
    view_angle: Optional[float] = None  # vertical, degrees
    size: Tuple[int, int] = DEFAULT_SIZE
    focal_disk: float = 0.0  # lens diameter, world units; 0 = pinhole
    focal_distance: float = 0.0  # along the view direction; 0 = to the focal point
    circle_of_confusion: Optional[float] = None  # px at infinity, in place of focal_disk
    focus_point: Optional[Vector] = None  # in focus, in place of focal_distance
    wishes: Wishes = Wishes()

    @property
    def has_lens(self):
        return bool(self.focal_disk or self.circle_of_confusion or self.wishes.blur
                    or self.wishes.f_number)

    def __str__(self):
        def row(vector):
            return " ".join(f"{value:.7g}" for value in vector)

        lens = "no lens"
        if self.circle_of_confusion is not None:
            lens = f"a lens with a blur radius of {self.circle_of_confusion:g} px at infinity"
        elif self.focal_disk:
            lens = f"a lens of diameter {self.focal_disk:g}"
        focus = f"{self.focal_distance:.7g}" if self.focal_distance else "the focal point"
        if self.focus_point:
            focus = row(self.focus_point)
        return (f"camera at {row(self.position)} looking at {row(self.focal_point)}, up "
                f"{row(self.view_up)}, angle {self.view_angle:g}, {lens}, focus at {focus}")


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def are_parallel(a, b, sine=PARALLEL):
    return math.hypot(*cross(a, b)) <= sine * math.hypot(*a) * math.hypot(*b)


class _FileView:
    """One view of a camera file; checks its values."""

    def __init__(self, where, values):
        self._where = where
        self._values = values

    def _fail(self, key, wanted):
        raise UserProblem(f"{self._where}: {key} is {json.dumps(self._values[key])}; it must be "
                          f"{wanted}")

    @staticmethod
    def _is_number(value):
        return (isinstance(value, (int, float)) and not isinstance(value, bool)
                and abs(value) <= LARGEST_FLOAT)

    def number(self, key, default, is_valid, wanted):
        value = self._values.get(key, default)
        if not self._is_number(value) or not is_valid(value):
            self._fail(key, wanted)
        return float(value)

    def vector(self, key):
        value = self._values.get(key)
        if value is None:
            return None
        if (not isinstance(value, list) or len(value) != 3
                or not all(self._is_number(v) for v in value)):
            self._fail(key, "three finite numbers")
        return tuple(float(v) for v in value)

    def size(self):
        value = self._values.get("size", list(DEFAULT_SIZE))
        if (not isinstance(value, list) or len(value) != 2
                or not all(self._is_number(v) and v >= 1 and v == int(v) for v in value)):
            self._fail("size", "two whole numbers from 1 on")
        return tuple(int(v) for v in value)


def _split_name(text):
    """FILE.json:VIEW -> FILE.json, VIEW; FILE.json -> FILE.json, None."""
    if not os.path.exists(text) and ":" in text:
        path, name = text.rsplit(":", 1)
        return path, name
    return text, None


def _pick(path, content, name):
    """The JSON objects of the views of this name, or of all."""
    views = content.get("views", [content]) if isinstance(content, dict) else content
    if not isinstance(views, list) or not views or not all(isinstance(v, dict) for v in views):
        raise UserProblem(f"{path} holds no views; expected {{\"views\": [{{\"name\": .., "
                          "\"position\": [x, y, z], ..}]}")
    if name is None:
        return views
    for view in views:
        if view.get("name") == name:
            return [view]
    names = [str(view["name"]) for view in views if "name" in view]
    known = f"its views are {', '.join(names)}" if names else "its views have no names"
    raise UserProblem(f"{path} has no view {name!r}; {known}")


def read_view(text):
    """The view of FILE.json[:VIEW]; without a name the first one."""
    return read_views(text)[0]


def read_views(text):
    """The view of FILE.json:VIEW, or all views of FILE.json."""
    from .trained import is_trained, load_json  # here, since numpy takes time to begin

    path, name = _split_name(text)
    content = load_json(path)
    if is_trained(content):
        return _trained_views(path, content, name)
    return [_view_of(path, text, values) for values in _pick(path, content, name)]


def _trained_views(path, content, name):
    """The views of cameras that a capture was trained with: as its photographs, but centred."""
    from .trained import cameras_in, chosen, pivot_of

    cameras = cameras_in(path, content)
    pivot = pivot_of(cameras)
    return [_photograph(camera, pivot)
            for camera in (cameras if name is None else [chosen(path, cameras, name)])]


def _photograph(camera, pivot):
    """The view of a TrainedCamera. It turns about the place on its axis beside the pivot."""
    place, forward = (tuple(map(float, vector)) for vector in (camera.position, camera.forward))
    distance = 0.0 if pivot is None else dot(subtract(map(float, pivot), place), forward)
    distance = distance if distance > 0 else 1.0
    scale = min(1.0, LARGEST_PHOTOGRAPH / max(camera.size))
    return View(position=place, focal_point=tuple(p + distance * f for p, f in zip(place, forward)),
                view_up=tuple(map(float, camera.up)),
                view_angle=2 * math.degrees(math.atan(camera.spread[1])),
                size=tuple(max(1, round(scale * side)) for side in camera.size),
                wishes=Wishes(finds_focus=True))


def _view_of(path, text, values):
    if not any(key in values for key in ("position", "focalPoint", "viewAngle", "viewUp")):
        raise UserProblem(f"{path} describes no camera; expected keys such as position, "
                          "focalPoint, viewUp, viewAngle, size, focalDisk, focalDistance")
    view = _FileView(text, values)
    has_pixels = "circleOfConfusion" in values
    return View(
        position=view.vector("position"),
        focal_point=view.vector("focalPoint"),
        view_up=view.vector("viewUp"),
        view_angle=view.number("viewAngle", DEFAULT_ANGLE, lambda a: 0 < a < 180,
                               "between 0 and 180 degrees") if "viewAngle" in values else None,
        size=view.size(),
        focal_disk=view.number("focalDisk", 0.0, lambda d: d >= 0, "a number from 0 on"),
        focal_distance=view.number("focalDistance", 0.0, lambda d: d >= 0, "a number from 0 on"),
        circle_of_confusion=view.number("circleOfConfusion", 0.0, lambda c: 0 <= c <= LARGEST_BLUR,
                                        f"between 0 and {LARGEST_BLUR}") if has_pixels else None,
        focus_point=view.vector("focusPoint"))


def view_values(view):
    """The content of a camera file with this view; read_view makes the same view of it."""
    values = {"position": view.position, "focalPoint": view.focal_point, "viewUp": view.view_up,
              "viewAngle": view.view_angle, "size": view.size, "focalDisk": view.focal_disk,
              "focalDistance": view.focal_distance,
              "circleOfConfusion": view.circle_of_confusion, "focusPoint": view.focus_point}
    return {key: value for key, value in values.items() if value is not None}


def _vector_or(option, default):
    return tuple(option) if option is not None else default


def asked_view(arguments):
    """The view from --camera, overridden by the other options."""
    return overridden(read_view(arguments.camera) if arguments.camera else View(), arguments)


def overridden(view, arguments):
    """The view with what the options say."""
    view = _with_lens(_with_camera(view, arguments), arguments)
    check_view(view)
    return view


def _with_camera(view, arguments):
    size = tuple(arguments.size or view.size)
    if view.circle_of_confusion:  # in pixels: the picture becomes larger, but does not change
        scaled = view.circle_of_confusion * size[1] / view.size[1]
        view = replace(view, circle_of_confusion=min(scaled, LARGEST_BLUR))
    wishes = replace(view.wishes, side=arguments.view, azimuth=arguments.azimuth,
                     elevation=arguments.elevation, roll=arguments.roll, zoom=arguments.zoom,
                     finds_focus=view.wishes.finds_focus and not arguments.focal_point)
    if arguments.view:
        # From another side the distance to what was in focus is another one.
        view = replace(view, position=None, focal_point=None, view_up=None, focal_distance=0.0)
    if arguments.up:
        view = replace(view, view_up=AXES.get(arguments.up))
    angle = arguments.view_angle or view.view_angle
    if arguments.focal_length:
        angle = angle_of_focal_length(arguments.focal_length, size)
    return replace(
        view, position=_vector_or(arguments.position, view.position),
        focal_point=_vector_or(arguments.focal_point, view.focal_point),
        view_up=_vector_or(arguments.view_up, view.view_up),
        view_angle=angle, size=size, wishes=wishes)


def _with_lens(view, arguments):
    if arguments.focal_distance is not None:
        view = replace(view, focal_distance=arguments.focal_distance, focus_point=None)
    elif arguments.focus_point:
        view = replace(view, focal_distance=0.0, focus_point=tuple(arguments.focus_point))
    elif arguments.focus_pixel:
        view = replace(view, focal_distance=0.0, focus_point=None,
                       wishes=replace(view.wishes, focus_pixel=tuple(arguments.focus_pixel)))
    disk, confusion = arguments.focal_disk, arguments.circle_of_confusion
    wishes = replace(view.wishes, blur=arguments.blur or None, f_number=arguments.f_number)
    if any(x is not None for x in (disk, confusion, arguments.blur, arguments.f_number)):
        view = replace(view, focal_disk=disk or 0.0, circle_of_confusion=confusion, wishes=wishes)
    return view


def angle_of_focal_length(focal_length, size):
    """The vertical view angle, degrees, of a focal length in mm on 35 mm film."""
    return math.degrees(2 * math.atan(FILM / 2 * size[1] / min(size) / focal_length))


def focal_length_of_angle(angle, size):
    """The inverse of angle_of_focal_length."""
    return FILM / 2 * size[1] / min(size) / math.tan(math.radians(angle) / 2)


def check_size(size):
    if size and (max(size) > LARGEST_SIDE or size[0] * size[1] > LARGEST_PICTURE):
        raise UserProblem(f"the picture's size {size[0]} x {size[1]} is too large; at most "
                          f"{LARGEST_SIDE} pixels per side and {LARGEST_PICTURE} in total")


def check_pixel(pixel, size):
    """pixel: column and row from the upper left corner"""
    width, height = size
    if not (0 <= pixel[0] < width and 0 <= pixel[1] < height):
        raise UserProblem(f"there is no pixel {pixel[0]} {pixel[1]} in a picture of {width} x "
                          f"{height}; its last one is {width - 1} {height - 1}, at the lower right")


def _check_range(view):
    for name, vector in (("position", view.position), ("focal point", view.focal_point),
                         ("view-up vector", view.view_up), ("focus point", view.focus_point)):
        for value in vector or ():
            if abs(value) > LARGEST:
                raise UserProblem(f"the camera's {name} has a coordinate of {value:g}; the largest "
                                  f"usable one is {LARGEST:g}")
    for name, value in (("focal disk", view.focal_disk), ("focal distance", view.focal_distance)):
        if value > LARGEST:
            raise UserProblem(f"the camera's {name} is {value:g}; the largest usable one is "
                              f"{LARGEST:g}")
    if not SMALLEST_ANGLE <= (view.view_angle or DEFAULT_ANGLE) <= 180 - SMALLEST_ANGLE:
        raise UserProblem(f"the camera's view angle is {view.view_angle:g} degrees; it must be "
                          f"between {SMALLEST_ANGLE} and {180 - SMALLEST_ANGLE}")
    if view.view_up is not None and 0 < max(map(abs, view.view_up)) < 1e-100:
        raise UserProblem("the view-up vector is too short to be a direction")


def check_view(view):
    """The checks that do not need the cloud."""
    check_size(view.size)
    if view.wishes.focus_pixel:
        check_pixel(view.wishes.focus_pixel, view.size)
    _check_range(view)
    if view.view_up is not None and not any(view.view_up):
        raise UserProblem("the view-up vector is 0 0 0; give a direction")
    if view.position is None or view.focal_point is None:
        return
    direction = subtract(view.focal_point, view.position)
    if not any(direction):
        raise UserProblem("the camera's position and focal point are the same point "
                          f"{' '.join(f'{x:g}' for x in view.position)}; move one of them")
    if view.view_up is not None and are_parallel(view.view_up, direction):
        raise UserProblem("the view-up vector is parallel to the view direction; turn it")
    if view.focus_point and dot(subtract(view.focus_point, view.position), direction) <= 0:
        raise UserProblem(f"the point in focus {' '.join(f'{x:g}' for x in view.focus_point)} is "
                          "behind the camera; give one in front of it")


def camera_files(text):
    """The files that --camera FILE.json[:VIEW] may read."""
    return [text, text.rsplit(":", 1)[0]] if text else []

# SPDX-License-Identifier: BSD-3-Clause
"""Views: read from camera files, overridden by options, and checked."""

import json
import math
import os
from dataclasses import dataclass, replace
from typing import Optional, Tuple

from .arguments import check_size
from .problems import UserProblem

Vector = Tuple[float, float, float]
DEFAULT_SIZE = (800, 600)
DEFAULT_ANGLE = 30.0
LARGEST = 1e17  # world units; as in the filters: sums of squares stay in float's range
SMALLEST_ANGLE = 1e-4  # degrees; below it a pixel is smaller than the camera's rounding errors
PARALLEL = 1e-6  # sine of the angle below which two directions count as parallel


@dataclass(frozen=True)
class View:
    """A camera with vtkCamera's names and units; framing.py fills in what is None."""

    position: Optional[Vector] = None
    focal_point: Optional[Vector] = None
    view_up: Optional[Vector] = None
    view_angle: float = DEFAULT_ANGLE  # vertical, degrees
    size: Tuple[int, int] = DEFAULT_SIZE
    focal_disk: float = 0.0  # lens diameter, world units; 0 = pinhole
    focal_distance: float = 0.0  # along the view direction; 0 = to the focal point
    circle_of_confusion: Optional[float] = None  # px at infinity, in place of focal_disk

    def __str__(self):
        def row(vector):
            return " ".join(f"{value:.7g}" for value in vector)

        lens = "no lens"
        if self.circle_of_confusion is not None:
            lens = f"a lens with a blur radius of {self.circle_of_confusion:g} px at infinity"
        elif self.focal_disk:
            lens = f"a lens of diameter {self.focal_disk:g}"
        focus = f"{self.focal_distance:.7g}" if self.focal_distance else "the focal point"
        return (f"camera at {row(self.position)} looking at {row(self.focal_point)}, up "
                f"{row(self.view_up)}, angle {self.view_angle:g}, {lens}, focus at {focus}")


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


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
                and math.isfinite(value))

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


def _load(path):
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except OSError as problem:
        raise UserProblem(f"cannot read the camera file {path}: {problem.strerror}") from problem
    except (ValueError, RecursionError) as problem:
        raise UserProblem(f"{path} is not a camera file in JSON: {problem}") from problem


def _pick(path, content, name):
    """The JSON object of the named view, or of the first one."""
    views = content.get("views", [content]) if isinstance(content, dict) else content
    if not isinstance(views, list) or not views or not all(isinstance(v, dict) for v in views):
        raise UserProblem(f"{path} holds no views; expected {{\"views\": [{{\"name\": .., "
                          "\"position\": [x, y, z], ..}]}")
    if name is None:
        return views[0]
    for view in views:
        if view.get("name") == name:
            return view
    names = [str(view["name"]) for view in views if "name" in view]
    known = f"its views are {', '.join(names)}" if names else "its views have no names"
    raise UserProblem(f"{path} has no view {name!r}; {known}")


def read_view(text):
    """The view of FILE.json[:VIEW]."""
    path, name = _split_name(text)
    values = _pick(path, _load(path), name)
    if not any(key in values for key in ("position", "focalPoint", "viewAngle", "viewUp")):
        raise UserProblem(f"{path} describes no camera; expected keys such as position, "
                          "focalPoint, viewUp, viewAngle, size, focalDisk, focalDistance")
    view = _FileView(text, values)
    return View(
        position=view.vector("position"),
        focal_point=view.vector("focalPoint"),
        view_up=view.vector("viewUp"),
        view_angle=view.number("viewAngle", DEFAULT_ANGLE, lambda a: 0 < a < 180,
                               "between 0 and 180 degrees"),
        size=view.size(),
        focal_disk=view.number("focalDisk", 0.0, lambda d: d >= 0, "a number from 0 on"),
        focal_distance=view.number("focalDistance", 0.0, lambda d: d >= 0, "a number from 0 on"))


def _vector_or(option, default):
    return tuple(option) if option is not None else default


def asked_view(arguments):
    """The view from --camera, overridden by the other options."""
    view = read_view(arguments.camera) if arguments.camera else View()
    view = replace(
        view,
        position=_vector_or(arguments.position, view.position),
        focal_point=_vector_or(arguments.focal_point, view.focal_point),
        view_up=_vector_or(arguments.view_up, view.view_up),
        view_angle=arguments.view_angle or view.view_angle,
        size=tuple(arguments.size or view.size))
    if arguments.focal_distance is not None:
        view = replace(view, focal_distance=arguments.focal_distance)
    if arguments.pinhole:
        view = replace(view, focal_disk=0.0)
    elif arguments.focal_disk is not None:
        view = replace(view, focal_disk=arguments.focal_disk)
    elif arguments.circle_of_confusion is not None:
        view = replace(view, circle_of_confusion=arguments.circle_of_confusion)
    check_view(view)
    return view


def _check_range(view):
    for name, vector in (("position", view.position), ("focal point", view.focal_point),
                         ("view-up vector", view.view_up)):
        for value in vector or ():
            if abs(value) > LARGEST:
                raise UserProblem(f"the camera's {name} has a coordinate of {value:g}; the largest "
                                  f"usable one is {LARGEST:g}")
    for name, value in (("focal disk", view.focal_disk), ("focal distance", view.focal_distance)):
        if value > LARGEST:
            raise UserProblem(f"the camera's {name} is {value:g}; the largest usable one is "
                              f"{LARGEST:g}")
    if not SMALLEST_ANGLE <= view.view_angle <= 180 - SMALLEST_ANGLE:
        raise UserProblem(f"the camera's view angle is {view.view_angle:g} degrees; it must be "
                          f"between {SMALLEST_ANGLE} and {180 - SMALLEST_ANGLE}")
    if view.view_up is not None and 0 < max(map(abs, view.view_up)) < 1e-100:
        raise UserProblem("the view-up vector is too short to be a direction")


def check_view(view):
    """The checks that do not need the cloud."""
    check_size(view.size)
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


def camera_files(text):
    """The files that --camera FILE.json[:VIEW] may read."""
    return [text, text.rsplit(":", 1)[0]] if text else []

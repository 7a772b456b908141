# SPDX-License-Identifier: BSD-3-Clause
"""A view that fits a cloud: the direction, the position, what is in focus of a volume."""

import math
from dataclasses import replace

import numpy as np

from ..shapes.directions import lengths, rotated, unit
from ..shapes.rooms import may_be_room
from ..shapes.samples import Samples
from ..shapes.sensor import sensor_of
from ..shapes.up import Up, find_up, floor_normal
from .cameras import DEFAULT_ANGLE, Wishes, are_parallel, check_view, focal_length_of_angle
from .homes import home_of
from .inside import name_of, options_inside
from .turning import front_of, seen_from, turned

MARGIN = 0.92  # the fraction of the picture that the cloud fills
AZIMUTH = math.radians(30)
LOW, ELEVATION, HIGH = math.radians(5), math.radians(22), math.radians(50)
BULK = (1, 99)  # percent of the points, whose extents tell what is flat
FLAT = 0.1, 0.35  # height over width of what is seen from HIGH, and from ELEVATION
SLENDER = 1.5, 2.0  # the same of what is seen from ELEVATION, and from LOW
HIDDEN = 0.8  # part of what is seen from HIGH, below which walls hide what matters
AROUND = 0.03  # part of the area beyond a side of the frame, above which the cloud goes on there
RASTER = 128  # cells along a side, of a picture that tells what is seen
# As in Core/Picture/MiddleFront.cxx, which has a picture where these have points.
MIDDLE = 0.25  # half-height of the picture's middle over the half-height of the picture
FRONT = 20  # percent of what is in the middle that is nearer than what a photographer focuses on
CELLS = 4  # into which the middle is divided along each side


def _raised(level, up, elevation):
    return math.cos(elevation) * level + math.sin(elevation) * up


def _three_quarter_direction(samples, up):
    """From the object to the lens: the usual side, unless another one, in steps of 45 degrees around,
    shows much more."""
    def facing(direction):
        projected = samples.some.areas @ direction
        return np.where(samples.some.two_sided, np.abs(projected), np.maximum(projected, 0)).sum()

    levels = [rotated(front_of(up), up, AZIMUTH + turn * math.pi / 4) for turn in range(8)]
    shown = [facing(_raised(level, up, ELEVATION)) for level in levels]
    best = int(np.argmax(shown))
    return _at_height(samples, levels[best if shown[best] > 1.5 * shown[0] else 0], up)


def _seen_area(samples, direction, up):
    """The area that nothing hides from this direction"""
    points, areas = samples.some.points, samples.some.areas
    facing = samples.some.two_sided | (areas @ direction > 0)
    points, areas = points[facing], areas[facing]
    if not len(points):
        return 0.0
    right = unit(np.cross(up, direction))
    places = points @ np.stack([right, np.cross(direction, right)], axis=1)
    places -= places.min(axis=0)
    width = max(places.max(), 1e-300) / RASTER
    cells = (places / width).astype(int) @ (1, RASTER + 1)
    height, area = points @ direction, lengths(areas)
    across = np.maximum(np.abs(areas @ direction), np.maximum(0.05 * area, 1e-300))
    within = width * area / across  # one cell, of a slope
    highest = np.full((RASTER + 1) ** 2, -np.inf)
    np.maximum.at(highest, cells, height)
    return float(area[height > highest[cells] - 2 * within].sum())


def _goes_on_around(samples, direction, up):
    """Whether the cloud goes on to more than one side of what is shown, as around a scanner in a street;
    what is behind a thing is at one side."""
    points, areas = samples.beyond
    right = unit(np.cross(up, direction))
    local = (points - samples.center) @ np.stack([right, np.cross(right, up)], axis=1)
    axis = np.abs(local).argmax(axis=1)  # along which a point is farther off
    sides = 2 * axis + (np.take_along_axis(local, axis[:, None], axis=1)[:, 0] > 0)
    least = AROUND * (areas.sum() + samples.sizes.sum())
    return bool(np.sort(np.bincount(sides, areas, 4))[-2] > least)


def _elevation(samples, up):
    """Of the camera, radians: higher above flat things and terrains, of which it would see a strip;
    lower beside trees, masts and people, whose ends would be nearer and farther than the middle. Walls
    are neither: they have little depth, and are wide."""
    front = front_of(up)
    depth, width, height = (np.ptp(np.percentile(samples.some.points @ axis, BULK))
                            for axis in (front, np.cross(up, front), up))
    flat = height / max(min(depth, width), 1e-300)
    slender = height / max(depth, width, 1e-300)
    return float(np.interp(flat, FLAT, (HIGH, ELEVATION)) if flat < FLAT[1] else
                 np.interp(slender, SLENDER, (ELEVATION, LOW)))


def _at_height(samples, level, up):
    """The direction from an elevation that suits what is shown, or from higher up where walls hide much,
    as of rooms without a ceiling, or where the cloud goes on around what is shown: grounds are thin
    strips from below.

    level: direction
    """
    high = _raised(level, up, HIGH)
    if _goes_on_around(samples, high, up):
        return high
    seen = _seen_area(samples, _raised(level, up, ELEVATION), up)
    is_hidden = seen < HIDDEN * _seen_area(samples, high, up)
    return high if is_hidden else _raised(level, up, _elevation(samples, up))


def fit(samples, direction, up, view):
    """-> position, focal point: as near as possible with all samples inside the picture."""
    right = np.cross(up, direction)
    right /= np.linalg.norm(right)
    above = np.cross(direction, right)
    tan_y = MARGIN * math.tan(math.radians(view.view_angle) / 2)
    tan_x = tan_y * view.size[0] / view.size[1]
    local = samples.points - samples.center
    x, y, z = local @ right, local @ above, local @ direction
    shift = np.zeros(2)
    distance = 0.0
    for _ in range(3):
        reach = np.maximum((np.abs(x - shift[0]) + samples.radius) / tan_x,
                           (np.abs(y - shift[1]) + samples.radius) / tan_y) + z
        nearest = 1e-3 * max(np.ptp(z), np.ptp(x), 1e-9 * np.abs(samples.center).max(), 1e-12)
        distance = max(reach.max(), z.max() + nearest)
        # The middle of the visible part moves with the distance.
        depth = distance - z
        for i, along in enumerate((x, y)):
            slope = (along - shift[i]) / depth
            shift[i] += 0.5 * (slope.min() + slope.max()) * distance
    focal_point = samples.center + shift[0] * right + shift[1] * above
    return focal_point + distance * direction, focal_point


def _other_than(up, direction):
    """Up, or another axis if up is nearly the view direction."""
    if not are_parallel(up, direction, sine=0.1):
        return up
    return np.eye(3)[int(np.argmin(np.abs(direction)))]


def _half_way(samples, position, forward, width):
    """The depth at which half of what is seen of a volume has been gathered; 0 without anything. Of
    what lies in one cell of the picture's middle is taken that it covers the cell evenly.

    width: tangent, of the middle
    """
    local = samples.points - position
    right = unit(np.cross(forward, np.eye(3)[int(np.argmin(np.abs(forward)))]))
    depth = local @ forward
    with np.errstate(divide="ignore", invalid="ignore"):
        places = local @ np.stack([right, np.cross(right, forward)], axis=1) / depth[:, None]
    cells = CELLS * (places / width + 0.5)
    inside = (depth > 0) & (cells >= 0).all(axis=1) & (cells < CELLS).all(axis=1)
    if not inside.any():
        return 0.0
    depth, cells = depth[inside], cells[inside].astype(int) @ (1, CELLS)
    thickness = samples.masses[inside] / (width / CELLS * depth) ** 2
    order = np.argsort(depth, kind="stable")
    seen = np.zeros(len(depth))
    for cell in range(CELLS**2):
        there = order[cells[order] == cell]
        seen[there] = np.diff(-np.expm1(-np.cumsum(thickness[there])), prepend=0.0)
    gathered = np.cumsum(seen[order])
    return float(depth[order][np.searchsorted(gathered, gathered[-1] / 2)])


def surface_in_the_middle(samples, position, focal_point, view):
    """Distance along the view direction to the front of the surface in the middle of the picture,
    on which a photographer would focus; of a volume, to where half of what is seen there has been
    gathered."""
    forward = unit(focal_point - position)
    tangent = MIDDLE * math.tan(math.radians(view.view_angle) / 2)
    if samples.is_volume:
        return _half_way(samples, position, forward, 2 * tangent)
    local = samples.points - position
    depth = local @ forward
    off_axis = lengths(local - np.outer(depth, forward))
    window = tangent * depth
    facing = samples.two_sided | (samples.areas @ forward < 0)
    in_the_middle = depth[(depth > 0) & (off_axis < window) & facing]
    return float(np.percentile(in_the_middle, FRONT)) if len(in_the_middle) else 0.0


def _up(view, sensor, samples, home):
    """-> Up in the world, about which the camera goes around"""
    if view.view_up:
        return Up(unit(np.asarray(view.view_up)), True)
    if home:
        return home.up
    return Up(floor_normal(samples, sensor.up), True) if sensor else find_up(samples)


def _aim(view, sensor, samples, up, home):
    """-> the direction to the camera, what is up in the picture, and the axis of azimuth; without
    turns."""
    if sensor and not are_parallel(up, sensor.direction, 0.1):
        direction = sensor.direction
        front = unit(direction - (direction @ up) * up)
    else:
        front = front_of(up)
        direction = None
    picture_up = up
    if home and not are_parallel(up, home.direction, 0.1):
        direction = home.direction
    elif direction is None and not view.wishes.side:
        direction = _three_quarter_direction(samples, up)
    if view.wishes.side:
        direction, picture_up = seen_from(view.wishes.side, front, up)
    return direction, picture_up, up


def _placed(view, aim, samples, home):
    """-> position, focal point, up in the picture"""
    direction, picture_up, axis = aim
    if not view.position:
        direction, up = turned(direction, picture_up, axis, view.wishes)
        if home:
            focal_point = home.focal_point
            position = focal_point + home.reach(view.wishes.side) * direction
        else:
            position, focal_point = fit(samples, direction, up, view)
        if view.focal_point:
            position = position - focal_point + np.asarray(view.focal_point)
            focal_point = np.asarray(view.focal_point)
        return position, focal_point, up
    middle = home.focal_point if home else samples and samples.center
    focal_point = np.asarray(view.focal_point or middle)
    arm = np.asarray(view.position) - focal_point
    distance = np.linalg.norm(arm)
    if not view.view_up:
        axis = _other_than(axis, arm)
    direction, up = turned(unit(arm), axis, axis, view.wishes)
    if not (view.wishes.azimuth or view.wishes.elevation):
        return np.asarray(view.position), focal_point, up  # exactly
    return focal_point + distance * direction, focal_point, up


def _zoomed(view):
    """The view with its zoom and f-number: an aperture of focal length / f-number."""
    angle = view.view_angle
    if view.wishes.zoom != 1:
        tangent = math.tan(math.radians(angle) / 2) / view.wishes.zoom
        angle = math.degrees(2 * math.atan(tangent))
    disk = view.focal_disk
    if view.wishes.f_number:
        disk = focal_length_of_angle(angle, view.size) / 1000 / view.wishes.f_number  # mm to m
    return replace(view, view_angle=angle, focal_disk=disk,
                   wishes=Wishes(blur=view.wishes.blur, focus_pixel=view.wishes.focus_pixel))


def _doubt(view, samples, up):
    """-> a line about what was taken for up, or for the outside, and what else it may be; or None"""
    is_told = view.view_up or view.position or view.wishes.side
    if not is_told and may_be_room(samples):
        return f"it may be a room; {options_inside(samples, up.axis)} looks into it"
    if up.is_clear or up.is_usual:
        return None
    axis = np.eye(3)[int(np.argmax(np.abs(up.axis)))] * np.sign(up.axis[np.argmax(np.abs(up.axis))])
    first, second, third = (word for word in ("y", "z", "-y", "-z") if word != name_of(axis))
    return (f"what is up is not clear; {name_of(axis)} was taken, and --up {first}, {second} or "
            f"{third} turns it")


def up_in(view, cloud, surfels):
    """-> Up in the world"""
    samples = Samples(surfels)
    return _up(view, sensor_of(cloud, surfels), samples, home_of(cloud, samples))


def home_in(cloud, surfels):
    """-> Home of a capture, or None"""
    return home_of(cloud, Samples(surfels))


def is_from_sensor(view, sensor):
    """Whether a view that is not complete begins at the place of a Sensor. From aside other parts are
    near, and the whole cloud is shown, unless a focal point says what."""
    wishes = view.wishes
    if not sensor or sensor.spread is None or view.position or wishes.side:
        return False
    if (wishes.azimuth or wishes.elevation) and not view.focal_point:
        return False
    arm = np.subtract(sensor.place, view.focal_point) if view.focal_point else sensor.direction
    return bool(np.any(arm)) and not are_parallel(view.view_up or sensor.up, arm, 0.1)


def _from_sensor(view, sensor, samples):
    """The view from the place of the sensor, at the surface in its middle."""
    placed = sensor.placed(view)
    if view.focal_point:
        return placed
    distance = (surface_in_the_middle(samples, sensor.place, np.asarray(placed.focal_point), placed)
                or np.median(lengths(samples.points - sensor.place)))
    point = sensor.place - distance * sensor.direction
    return replace(placed, focal_point=tuple(map(float, point)))


def _focused(view, position, focal_point, samples):
    """The view of a volume with what is seen in its middle in focus, unless another focus is given. Of
    surfaces, focused_on_front in focus.py finds it from a picture."""
    if view.focal_distance or view.focus_point or view.wishes.focus_pixel or not samples.is_volume:
        return view
    distance = surface_in_the_middle(samples, position, focal_point, view)
    return replace(view, focal_distance=distance)


def complete_view(view, cloud, surfels, hint=None, samples=None):
    """The view; everything that was not given is derived from the cloud, but for the focus on a
    surface: focused_on_front in focus.py.

    hint: is called with a line about what is a guess, and which options tell it
    samples: of the surfels, where they are known
    """
    is_placed = view.position and view.focal_point and view.view_up
    if is_placed and view.wishes == Wishes():
        return view if view.view_angle else replace(view, view_angle=DEFAULT_ANGLE)
    has_focal_point = view.focal_point is not None
    sensor = None if is_placed else sensor_of(cloud, surfels)
    samples = None if is_placed else samples or Samples(surfels)
    if is_from_sensor(view, sensor):
        view, is_placed = _from_sensor(view, sensor, samples), True
    home = None if is_placed else home_of(cloud, samples, hint)
    view = replace(view, view_angle=view.view_angle or (home.angle(view.size) if home else
                                                        DEFAULT_ANGLE))
    if is_placed:
        aim = None, None, np.asarray(view.view_up)
    else:
        up = _up(view, sensor, samples, home)
        doubt = hint and _doubt(view, samples, up)
        if doubt:
            hint(doubt)
        aim = _aim(view, sensor, samples, up.axis, home)
    position, focal_point, up = _placed(view, aim, samples, home)
    if not has_focal_point:
        view = _focused(view, position, focal_point, samples)
    completed = _zoomed(replace(view, position=tuple(map(float, position)),
                                   focal_point=tuple(map(float, focal_point)),
                                   view_up=tuple(map(float, up))))
    check_view(completed)
    return completed


def extent_of(samples):
    """Bounds and spacing as text."""
    bounds = ", ".join(f"{axis} {low:.7g} to {high:.7g}"
                       for axis, low, high in zip("xyz", samples.low, samples.high))
    return bounds + (f"; spacing {samples.spacing:.3g}" if samples.spacing else "")

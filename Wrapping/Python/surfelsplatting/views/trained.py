# SPDX-License-Identifier: BSD-3-Clause
"""The cameras that a capture was trained with: cameras.json of the reference implementation, and
transforms.json."""

import json
import math
import os
from dataclasses import dataclass

import numpy as np

from ..problems import UserProblem

NAMES = ("cameras.json", "transforms.json")
LEVELS = 3  # folders above a capture
LARGEST_FILE = 64_000_000  # bytes; a camera takes about 600
LARGEST = 1e17  # world units, as of other cameras
LARGEST_IMAGE = 1 << 20  # px, a side
OFF = 1e-3  # of a rotation's products of columns; text has rounded them
NAMED = 3  # cameras, in an error
IN_FRONT = 0.8  # part of the cameras that must look towards what they look at
FAR_OFF = 4.0  # of the cameras' spread, the farthest that it is away; else they look in parallel
FLIPPED = np.array([1.0, -1.0, -1.0])  # from right, up, backward to right, down, forward


@dataclass(frozen=True)
class TrainedCamera:
    """rotation: its columns are right, down and forward in the world. spread: tangents of the angles
    from the middle of the image to its side and to its upper border."""

    name: str
    position: np.ndarray
    rotation: np.ndarray
    size: tuple  # of the image, px
    spread: tuple

    @property
    def forward(self):
        return self.rotation[:, 2]

    @property
    def up(self):
        return -self.rotation[:, 1]


def load_json(path):
    """-> content of a camera file, or UserProblem"""
    try:
        size = os.path.getsize(path)
        if size > LARGEST_FILE:
            raise UserProblem(f"{path} has {size / 1e6:.0f} MB; camera files have at most "
                              f"{LARGEST_FILE / 1e6:.0f} MB; leave cameras out")
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except OSError as problem:
        raise UserProblem(f"cannot read the camera file {path}: {problem.strerror}") from problem
    except (ValueError, RecursionError) as problem:
        raise UserProblem(f"{path} is not a camera file in JSON: {problem}") from problem


def is_trained(content):
    """Whether it is the content of a file with the cameras of a training, not with views."""
    if isinstance(content, list):
        return bool(content) and isinstance(content[0], dict) and (
            "rotation" in content[0] or "img_name" in content[0])
    return isinstance(content, dict) and "frames" in content and "views" not in content


class _Entry:
    """One camera of a file; checks its values."""

    def __init__(self, where, values, common):
        self.where, self._values = where, {**common, **values}

    def fail(self, key, wanted):
        value = json.dumps(self._values.get(key))
        shown = value if len(value) <= 120 else value[:117] + "..."
        said = f"is {shown}" if key in self._values else "is missing"
        raise UserProblem(f"{self.where}: {key} {said}; it must be {wanted}")

    def has(self, key):
        return self._values.get(key) is not None

    def name(self, key):
        value = self._values.get(key, "")
        if not isinstance(value, str):
            self.fail(key, "the name of an image")
        return value

    def number(self, key, most, wanted):
        """A number above 0"""
        value = self._values.get(key)
        if not _is_number(value) or not 0 < value <= most:
            self.fail(key, wanted)
        return float(value)

    def array(self, key, shapes, wanted):
        """Finite numbers in one of these shapes"""
        value = self._values.get(key)
        rows = value if isinstance(value, list) else []
        flat = [x for row in rows for x in (row if isinstance(row, list) else [row])]
        if not flat or not all(map(_is_number, flat)):
            self.fail(key, wanted)
        try:
            array = np.array(value, float)
        except ValueError:  # rows of different lengths
            self.fail(key, wanted)
        if array.shape not in shapes or np.abs(array).max() > LARGEST:
            self.fail(key, wanted)
        return array


def _is_number(value):
    return (isinstance(value, (int, float)) and not isinstance(value, bool)
            and abs(value) <= np.finfo(float).max)


def _checked_rotation(entry, key, rotation):
    """The rotation, or UserProblem"""
    lengths = np.linalg.norm(rotation, axis=0)
    if np.abs(lengths - 1).max() > OFF:
        raise UserProblem(f"{entry.where}: the columns of {key} have the lengths "
                          f"{', '.join(f'{x:.4g}' for x in lengths)}; all must be 1, without a scale")
    off = np.abs(rotation.T @ rotation - np.eye(3)).max()
    if off > OFF:
        raise UserProblem(f"{entry.where}: the columns of {key} are not perpendicular, by {off:.2g}; "
                          "give the rotation from the camera to the world")
    if np.linalg.det(rotation) < 0:
        raise UserProblem(f"{entry.where}: {key} is left-handed, a mirror; its columns must be "
                          "right-handed, so turn one of them round")
    return rotation


def _of_reference(entry):
    """A camera of cameras.json: x right, y down, z forward"""
    position = entry.array("position", [(3,)], "three finite numbers")
    rotation = _checked_rotation(entry, "rotation", entry.array(
        "rotation", [(3, 3)], "three rows of three finite numbers"))
    size = tuple(entry.number(key, LARGEST_IMAGE, "a number of pixels above 0")
                 for key in ("width", "height"))
    focal = [entry.number(key, LARGEST, "a focal length in pixels above 0") for key in ("fx", "fy")]
    spread = tuple(side / 2 / length for side, length in zip(size, focal))
    return TrainedCamera(entry.name("img_name"), position, rotation, size, spread)


def _of_transforms(entry):
    """A frame of transforms.json: x right, y up, z backward"""
    matrix = entry.array("transform_matrix", [(4, 4), (3, 4)], "four rows of four finite numbers")
    rotation = _checked_rotation(entry, "transform_matrix", matrix[:3, :3]) * FLIPPED
    size = tuple(entry.number(key, LARGEST_IMAGE, "a number of pixels above 0")
                 if entry.has(key) else None for key in ("w", "h"))
    if entry.has("fl_x"):
        if None in size:
            entry.fail("w" if size[0] is None else "h", "the size of the image, px, beside fl_x")
        focal = [entry.number("fl_y" if axis and entry.has("fl_y") else "fl_x", LARGEST,
                              "a focal length in pixels above 0") for axis in (0, 1)]
        spread = tuple(side / 2 / length for side, length in zip(size, focal))
    else:
        angle = entry.number("camera_angle_x", 3.1, "an angle in radians between 0 and pi, or give "
                             "fl_x, w and h")
        size = size if None not in size else (800.0, 800.0)  # of which the shape counts only
        spread = tuple(math.tan(angle / 2) * side / size[0] for side in size)
    return TrainedCamera(entry.name("file_path"), matrix[:3, 3], rotation, size, spread)


def _checked_entries(path, content):
    """-> the objects of the cameras, what they have in common, how to read one"""
    if isinstance(content, list):
        return content, {}, _of_reference
    frames = content["frames"]
    if not isinstance(frames, list) or not frames:
        raise UserProblem(f"{path}: frames holds no cameras; expected [{{\"file_path\": .., "
                          "\"transform_matrix\": [[..], [..], [..], [..]]}, ..]")
    return frames, {key: value for key, value in content.items() if key != "frames"}, _of_transforms


def cameras_in(path, content):
    """[TrainedCamera] of the content of a file, or UserProblem"""
    entries, common, read = _checked_entries(path, content)
    cameras = []
    for number, values in enumerate(entries):
        where = f"{path}: camera {number}"
        if not isinstance(values, dict):
            raise UserProblem(f"{where} is {json.dumps(values)[:120]}; it must be an object with keys "
                              "such as those of the others")
        cameras.append(read(_Entry(where, values, common)))
    return cameras


def chosen(path, cameras, name):
    """-> the camera of an image, with or without its extension and folder, or of this number."""
    def names(camera):
        base = os.path.basename(camera.name)
        return camera.name, base, os.path.splitext(base)[0]

    for camera in cameras:
        if name and name in names(camera):
            return camera
    if name.isdecimal() and int(name) < len(cameras):
        return cameras[int(name)]
    known = ", ".join(names(camera)[1] for camera in cameras[:NAMED] if camera.name)
    known = f", or an image such as {known}" if known else ""
    raise UserProblem(f"{path} has no camera {name!r}; give a number from 0 to {len(cameras) - 1}"
                      + known)


def pivot_of(cameras):
    """The point nearest to the axes of all cameras, in least squares; None if most do not look
    towards it, as in rooms, or if it is far off, as of cameras in parallel."""
    places = np.array([camera.position for camera in cameras])
    axes = np.array([camera.forward for camera in cameras])
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    matrix = across.sum(axis=0)
    if len(cameras) < 2 or np.linalg.cond(matrix) > 1e6:
        return None
    pivot = np.linalg.solve(matrix, np.einsum("nij,nj->i", across, places))
    ahead = np.einsum("ij,ij->i", pivot - places, axes) > 0
    spread = np.linalg.norm(places - np.median(places, axis=0), axis=1).max()
    is_near = np.linalg.norm(pivot - np.median(places, axis=0)) <= FAR_OFF * spread
    return pivot if is_near and ahead.mean() >= IN_FRONT else None


def cameras_file(path):
    """The camera file of a capture: beside it, or in the folder of the model to which the folders
    point_cloud/iteration_N belong; None without one."""
    folder = os.path.dirname(os.path.abspath(path))
    for _ in range(LEVELS + 1):
        for name in NAMES:
            file = os.path.join(folder, name)
            if os.path.isfile(file):
                return file
        folder, last = os.path.split(folder)
        if last != "point_cloud" and not last.startswith("iteration_"):
            return None
    return None


def files_of(path):
    """The files with cameras that a view of a capture may come from: one, or none"""
    file = cameras_file(path)
    try:
        return [file] if file and is_trained(load_json(file)) else []
    except UserProblem:
        return [file]

# SPDX-License-Identifier: BSD-3-Clause
"""Reads the meshes of glTF 2.0 files, .gltf and .glb. VTK's reader would round places far from the
origin to floats."""

import base64
import json
import os
import struct
from urllib.parse import unquote

import numpy as np

from ..clouds.polydata import cells_of, polydata_of
from ..pictures import to_srgb
from ..problems import UserProblem

MAGIC = b"glTF"
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES, STRIP, FAN = 4, 5, 6  # modes of primitives; others are points and lines
MOST_SHARED = 16  # times that a node has a place, on average; the format allows one


def _chunks(content):
    """-> the JSON text and the binary buffer of a file."""
    if content[:4] != MAGIC:
        return content, b""
    found, at = {}, 12
    while at + 8 <= len(content):
        length, kind = struct.unpack_from("<I4s", content, at)
        found.setdefault(kind, content[at + 8:at + 8 + length])
        at += 8 + length
    return found[JSON_CHUNK], found.get(BINARY_CHUNK, b"")


def _check_compression(part):
    """Raises ValueError if a primitive, or a view of a buffer, is compressed by an extension."""
    compressed = [name for name in part.get("extensions", {}) if "compression" in name]
    if compressed:
        raise ValueError(f"it is compressed by {compressed[0]}; store it without compression")


class _File:
    def __init__(self, path):
        with open(path, "rb") as file:
            text, self._binary = _chunks(file.read())
        self._folder = os.path.dirname(path)
        try:
            self.json = json.loads(text)
        except ValueError as problem:
            raise ValueError(f"it begins with {text[:20]!r} and is no JSON: {problem}; was all of it downloaded?") \
                from problem
        self._buffers = {}

    def _buffer(self, number):
        if number not in self._buffers:
            uri = self.json["buffers"][number].get("uri")
            if uri is None:
                content = self._binary
            elif uri.startswith("data:"):
                content = base64.b64decode(uri.split(",", 1)[1])
            else:
                name = unquote(uri)
                if os.path.isabs(name) or "://" in name:
                    raise ValueError(f"its buffer {name} is not in a file beside it")
                with open(os.path.join(self._folder, name), "rb") as file:
                    content = file.read()
            self._buffers[number] = content
        return self._buffers[number]

    def values(self, number):
        """[count, width] of an accessor; whole numbers of a normalized one as fractions."""
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        _check_compression(view)
        kind, width = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        count, stride = accessor["count"], view.get("byteStride", kind.itemsize * width)
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        buffer = self._buffer(view["buffer"])
        if (count < 1 or begin < 0 or stride < kind.itemsize * width
                or begin + (count - 1) * stride + kind.itemsize * width > len(buffer)):
            raise ValueError(f"accessor {number} reaches past the end of its buffer")
        values = np.ndarray((count, width), kind, buffer, begin, (stride, kind.itemsize))
        if accessor.get("normalized"):
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values.astype(float)


def _rotation(x, y, z, w):
    """The matrix of a unit quaternion."""
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def _matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T  # columns come first in the file
    matrix = np.eye(4)
    matrix[:3, :3] = (_rotation(*node.get("rotation", (0, 0, 0, 1)))
                      * np.array(node.get("scale", (1, 1, 1)), float))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _placed_meshes(content):
    """-> [(number of a mesh, its matrix to the world)]"""
    nodes = content.get("nodes", [])
    scenes = content.get("scenes")
    if scenes:
        roots = scenes[content.get("scene", 0)].get("nodes", [])
    else:
        inner = {child for node in nodes for child in node.get("children", [])}
        roots = [number for number in range(len(nodes)) if number not in inner]
    waiting = [(root, np.eye(4)) for root in reversed(roots)]
    found, places = [], 0
    while waiting:
        number, parent = waiting.pop()
        places += 1
        if places > MOST_SHARED * len(nodes):
            raise ValueError("its nodes hold one another, or share others many times")
        matrix = parent @ _matrix(nodes[number])
        if "mesh" in nodes[number]:
            found.append((nodes[number]["mesh"], matrix))
        waiting += [(child, matrix) for child in reversed(nodes[number].get("children", []))]
    return found


def _colors(values):
    """sRGB bytes: the file has linear light (glTF 2.0, 3.7.2.1)."""
    return np.round(255 * to_srgb(np.clip(np.nan_to_num(values[:, :3]), 0, 1))).astype(np.uint8)


def _faces(file, primitive, count, is_mirrored):
    """-> [n, 3] numbers of vertices"""
    mode = primitive.get("mode", TRIANGLES)
    if mode not in (TRIANGLES, STRIP, FAN):
        return np.zeros((0, 3), np.int64)
    corners = np.arange(count)
    if "indices" in primitive:
        corners = file.values(primitive["indices"]).ravel().astype(np.int64)
        corners[corners >= count] = -1  # of no vertex: such triangles are left out
    if mode == TRIANGLES:
        triangles = corners[:len(corners) - len(corners) % 3].reshape(-1, 3)
    else:
        triangles = np.column_stack([corners[:-2], corners[1:-1], corners[2:]])
        if mode == FAN:
            triangles[:, 0] = corners[0]
        else:
            triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles[:, ::-1] if is_mirrored else triangles


def _primitive(file, primitive, matrix):
    """-> places, colours or None, normals or None, triangles"""
    _check_compression(primitive)
    attributes = primitive["attributes"]
    places = file.values(attributes["POSITION"]) @ matrix[:3, :3].T + matrix[:3, 3]
    colors = _colors(file.values(attributes["COLOR_0"])) if "COLOR_0" in attributes else None
    normals = None
    if "NORMAL" in attributes and np.linalg.det(matrix[:3, :3]):
        normals = file.values(attributes["NORMAL"]) @ np.linalg.inv(matrix[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    if any(len(a) != len(places) for a in (colors, normals) if a is not None):
        raise ValueError("a mesh has attributes of different lengths")
    is_mirrored = np.linalg.det(matrix[:3, :3]) < 0
    return places, colors, normals, _faces(file, primitive, len(places), is_mirrored)


def _joined(parts, triangles):
    """-> vtkCellArray of triangles of parts whose vertices come one part after another"""
    firsts = np.cumsum([0, *map(len, parts)])
    rows = np.concatenate([np.where(corners < 0, -1, corners + first)
                           for corners, first in zip(triangles, firsts)])
    return cells_of(rows.ravel(), np.arange(0, rows.size + 1, 3))


def _read(path):
    file = _File(path)
    parts = [_primitive(file, primitive, matrix)
             for mesh, matrix in _placed_meshes(file.json)
             for primitive in file.json["meshes"][mesh]["primitives"]]
    if not parts:
        raise ValueError("it holds no meshes")
    # What one of the parts lacks cannot be shown for all.
    *attributes, triangles = zip(*parts)
    places, colors, normals = (None if any(p is None for p in part) else np.concatenate(part)
                               for part in attributes)
    arrays = {"RGB": colors, "Normals": normals}
    return polydata_of(places, {name: a for name, a in arrays.items() if a is not None},
                       _joined(attributes[0], triangles))


def read_gltf_cloud(path):
    """-> vtkPolyData with double points, and faces."""
    try:
        return _read(path)
    except OSError as problem:
        raise UserProblem(f"{path}: cannot read its buffer {problem.filename}: "
                          f"{problem.strerror}") from problem
    except KeyError as problem:
        raise UserProblem(f"{path} is not a readable glTF file: it lacks {problem}") from problem
    except (ValueError, TypeError, AttributeError, IndexError, OverflowError, RecursionError,
            struct.error, np.linalg.LinAlgError) as problem:
        raise UserProblem(f"{path} is not a readable glTF file: {problem}") from problem

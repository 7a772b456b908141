# SPDX-License-Identifier: BSD-3-Clause
"""Reads the faces of .ply files, which the reader of their points skips."""

import numpy as np

from .polydata import cells_of

KINDS = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
         "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
         "float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}
ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
INDICES = ("vertex_indices", "vertex_index")
LONGEST_HEADER = 10_000  # lines


def _header(file):
    """-> byte order or None of text, {element: (count, [(name, kind, kind of a list's length)])}"""
    order, elements, properties = None, {}, []
    for _ in range(LONGEST_HEADER):
        words = file.readline().decode("ascii", "replace").split()
        if words[:1] == ["end_header"]:
            return order, elements
        if words[:1] == ["format"]:
            order = ORDERS[words[1]]
        elif words[:1] == ["element"]:
            properties = []
            elements[words[1]] = int(words[2]), properties
        elif words[:2] == ["property", "list"]:
            properties.append((words[4], KINDS[words[3]], KINDS[words[2]]))
        elif words[:1] == ["property"]:
            properties.append((words[2], KINDS[words[1]], None))
    raise ValueError("no end of the header")


def _row_lengths(lists):
    sizes = np.fromiter(map(len, lists), np.int64, len(lists))
    return np.append(0, np.cumsum(sizes))


def _text_lists(file, count, properties):
    """The lists of indices of the next lines."""
    lists = []
    for _ in range(count):
        words, at = file.readline().split(), 0
        for name, _kind, length in properties:
            size = int(words[at]) if length else 1
            at += bool(length)
            if name in INDICES:
                lists.append([int(word) for word in words[at:at + size]])
            at += size
    return lists


def _equal_lists(content, count, properties, order):
    """[count, n] indices, if all lists are as long as those of the first face; else None"""
    fields, lengths, at = [], {}, 0
    for number, (name, kind, length) in enumerate(properties):
        size = 1
        if length:
            size = int(np.frombuffer(content, order + length, 1, at)[0])
            fields.append((f"length {number}", order + length))
            lengths[f"length {number}"] = size
        fields.append((name if name in INDICES else f"other {number}", order + kind, (size,)))
        at = np.dtype(fields).itemsize
    if at * count > len(content):
        return None
    rows = np.frombuffer(content, np.dtype(fields), count)
    if any((rows[name] != size).any() for name, size in lengths.items()):
        return None
    return next(rows[name] for name in INDICES if name in rows.dtype.names)


def _lists(content, count, properties, order):
    """The lists of indices of faces one by one."""
    lists, at = [], 0
    for _ in range(count):
        for name, kind, length in properties:
            size = 1
            if length:
                size = int(np.frombuffer(content, order + length, 1, at)[0])
                at += np.dtype(length).itemsize
            if name in INDICES:
                lists.append(np.frombuffer(content, order + kind, size, at))
            at += size * np.dtype(kind).itemsize
    return lists


def _faces(path):
    with open(path, "rb") as file:
        order, elements = _header(file)
        count, properties = elements.get("face", (0, []))
        if not count or not any(name in INDICES and length for name, _, length in properties):
            return None
        before = list(elements)[:list(elements).index("face")]
        if any(length for name in before for _, _, length in elements[name][1]):
            return None
        if order is None:
            for _ in range(sum(elements[name][0] for name in before)):
                file.readline()
            lists = _text_lists(file, count, properties)
            return cells_of(np.concatenate(lists), _row_lengths(lists))
        file.seek(sum(elements[name][0] * np.dtype(kind).itemsize
                      for name in before for _, kind, _ in elements[name][1]), 1)
        content = file.read()
    rows = _equal_lists(content, count, properties, order)
    if rows is not None:
        return cells_of(rows.ravel(), np.arange(count + 1) * rows.shape[1])
    lists = _lists(content, count, properties, order)
    return cells_of(np.concatenate(lists), _row_lengths(lists))


def read_ply_faces(path):
    """-> vtkCellArray; None if there are no faces, or they cannot be read"""
    try:
        return _faces(path)
    except (ValueError, KeyError, IndexError, TypeError, OverflowError, MemoryError):
        return None

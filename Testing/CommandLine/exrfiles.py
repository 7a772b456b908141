# SPDX-License-Identifier: BSD-3-Clause
"""OpenEXR files byte by byte, uncompressed: of any kind, and such as no writer leaves."""

import struct

import numpy as np

from toolcase import write

MAGIC, TILED, DEEP, PARTS = 20000630, 0x200, 0x800, 0x1000
KINDS = {np.dtype("u4"): 0, np.dtype("f2"): 1, np.dtype("f4"): 2}


def attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def header(channels, window, *, display=None, order=0, compression=0, flags=0, sampling=1, extra=(),
           screen=(0.0, 0.0, 1.0), aspect=1.0):
    """channels: {name: type}; windows: (left, top, right, bottom); extra: attributes as bytes"""
    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iiii", KINDS[np.dtype(kind)], 0, sampling, sampling)
        for name, kind in sorted(channels.items()))
    attributes = [attribute("channels", "chlist", listed + b"\0"),
                  attribute("compression", "compression", bytes([compression])),
                  attribute("dataWindow", "box2i", struct.pack("<4i", *window)),
                  attribute("displayWindow", "box2i", struct.pack("<4i", *(display or window))),
                  attribute("lineOrder", "lineOrder", bytes([order])),
                  attribute("pixelAspectRatio", "float", struct.pack("<f", aspect)),
                  attribute("screenWindowCenter", "v2f", struct.pack("<2f", *screen[:2])),
                  attribute("screenWindowWidth", "float", struct.pack("<f", screen[2])), *extra]
    return struct.pack("<ii", MAGIC, 2 | flags) + b"".join(attributes) + b"\0"


def join(begin, chunks, order):
    """Chunks, top row first, behind their table; order: 0 as they are, 1 from the lowest row up."""
    places = np.zeros(len(chunks), np.uint64)
    place = len(begin) + 8 * len(chunks)
    rows = range(len(chunks))[::-1] if order == 1 else range(len(chunks))
    for row in rows:
        places[row] = place
        place += len(chunks[row])
    return begin + places.tobytes() + b"".join(chunks[row] for row in rows)


def flat_file(path, planes, corner=(0, 0), order=0, **options):
    """planes: {channel: [height, width] of u4, f2 or f4}, top row first"""
    height, width = next(iter(planes.values())).shape
    left, top = corner
    begin = header({name: plane.dtype for name, plane in planes.items()},
                   (left, top, left + width - 1, top + height - 1), order=order, **options)
    chunks = []
    for row in range(height):
        data = b"".join(planes[name][row].tobytes() for name in sorted(planes))
        chunks.append(struct.pack("<ii", top + row, len(data)) + data)
    write(path, join(begin, chunks, order))


def deep_file(path, counts, samples, corner=(0, 0), order=0, kind="deepscanline", **options):
    """counts: [height, width]; samples: {channel: [n]}, both top row first"""
    height, width = counts.shape
    left, top = corner
    extra = (attribute("type", "string", kind.encode()), attribute("version", "int", b"\1\0\0\0"),
             *options.pop("extra", ()))
    begin = header({name: values.dtype for name, values in samples.items()},
                   (left, top, left + width - 1, top + height - 1), order=order, flags=DEEP,
                   extra=extra, **options)
    chunks, first = [], 0
    for row in range(height):
        table = np.cumsum(counts[row], dtype=np.int32).tobytes()
        end = first + int(counts[row].sum())
        data = b"".join(samples[name][first:end].tobytes() for name in sorted(samples))
        sizes = len(table), len(data), len(data)
        chunks.append(struct.pack("<iQQQ", top + row, *sizes) + table + data)
        first = end
    write(path, join(begin, chunks, order))

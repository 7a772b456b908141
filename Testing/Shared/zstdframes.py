# SPDX-License-Identifier: BSD-3-Clause
"""Frames of zstd (RFC 8878) for tests."""

import ctypes
import struct

MAGIC = b"\x28\xb5\x2f\xfd"
RAW, REPEATED = 0, 1  # types of blocks
LARGEST = 1 << 17  # bytes of a block
WINDOW = b"\x00\x38"  # no sizes in the header; 128 KiB


def block(kind, size, content, is_last):
    return struct.pack("<I", size << 3 | kind << 1 | is_last)[:3] + content


def raw_frame(content):
    """A frame that compresses nothing"""
    parts = [content[i:i + LARGEST] for i in range(0, len(content), LARGEST)] or [b""]
    blocks = (block(RAW, len(part), part, i == len(parts) - 1) for i, part in enumerate(parts))
    return MAGIC + WINDOW + b"".join(blocks)


def repeated_frame(byte, count):
    """A frame of equal bytes, 128 KiB times count: 4 bytes for each"""
    return MAGIC + WINDOW + b"".join(block(REPEATED, LARGEST, byte, i == count - 1) for i in range(count))


def compressed(content):
    """A frame by libzstd, or where that is missing, one that compresses nothing"""
    try:
        library = ctypes.CDLL("libzstd.so.1")
    except OSError:
        return raw_frame(content)
    library.ZSTD_compressBound.restype = library.ZSTD_compress.restype = ctypes.c_size_t
    library.ZSTD_compressBound.argtypes = [ctypes.c_size_t]
    library.ZSTD_compress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p,
                                      ctypes.c_size_t, ctypes.c_int]
    room = library.ZSTD_compressBound(len(content))
    buffer = ctypes.create_string_buffer(room)
    size = library.ZSTD_compress(buffer, room, content, len(content), 3)
    return buffer.raw[:size]

# SPDX-License-Identifier: BSD-3-Clause
"""How many bytes of raw data lie beside the headers of volumes. VTK's readers fill up what a file
cut short lacks, and only print that, if at all."""

import os

from ..problems import UserProblem

LONGEST_HEADER = 1 << 16  # bytes


def _fields(lines, separator):
    """{key in small letters: value} of header lines"""
    pairs = (line.partition(separator) for line in lines if not line.startswith("#"))
    return {key.strip().lower(): value.strip() for key, _, value in pairs}


def _of_meta_image(start):
    """-> (name of the data's file or "" for this one, bytes of the header, whether the data are numbers
    as text), or None: neither raw nor text"""
    at = start.find(b"ElementDataFile")
    end = start.find(b"\n", at)
    if at < 0:
        return None
    text = start[:end if end >= 0 else len(start)].decode("latin-1")
    fields = _fields(text.splitlines(), "=")
    name = fields.get("elementdatafile", "")
    if (fields.get("compresseddata", "false").lower() == "true" or "headersize" in fields
            or name == "LIST" or "%" in name or len(name.split()) != 1):
        return None
    is_text = fields.get("binarydata", "true").lower() == "false"
    return ("", end + 1, is_text) if name == "LOCAL" else (name, 0, is_text)


def _of_nrrd(start):
    """The same."""
    line = b"\r\n" if b"\r\n" in start[:16] else b"\n"
    header, empty, _ = start.partition(2 * line)
    fields = _fields(header.decode("latin-1").splitlines(), ":")
    name = fields.get("data file", fields.get("datafile", ""))
    if (fields.get("encoding", "").lower() != "raw" or "byte skip" in fields or "line skip" in fields
            or name.split()[:1] == ["LIST"] or "%" in name):
        return None
    return (name, 0, False) if name else ("", len(header) + len(empty), False)


def check_raw_size(path, array):
    """-> whether the data are numbers as text. UserProblem if a volume's file has fewer bytes, or
    numbers as text, than the array that was read from it."""
    with open(path, "rb") as file:
        start = file.read(LONGEST_HEADER)
    found = (_of_nrrd if start.startswith(b"NRRD") else _of_meta_image)(start)
    if found is None or array is None:
        return False
    name, header, is_text = found
    data = os.path.join(os.path.dirname(path), name) if name else path
    if not os.path.isfile(data):
        return False
    if is_text:
        with open(data, "rb") as file:
            file.seek(header)
            there, promised, what = len(file.read().split()), array.GetDataSize(), "scalars"
    else:
        there, what = max(0, os.path.getsize(data) - header), "bytes of scalars"
        promised = array.GetDataSize() * array.GetDataTypeSize()
    if there < promised:
        raise UserProblem(f"{path} promises {promised} {what}, but {data} has {there}: it was cut "
                          "short")
    return is_text

# SPDX-License-Identifier: BSD-3-Clause
"""Headers of .ply and .pcd files whose readers could only say that they are damaged, or would misread them."""

import codecs
import os
import re
from shlex import quote

from ..problems import UserProblem, shortened

START = 1 << 20  # bytes that are looked at
MARKS = {codecs.BOM_UTF8: "tail -c +4 {}", codecs.BOM_UTF16_LE: "iconv -f utf-16 -t utf-8 {}",
         codecs.BOM_UTF16_BE: "iconv -f utf-16 -t utf-8 {}"}
END = re.compile(rb"[\r\n](?:end_header|DATA[ \t]+(?:ascii|binary\w*))[ \t]*(?:\r*\n|\r)")
LINE_END = re.compile(rb"\r*\n|\r")  # CR CR LF: made twice of LF
TYPES = set("char uchar short ushort int uint float double "
            "int8 uint8 int16 uint16 int32 uint32 float32 float64".split())
ENOUGH = 8  # bytes LF of numbers, before which CR does not stand by chance


def _mended(path, command):
    name = quote("mended-" + os.path.basename(path))
    return f"mend it by {command.format(quote(path))} > {name}"


def _check_line_ends(path, header):
    """PCL's parser takes all to be as the first one."""
    ends = LINE_END.findall(header)
    if ends[0] == b"\r":
        how = _mended(path, r"tr '\r' '\n' < {}") if b"ascii" in header else "save it again, with LF at the ends of lines"
        raise UserProblem(f"{path}: the lines of its header end in CR alone, as on old Macs; {how}")
    if ends[0] != b"\n" and b"\n" in ends:
        number = 1 + ends.index(b"\n")
        how = _mended(path, r"LC_ALL=C sed '1,/^end_header/s/\r*$//' {}")
        raise UserProblem(f"{path}: line {number} of its header ends in LF, and line 1 in CR LF; {how}")


def _check_properties(path, header):
    names = set()
    for line in LINE_END.split(header):
        words = line.decode(errors="replace").split()
        if words[:1] == ["element"]:
            names.clear()
        elif words[:1] == ["property"]:
            last = 4 if words[1:2] == ["list"] else 2  # before the name, whose first word counts
            unknown = next((kind for kind in words[last // 2:last] if kind not in TYPES), None)
            if unknown:
                raise UserProblem(f"{path}: its header says {shortened(' '.join(words))!r}, but .ply has no type "
                                  f"{unknown!r}; save it as int or double")
            if names.intersection(words[last:last + 1]):
                raise UserProblem(f"{path}: two properties of an element are called {shortened(words[last])!r}; give "
                                  "one of them another name")
            names.update(words[last:last + 1])


def check_header(path):
    """Raises UserProblem if a .ply or .pcd file cannot be read for what other programs did to it."""
    with open(path, "rb") as file:
        start = file.read(START)
    for mark, command in MARKS.items():
        if start.startswith(mark):
            raise UserProblem(f"{path} begins with a mark of Unicode, as editors and shells of Windows write it; "
                              + _mended(path, command))
    end = END.search(start)
    if not end:
        return  # the reader says so
    header, data = start[:end.end()], start[end.end():]
    count = data.count(b"\n")
    if end[0].endswith(b"\r\n") and b"binary" in header and count >= ENOUGH and data.count(b"\r\n") == count:
        raise UserProblem(f"{path} was written or copied as text, by which each byte LF of its numbers became CR LF; "
                          "write or copy it in binary mode")
    if start.startswith(b"ply"):
        _check_line_ends(path, header)
        _check_properties(path, header)

# SPDX-License-Identifier: BSD-3-Clause
"""What marks the decimals and the thousands of numbers in text, as programs of several languages write them."""

import re
from dataclasses import dataclass, field

DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*(\d|,\d+)([eE][+-]?\d+)?\s*")
# Numbers that have marks for their thousands, by that mark.
GROUPED = {".": re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d+"), ",": re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d+")}
# Other marks of thousands: apostrophes, and blanks
APART = ("'", "\u2019", "\u00a0", "\u202f", " ")
QUOTED = re.compile(r'"([^"]*)"')
WORD = re.compile(r"[^\W\d_]{2}")
FEW = 100  # lines that show how the numbers of a file are written
# A colour; a line that begins with one and has no other columns is a comment.
COLOR = re.compile(r"(?:(?<=[\s,;|\"'])|^(?=\S+[,;|\t]))(?:#|0x)([0-9a-fA-F]{6})(?!\w)")
# Words for numbers, and what Python reads instead: colours, exponents of Fortran, the minus of .NET in the North of
# Europe, and what Windows writes for a number that is none.
ODD = ((COLOR, lambda match: str(int(match[1], 16))),
       (re.compile(r"(?<![\w.])([+-]?\d*\.\d*)[dD]([+-]?\d{1,3})(?![\w.])"), r"\1e\2"),
       (re.compile("\u2212(?=[\\d.])"), "-"),
       (re.compile(r"[+-]?(?:nan\(\w+\)|\b1\.#(?:IND|QNAN|SNAN|INF)\d*)"), "nan"))


def _joined(text, mark):
    """The text without the mark where it is one of thousands."""
    return re.sub(rf"(?<=\d){mark}(?=\d{{3}}(?!\d))", "", text)


def _in_quotes(match):
    """A quoted number or text, whose commas separate no columns, as Python writes it; else what is quoted."""
    text = match[1].strip()
    if WORD.search(text):
        return re.sub(r"[,;|\t]", " ", text)
    for mark in APART:
        joined = _joined(text, mark)
        text = joined if DECIMAL_COMMA.fullmatch(joined) else text
    for mark, pattern in GROUPED.items():
        if pattern.fullmatch(text):
            text = text.replace(mark, "")
    return text.replace(",", ".") if DECIMAL_COMMA.fullmatch(text) else text


def odd_of(lines):
    """-> those of ODD that are in the lines"""
    return [odd for odd in ODD if any(map(odd[0].search, lines))]


def without_odd(line, odd=ODD):
    """odd: those of ODD that it may have"""
    for pattern, number in odd:
        line = pattern.sub(number, line)
    return line


@dataclass
class Marks:
    """How the numbers of a file are written, but for Python's way."""

    has_quotes: bool = False
    has_quoted_commas: bool = False
    thousands: str = ""  # "." or ","
    apart: str = ""  # one of APART, or nothing
    has_decimal_comma: bool = False
    odd: list = field(default_factory=list)  # of ODD

    def __bool__(self):
        return bool(self.has_quotes or self.thousands or self.apart or self.has_decimal_comma or self.odd)

    def read(self, line):
        """-> the line with numbers as Python writes them"""
        line = without_odd(line, self.odd)
        if self.has_quoted_commas:
            line = QUOTED.sub(_in_quotes, line)
        if self.has_quotes:
            line = line.replace('"', "")
        if self.apart:
            line = _joined(line, self.apart)
        if self.thousands:
            line = line.replace(self.thousands, "")
        return line.replace(",", ".") if self.has_decimal_comma else line


def _find_apart(lines):
    """The one of APART that marks thousands in these lines, or nothing."""
    for mark in APART:
        # A blank separates columns, unless something else does.
        columns = re.compile(r"[;|\t]" if mark == " " else r"[;|,\t ]")
        grouped = re.compile(rf"[+-]?\d{{1,3}}({mark}\d{{3}})+([.,]\d+)?")
        rows = [columns.split(line.strip()) for line in lines if mark in line]
        if any(grouped.fullmatch(cell.strip()) for row in rows if len(row) > 2 for cell in row):
            return mark
    return ""


def marks_of(lines, odd=()):
    """-> Marks of a file that begins with these lines; its delimiter tells whether commas are decimal points.
    odd: of ODD, which the lines no longer have"""
    quoted = [cell for line in lines if '"' in line for cell in QUOTED.findall(line)]
    marks = Marks(bool(quoted), any("," in cell for cell in quoted))
    marks.apart = _find_apart(list(map(marks.read, lines[:FEW])))
    rows = [re.split(r"[;|\s]+", marks.read(line).strip()) for line in lines[:FEW]]
    # 123,456,789.5 alone in a line is a point.
    cells = {cell for row in rows if len(row) > 2 for cell in row}
    for mark, pattern in GROUPED.items():
        if any(map(pattern.fullmatch, cells)):
            marks.thousands = mark
    marks.odd = list(odd)
    return marks

# SPDX-License-Identifier: BSD-3-Clause
"""Point clouds in columns of text: .xyz, .txt, .csv, .tsv, .asc, .pts and the like."""

import codecs
import itertools
import math
import re
from dataclasses import dataclass

import numpy as np

from ..clouds.degrees import cloud_of_degrees
from ..clouds.polydata import polydata_of
from ..problems import UserProblem, no_points, shortened
from .columnnames import RGB, has_places
from .columns import arrays_of_columns, by_names, by_values, channels_of
from .numbermarks import COLOR, DECIMAL_COMMA, ODD, Marks, marks_of, odd_of, without_odd

COMMENTS = ("#", "//")
BEGINS_OF_COMMENTS = "#/%!"  # above the points
BLANK = " \t\r\n,;|\""
MISSING = {"", "na", "n/a", "#n/a", "null", "none", "nil", "-", "--", "?"}  # values, as programs write them
PTS_MARK = re.compile(r"\d+|BEGIN|END")  # a scan may begin with the number of its points, or a word
HEAD = 1000  # lines in which the first point is looked for
START = 1 << 20  # bytes that tell the encoding
TOP = 100  # lines in which a table of any name has its first point
MOST_COLUMNS = 1000  # of a table that has more columns than lines


@dataclass
class _Layout:
    encoding: str
    head: list  # lines above the first point
    delimiter: str  # None: blanks
    marks: Marks
    names: list  # of the columns; None if there are none
    used: list  # columns that hold numbers; None: all
    color: int  # the column that is #rrggbb, or None
    repeats_head: bool = False  # as where tables were joined


def _words(line):
    return re.split(r"[\s,;|]+", line.strip(" \t\r\n,;|"))


def _is_number(word):
    try:
        float(word)
    except ValueError:
        return False
    return True


def _is_missing(cell):
    return cell.strip(" \t\"'").lower() in MISSING


def _is_row(line, least):
    words = _words(line)
    return len(words) >= least and all(map(_is_number, words[:3]))


def _first_row(lines, with_comments, numbers=(3, 2)):
    """The number of the line with the first point, or None. A point may begin with words, such as its
    name, where the line above names the columns, perhaps as a comment.
    numbers: how many it has at least, and at least if no line has as many: two count points and columns"""
    for least in numbers:
        for number, (line, above) in enumerate(zip(lines, ["", *with_comments])):
            names = _words(above.lstrip(BEGINS_OF_COMMENTS + " "))
            is_named = sum(map(_is_number, _words(line))) >= 3 and has_places(names)
            if is_named or _is_row(line, least):
                return number
    return None


def _without_comment(line):
    return re.split("|".join(COMMENTS), line)[0]


def _plain(lines):
    """-> the lines without comments, with numbers as Python writes them; their Marks"""
    odd = odd_of(lines)
    lines = [_without_comment(without_odd(line, odd)) for line in lines]
    marks = marks_of(lines, odd)
    return list(map(marks.read, lines)), marks


def _split(line, delimiter):
    return [word.strip(" \t\r\n\"'") for word in line.strip(" \r\n").split(delimiter)]


def _delimiter(row):
    """-> the mark between the columns or None for blanks, whether a comma is a decimal point."""
    for delimiter in (";", "|"):
        if delimiter in row:
            return delimiter, "," in row
    for delimiter in ("\t", None):
        cells = row.strip().split(delimiter)
        if "," in row and len(cells) > 2 and all(map(DECIMAL_COMMA.fullmatch, cells)):
            return delimiter, True
    return ("," if "," in row else None), False


def _are_between_tabs(rows):
    """Whether tabs separate as many cells in all rows, and blanks do not: of empty cells, or words with blanks"""
    counts = [{len(_split(row, delimiter)) for row in rows} for delimiter in ("\t", None)]
    return len(counts[0]) == 1 < len(counts[1]) and counts[0] != {1}


def _find_names(lines, delimiter, count):
    """The names of the columns, from the lines above the first point; None if there are none. A line of units may
    follow."""
    others = None
    for line in reversed(lines):
        plain = line.strip().lstrip(BEGINS_OF_COMMENTS).strip()
        is_comment = line.lstrip()[:1] in BEGINS_OF_COMMENTS
        for names in (_split(plain, delimiter), _words(plain)):
            names = [name.strip("\"'") for name in names]
            is_table_head = len(names) == count and not all(map(_is_number, names))
            if is_table_head and has_places(names):
                return names
            if is_table_head and not is_comment:
                others = others or names
    return others


def _are_halves(rows):
    """Whether each two of the first six cells are a number with a decimal comma: what is behind it begins with a
    zero here and there, as no other whole number does."""
    rows = [row for row in rows if len(row) >= 6]
    wholes = [cell for row in rows for cell in row[0:6:2]]
    decimals = [cell for row in rows for cell in row[1:6:2]]
    return (all(map(re.compile(r"[+-]?(0|[1-9]\d*)").fullmatch, wholes)) and all(map(str.isdecimal, decimals))
            and any(cell.startswith("0") and len(cell) > 1 for cell in decimals)
            and not any("." in cell for row in rows for cell in row))


def _check_commas(path, lines, rows):
    """Raises UserProblem if each number has a comma, as the columns have between them. lines: above the rows"""
    counts = [len(names) for names in (_split(line.strip().lstrip("#/"), ",") for line in lines)
              if has_places(names)]
    if _are_halves(rows) or (counts and 2 * counts[-1] == len(rows[0])):
        raise UserProblem(f"{path}: commas seem to be decimal points, and to separate the columns, too; write it "
                          "with points, or with semicolons between the columns")


def _columns_of_numbers(rows):
    """Those whose first cell that is not missing holds a number."""
    return [number for number, cells in enumerate(zip(*rows))
            if _is_number(next((cell for cell in cells if not _is_missing(cell)), ""))]


def _find_encoding(path):
    """UTF-8, or what office programs write: UTF-16 with its mark, or the letters of Western Europe"""
    with open(path, "rb") as file:
        start = file.read(START)
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _open(path, encoding):
    return open(path, encoding=encoding, errors="replace")  # what is left is no number


def is_table(path):
    """Whether a file whose name does not tell it has points in columns of text."""
    with open(path, "rb") as file:
        start = file.read(START)
    is_utf16 = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    if b"\0" in start and not is_utf16:
        return False
    with _open(path, _find_encoding(path)) as file:
        whole = list(itertools.islice(file, TOP))
    top, _ = _plain(whole)
    first = _first_row(top, whole, (2,))
    return first is not None and len(_words(top[first])) >= 3


def _is_head(line, head):
    return line.lstrip("\ufeff") in head  # tables that were joined have their marks


def _no_point(path, lines):
    """-> UserProblem. lines: the first ones, without comments"""
    words = [line.strip() for line in lines if line.strip() and line.strip() != "0"]  # the number of points
    if not words or (len(words) == 1 and has_places(_words(words[0]))):
        return no_points(path)
    has_numbers = any(sum(map(_is_number, _words(line))) >= 3 for line in words)
    return UserProblem(f"{path} is not a table of numbers: there is no point x y z in its first {len(lines)} "
                       f"line{'s' * (len(lines) > 1)}; it begins with {shortened(words[0])!r}"
                       + "; where words come before x y z, name all columns in the first line" * has_numbers)


def _color_column(lines, marks, delimiter):
    """-> the number of the column that is #rrggbb in these lines of the file, or None"""
    line = next(filter(COLOR.search, lines), "")
    cells = _split(marks.read(_without_comment(COLOR.sub("\0", line))), delimiter)
    return cells.index("\0") if "\0" in cells else None


def _find_layout(path):
    encoding = _find_encoding(path)
    with _open(path, encoding) as file:
        head = list(itertools.islice(file, HEAD))
    if head and _words(head[0])[0].lower() == "ncols":
        raise UserProblem(f"{path} is a grid of heights, not a table of points; convert it, for "
                          f"example with `gdal_translate -of XYZ {path} out.xyz`")
    plain, marks = _plain(head)
    first = _first_row(plain, head)
    if first is None:
        raise _no_point(path, plain)
    delimiter, marks.has_decimal_comma = _delimiter(plain[first])
    lines = [marks.read(line) for line, whole in zip(plain[first:], head[first:])
             if line is plain[first] or (line.strip(BLANK) and not _is_head(whole, head[:first]))]
    if delimiter is None and _are_between_tabs(lines):
        delimiter = "\t"
    rows = [_split(line, delimiter) for line in lines]
    words = rows[0]
    names = _find_names(head[:first], delimiter, len(words))
    if names is None and delimiter == ",":
        _check_commas(path, head[:first], rows)
    used = _columns_of_numbers([row for row in rows if len(row) == len(words)])
    color = _color_column(head[first:], marks, delimiter)
    return _Layout(encoding, head[:first], delimiter, marks, names, None if len(used) == len(words) else used,
                   color if color in used else None)


def _lines(file, path, layout, at):
    """Lines of points. at: [number of the line that was read last, the line]"""
    def counted():
        skip = len(layout.head)
        for at[0], at[1] in enumerate(file, 1):
            # loadtxt's skiprows does not count blank lines, so the lines are skipped here.
            if at[0] > skip and at[1].strip(BLANK):  # spreadsheets end in ",,,"
                yield at[1]

    lines = counted()
    if layout.repeats_head:
        lines = (line for line in lines if not _is_head(line, layout.head))
    lines = map(layout.marks.read, lines) if layout.marks else lines
    if path.lower().endswith(".pts"):
        lines = (line for line in lines if not PTS_MARK.fullmatch(line.strip()))
    return lines


def _read_table(path, layout):
    """-> [rows, columns], float64"""
    at = [0, ""]
    more = {}
    while True:
        try:
            with _open(path, layout.encoding) as file:
                return np.loadtxt(_lines(file, path, layout, at), ndmin=2, comments=COMMENTS,
                                  delimiter=layout.delimiter, usecols=layout.used, encoding=None, **more)
        except ValueError as problem:
            cell = re.search("convert string '(.*?)'", str(problem))
            if len(layout.marks.odd) < len(ODD) and odd_of([at[1]]):
                layout.marks.odd = ODD  # the first lines have not shown them
            elif cell and _is_missing(cell[1]) and not more:
                # Cells may be empty. This takes ten times as long.
                more = {"converters": lambda cell: math.nan if _is_missing(cell) else float(cell)}
            elif _is_head(at[1], layout.head) and not layout.repeats_head:
                layout.repeats_head = True
            else:
                reason = re.sub(r" at row \d+.*| to float64.*", "", str(problem).split(";")[0]).rstrip(".")
                reason = re.sub("invalid column index.*", "there are too few columns", reason)
                raise UserProblem(f"{path} is not a table of numbers: {reason}, line {at[0]}; complete or delete "
                                  "that line") from problem


def read_text_cloud(path):
    """-> vtkPolyData with double points, and the Columns that it was read from."""
    layout = _find_layout(path)
    table = _read_table(path, layout)
    if table.shape[0] == 0:
        raise no_points(path)
    lines, count = table.shape
    if count < 3:
        mark = f" between {layout.delimiter!r}" if layout.delimiter else ""
        raise UserProblem(f"{path} has {count} column{'s' * (count != 1)} of numbers{mark}; a point has at least x y z")
    if count > max(lines, MOST_COLUMNS):
        raise UserProblem(f"{path} has {lines} lines of {count} numbers; each point needs a line of its "
                          "own, so write the table with its rows as columns")
    names = layout.names
    if names and layout.used:
        names = [names[number] for number in layout.used]
    known = ()
    if layout.color is not None:
        at, known = layout.used.index(layout.color) if layout.used else layout.color, RGB
        names = names and names[:at] + names[at + 1:]
        table = np.hstack([np.delete(table, at, 1), channels_of(table[:, at])])
    if names:
        columns = by_names([*names, *known], table)
    else:
        columns = by_values(path, table[:, :table.shape[1] - len(known)])
        columns.meanings += known
    make = cloud_of_degrees if columns.are_degrees else polydata_of
    return make(*arrays_of_columns(table, columns)), columns

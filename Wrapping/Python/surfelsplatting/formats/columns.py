# SPDX-License-Identifier: BSD-3-Clause
"""What the columns of a table of points mean: by their names, or guessed by their values."""

from dataclasses import dataclass

import numpy as np

from ..clouds.colors import scale_to_bytes
from ..clouds.degrees import HOW
from .columnnames import NORMALS, PACKED_RGB, RGB, XYZ, meanings_in_degrees, meanings_of

ENOUGH_TO_COUNT = 10  # points whose numbers are no places by chance
MOST_SAMPLES = 20_000  # points whose values stand for all
FEW_VALUES = 4  # as many times fewer than a channel of a colour has alpha, a class or a return, or more an intensity
MANY_VALUES = 32  # of a channel of a colour, where nothing but its values tells that it is one
MOST_NAMED = 30  # columns in a message
THIN = 1000  # times as high as wide and long: nothing that is scanned in metres
ALIKE = 0.5  # least correlation of two channels of a colour: both are bright in the light


@dataclass
class Columns:
    """The meaning of each column, and how sure it is."""

    meanings: list  # of columnnames.NAMES, or else the name of a scalar
    source: str  # of the meanings, for people
    unsure: bool = False
    are_degrees: bool = False  # whether x and y are longitudes and latitudes

    def __str__(self):
        advice = "; if that is wrong, write their names into the first line" if self.unsure else ""
        more = len(self.meanings) - MOST_NAMED
        named = [*self.meanings[:MOST_NAMED], *([f"{more} more"] if more > 0 else [])]
        return f"columns {', '.join(named)}, {self.source}{advice}"


def _are_numbers_of_points(column):
    return len(column) >= ENOUGH_TO_COUNT and bool((np.diff(column) == 1).all())


def _begins_with_numbers(table):
    """Whether there are places behind the numbers of the points."""
    return table.shape[1] > 3 and _are_numbers_of_points(table[:, 0])


def _may_begin_with_times(table):
    """Whether the first column only increases, as times do; so do places that were sorted"""
    return table.shape[1] > 3 and len(table) >= ENOUGH_TO_COUNT and bool((np.diff(table[:, 0]) > 0).all())


def by_names(names, table):
    """-> Columns"""
    all_known = meanings_of(names)
    degrees = meanings_in_degrees(names)
    are_degrees = not {"x", "y"} & set(all_known) and set(XYZ) <= set(degrees)
    if are_degrees:
        all_known = degrees
    meanings = []
    for name, known in zip(names, all_known):
        meanings.append(known if known and known not in meanings else name.strip() or "column")
    for triple in (RGB, NORMALS):  # an r without g is no colour
        if not set(triple) <= set(meanings):
            meanings = [name if meaning in triple else meaning
                        for meaning, name in zip(meanings, names)]
    if set(XYZ) <= set(meanings):
        return Columns(meanings, f"by their names, {HOW}" if are_degrees else "by their names",
                       are_degrees=are_degrees)
    first = int(_begins_with_numbers(table))
    meanings = [f"{m}_" if m in XYZ else m for m in meanings]
    meanings[first:first + 3] = XYZ
    return Columns(meanings, f"as {', '.join(names[first:first + 3])} seem to be places", True)


def _are_normals(triple):
    length = np.linalg.norm(triple, axis=1)
    return len(triple) > 0 and np.mean(np.abs(length - 1) < 0.02) > 0.99


def _are_bytes(triple):
    in_range = len(triple) > 0 and triple.min() >= 0 and triple.max() <= 255
    return in_range and not _are_normals(triple)


def _are_colors(triple):
    """Of 8 bits, 16 bits or fractions."""
    if len(triple) == 0 or _are_normals(triple) or triple.min() < 0:
        return False
    return triple.max() <= 255 or (triple.max() <= 65535 and (triple == np.round(triple)).all())


def _intensity_is_last(values):
    """Of i r g b or r g b i: the channels of a colour are alike, and the intensity is the odd one.
    Without a clear sign it comes first, as in .pts files."""
    def difference(a, b):
        return np.abs(values[:, a] - values[:, b]).mean()

    return difference(2, 3) > 2 * difference(0, 1)


def _numbers_of_values(values):
    """-> [columns] how many values they have, of some points"""
    some = values[::max(1, len(values) // MOST_SAMPLES)]
    return [len(np.unique(column)) for column in some.T]


def _differ_in_counts(values):
    """Whether a column has many more values than another, as an intensity beside returns and classes"""
    counts = _numbers_of_values(values)
    return len(values) > 0 and FEW_VALUES * min(counts) <= max(counts)


def _of_other_count(values):
    """-> (0 or 3, meaning) of the first or last of four columns, if it has many fewer values than the middle ones,
    as alpha or a class, or many more, as an intensity; or None"""
    start, *middle, end = _numbers_of_values(values)
    mean = sum(middle) / 2
    ratio, number = max((max(count / mean, mean / count), number) for number, count in ((0, start), (3, end)))
    if ratio < FEW_VALUES:
        return None
    has_few = (end if number else start) < mean
    return number, f"column {4 + number}" if has_few else "intensity"


def _seven(values):
    """-> meanings of x y z and four more, whether they are unsure."""
    if _are_normals(values[:, 1:]):
        return ("intensity", *NORMALS), False
    if _are_normals(values[:, :3]):
        return (*NORMALS, "intensity"), False
    first, last = ("intensity", *RGB), (*RGB, "intensity")
    for fits in (_are_bytes, _are_colors):
        middle, behind = fits(values[:, :3]), fits(values[:, 1:])
        if middle and behind:
            are_whole = (values == np.round(values)).all(axis=0)
            if are_whole[1:3].all() and are_whole[0] != are_whole[3]:  # a fraction is no part of bytes
                return (last if are_whole[0] else first), False
            odd = _of_other_count(values)
            if odd:
                return ((*RGB, odd[1]) if odd[0] == 3 else (odd[1], *RGB)), True
            return (last if _intensity_is_last(values) else first), True
        if middle or behind:
            return (last if middle else first), False
    return (*NORMALS, "intensity"), True


def _nine(values):
    front, back = _are_colors(values[:, :3]), _are_colors(values[:, 3:])
    if front == back:
        return None, False
    return ((*RGB, *NORMALS) if front else (*NORMALS, *RGB)), False


def _are_photographed(triple):
    """Whether these are whole numbers of as many values, and as alike, as the channels of photographs"""
    if len(triple) == 0 or triple.min() < 0 or triple.max() > 65535 or (triple != np.round(triple)).any():
        return False
    some = triple[::max(1, len(triple) // MOST_SAMPLES)]
    return (min(_numbers_of_values(some)) >= MANY_VALUES
            and np.corrcoef(some, rowvar=False).min() >= ALIKE)


def _any_number(values, first):
    """-> meanings of columns of which nothing but their values tells that some are colours or normals.
    first: the number of the first column in the table, from 1"""
    meanings = [f"column {first + n}" for n in range(values.shape[1])]
    for triple, fits in ((NORMALS, _are_normals), (RGB, _are_photographed)):
        for begin in range(len(meanings) - 2):
            are_free = all(meaning.startswith("column") for meaning in meanings[begin:begin + 3])
            if are_free and fits(values[:, begin:begin + 3]):
                meanings[begin:begin + 3] = triple
                break
    return meanings


def _are_like_degrees(places):
    """Whether x and y are in the range of latitudes and longitudes, and change so little beside z that nothing
    in metres would be so thin."""
    if len(places) == 0:
        return False
    x, y, z = np.ptp(places, axis=0)
    farthest = np.sort(np.abs(places[:, :2]).max(axis=0))
    return bool(1 < farthest[1] <= 180 and farthest[0] <= 90 and 0 < THIN * max(x, y) < z)


def by_values(path, table):
    """-> Columns of a table without names"""
    numbers = ["number"] if _begins_with_numbers(table) else []
    count = table.shape[1] - len(numbers)
    values = table[np.isfinite(table).all(axis=1)][:, 3 + len(numbers):]
    unsure = False
    if path.lower().endswith(".pts") and count == 7:
        rest = ("intensity", *RGB)
    elif count in (3, 4):
        rest = ("intensity",)[:count - 3]
    elif count == 6:
        rest = RGB if _are_colors(values) else NORMALS
        unsure = _differ_in_counts(values) if rest is RGB else not _are_normals(values)
    elif count in (7, 9):
        rest, unsure = _seven(values) if count == 7 else _nine(values)
    else:
        rest = None
    if rest is None:
        rest, unsure = _any_number(values, 4 + len(numbers)), True
    source, first = "guessed by their values", len(numbers)
    places = table[:, first:first + 3]
    if _are_like_degrees(places[np.isfinite(places).all(axis=1)]):
        source, unsure = source + ", although x and y look like latitudes and longitudes in degrees", True
    if not numbers and _may_begin_with_times(table):
        source, unsure = source + ", although x only increases, as times do", True
    return Columns([*numbers, *XYZ, *rest], source, unsure)


def _as_bytes(triple):
    return np.round(np.clip(triple * scale_to_bytes(triple.max(initial=0)), 0, 255)).astype(np.uint8)


def channels_of(packed):
    """-> [n, 3] bytes of whole numbers 0xRRGGBB; those that are missing are black"""
    return (np.nan_to_num(packed).astype(np.int64)[:, None] >> np.array([16, 8, 0]) & 0xFF).astype(np.uint8)


def _unpacked(packed):
    """The same, perhaps with alpha before; None if they are none"""
    known = np.nan_to_num(packed, posinf=-1.0, neginf=-1.0)
    if len(known) == 0 or known.min() < 0 or not 0xFFFF < known.max() <= 0xFFFFFFFF \
            or (known != np.round(known)).any():
        return None
    return channels_of(known)


def arrays_of_columns(table, columns):
    """-> [n, 3] places, {name: array} of the others: RGB, Normals, intensity, scalars."""
    def triple(names):
        return table[:, [columns.meanings.index(name) for name in names]]

    arrays, used = {}, set(XYZ)
    if set(RGB) <= set(columns.meanings):
        colors = _as_bytes(np.nan_to_num(triple(RGB), posinf=0.0, neginf=0.0))
        if colors.any():  # writers that have no colours leave zeros
            arrays["RGB"] = colors
        used.update(RGB)
    elif PACKED_RGB in columns.meanings:
        colors = _unpacked(table[:, columns.meanings.index(PACKED_RGB)])
        if colors is not None:
            arrays["RGB"] = colors
            used.add(PACKED_RGB)
    if set(NORMALS) <= set(columns.meanings):
        arrays["Normals"] = np.nan_to_num(triple(NORMALS), posinf=0.0, neginf=0.0)
        used.update(NORMALS)
    for number, name in enumerate(columns.meanings):
        if columns.meanings.index(name) < number:  # a second one of this name
            arrays[f"{name} (column {number + 1})"] = table[:, number]
        elif name not in used and name not in arrays:
            arrays[name] = table[:, number]
    return triple(XYZ), arrays

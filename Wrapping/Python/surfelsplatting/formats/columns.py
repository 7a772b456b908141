# SPDX-License-Identifier: BSD-3-Clause
"""What the columns of a table of points mean: by their names, or guessed by their values."""

import re
import unicodedata
from dataclasses import dataclass

import numpy as np

from ..clouds.degrees import HOW

# The names of a column in lower case, without units and accents, and with _ for blanks; in English, and in
# German, French, Spanish, Italian and Portuguese.
NAMES = {
    "x": ("x", "easting", "east", "e", "x_coordinate", "coord_x", "cartesianx", "points_0",
          "points:0", "rechtswert", "ostwert", "ost", "est", "este", "leste"),
    "y": ("y", "northing", "north", "n", "y_coordinate", "coord_y", "cartesiany", "points_1",
          "points:1", "hochwert", "nordwert", "nord", "norte"),
    "z": ("z", "elevation", "height", "altitude", "h", "z_coordinate", "coord_z", "cartesianz",
          "points_2", "points:2", "hohe", "hoehe", "hauteur", "altura", "elevacion", "cota", "quota",
          "altezza", "elevacao"),
    "red": ("r", "red", "rf", "diffuse_red", "colorred", "rgb_0", "rgb:0", "rot", "rouge", "rojo",
            "rosso", "vermelho"),
    "green": ("g", "green", "gf", "diffuse_green", "colorgreen", "rgb_1", "rgb:1", "grun", "gruen",
              "vert", "verde"),
    "blue": ("b", "blue", "bf", "diffuse_blue", "colorblue", "rgb_2", "rgb:2", "blau", "bleu", "azul",
             "blu"),
    "nx": ("nx", "normal_x", "normalx", "n_x", "normals_0", "normals:0"),
    "ny": ("ny", "normal_y", "normaly", "n_y", "normals_1", "normals:1"),
    "nz": ("nz", "normal_z", "normalz", "n_z", "normals_2", "normals:2"),
    "intensity": ("intensity", "i", "scalar_intensity", "reflectance", "reflectivity", "remission",
                  "amplitude", "intensitat", "intensitaet", "intensite", "intensidad", "intensita",
                  "intensidade"),
}
DEGREES = {"x": ("lon", "long", "lng", "longitude"), "y": ("lat", "latitude"), "z": ("alt", "ele")}
XYZ, RGB, NORMALS = ("x", "y", "z"), ("red", "green", "blue"), ("nx", "ny", "nz")
ENOUGH_TO_COUNT = 10  # points whose numbers are no places by chance


@dataclass
class Columns:
    """The meaning of each column, and how sure it is."""

    meanings: list  # of NAMES, or else the name of a scalar
    source: str  # of the meanings, for people
    unsure: bool = False
    are_degrees: bool = False  # whether x and y are longitudes and latitudes

    def __str__(self):
        advice = "; if that is wrong, write their names into the first line" if self.unsure else ""
        return f"columns {', '.join(self.meanings)}, {self.source}{advice}"


def _known(name):
    """The meaning of a name, or None."""
    letters = unicodedata.normalize("NFKD", name.lower())  # without the accents, which stand alone
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    plain = re.sub(r"\(.*?\)|\[.*?\]", "", plain).strip(" \t_")
    plain = re.sub(r"[\s.-]+", "_", plain)
    return next((meaning for meaning, names in NAMES.items() if plain in names), None)


def _known_degrees(names):
    """-> [n] x and y for longitudes and latitudes, z for heights, else what _known says"""
    plain = [name.lower().split("(")[0].strip(" \t_") for name in names]
    return [next((axis for axis, words in DEGREES.items() if name in words), _known(name))
            for name in plain]


def _are_numbers_of_points(column):
    return len(column) >= ENOUGH_TO_COUNT and bool((np.diff(column) == 1).all())


def _begins_with_numbers(table):
    """Whether there are places behind the numbers of the points."""
    return table.shape[1] > 3 and _are_numbers_of_points(table[:, 0])


def by_names(names, table):
    """-> Columns"""
    all_known = [_known(name) for name in names]
    degrees = _known_degrees(names)
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


def has_places(names):
    return any(set(XYZ) <= set(known) for known in (map(_known, names), _known_degrees(names)))


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
            return (last if _intensity_is_last(values) else first), True
        if middle or behind:
            return (last if middle else first), False
    return (*NORMALS, "intensity"), True


def _nine(values):
    front, back = _are_colors(values[:, :3]), _are_colors(values[:, 3:])
    if front == back:
        return None, False
    return ((*RGB, *NORMALS) if front else (*NORMALS, *RGB)), False


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
        unsure = rest is NORMALS and not _are_normals(values)
    elif count in (7, 9):
        rest, unsure = _seven(values) if count == 7 else _nine(values)
    else:
        rest = None
    if rest is None:
        rest, unsure = [f"column {4 + len(numbers) + n}" for n in range(count - 3)], True
    return Columns([*numbers, *XYZ, *rest], "guessed by their values", unsure)


def _as_bytes(triple):
    # No scan is as dark as 1 of 255: values up to 1 are fractions, whole numbers too.
    largest = triple.max(initial=0)
    scale = 255.0 if largest <= 1 else 1.0 if largest <= 255 else 1 / 257
    return np.round(np.clip(triple * scale, 0, 255)).astype(np.uint8)


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
    if set(NORMALS) <= set(columns.meanings):
        arrays["Normals"] = np.nan_to_num(triple(NORMALS), posinf=0.0, neginf=0.0)
        used.update(NORMALS)
    for number, name in enumerate(columns.meanings):
        if name not in used and name not in arrays:
            arrays[name] = table[:, number]
    return triple(XYZ), arrays

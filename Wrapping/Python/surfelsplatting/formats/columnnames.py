# SPDX-License-Identifier: BSD-3-Clause
"""What the names of the columns of a table of points mean."""

import re
import unicodedata

from ..clouds.colors import INTENSITY_NAMES

XYZ, RGB, NORMALS = ("x", "y", "z"), ("red", "green", "blue"), ("nx", "ny", "nz")
PACKED_RGB = "rgb"
# The names of a column in lower case, without units and accents, and with _ for blanks; in English, and in
# German, French, Spanish, Italian and Portuguese.
NAMES = {
    "x": ("x", "easting", "east", "e", "rechtswert", "ostwert", "ost", "est", "este", "leste"),
    "y": ("y", "northing", "north", "n", "hochwert", "nordwert", "nord", "norte"),
    "z": ("z", "elevation", "height", "altitude", "h", "hohe", "hoehe", "hauteur", "altura", "elevacion",
          "cota", "quota", "altezza", "elevacao"),
    "red": ("r", "red", "rf", "rot", "rouge", "rojo", "rosso", "vermelho"),
    "green": ("g", "green", "gf", "grun", "gruen", "vert", "verde"),
    "blue": ("b", "blue", "bf", "blau", "bleu", "azul", "blu"),
    "nx": ("nx",),
    "ny": ("ny",),
    "nz": ("nz",),
    "intensity": INTENSITY_NAMES,
    PACKED_RGB: ("rgb", "rgba"),
}
DEGREES = {"x": ("lon", "long", "lng", "longitude"), "y": ("lat", "latitude"), "z": ("alt", "ele")}
# Names such as point.x, Pos_X, XCoord, x_m, X1 (m), Points_m_XYZ:0, color.r, ColR: a stem and a part.
PART_BEHIND = re.compile(r"(.*?)[_:]*(red|green|blue|[xyzrgb012])")
PART_BEFORE = re.compile(r"([xyz])_?(coord\w*|pos\w*|mm?|cm|ft|1)")  # 1: of several returns
PARTS = (("x", "y", "z"), ("r", "g", "b"), RGB, ("0", "1", "2"))
OF_PLACES = re.compile(r"xyz|point|pos|coord|loc|vert|cart|world|mm?$|cm$|ft$|p$|^1$")
OF_COLORS = re.compile(r"rgb|col|diffuse|tex|c$")
OF_NORMALS = re.compile(r"norm|n$")


def _plain(name):
    letters = unicodedata.normalize("NFKD", name.lower())  # without the accents, which stand alone
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    plain = re.sub(r"\(.*?\)|\[.*?\]", "", plain).strip(" \t_")
    return re.sub(r"[\s.-]+", "_", plain)


def _known(name):
    """The meaning of a name, such as easting or X/Easting, or None."""
    words = _plain(name).split("/")
    return next((meaning for meaning, names in NAMES.items() if set(words) <= set(names)), None)


def _triples(names):
    """-> [(meanings, numbers of columns)] of three columns whose names have a stem in common"""
    stems = {}
    for number, name in enumerate(names):
        plain = _plain(name)
        before, behind = PART_BEFORE.fullmatch(plain), PART_BEHIND.fullmatch(plain)
        if before or behind:
            part, stem = before.groups() if before else reversed(behind.groups())
            stems.setdefault(stem, {}).setdefault(part, number)
    for stem, columns in stems.items():
        for parts in PARTS:
            if set(parts) <= set(columns):
                meanings = _meanings_of_stem(stem, parts)
                if meanings:
                    yield meanings, [columns[part] for part in parts]


def _meanings_of_stem(stem, parts):
    is_place, is_color = "x" in parts, "r" in parts or parts == RGB
    if is_color or (not is_place and OF_COLORS.match(stem)):
        return RGB if OF_COLORS.match(stem) else None
    if OF_NORMALS.match(stem):
        return NORMALS
    return XYZ if OF_PLACES.search(stem) else None


def meanings_of(names):
    """-> [n] the meaning of each name, one of NAMES, or None"""
    found = [_known(name) for name in names]
    for meanings, columns in _triples(names):
        if not set(meanings) <= set(found):  # then they are the names that count
            for meaning, number in zip(meanings, columns):
                found = [None if other == meaning else other for other in found]
                found[number] = meaning
    return found


def meanings_in_degrees(names):
    """-> [n] x and y for longitudes and latitudes, z for heights, else as meanings_of"""
    plain = [name.lower().split("(")[0].strip(" \t_") for name in names]
    return [next((axis for axis, words in DEGREES.items() if name in words), meaning)
            for name, meaning in zip(plain, meanings_of(names))]


def has_places(names):
    return any(set(XYZ) <= set(known) for known in (meanings_of(names), meanings_in_degrees(names)))

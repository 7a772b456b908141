# SPDX-License-Identifier: BSD-3-Clause
"""What the meta.json of a .sog capture says, checked."""

import json
from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

BYTES = 256  # values of a byte
LARGEST = float(np.finfo(np.float32).max)
AGAIN = "the file is damaged: export or download it again"
OTHERWISE = "save it as .ply or .spz, for example with SuperSplat"
SECTIONS = {"means": 2, "scales": 1, "quats": 1, "sh0": 1}  # and their images
PALETTE = "shN"  # a section that not all captures have


class SogProblem(Exception):
    """What is wrong with a .sog capture, and what to do."""


@dataclass
class Levels:
    """What the bytes of an image stand for"""

    name: str  # of the image
    values: np.ndarray  # [n, 3]: of byte b in channel c [b, c]; n is 256 at most


@dataclass
class Palette:
    """The harmonics from degree 1 on: each Gaussian has those of one entry."""

    centroids: Levels  # of the image with the entries
    labels: str  # name of the image with the number of each Gaussian's entry
    entries: Optional[int]  # None: as many as the image has room for
    degree: Optional[int]  # None: as the width of the image tells


@dataclass
class SogMeta:
    count: int  # Gaussians
    is_antialiased: bool  # whether the capture was trained so
    means: Tuple[str, str]  # names of the images with the low and the high bytes of positions
    ends: np.ndarray  # [2, 3] what the lowest and the highest number of a position stand for
    scales: Levels  # logarithms of standard deviations
    quats: str  # name of the image
    colors: Levels  # harmonics of degree 0
    opacities: np.ndarray  # [256] 0..1, of the fourth channel of that image
    palette: Optional[Palette]


def _shortened(value):
    text = repr(value)
    return text if len(text) < 40 else text[:36] + " ..."


def _numbers(value, counts, what):
    """-> [n] floats; n: one of counts"""
    if not isinstance(value, list) or len(value) not in counts:
        found = f"{len(value)} numbers" if isinstance(value, list) else _shortened(value)
        wanted = counts[0] if len(counts) == 1 else f"1 to {counts[-1]}"
        raise SogProblem(f"its meta.json has {found} as {what}, and not {wanted} numbers; {AGAIN}")
    for i, number in enumerate(value):
        is_number = isinstance(number, (int, float)) and not isinstance(number, bool)
        if not is_number or not abs(number) <= LARGEST:  # NaN is not, either
            raise SogProblem(f"its meta.json has {_shortened(number)} as number {i} of {what}, which is "
                             f"no finite float; {AGAIN}")
    return np.array(value, dtype=float)


def _whole(value, smallest, largest, what):
    if type(value) is not int or not smallest <= value <= largest:
        raise SogProblem(f"its meta.json has {_shortened(value)} as {what}, and not a whole number from "
                         f"{smallest} to {largest}; {AGAIN}")
    return value


def _section(meta, name):
    section = meta.get(name)
    if not isinstance(section, dict):
        found = f"{_shortened(section)} as" if name in meta else "no"
        raise SogProblem(f"its meta.json has {found} {name!r}, which captures have; it is that of "
                         f"something else, or {AGAIN}")
    return section


def _images(section, what, count):
    """-> names of images, which lie beside the meta.json"""
    names = section.get("files")
    if not isinstance(names, list) or len(names) < count or not all(
            isinstance(name, str) and name and name.isprintable() and not set(name) & set("/\\")
            for name in names):
        raise SogProblem(f"its meta.json has {_shortened(names)} as files of {what!r}, and not the names "
                         f"of {count} image{'s' if count > 1 else ''}; {AGAIN}")
    return tuple(names[:count])


def _codebook(section, what):
    """-> [n, 3] what bytes stand for in version 2"""
    book, what = section.get("codebook"), f"codebook of {what!r}"
    if isinstance(book, list) and len(book) == BYTES and book[0] is None:
        # NaN of early writers: a mean step below the next number, as PlayCanvas takes it.
        rest = _numbers(book[1:], (BYTES - 1,), what)
        book = [rest[0] + (rest[0] - rest[-1]) / (BYTES - 1), *rest.tolist()]
    return np.repeat(_numbers(book, range(1, BYTES + 1), what)[:, None], 3, axis=1)


def _between(section, channels, what):
    """-> [256, channels] what bytes stand for in version 1"""
    lowest, highest = (_numbers(section.get(end), (channels,), f"{end} of {what!r}")
                       for end in ("mins", "maxs"))
    return lowest + np.arange(BYTES)[:, None] / (BYTES - 1) * (highest - lowest)


def _values_1(sections):
    """-> of version 1: number of Gaussians; what the bytes of scales, colours and opacities stand for;
    Palette or None"""
    shape = sections["means"].get("shape")
    count = shape[0] if isinstance(shape, list) and shape else shape
    colors = _between(sections["sh0"], 4, "sh0")
    palette, section = None, sections.get(PALETTE)
    if section is not None:
        ends = {end: [section.get(end)] for end in ("mins", "maxs")}
        centroids, labels = _images(section, PALETTE, 2)
        values = np.repeat(_between(ends, 1, PALETTE), 3, axis=1)
        palette = Palette(Levels(centroids, values), labels, None, None)
    return (_whole(count, 0, 1 << 31, "shape of 'means'"), _between(sections["scales"], 3, "scales"),
            colors[:, :3], 1 / (1 + np.exp(-colors[:, 3])), palette)


def _values_2(meta, sections):
    """-> the same of version 2"""
    palette, section = None, sections.get(PALETTE)
    if section is not None and section.get("bands") != 0:
        degree = section.get("bands")
        centroids, labels = _images(section, PALETTE, 2)
        palette = Palette(Levels(centroids, _codebook(section, PALETTE)), labels,
                          _whole(section.get("count"), 1, 1 << 16, f"count of {PALETTE!r}"),
                          None if degree is None else
                          _whole(degree, 1, 3, f"bands of {PALETTE!r}"))
    return (_whole(meta.get("count"), 0, 1 << 31, "count"), _codebook(sections["scales"], "scales"),
            _codebook(sections["sh0"], "sh0"), np.arange(BYTES) / (BYTES - 1), palette)


def _loaded(text):
    """-> {name: value}, of a version that is read"""
    try:
        meta = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SogProblem(f"its meta.json is not readable ({error}); {AGAIN}") from None
    if not isinstance(meta, dict):
        raise SogProblem(f"its meta.json holds {_shortened(meta)}, and not names with values; {AGAIN}")
    if "lodLevels" in meta:
        raise SogProblem("it lists the parts of a streamed .sog capture; give the meta.json of one of "
                         "them, or " + OTHERWISE)
    if meta.get("version", 1) not in (1, 2):
        raise SogProblem(f"a .sog capture of version {_shortened(meta['version'])}; versions 1 and 2 are "
                         "read: " + OTHERWISE)
    return meta


def parse_meta(text):
    """-> SogMeta of the bytes of a meta.json"""
    meta = _loaded(text)
    sections = {name: _section(meta, name) for name in SECTIONS}
    if meta.get(PALETTE) is not None:
        sections[PALETTE] = _section(meta, PALETTE)
    images = {name: _images(sections[name], name, count) for name, count in SECTIONS.items()}
    is_first = meta.get("version", 1) == 1
    count, scales, colors, opacities, palette = (_values_1(sections) if is_first else
                                                 _values_2(meta, sections))
    ends = [_numbers(sections["means"].get(end), (3,), f"{end} of 'means'") for end in ("mins", "maxs")]
    return SogMeta(count, meta.get("antialias") is True or meta.get("model") == "antialiased",
                   images["means"], np.array(ends), Levels(*images["scales"], scales),
                   *images["quats"], Levels(*images["sh0"], colors), opacities, palette)

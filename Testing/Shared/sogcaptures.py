# SPDX-License-Identifier: BSD-3-Clause
"""Captures in .sog files for tests. Needs Pillow."""

import io
import json
import os
import zipfile

import numpy as np
from PIL import Image

from captures import Gaussians

ROW = 64  # entries of a palette


def _steps(values, ends):
    """-> bytes of values [n, k] between ends [2, k], and what they stand for"""
    lowest, highest = ends
    numbers = np.rint(255 * (values - lowest) / np.maximum(highest - lowest, 1e-30)).astype(np.uint8)
    return numbers, lowest + numbers / 255 * (highest - lowest)


def _ends(values):
    return np.array([values.min(axis=0, initial=0), values.max(axis=0, initial=0)])


def _of_codebook(values):
    """-> bytes of values, what they stand for, and the codebook, which has 256 quantiles"""
    book = np.unique(np.quantile(values, np.linspace(0, 1, 256)))
    numbers = np.searchsorted((book[1:] + book[:-1]) / 2, values).astype(np.uint8)
    return numbers, book[numbers], book.tolist()


def _quaternions(rotations):
    """-> [n, 4] bytes, and the quaternions w x y z that they stand for"""
    unit = rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
    largest, rows = np.abs(unit).argmax(axis=1), np.arange(len(unit))
    unit *= np.sign(unit[rows, largest])[:, None]
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])[largest]
    numbers = np.rint(127.5 * (unit[rows[:, None], others] * np.sqrt(2) + 1)).astype(np.uint8)
    read = np.zeros_like(unit)
    read[rows[:, None], others] = (numbers / 127.5 - 1) / np.sqrt(2)
    read[rows, largest] = np.sqrt(np.maximum(0, 1 - (read ** 2).sum(axis=1)))
    return np.hstack([numbers, 252 + largest[:, None]]).astype(np.uint8), read


def _positions(positions):
    """-> low and high bytes, what they stand for, and ends of the logarithms"""
    logs = np.sign(positions) * np.log1p(np.abs(positions))
    ends = _ends(logs)
    numbers = np.rint(65535 * (logs - ends[0]) / np.maximum(ends[1] - ends[0], 1e-30)).astype(int)
    logs = ends[0] + numbers / 65535 * (ends[1] - ends[0])
    return (numbers & 255).astype(np.uint8), numbers >> 8, np.sign(logs) * np.expm1(np.abs(logs)), ends


def image_of(pixels, width=None):
    """Pixels [n, 3 or 4], row by row -> bytes of a WebP image without losses; the last row ends in 0"""
    pixels = np.asarray(pixels, dtype=np.uint8)
    width = width or max(1, int(np.ceil(np.sqrt(len(pixels)))))
    height = max(1, -(-len(pixels) // width))
    padded = np.zeros((width * height, pixels.shape[1]), np.uint8)
    padded[:len(pixels)] = pixels
    file = io.BytesIO()
    Image.fromarray(padded.reshape(height, width, -1)).save(file, "WEBP", lossless=True, exact=True)
    return file.getvalue()


def _section(version, values):
    """-> what the meta.json says of values [n, k], their bytes, and what these stand for"""
    if version == 1:
        ends = _ends(values)
        return dict(zip(("mins", "maxs"), ends.tolist())), *_steps(values, ends)
    numbers, read, book = _of_codebook(values)
    return {"codebook": book}, numbers, read


def _palette(version, rest):
    """-> section of the meta.json, images, and what harmonics [n, K, 3] became"""
    entries, labels = np.unique(rest.reshape(len(rest), -1), axis=0, return_inverse=True)
    entries, labels = entries.reshape(-1, *rest.shape[1:]), labels.ravel()
    if version == 1:
        ends = np.array([entries.min(), entries.max()])
        numbers, read = _steps(entries, ends)
        section = dict(zip(("mins", "maxs"), ends.tolist()))
    else:
        numbers, read, book = _of_codebook(entries)
        section = {"codebook": book, "count": len(entries), "bands": {3: 1, 8: 2, 15: 3}[rest.shape[1]]}
    labels_there = np.stack([labels & 255, labels >> 8, 0 * labels], axis=1)
    images = {"shN_centroids.webp": image_of(numbers.reshape(-1, 3), ROW * rest.shape[1]),
              "shN_labels.webp": image_of(labels_there)}
    return {**section, "files": [*images]}, images, read[labels]


def sog_files(gaussians, version=2):
    """-> content of the meta.json, {name: bytes} of the images, and the Gaussians in float64 that they
    stand for"""
    low, high, positions, ends = _positions(gaussians.positions)
    scales, scale_bytes, logs = _section(version, np.log(gaussians.scales))
    quats, rotations = _quaternions(gaussians.rotations)
    if version == 1:
        logits = np.log(gaussians.opacities / (1 - gaussians.opacities))
        sh0, pixels, read = _section(1, np.hstack([gaussians.harmonics[:, 0], logits[:, None]]))
        colors, opacities = read[:, :3], 1 / (1 + np.exp(-read[:, 3]))
    else:
        sh0, pixels, colors = _section(2, gaussians.harmonics[:, 0])
        alphas = np.rint(255 * gaussians.opacities).astype(np.uint8)
        pixels, opacities = np.hstack([pixels, alphas[:, None]]), alphas / 255
    images = {name + ".webp": image_of(content) for name, content in (
        ("means_l", low), ("means_u", high), ("scales", scale_bytes), ("quats", quats),
        ("sh0", pixels))}
    meta = {"version": 2, "count": len(gaussians)} if version == 2 else {}
    means = {"shape": [len(gaussians), 3]} if version == 1 else {}
    meta |= {"means": {**means, **dict(zip(("mins", "maxs"), ends.tolist())),
                       "files": ["means_l.webp", "means_u.webp"]},
             "scales": {**scales, "files": ["scales.webp"]}, "quats": {"files": ["quats.webp"]},
             "sh0": {**sh0, "files": ["sh0.webp"]}}
    harmonics = colors[:, None]
    if gaussians.harmonics.shape[1] > 1:
        meta["shN"], more, rest = _palette(version, gaussians.harmonics[:, 1:])
        images |= more
        harmonics = np.concatenate([harmonics, rest], axis=1)
    return meta, images, Gaussians(positions, np.exp(logs), rotations, opacities, harmonics)


def store(path, meta, images, method=zipfile.ZIP_STORED):
    """Writes a zip file, or, without the extension .sog, into a folder. meta: content, or bytes."""
    content = meta if isinstance(meta, bytes) else json.dumps(meta).encode()
    files = {**images, "meta.json": content}
    if path.endswith(".sog"):
        with zipfile.ZipFile(path, "w", method) as file:
            for name, content in files.items():
                file.writestr(name, content)
        return path
    os.makedirs(path, exist_ok=True)
    for name, content in files.items():
        with open(os.path.join(path, name), "wb") as file:
            file.write(content)
    return path


def write_sog(path, gaussians, version=2):
    """A .sog file or a folder -> the Gaussians it stands for, in float64"""
    meta, images, stored = sog_files(gaussians, version)
    store(path, meta, images)
    return stored

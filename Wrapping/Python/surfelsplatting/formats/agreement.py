# SPDX-License-Identifier: BSD-3-Clause
"""Whether files that become one cloud are in the same place and in the same unit."""

import numpy as np

FAR = 10  # times the larger one's size, to the nearest other file: they show nothing together
SMALLER = 300  # times as small as another file: metres beside millimetres, or a detail of it
BULK = (5, 95)  # percentiles between which stray points do not count
SAMPLED = 20_000  # points that tell the bulk


def _bulk(places):
    """-> [2, 3] the box of most points, or None where none is finite"""
    places = places[::max(1, len(places) // SAMPLED)]
    places = places[np.isfinite(places).all(axis=1)]
    return np.percentile(places, BULK, axis=0) if len(places) else None


def _beside_first(lows, highs, sizes):
    """-> [n] whether a box is near the first one, or near one that is, and so on"""
    are_beside = np.zeros(len(sizes), bool)
    are_beside[0] = True
    waiting = [0]
    while waiting:
        box = waiting.pop()
        gaps = np.maximum(np.maximum(lows - highs[box], lows[box] - highs), 0)
        are_new = np.linalg.norm(gaps, axis=1) <= FAR * np.maximum(sizes, sizes[box])
        are_new &= ~are_beside
        are_beside |= are_new
        waiting += np.flatnonzero(are_new).tolist()
    return are_beside


def doubts(paths, places):
    """-> texts about files that do not seem to fit together. places: [n, 3] of each"""
    bulks = [(path, box) for path, box in zip(paths, map(_bulk, places)) if box is not None]
    if len(bulks) < 2:
        return []
    paths, boxes = zip(*bulks)
    lows, highs = np.stack(boxes, axis=1)
    sizes = np.linalg.norm(highs - lows, axis=1)
    texts = []
    are_beside = _beside_first(lows, highs, sizes)
    if not are_beside.all():
        texts.append(f"{paths[int(np.argmin(are_beside))]} is far away from {paths[0]}, as if their "
                     "coordinates differed: draw it apart, or convert it")
    small, large = int(np.argmin(sizes)), int(np.argmax(sizes))
    if sizes[large] > SMALLER * sizes[small] > 0:
        texts.append(f"{paths[large]} is {sizes[large] / sizes[small]:.0f} times as large as "
                     f"{paths[small]}, as if their units differed: convert one of them")
    return texts

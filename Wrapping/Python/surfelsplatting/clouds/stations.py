# SPDX-License-Identifier: BSD-3-Clause
"""Scans of several scanners as one cloud: the point array ToScanner of DataContract.md."""

import numpy as np

from ..vtkarrays import to_numpy

TO_SCANNER = "ToScanner"
ROUNDING = 1e-5  # of the longest way: places that are nearer to each other are one
MANY = 1000  # places, from which on they are means, as of points that were thinned by a grid


def trusted_places(places):
    """The places of scanners, or None for each that is not known.

    places: [3] or None for each scan. Programs that only convert points write none, or the origin, at
    which there is one scanner at most.
    """
    at_origin = [place is not None and not np.any(place) for place in places]
    return [None if is_there and sum(at_origin) > 1 else place
            for place, is_there in zip(places, at_origin)]


def ways_of(scans, places):
    """-> {ToScanner: [n, 3] vectors from the points of all scans to their scanners, 0 where they are
    not known}, or {} if none is. scans: [m, 3] points each; places: as of trusted_places"""
    if all(place is None for place in places):
        return {}
    ways = [np.zeros(points.shape) if place is None else np.subtract(place, points)
            for points, place in zip(scans, places)]
    return {TO_SCANNER: np.concatenate(ways).astype(np.float32)}


def scanners_of(data):
    """-> places of the scanners that the points of a vtkPointSet know, a list of lists, or None if there
    are no or too many of them; part of the points that know theirs"""
    array = data.GetPointData().GetArray(TO_SCANNER)
    if array is None or array.GetNumberOfComponents() != 3:
        return None, 0.0
    ways = to_numpy(array).astype(float)
    lengths = np.linalg.norm(ways, axis=1)
    points = to_numpy(data.GetPoints().GetData())
    known = np.isfinite(points).all(axis=1) & np.isfinite(lengths) & (lengths > 0)
    if not known.any():
        return None, 0.0
    tolerance = ROUNDING * lengths[known].max()
    places = points[known] + ways[known]
    steps = np.round((places - places[0]) / tolerance)  # wild ones are no integers of 64 bits
    _, firsts = np.unique(steps, axis=0, return_index=True)
    if len(firsts) > MANY:
        return None, float(np.mean(known))
    found = []  # in the order of the points; what rounding puts beside a place is that place
    for place in places[np.sort(firsts)]:
        if all(np.abs(place - other).max() > 2 * tolerance for other in found):
            found.append(place)
    return np.round(found, 6).tolist(), float(np.mean(known))

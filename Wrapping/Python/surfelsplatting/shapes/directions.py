# SPDX-License-Identifier: BSD-3-Clause
"""Directions: their lengths, and turns of them."""

import math

import numpy as np


def unit(vector):
    return vector / max(np.linalg.norm(vector), 1e-300)


def lengths(vectors):
    """[n] of [n, 3]. numpy.linalg.norm gives the same in four times the time."""
    x, y, z = vectors.T
    return np.sqrt(x * x + y * y + z * z)


def rotated(vector, axis, angle):
    """The vector, turned about the unit axis by the angle in radians (Rodrigues' formula)."""
    along = (vector @ axis) * axis
    return along + math.cos(angle) * (vector - along) + math.sin(angle) * np.cross(axis, vector)

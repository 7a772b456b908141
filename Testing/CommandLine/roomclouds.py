# SPDX-License-Identifier: BSD-3-Clause
"""Clouds of rooms and walls, as a scanner sees them: z is up, the unit is a metre."""

import numpy as np

WALLS, FLOOR, CEILING, CUPBOARD = (200, 190, 170), (150, 100, 50), (250, 250, 250), (40, 60, 220)


class Scan:
    """Random points on rectangles, and their colours."""

    def __init__(self, spacing, seed=1):
        self._spacing, self._random = spacing, np.random.default_rng(seed)
        self._points, self._colors = [], []

    def add(self, low, high, color):
        """A rectangle: low and high have one coordinate in common."""
        size = np.subtract(high, low)
        count = int(np.prod(size[size > 0]) / self._spacing ** 2)
        self._points.append(low + self._random.uniform(size=(count, 3)) * size)
        self._colors.append(np.tile(np.uint8(color), (count, 1)))

    def add_sides(self, low, high, color):
        """The four upright sides of a box."""
        for axis in (0, 1):
            for at in (low[axis], high[axis]):
                ends = np.array([low, high], float)
                ends[:, axis] = at
                self.add(*ends, color)

    def add_box(self, low, high, color):
        self.add_sides(low, high, color)
        for at in (low[2], high[2]):
            self.add((*low[:2], at), (*high[:2], at), color)

    def cloud(self):
        """-> points, colours"""
        return np.concatenate(self._points), np.concatenate(self._colors)


def room(size=(5.0, 4.0, 2.5), spacing=0.05, ceiling=True, cupboard=False, table=False):
    """-> points, colours. The cupboard stands in the corner at 0, and hides what is behind it and
    below; the table stands free."""
    scan = Scan(spacing)
    x, y, z = size
    scan.add((0, 0, 0), (x, y, 0), FLOOR)
    scan.add_sides((0, 0, 0), size, WALLS)
    if ceiling:
        scan.add((0, 0, z), (x, y, z), CEILING)
    if table:
        scan.add_box((0.5 * x, 0.5 * y, 0.2 * z), (0.7 * x, 0.7 * y, 0.3 * z), CUPBOARD)
    points, colors = scan.cloud()
    if not cupboard:
        return points, colors
    corner = np.array([0.3 * x, 0.4 * y, 0.4 * z])
    seen = ~(points < corner).all(axis=1)
    scan = Scan(spacing, 2)
    scan.add((0, 0, corner[2]), corner, CUPBOARD)
    scan.add((corner[0], 0, 0), corner, CUPBOARD)
    scan.add((0, corner[1], 0), corner, CUPBOARD)
    more = scan.cloud()
    return np.vstack([points[seen], more[0]]), np.vstack([colors[seen], more[1]])


def facade(cornice=True):
    """[n, 3]: a wall of 12 by 8 metres along x that has six windows, and a cornice before it"""
    scan = Scan(0.06)
    scan.add((0, 0, 0), (12, 0, 8), WALLS)
    wall = scan.cloud()[0]
    relief = Scan(0.06, 2)
    for x in (1, 5, 9):
        for z in (1, 5):
            low, high = np.array([x, 0, z]), np.array([x + 2.0, 0.4, z + 2.0])
            wall = wall[~((wall[:, 0::2] > low[0::2]) & (wall[:, 0::2] < high[0::2])).all(axis=1)]
            for axis in (0, 2):
                for at in (low[axis], high[axis]):
                    ends = np.array([low, high])
                    ends[:, axis] = at
                    relief.add(*ends, WALLS)
            relief.add((low[0], 0.4, low[2]), high, WALLS)
    if cornice:
        for z in (3.8, 4.2):
            relief.add((0, -0.3, z), (12, 0, z), WALLS)
        relief.add((0, -0.3, 3.8), (12, -0.3, 4.2), WALLS)
    return np.vstack([wall, relief.cloud()[0]])

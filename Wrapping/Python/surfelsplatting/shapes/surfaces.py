# SPDX-License-Identifier: BSD-3-Clause
"""Points of a surface, and what many rules ask of them."""

from functools import cached_property, wraps

import numpy as np

from .directions import lengths

BULK = (0.5, 99.5)  # percent of the heights


class Surface:
    """Points of a surface, their area vectors, and whether these have two sides."""

    def __init__(self, points, areas, two_sided):
        self.points, self.areas, self.two_sided = points, areas, two_sided
        self.known = {}  # of found_once

    @cached_property
    def sizes(self):
        """[n] lengths of the area vectors"""
        return lengths(self.areas)

    @cached_property
    def opening(self):
        """The sum of the area vectors whose outside is known, over the sum of the areas"""
        one_sided = ~self.two_sided
        total = self.sizes[one_sided].sum()
        return self.areas[one_sided].sum(axis=0) / total if total > 0 else np.zeros(3)


def found_once(find):
    """find: a function of a Surface and of a direction, for which many rules ask"""
    @wraps(find)
    def known(surface, direction):
        key = find.__name__, *direction
        if key not in surface.known:
            surface.known[key] = find(surface, direction)
        return surface.known[key]

    return known


@found_once
def heights_along(surface, up):
    """-> [n] heights of the points, and the lower and the upper end of the bulk of them"""
    height = surface.points @ up
    return height, *np.percentile(height, BULK)

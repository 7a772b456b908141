# SPDX-License-Identifier: BSD-3-Clause
"""A lens and what it is focused on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

from .checks import finite_triple, number_in, whole_number_in, with_checked_init
from .views.cameras import STILL_CELLS


@with_checked_init
@dataclass(frozen=True)
class Lens:
    """A lens: how much it blurs, and what is in focus.

    Parameters
    ----------
    coc : float, optional
        Radius of the circle of confusion of very distant points, in pixels. Nearer things
        blur less. 0 is a pinhole: everything is sharp.

    diameter : float, optional
        Diameter of the lens in world units, instead of ``coc``.

    focus : sequence[float], optional
        A point ``(x, y, z)`` of the world, or a pixel ``(x, y)`` of the picture, counted from its
        lower left corner, whose surface comes into focus. Without it, the focal point of the
        camera is in focus, or where no camera was given, the surface in the middle.

    cells : int, default: 7
        Number of parts that the lens is divided into, whose pictures are averaged where things at
        different depths cover one another. 1 is less accurate there and fastest.

    Examples
    --------
    >>> import surfelsplatting
    >>> surfelsplatting.Lens(coc=12, focus=(0, 0, 1))
    Lens(coc=12, diameter=None, focus=(0.0, 0.0, 1.0), cells=7)

    """

    coc: float | None = None
    diameter: float | None = None
    focus: Sequence[float] | None = None
    cells: int = STILL_CELLS

    def __post_init__(self) -> None:
        if self.coc is not None and self.diameter is not None:
            raise ValueError(f"the lens has both a coc ({self.coc!r}) and a diameter "
                             f"({self.diameter!r}); give one of them")
        for name, size, largest in (("coc", self.coc, 1e6), ("diameter", self.diameter, 1e17)):
            if size is not None:
                number_in(size, 0, largest, f"the lens's {name}")
        whole_number_in(self.cells, 1, 65536, "the lens's number of cells")
        object.__setattr__(self, "focus", _checked_focus(self.focus))

    @property
    def focus_is_pixel(self) -> bool:
        """Whether ``focus`` is a pixel."""
        return self.focus is not None and len(self.focus) == 2

    def set_size(self, splatter, camera) -> None:
        """Sets the size of the lens of a vtkSurfelSplatter and a vtkCamera, but not the focus."""
        if self.coc:
            splatter.SetLensModeToCircleOfConfusion()
            splatter.SetCircleOfConfusion(self.coc)
        elif self.diameter:
            splatter.SetLensModeToCamera()
            camera.SetFocalDisk(self.diameter)
        else:
            splatter.SetLensModeToPinhole()
        splatter.SetLensCells(int(self.cells))


def _checked_focus(focus):
    if focus is None:
        return None
    try:
        count = len(focus)
    except TypeError:
        count = 0
    if count == 3:
        return finite_triple(focus, "the lens's focus")
    is_pixel = count == 2 and all(isinstance(value, Real) and math.isfinite(value) and value == int(value)
                                  for value in focus)
    if not is_pixel:
        raise ValueError(f"the lens's focus is {focus!r}; it must be a point (x, y, z), or a pixel "
                         "(x, y) of two whole numbers")
    return tuple(int(value) for value in focus)


def focus_on_point(splatter, camera, point) -> None:
    """Focuses on the plane through a point in front of the camera; None if that is placed later."""
    if camera is not None:
        position, direction = camera.GetPosition(), camera.GetDirectionOfProjection()
        distance = sum((p - q) * d for p, q, d in zip(point, position, direction))
        if not distance > 0:
            raise ValueError(f"the lens's focus {tuple(point)} is {-distance:g} behind the camera at "
                             f"{position}; give a point in front of it")
    splatter.SetFocusModeToPoint()
    splatter.SetFocusPoint(point)

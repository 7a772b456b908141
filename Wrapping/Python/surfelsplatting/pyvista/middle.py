# SPDX-License-Identifier: BSD-3-Clause
"""What a subplot shows in its middle, on which a lens without another focus is focused."""

import numpy as np

from ..problems import UserProblem
from ..views.cameras import View
from ..views.focus import fronts_of
from ..vtkSurfelRendering import vtkSurfelImageRenderer
from .mapper import SurfelMapper


def surface_in_the_middle(renderer):
    """The point of the line of sight in which a photographer would focus; None without surfels there."""
    camera, image = renderer.camera, vtkSurfelImageRenderer()
    actors = [actor for actor in renderer.actors.values() if actor.GetVisibility()
              and isinstance(getattr(actor, "mapper", None), SurfelMapper)]
    if not actors:
        return None
    for actor in actors:
        image.AddActor(actor)
    size = tuple(renderer.GetSize())
    image.SetSize(*size)
    view = View(camera.position, camera.focal_point, camera.up, camera.view_angle, size)
    try:
        [front] = fronts_of([view], image)
    except UserProblem:
        return None  # the frame will say it
    return np.add(camera.position, front * np.array(camera.direction)) if front else None

# SPDX-License-Identifier: BSD-3-Clause
"""The lights, and whether a cloud's colours need them: photographs have the light of the day."""

import numpy as np

from .backend import vtk
from .clouds.colors import is_colors
from .vtkarrays import to_numpy

LIGHT_GREY = (0.8, 0.8, 0.8)  # of lit clouds without colours
BACKDROP = (0.16, 0.17, 0.19)  # behind what is lit

# Half of a cloud with labels or a colour map has so few colours, or grey levels; the borders
# between them, where surfels mix them, have others. Half of a photograph has thousands.
MOST_COLORS, MOST_GREYS = 256, 32
SAMPLES = 100_000


# Intensity, elevation and azimuth as seen from the camera, degrees. A lone light at the camera leaves
# floors and ceilings of rooms black. So there are the key, fill, head and back lights of vtkLightKit,
# all white, but the key light falls from the upper left, as on maps: from above, plains have no relief.
_LIGHTS = ((0.75, 35, -40), (0.25, -75, 0), (0.25, 0, 0), (0.21, 0, 110), (0.21, 0, -110))


def set_lights(renderer, actor):
    """Lights the surfels of an actor from the upper left, in a vtkSurfelImageRenderer or vtkRenderer. Shaded
    volumes keep the renderer's own light at the camera, which is that of VTK's ray casters."""
    renderer.RemoveAllLights()
    if actor.GetMapper().GetInput().GetPointData().HasArray("GaussianNormal"):
        return
    for intensity, elevation, azimuth in _LIGHTS:
        light = vtk("vtkRenderingCore").vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetDirectionAngle(elevation, azimuth)
        light.SetIntensity(intensity)
        renderer.AddLight(light)


def are_photographs(colors):
    """Whether colours, n x 3 or n x 4 bytes, are as varied as those of photographs."""
    sampled = colors[::-(-len(colors) // SAMPLES) or 1, :3].astype(np.uint32)
    counts = np.unique(sampled @ np.array([65536, 256, 1], np.uint32), return_counts=True)[1]
    is_grey = (sampled == sampled[:, :1]).all()
    most_frequent = np.sort(counts)[::-1][:MOST_GREYS if is_grey else MOST_COLORS]
    return bool(most_frequent.sum() < 0.5 * len(sampled))


def needs_light(surfels):
    """Whether surfels are lit unless somebody says otherwise: all but those whose own colours are
    those of photographs. Shaded volumes are lit."""
    data = surfels.GetPointData()
    colors = data.GetScalars()
    if not is_colors(colors) or data.HasArray("GaussianNormal"):
        return True
    return not are_photographs(to_numpy(colors))

# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of volumes by VTK's own ray caster on the processor, and volumes to show.

A picture is an array [size, size, 3] of red, green and blue over black, 0 to 1; row 0 is at the
bottom.
"""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkImagingCore import vtkRTAnalyticSource
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkVolume, vtkWindowToImageFilter
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper


def wavelet(half):
    """ParaView's source Wavelet with 2 half + 1 points along each axis; float scalars, 37 to 277."""
    source = vtkRTAnalyticSource()
    source.SetWholeExtent(-half, half, -half, half, -half, half)
    source.Update()
    image = source.GetOutput()
    image.SetSpacing(10 / half, 10 / half, 10 / half)
    return image


def _ellipsoid(places, center, axes):
    """Distance to an ellipsoid, roughly: < 0 inside."""
    q = np.sqrt(sum(((x - c) / a) ** 2 for x, c, a in zip(places, center, axes)))
    return (q - 1) * min(axes)


def phantom(count):
    """A head of skin and soft tissue, 100, and bone, 255, in air, 0; 16 bits, 2 wide. Each border is
    three voxels wide."""
    axis = np.linspace(-1, 1, count)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    places, width = (x, y, z), 6 / count

    def inside(distance):
        return np.clip(0.5 - distance / width, 0, 1)

    skull = _ellipsoid(places, (0, 0.05, 0.1), (0.62, 0.75, 0.72))
    jaw = _ellipsoid(places, (0, -0.35, -0.5), (0.36, 0.32, 0.3))
    skin = np.minimum(np.minimum(skull, jaw), _ellipsoid(places, (0, -0.72, -0.1), (0.1, 0.16, 0.2)))
    for side in (-1, 1):
        skin = np.minimum(skin, _ellipsoid(places, (0.64 * side, 0.1, 0), (0.06, 0.14, 0.18)))
    bone = np.maximum(skull + 0.08, -(skull + 0.18))
    bone = np.minimum(bone, np.maximum(jaw + 0.07, -(jaw + 0.15)))
    for side in (-1, 1):
        bone = np.maximum(bone, -_ellipsoid(places, (0.24 * side, -0.62, 0.1), (0.14, 0.2, 0.12)))
    values = 100 * inside(skin) + 155 * np.minimum(inside(bone), inside(skin + 0.03))
    image = vtkImageData()
    image.SetDimensions(count, count, count)
    image.SetSpacing([2 / (count - 1)] * 3)
    image.SetOrigin(-1, -1, -1)
    scalars = numpy_to_vtk(np.round(40 * values).astype(np.uint16).ravel(), deep=1)
    scalars.SetName("density")
    image.GetPointData().SetScalars(scalars)
    return image


def cast_rays(image, prop, camera, size, lights=()):
    """By vtkFixedPointVolumeRayCastMapper, one ray for each pixel, steps of 0.3 of the least spacing:
    it rounds each sample, so that shorter ones are no better. lights: vtkLight; none: a headlight."""
    mapper, volume, renderer, window = (
        vtkFixedPointVolumeRayCastMapper(), vtkVolume(), vtkRenderer(), vtkRenderWindow())
    mapper.SetInputData(image)
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetImageSampleDistance(1)
    mapper.SetSampleDistance(0.3 * min(image.GetSpacing()))
    mapper.IntermixIntersectingGeometryOff()
    volume.SetMapper(mapper)
    volume.SetProperty(prop)
    renderer.AddVolume(volume)
    renderer.SetBackground(0, 0, 0)
    for light in lights:
        renderer.AddLight(light)
    window.OffScreenRenderingOn()
    window.SetMultiSamples(0)
    window.SetSize(size, size)
    window.AddRenderer(renderer)
    renderer.SetActiveCamera(camera)
    renderer.ResetCameraClippingRange()
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    pixels = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    return pixels.reshape(size, size, 3) / 255

# SPDX-License-Identifier: BSD-3-Clause
"""Surfels, camera and lens as the options say: a vtkSurfelImageRenderer."""

from ..backend import vtk
from ..clouds.colors import is_colors
from ..colormaps import color_by
from ..lighting import BACKDROP, LIGHT_GREY, needs_light, set_lights
from ..views.cameras import STILL_CELLS
from ..views.vtkcamera import make_camera, set_lens
from ..vtkSurfelRendering import vtkSurfelImageRenderer, vtkSurfelMapper
from ..vtkSurfelVolumes import vtkVolumeSplatting


def _is_lit(surfels, arguments):
    if arguments.lit or arguments.unlit:
        return arguments.lit
    return bool(arguments.scalars) or needs_light(surfels)


def make_actor(surfels, arguments):
    mapper = vtkSurfelMapper()
    mapper.SetInputData(surfels)
    if arguments.scalars:
        color_by(mapper, arguments.scalars, arguments.colormap or "viridis", arguments.range)
    else:
        mapper.SetScalarVisibility(is_colors(surfels.GetPointData().GetScalars()))
    actor = vtk("vtkRenderingCore").vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(LIGHT_GREY)
    actor.GetProperty().SetLighting(_is_lit(surfels, arguments))
    if surfels.GetPointData().HasArray("GaussianNormal"):  # of a volume, by --shade
        vtkVolumeSplatting.CopyMaterial(
            vtk("vtkRenderingCore").vtkVolumeProperty(), actor.GetProperty())
    return actor


def backdrop_of(arguments):
    """The background of an opaque picture: red, green, blue from 0 to 1."""
    return tuple(arguments.background or ((0.0, 0.0, 0.0) if arguments.unlit else BACKDROP))


def _set_background(renderer, arguments):
    is_picture = not (arguments.output.lower().endswith(".exr") or arguments.transparent)
    if arguments.background or is_picture:
        renderer.SetBackground(backdrop_of(arguments))
        renderer.SetBackgroundAlpha(1.0)


def set_splatter(splatter, arguments):
    """Sets kernels and colours, but not the lens."""
    splatter.SetLinearLight(arguments.linear_light)
    if arguments.kernel == "gaussian":
        splatter.SetKernelToGaussian()
    splatter.SetKeepCaptureMass(arguments.capture_filter == "antialiased")
    _set_detail(splatter, arguments)


def _parts_of_lens(arguments):
    """A deep picture has the layers of each cell: one, unless they are asked for."""
    cells = 1 if arguments.deep else STILL_CELLS
    return arguments.reference or arguments.lens_cells or cells


def make_renderer(surfels, view, arguments):
    renderer = vtkSurfelImageRenderer()
    actor = make_actor(surfels, arguments)
    renderer.AddActor(actor)
    set_lights(renderer, actor)
    renderer.SetCamera(make_camera(view))
    renderer.SetSize(*view.size)
    _set_background(renderer, arguments)
    splatter = renderer.GetSplatter()
    set_lens(splatter, view)
    splatter.SetLensCells(_parts_of_lens(arguments))
    splatter.SetLensPinholes(arguments.reference is not None)
    splatter.SetDeepSamples(arguments.deep)
    splatter.SetChannels(sum({getattr(splatter, f"CHANNEL_{name}")
                              for name in arguments.channels or ()}))
    splatter.FrameReuseOff()  # for --stats, count the frame although it was focused on
    set_splatter(splatter, arguments)
    return renderer


def _set_detail(splatter, arguments):
    if arguments.no_lod:
        splatter.SetLODModeToOff()
    if arguments.lod_error is not None:
        splatter.SetLODError(arguments.lod_error)

# SPDX-License-Identifier: BSD-3-Clause
"""Surfels through one camera, drawn in every way that the splatter has."""

import os
from dataclasses import dataclass

from vtkmodules.util.numpy_support import vtk_to_numpy

from clouds import bumpy_ball, framed_camera, read, surfels_of
from renderers import hierarchy_of, image_renderer, set_blur


@dataclass(frozen=True)
class Way:
    """Settings of a picture."""

    kernel: str = "PearsonII"
    lod: str = "Moments"
    error: float = 1.0
    cells: int = 1
    pinholes: bool = False
    coarse_grids: bool = True

    def __str__(self):
        if self.pinholes:
            return f"multisampling, N = {self.cells}"
        kernel = "Pearson II" if self.kernel == "PearsonII" else "Gaussian"
        detail = {"Moments": f"error {self.error:g}", "Paper": "paper's detail",
                  "Off": "no detail"}[self.lod]
        cells = f", K = {self.cells}" if self.cells > 1 else ""
        return f"{kernel}, {detail}{cells}"


DEFAULT = Way()
PAPER = Way("Gaussian", "Paper", coarse_grids=False)


def multisampling(count):
    return Way(cells=count, pinholes=True)


@dataclass
class Frame:
    picture: object  # [height, width, 3], top row first
    milliseconds: float
    splats: int
    fragments: int


class Drawing:
    """Surfels and their hierarchy, without a window."""

    def __init__(self, name, surfels, camera, lit):
        self.name, self.surfels, self.camera = name, surfels, camera
        self.count = surfels.GetNumberOfPoints()
        self._plain = image_renderer(surfels, camera, lit)
        self._detailed = image_renderer(hierarchy_of(surfels), camera, lit)

    def frame(self, way, size, confusion):
        """confusion: radius of the blur of a point at infinity in px, 0 = pinhole."""
        renderer = self._plain if way.lod == "Off" else self._detailed
        renderer.SetSize(size, size)
        splatter = renderer.GetSplatter()
        set_blur(splatter, confusion)
        getattr(splatter, "SetKernelTo" + way.kernel)()
        getattr(splatter, "SetLODModeTo" + way.lod)()
        splatter.SetLODError(way.error)
        splatter.SetLensCells(way.cells)
        splatter.SetLensPinholes(way.pinholes)
        splatter.SetCoarseGrids(way.coarse_grids)
        renderer.Modified()
        renderer.Update()
        colors = vtk_to_numpy(renderer.GetOutput().GetPointData().GetScalars())
        picture = colors.reshape(size, size, 4)[::-1, :, :3].astype(float)
        return Frame(picture, splatter.GetFrameMilliseconds(), splatter.GetNumberOfSplats(),
                     splatter.GetNumberOfFragments())


def scan_drawing(path):
    """A scan, as surfelsplat render shows it"""
    surfels = surfels_of(read(path))
    name = os.path.basename(path).split("_")[0].split(".")[0]
    return Drawing(name, surfels, framed_camera(surfels), lit=True)


def ball_drawing():
    """Without any file"""
    surfels = surfels_of(bumpy_ball())
    return Drawing("ball", surfels, framed_camera(surfels), lit=False)

# SPDX-License-Identifier: BSD-3-Clause
"""What other renderers make of a view, as rows of the benchmark. Needs a display."""

import sys

from measures import psnr
from peers import (Mitsuba, Window, depth_of_field_pass, mesh_views, sharp_gaussians, sharp_mesh,
                   sharp_surfels, timed)

MITSUBA_SAMPLES = (1, 4, 16, 64)
TRUTH_SAMPLES = 1024
MESH_POINTS = (4, 16, 64)


def _mitsuba(scene, size, confusion):
    try:
        return Mitsuba(scene, size, confusion)
    except ImportError:
        print("Mitsuba is not installed: VTK's views of the meshes are the truth",
              file=sys.stderr)
        return None


def mesh_truth(scene, size, confusion, points):
    ray_tracer = _mitsuba(scene, size, confusion)
    if ray_tracer:
        return ray_tracer.render(TRUTH_SAMPLES)[0]
    return mesh_views(scene.mesh(), scene.camera(), size, confusion, points).frame()[0]


def _row(name, picture, milliseconds, view):
    return {"way": name, "milliseconds": milliseconds, **view.rate(picture)}


def _depth_of_field(name, fill, view, frames):
    picture, milliseconds, scale = depth_of_field_pass(
        fill, view.drawing.camera, view.size, view.confusion, frames,
        lambda p: -psnr(p, view.truth))
    return _row(f"vtkDepthOfFieldPass on {name} (lens x {scale:g})", picture, milliseconds, view)


def _of_cloud(view, frames):
    window = Window(view.size)
    window.add_gaussians(view.drawing.surfels)
    window.see(view.drawing.camera, 0)
    rows = [_row("vtkPointGaussianMapper, sharp", *timed(window, frames), view)]
    if view.confusion:
        rows.append(_depth_of_field("our sharp surfels", sharp_surfels(view.drawing.surfels), view,
                                    frames))
        rows.append(_depth_of_field("vtkPointGaussianMapper",
                                    sharp_gaussians(view.drawing.surfels), view, frames))
    return rows


def _of_mesh(view, frames):
    rows = []
    scene, camera = view.mesh, view.drawing.camera
    if view.confusion:
        rows.append(_depth_of_field("the meshes", sharp_mesh(scene.mesh()), view, frames))
    for points in MESH_POINTS:
        window = mesh_views(scene.mesh(), camera, view.size, view.confusion, points)
        rows.append(_row(f"vtkLensAccumulationPass on the meshes, N = {points}",
                         *timed(window, 1), view))
    ray_tracer = _mitsuba(scene, view.size, view.confusion)
    for samples in MITSUBA_SAMPLES if ray_tracer else ():
        rows.append(_row(f"Mitsuba 3 on the meshes, {samples} samples a pixel",
                         *ray_tracer.render(samples), view))
    return rows


def peers(view, frames):
    return _of_cloud(view, frames) + (_of_mesh(view, frames) if view.mesh else [])

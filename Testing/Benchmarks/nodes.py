#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the nodes of captures hide through the lens, against the mean of pinholes of all Gaussians.

    PYTHONPATH=build/lib/python3/dist-packages:Testing/Shared /usr/bin/python3 Testing/Benchmarks/nodes.py OUT

writes OUT.md: per capture, view, blur and error of the level of detail (0: all Gaussians) the PSNR,
what is hidden too much in percent of alpha, splats and fragments. Two builds are compared by two runs.
"""

import argparse

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkRenderingCore import vtkCamera

import captures
from renderers import hierarchy_of, image_renderer
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.vtkarrays import named_array

SCENES = {"trained": captures.trained, "other": lambda count: captures.trained(count, 5, 0.6),
          "ball": captures.furry_ball, "torus": captures.torus}
VIEWS = {"front": ((0.3, -2.6, 0.9), 0.25), "side": ((2.4, 1.0, 0.6), -0.2),
         "close": ((-0.5, -1.2, 0.7), 0.45)}  # place in radii; focus, from the middle to the place
ERRORS = (0.0, 0.5, 1.0, 1.5, 2.0, 4.0)


def polydata(gaussians):
    data, s = polydata_of(gaussians.positions, {}), gaussians.covariances()
    for name, values in {"GaussianCovariance": s[:, (0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)],
                         "GaussianOpacity": gaussians.opacities,
                         "GaussianHarmonics": gaussians.harmonics.reshape(len(s), -1)}.items():
        data.GetPointData().AddArray(named_array(name, values, np.float32))
    return data


def camera_at(positions, view):
    """-> a camera, and the distance of its focus"""
    place, focus = VIEWS[view]
    middle = (np.percentile(positions, 5, axis=0) + np.percentile(positions, 95, axis=0)) / 2
    radius = np.percentile(np.linalg.norm(positions - middle, axis=1), 95)
    camera = vtkCamera()
    camera.SetPosition(*(middle + radius * np.array(place)))
    camera.SetFocalPoint(*middle)
    camera.SetViewUp(0, 0, 1)
    camera.SetViewAngle(40)
    return camera, (1 - focus) * camera.GetDistance()


def confusion_for(camera, positions, focus, blur):
    """Circle of confusion of what is infinitely far, where the most blurred things have `blur` px."""
    place, forward = np.array(camera.GetPosition()), np.array(camera.GetDirectionOfProjection())
    depths = (positions - place) @ forward
    ends = np.percentile(depths[depths > 0.1 * focus], (1, 99))
    return blur / max(abs(1 - focus / ends))


def picture(renderer, camera, size, confusion, error, pinholes=1):
    splatter = renderer.GetSplatter()
    renderer.SetCamera(camera)
    renderer.SetSize(size, size)
    splatter.SetLensModeToCircleOfConfusion()
    splatter.SetCircleOfConfusion(confusion)
    splatter.SetLensCells(pinholes)
    splatter.SetLensPinholes(pinholes > 1)
    splatter.SetLODMode(splatter.LOD_MOMENTS if error > 0 else splatter.LOD_OFF)
    splatter.SetLODError(error)
    renderer.Modified()
    renderer.Update()
    return vtk_to_numpy(renderer.GetOutput().GetPointData().GetScalars()).reshape(size, size, 4).copy()


def psnr(first, second):
    """Over the background that shows the larger difference, dB"""
    found = []
    for background in (0, 1):
        over = [np.clip(p[..., :3] + (1 - p[..., 3:]) * background, 0, 1) for p in (first, second)]
        found.append(np.mean((over[0] - over[1]) ** 2))
    return -10 * np.log10(max(*found, 1e-10))


def rows(name, arguments):
    """-> lines of the table"""
    gaussians = SCENES[name](arguments.points)
    renderer = image_renderer(hierarchy_of(polydata(gaussians)), vtkCamera(), False)
    splatter = renderer.GetSplatter()
    for view in VIEWS:
        camera, focus = camera_at(gaussians.positions, view)
        camera.SetFocalDistance(focus)
        for blur in arguments.blurs:
            confusion = confusion_for(camera, gaussians.positions, focus, blur)
            truth = picture(renderer, camera, arguments.size, confusion, 0, arguments.pinholes)
            for error in ERRORS:
                found = picture(renderer, camera, arguments.size, confusion, error)
                bias = 100 * (found[..., 3].sum() / truth[..., 3].sum() - 1)
                yield (f"| {name}, {view}, {blur:g} | {error:g} | {psnr(found, truth):.2f} | {bias:+.2f} | "
                       f"{splatter.GetNumberOfSplats()} | {splatter.GetNumberOfFragments()} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("out")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--points", type=int, default=120_000)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--blurs", type=float, nargs="+", default=[12, 36, 60])
    parser.add_argument("--pinholes", type=int, default=256)
    arguments = parser.parse_args()
    lines = ["| capture, view, blur, px | error | dB | hidden too much, % | splats | fragments |",
             "|---|---|---|---|---|---|"]
    for name in arguments.scenes:
        lines += rows(name, arguments)
    with open(arguments.out + ".md", "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()

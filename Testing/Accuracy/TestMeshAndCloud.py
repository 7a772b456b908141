# SPDX-License-Identifier: BSD-3-Clause
"""One surface as a mesh and as a cloud that was sampled from it, each drawn by the pass from the
same camera: the bunny of the ray-traced scenes, its mesh reconstructed by VTK."""

import json
import os
import sys
import unittest

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkConnectivityFilter
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersPoints import (
    vtkExtractSurface, vtkPCANormalEstimation, vtkPointInterpolator, vtkSignedDistance, vtkVoronoiKernel)
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter)

from clouds import points_of, read, surfels_of
from measures import psnr
from renderers import hierarchy_of, view_camera
from surfelsplatting import vtkSurfelMapper, vtkSurfelSplattingPass
from surfelsplatting.vtkarrays import named_array

TRUTH = os.environ["TRUTH"]
SCENE = f"{TRUTH}/stanford-bunny"
WALL = -1.9  # z; the wall behind the bunny is farther

# dB: what is asked for is 30 with one picture and 34 with seven cells; measured 38.4 and 38.8 (coc12),
# 41.9 and 43.4 (coc36). What differs is the mesh's lack of a pixel filter where it is in focus.
FLOORS = {("coc12", 1): 37.0, ("coc12", 7): 37.5, ("coc36", 1): 38.5, ("coc36", 7): 42.0}


def cloud_of(points, colors):
    data = vtkPolyData()
    data.SetPoints(points_of(points))
    data.GetPointData().SetScalars(named_array("RGB", colors, np.uint8))
    return data


def bunny_points():
    cloud = read(SCENE + ".ply")
    points = vtk_to_numpy(cloud.GetPoints().GetData())
    colors = vtk_to_numpy(cloud.GetPointData().GetScalars())[:, :3]
    bunny = points[:, 2] > WALL
    return cloud_of(points[bunny], colors[bunny])


def reconstruct(cloud):
    """-> triangles with the colour of the nearest point at each corner"""
    bounds = np.array(cloud.GetBounds()).reshape(3, 2)
    size = np.ptp(bounds, axis=1).max()
    margin, cells = 0.06 * size, 200
    normals = vtkPCANormalEstimation()
    normals.SetInputData(cloud)
    normals.SetSampleSize(20)
    normals.FlipNormalsOn()
    normals.SetNormalOrientationToGraphTraversal()
    distance = vtkSignedDistance()
    distance.SetInputConnection(normals.GetOutputPort())
    distance.SetRadius(0.02 * size)
    distance.SetBounds((bounds + [-margin, margin]).ravel())
    distance.SetDimensions(*(int(cells * (side + 2 * margin) / size) for side in np.ptp(bounds, axis=1)))
    surface = vtkExtractSurface()
    surface.SetInputConnection(distance.GetOutputPort())
    surface.SetRadius(0.02 * size)
    largest = vtkConnectivityFilter()
    largest.SetInputConnection(surface.GetOutputPort())
    largest.SetExtractionModeToLargestRegion()
    geometry = vtkGeometryFilter()
    geometry.SetInputConnection(largest.GetOutputPort())
    colors = vtkPointInterpolator()
    colors.SetInputConnection(geometry.GetOutputPort())
    colors.SetSourceData(cloud)
    colors.SetKernel(vtkVoronoiKernel())
    colors.PromoteOutputArraysOff()  # bytes are colours, floats are not
    colors.Update()
    mesh = colors.GetOutput()
    mesh.GetPointData().SetActiveScalars("RGB")
    return mesh


def sample(mesh, count):
    """Points with colours, uniform on the mesh."""
    points = vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
    colors = vtk_to_numpy(mesh.GetPointData().GetScalars()).astype(float)
    corners = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    a, b, c = (points[corners[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(3)
    chosen = corners[rng.choice(len(corners), count, p=area / area.sum())]
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    weights = np.stack([1 - u - v, u, v], axis=1)
    return cloud_of(np.einsum("ni,nij->nj", weights, points[chosen]),
                    np.einsum("ni,nij->nj", weights, colors[chosen]).round())


def picture(mapper, view, cells):
    """-> [height, width, 3] bytes"""
    window, renderer, splatting = vtkRenderWindow(), vtkRenderer(), vtkSurfelSplattingPass()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*view["size"])
    window.AddRenderer(renderer)
    renderer.SetBackground(0.1, 0.1, 0.15)
    renderer.SetPass(splatting)
    splatting.GetSplatter().SetLensCells(cells)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().LightingOff()
    renderer.AddActor(actor)
    camera = view_camera(view)
    camera.SetFocalDisk(view["focalDisk"])
    renderer.SetActiveCamera(camera)
    renderer.ResetCameraClippingRange()
    window.Render()
    grabbed = vtkWindowToImageFilter()
    grabbed.SetInput(window)
    grabbed.ReadFrontBufferOff()
    grabbed.Update()
    pixels = vtk_to_numpy(grabbed.GetOutput().GetPointData().GetScalars())
    return pixels.reshape(view["size"][1], view["size"][0], 3)


class MeshAndCloud(unittest.TestCase):
    def test_bunny(self):
        mesh = reconstruct(bunny_points())
        self.assertGreater(mesh.GetNumberOfPolys(), 100000)
        mesh_mapper, cloud_mapper = vtkPolyDataMapper(), vtkSurfelMapper()
        mesh_mapper.SetInputData(mesh)
        cloud_mapper.SetInputData(hierarchy_of(surfels_of(sample(mesh, 300000))))
        with open(SCENE + ".json") as file:
            views = {view["name"]: view for view in json.load(file)["views"]}
        for (view, cells), floor in FLOORS.items():
            a, b = (picture(mapper, views[view], cells) for mapper in (mesh_mapper, cloud_mapper))
            value = psnr(a, b, 255)
            print(f"mesh and cloud, {view}, K = {cells}: {value:.2f}")
            self.assertGreater(value, floor, (view, cells))


if __name__ == "__main__":
    if not os.path.exists(SCENE + ".json"):
        print(f"skipped: no ray-traced scenes in {TRUTH} (SURFELSPLATTING_TRUTH_DIR)")
        sys.exit(77)
    unittest.main()

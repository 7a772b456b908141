# SPDX-License-Identifier: BSD-3-Clause
"""Other ways to a picture with depth of field: VTK's passes in a window, Mitsuba 3."""

import math
import os
import tempfile
import time

import numpy as np
import vtkmodules.vtkInteractionStyle  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import (vtkActor, vtkCamera, vtkPointGaussianMapper,
                                         vtkPolyDataMapper, vtkRenderer, vtkRenderWindow)
from vtkmodules.vtkRenderingOpenGL2 import vtkDepthOfFieldPass, vtkRenderStepsPass

from surfelsplatting.vtkSurfelRendering import (vtkLensAccumulationPass, vtkSurfelMapper,
                                                vtkSurfelSplattingPass)


def focal_length(camera, height):
    return 0.5 * height / math.tan(math.radians(camera.GetViewAngle()) / 2)


def focal_disk(camera, height, confusion):
    """Diameter of the lens with this blur radius at infinity in px."""
    return 2 * confusion * camera.GetFocalDistance() / focal_length(camera, height)


def _actor(mapper, data):
    mapper.SetInputData(data)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetLighting(False)
    return actor


class Window:
    """One renderer off screen; unlit props on black."""

    def __init__(self, size):
        self.renderer = vtkRenderer()
        self.window = vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(0)
        self.window.SetSize(size, size)
        self.window.AddRenderer(self.renderer)
        self.size = size

    def add_mesh(self, mesh):
        self.renderer.AddActor(_actor(vtkPolyDataMapper(), mesh))

    def add_surfels(self, surfels):
        actor = _actor(vtkSurfelMapper(), surfels)
        self.renderer.AddActor(actor)
        return actor

    def add_gaussians(self, surfels):
        """VTK's own splats, of the surfels' size."""
        trace = vtk_to_numpy(surfels.GetPointData().GetArray("SurfelCovariance"))[:, :3].sum(axis=1)
        mapper = vtkPointGaussianMapper()
        mapper.SetScaleFactor(math.sqrt(np.median(trace) / 2) * 3)
        mapper.EmissiveOff()
        # Opaque discs: blended ones would need sorting.
        mapper.SetSplatShaderCode("//VTK::Color::Impl\n"
                                  "if (dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy) > 0.44)"
                                  " discard;\n")
        self.renderer.AddActor(_actor(mapper, surfels))

    def see(self, camera, confusion, focal_point_in_focus=False):
        own = vtkCamera()
        own.DeepCopy(camera)
        own.SetFocalDisk(focal_disk(camera, self.size, confusion))
        if focal_point_in_focus:
            direction = np.array(camera.GetDirectionOfProjection())
            own.SetFocalPoint(camera.GetPosition() + camera.GetFocalDistance() * direction)
        self.renderer.SetActiveCamera(own)
        self.renderer.ResetCameraClippingRange()
        return own

    def draw(self):
        self.window.Render()
        self.window.WaitForCompletion()

    def frame(self):
        """-> [height, width, 3], milliseconds"""
        began = time.perf_counter()
        self.draw()
        elapsed = 1000 * (time.perf_counter() - began)
        pixels = vtkUnsignedCharArray()
        self.window.GetRGBACharPixelData(0, 0, self.size - 1, self.size - 1, 0, pixels)
        rgba = vtk_to_numpy(pixels).reshape(self.size, self.size, 4)[::-1]
        return rgba[..., :3] / 255.0, elapsed


def timed(window, frames):
    """-> picture, median milliseconds; the first frame, which uploads, does not count (and that of
    vtkDepthOfFieldPass is black)."""
    window.frame()
    times = []
    for _ in range(max(1, frames)):
        picture, milliseconds = window.frame()
        times.append(milliseconds)
    return picture, float(np.median(times))


def mesh_views(mesh, camera, size, confusion, points, pixel_filter=1.0):
    """The mean of views of a mesh from points of the lens."""
    window = Window(size)
    window.add_mesh(mesh)
    accumulation = vtkLensAccumulationPass()
    accumulation.SetDelegatePass(vtkRenderStepsPass())
    accumulation.SetNumberOfLensPoints(points)
    accumulation.SetPixelFilter(pixel_filter)
    window.renderer.SetPass(accumulation)
    window.see(camera, confusion)
    return window


def depth_of_field_pass(fill, camera, size, confusion, frames, error):
    """vtkDepthOfFieldPass at the best of five scales of the lens: its blur is not a thin lens's.

    fill(window) adds the props and returns the pass that draws them sharp.
    -> picture, milliseconds, scale
    """
    best = None
    for scale in (0.25, 0.5, 1.0, 2.0, 4.0):
        window = Window(size)
        blur = vtkDepthOfFieldPass()
        blur.AutomaticFocalDistanceOff()
        blur.SetDelegatePass(fill(window))
        window.renderer.SetPass(blur)
        window.see(camera, confusion * scale, focal_point_in_focus=True)
        picture, milliseconds = timed(window, frames)
        blur.ReleaseGraphicsResources(window.window)
        if best is None or error(picture) < error(best[0]):
            best = picture, milliseconds, scale
    return best


def sharp_surfels(surfels):
    """For depth_of_field_pass: our own sharp picture and its depth."""
    def fill(window):
        window.add_surfels(surfels)
        splats = vtkSurfelSplattingPass()
        splats.GetSplatter().SetLensModeToPinhole()
        splats.GetSplatter().FrameReuseOff()
        return splats
    return fill


def sharp_gaussians(surfels):
    def fill(window):
        window.add_gaussians(surfels)
        return vtkRenderStepsPass()
    return fill


def sharp_mesh(mesh):
    def fill(window):
        window.add_mesh(mesh)
        return vtkRenderStepsPass()
    return fill


class Mitsuba:
    """Mitsuba 3's thin lens on a mesh whose vertices emit their colour (pip install mitsuba)."""

    def __init__(self, scene, size, confusion):
        import mitsuba

        mitsuba.set_variant("scalar_rgb")
        self._mi = mitsuba
        camera = scene.camera()
        mesh = mitsuba.Mesh("scene", len(scene.positions), len(scene.triangles))
        parameters = mitsuba.traverse(mesh)
        parameters["vertex_positions"] = scene.positions.astype(np.float32).ravel()
        parameters["faces"] = scene.triangles.astype(np.uint32).ravel()
        parameters.update()
        mesh.add_attribute("vertex_color", 3, scene.colors.astype(np.float32).ravel())
        # Colours reach an emitter through a file: area lights are parts of shapes.
        folder = tempfile.TemporaryDirectory()
        path = os.path.join(folder.name, "mesh.ply")
        mesh.write_ply(path)
        transform = mitsuba.ScalarTransform4f().look_at(
            origin=list(camera.GetPosition()), target=list(camera.GetFocalPoint()), up=[0, 1, 0])
        disk = focal_disk(camera, size, confusion)
        lens = {"type": "thinlens", "aperture_radius": disk / 2,
                "focus_distance": camera.GetFocalDistance()} if disk else {"type": "perspective"}
        self._scene = mitsuba.load_dict({
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 1},
            "sensor": {**lens, "fov": camera.GetViewAngle(), "fov_axis": "y",
                       "near_clip": 0.01, "far_clip": 100.0, "to_world": transform,
                       "film": {"type": "hdrfilm", "width": size, "height": size,
                                "rfilter": {"type": "gaussian", "stddev": 1.0},
                                "pixel_format": "rgb", "component_format": "float32"},
                       "sampler": {"type": "multijitter"}},
            "mesh": {"type": "ply", "filename": path,
                     "emitter": {"type": "area",
                                 "radiance": {"type": "mesh_attribute", "name": "vertex_color"}}}})
        folder.cleanup()

    def render(self, samples):
        """-> [height, width, 3], milliseconds"""
        began = time.perf_counter()
        picture = np.array(self._mi.render(self._scene, spp=samples))
        return picture.astype(float), 1000 * (time.perf_counter() - began)

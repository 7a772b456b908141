# SPDX-License-Identifier: BSD-3-Clause
"""Depth-of-field surface splatting of point clouds for VTK.

All classes are in this one namespace:

    from surfelsplatting import vtkSurfelEstimation, vtkSurfelSplattingPass

Points to surfels
    vtkPointCloudReader             reads .pcd and .ply files
    vtkGaussianSplatReader          reads captures of 3D Gaussian splatting, .ply, .spz, .splat
    vtkPointsOnFaces                points on the faces of meshes with few vertices
    vtkPointCloudCleaning           removes stray points, duplicates and noise
    vtkSurfelEstimation             points to surfels: normals, kernels, outside
    vtkSurfelNormalization          weights, so that the kernels sum to 1 over the surface
    vtkPartitionedSurfelEstimation  these three, for clouds too large to be processed at once
    vtkSurfelHierarchy              level of detail
    vtkPointsToSurfels              cleaning, estimation, normalization and hierarchy in one, faster
Volumes to Gaussians in space
    vtkVolumeSplatting              classifies images with scalars, or particles
Surfels to pictures
    vtkSurfelMapper                 surfels in a vtkActor
    vtkSurfelSplattingPass          surfels and meshes in a window: renderer.SetPass(...)
    vtkSurfelImageRenderer          a picture without window, OpenGL or X server
    vtkSurfelSplatter               lens, kernel and statistics of these two: GetSplatter()
    vtkLensAccumulationPass         reference: the mean of views from N points of the lens
Files
    vtkSurfelHierarchyWriter, vtkSurfelHierarchyReader    hierarchies that open at once, any size
    vtkSurfelEXRWriter, vtkDeepEXRWriter, vtkSurfelEXRReader    OpenEXR, flat and deep
    write_png                       8-bit PNG of a float picture
Arrays of numpy to pictures
    render                          points, perhaps with colours, scalars or normals, to an array of pixels
    Camera, Lens                    what render() sees them through
PyVista finds dataset.surfels, plotter.surfels and the readers of .pcd and other files by itself.

help() of each class describes its methods, with units, defaults and ranges.
"""

from . import backend

# VTK's modules come first: the wrapped classes derive from theirs.
backend.load(("vtkCommonCore", "vtkCommonDataModel", "vtkCommonExecutionModel", "vtkIOImage",
              "vtkRenderingCore", "vtkRenderingOpenGL2"))
try:
    from .vtkSurfelFilters import *  # noqa: F401,F403
    from .vtkSurfelOpenEXR import *  # noqa: F401,F403
    from .vtkSurfelReaders import *  # noqa: F401,F403
    from .vtkSurfelRendering import *  # noqa: F401,F403
    from .vtkSurfelVolumes import *  # noqa: F401,F403
except ImportError as _error:
    raise backend.cannot_load(_error) from _error
backend.explain_mixing([_value for _name, _value in globals().items() if _name.startswith("vtk")])

from .arraypictures import Camera, render  # noqa: F401
from .lens import Lens  # noqa: F401
from .pictures import write_png  # noqa: F401
from .version import __version__  # noqa: F401

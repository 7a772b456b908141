# SPDX-License-Identifier: BSD-3-Clause
"""Depth-of-field surface splatting of point clouds for VTK.

Holds every class of the modules below, in one namespace:

    from surfelsplatting import vtkSurfelEstimation, vtkSurfelSplattingPass
"""

# VTK's modules come first: the wrapped classes derive from theirs.
from vtkmodules import (  # noqa: F401
    vtkCommonCore,
    vtkCommonDataModel,
    vtkCommonExecutionModel,
    vtkIOImage,
    vtkRenderingCore,
    vtkRenderingOpenGL2,
)

from .vtkSurfelFilters import *  # noqa: F401,F403
from .vtkSurfelOpenEXR import *  # noqa: F401,F403
from .vtkSurfelReaders import *  # noqa: F401,F403
from .vtkSurfelRendering import *  # noqa: F401,F403
from .version import __version__  # noqa: F401

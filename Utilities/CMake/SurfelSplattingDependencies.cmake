# Finds VTK, Python, PCL (with FLANN), zstd, Eigen and OpenEXR so that nothing more than what is used comes along.

set(surfelsplatting_vtk_components
  CommonCore CommonDataModel CommonExecutionModel CommonMath CommonTransforms FiltersCore IOImage
  ParallelCore RenderingCore RenderingOpenGL2 zlib)
if (SURFELSPLATTING_WRAP_PYTHON)
  # Debian's interpreter, which sees python3-vtk9: a pyenv or conda python3 is often first on PATH.
  if (NOT Python3_EXECUTABLE AND EXISTS "/usr/bin/python3")
    set(Python3_EXECUTABLE "/usr/bin/python3" CACHE FILEPATH "Interpreter that has vtkmodules")
  endif ()
  find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module)
  list(APPEND surfelsplatting_vtk_components WrappingPythonCore Python)
endif ()
if (SURFELSPLATTING_BUILD_TESTING)
  list(APPEND surfelsplatting_vtk_components IOXML)
endif ()
# Without COMPONENTS the package demands Qt5's development files.
# OpenGL's functions come by glew up to VTK 9.3, by glad since.
find_package(VTK 9.1 REQUIRED COMPONENTS ${surfelsplatting_vtk_components}
  OPTIONAL_COMPONENTS glad glew opengl)

find_package(Eigen3 REQUIRED NO_MODULE)
set(pcl_components common search) # search for FLANN, which it finds
if (SURFELSPLATTING_BUILD_TESTING)
  list(APPEND pcl_components kdtree octree features filters io)
endif ()
find_package(PCL 1.13 QUIET REQUIRED COMPONENTS ${pcl_components})
# The parser of .ply files, for which PCL's configuration has no target.
find_library(SURFELSPLATTING_PCL_IO_PLY pcl_io_ply REQUIRED)
# For .spz files of version 4.
find_library(SURFELSPLATTING_ZSTD zstd REQUIRED)
find_path(SURFELSPLATTING_ZSTD_INCLUDE zstd.h REQUIRED)
# For tests PCL's configuration finds VTK again for modules that they do not use. Its targets pcl_2d,
# pcl_features and pcl_io would link 35 VTK libraries, Qt and two depth cameras' drivers.
foreach (pcl_target IN ITEMS pcl_2d pcl_features pcl_io)
  if (TARGET ${pcl_target})
    get_target_property(pcl_links ${pcl_target} INTERFACE_LINK_LIBRARIES)
    if (pcl_links)
      list(FILTER pcl_links EXCLUDE REGEX "^VTK::|OpenNI|libusb")
      set_target_properties(${pcl_target} PROPERTIES INTERFACE_LINK_LIBRARIES "${pcl_links}")
    endif ()
  endif ()
endforeach ()

# Debian's Imath tells at length that it does not ship a Python library which nobody asked for.
set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)
find_package(OpenEXR 3.1 REQUIRED)
unset(CMAKE_MESSAGE_LOG_LEVEL)
find_package(Threads REQUIRED)

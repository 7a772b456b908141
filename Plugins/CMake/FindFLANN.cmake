# FLANN::FLANN, the headers and the shared library of flann_cpp. PCL's configuration brings a module
# of the same name along; this one serves where PCL is not asked for.
find_path(FLANN_INCLUDE_DIR flann/flann.hpp)
find_library(FLANN_LIBRARY NAMES flann_cpp flann)
find_library(FLANN_LZ4_LIBRARY NAMES lz4)
mark_as_advanced(FLANN_INCLUDE_DIR FLANN_LIBRARY FLANN_LZ4_LIBRARY)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(FLANN REQUIRED_VARS FLANN_LIBRARY FLANN_INCLUDE_DIR)
if (FLANN_FOUND AND NOT TARGET FLANN::FLANN)
  add_library(FLANN::FLANN UNKNOWN IMPORTED)
  set_target_properties(FLANN::FLANN PROPERTIES
    IMPORTED_LOCATION "${FLANN_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${FLANN_INCLUDE_DIR}")
  if (FLANN_LZ4_LIBRARY)
    set_target_properties(FLANN::FLANN PROPERTIES INTERFACE_LINK_LIBRARIES "${FLANN_LZ4_LIBRARY}")
  endif ()
endif ()

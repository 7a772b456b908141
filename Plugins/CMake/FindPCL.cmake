# The targets pcl_<component>, headers and shared library, of PCL's modules that link no VTK. PCL's
# own configuration asks for another VTK than ParaView's, whatever the components. The headers may
# lie apart from the libraries, below PCL_ROOT: Debian's libpcl-dev needs that VTK as well.
set(pcl_suffixes pcl)
foreach (minor RANGE 13 30)
  list(PREPEND pcl_suffixes pcl-1.${minor})
endforeach ()
find_path(PCL_INCLUDE_DIR pcl/pcl_config.h PATH_SUFFIXES ${pcl_suffixes})
mark_as_advanced(PCL_INCLUDE_DIR)
if (PCL_INCLUDE_DIR)
  file(STRINGS "${PCL_INCLUDE_DIR}/pcl/pcl_config.h" pcl_line REGEX "define PCL_VERSION_PRETTY")
  string(REGEX MATCH "[0-9]+\\.[0-9]+" PCL_VERSION "${pcl_line}")
endif ()
set(pcl_variables PCL_INCLUDE_DIR)
foreach (component IN LISTS PCL_FIND_COMPONENTS)
  find_library(PCL_${component}_LIBRARY
    NAMES pcl_${component} libpcl_${component}.so.${PCL_VERSION})
  mark_as_advanced(PCL_${component}_LIBRARY)
  list(APPEND pcl_variables PCL_${component}_LIBRARY)
endforeach ()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(PCL REQUIRED_VARS ${pcl_variables} VERSION_VAR PCL_VERSION)
foreach (component IN LISTS PCL_FIND_COMPONENTS)
  if (PCL_FOUND AND NOT TARGET pcl_${component})
    add_library(pcl_${component} UNKNOWN IMPORTED)
    set_target_properties(pcl_${component} PROPERTIES
      IMPORTED_LOCATION              "${PCL_${component}_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES  "${PCL_INCLUDE_DIR}"
      INTERFACE_LINK_LIBRARIES       "Eigen3::Eigen")
  endif ()
endforeach ()

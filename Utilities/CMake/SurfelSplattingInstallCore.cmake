# Package configuration for find_package(SurfelSplattingCore): the target SurfelSplatting::Core, a
# static library with its headers. Nothing of it needs VTK. `cmake --install BUILD --component Core`
# installs it alone.
include(CMakePackageConfigHelpers)
set(core_headers "${CMAKE_INSTALL_INCLUDEDIR}/surfelsplatting")
set(core_package "${CMAKE_INSTALL_LIBDIR}/cmake/SurfelSplattingCore")

# *Implementation.h are compiled into the library, once per instruction set.
install(DIRECTORY Core DESTINATION "${core_headers}" COMPONENT Core
  FILES_MATCHING PATTERN "*.h" PATTERN "*Implementation.h" EXCLUDE)
target_include_directories(SurfelSplattingCore INTERFACE "$<INSTALL_INTERFACE:${core_headers}>")
set_target_properties(SurfelSplattingCore PROPERTIES EXPORT_NAME Core)
install(TARGETS SurfelSplattingCore EXPORT SurfelSplattingCore
  DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT Core)
install(EXPORT SurfelSplattingCore NAMESPACE SurfelSplatting:: DESTINATION "${core_package}"
  FILE SurfelSplattingCoreTargets.cmake COMPONENT Core)

file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingCoreConfig.cmake"
  "include(CMakeFindDependencyMacro)\n"
  "find_dependency(Threads)\n"
  "include(\"\${CMAKE_CURRENT_LIST_DIR}/SurfelSplattingCoreTargets.cmake\")\n")
write_basic_package_version_file(
  "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingCoreConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES
  "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingCoreConfig.cmake"
  "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingCoreConfigVersion.cmake"
  DESTINATION "${core_package}" COMPONENT Core)

# Likewise the filters' code for points, without headers: only the plugin and the wheel can use it.
if (TARGET SurfelSplattingPoints)
  set_target_properties(SurfelSplattingPoints PROPERTIES EXPORT_NAME Points)
  install(TARGETS SurfelSplattingPoints EXPORT SurfelSplattingPoints
    DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT Points EXCLUDE_FROM_ALL)
  install(EXPORT SurfelSplattingPoints NAMESPACE SurfelSplatting::
    DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/SurfelSplattingPoints"
    FILE SurfelSplattingPointsConfig.cmake COMPONENT Points EXCLUDE_FROM_ALL)
endif ()

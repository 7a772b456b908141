# Package configuration for find_package(SurfelSplatting).
include(CMakePackageConfigHelpers)
set(surfelsplatting_cmake_destination "${CMAKE_INSTALL_LIBDIR}/cmake/SurfelSplatting")
configure_package_config_file(
  "${CMAKE_CURRENT_SOURCE_DIR}/Utilities/CMake/SurfelSplattingConfig.cmake.in"
  "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingConfig.cmake"
  INSTALL_DESTINATION "${surfelsplatting_cmake_destination}")
write_basic_package_version_file(
  "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES
  "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingConfig.cmake"
  "${CMAKE_CURRENT_BINARY_DIR}/SurfelSplattingConfigVersion.cmake"
  DESTINATION "${surfelsplatting_cmake_destination}")

# `cmake --build build --target docs` makes pages of the public classes in build/docs and of the core
# in build/docs/core. It fails on Doxygen's warnings.
find_package(Doxygen QUIET)
if (NOT TARGET Doxygen::doxygen)
  return()
endif ()
set(docs_folder "${CMAKE_CURRENT_BINARY_DIR}/docs")
configure_file(Utilities/Doxygen/Doxyfile.in Doxyfile @ONLY)
configure_file(Utilities/Doxygen/Core.in CoreDoxyfile @ONLY)
add_custom_target(docs
  COMMAND "${CMAKE_COMMAND}" -E make_directory "${docs_folder}/core"
  COMMAND Doxygen::doxygen "${CMAKE_CURRENT_BINARY_DIR}/Doxyfile"
  COMMAND Doxygen::doxygen "${CMAKE_CURRENT_BINARY_DIR}/CoreDoxyfile"
  COMMENT "Pages of the classes: ${docs_folder}/index.html"
  VERBATIM)

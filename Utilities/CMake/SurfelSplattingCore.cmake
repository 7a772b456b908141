# The target SurfelSplattingCore: compiled here, or for the plugin and the wheel an installed one of this
# version, which the same compiler has made.
if (SURFELSPLATTING_CORE_PREFIX AND
    (SURFELSPLATTING_BUILD_PARAVIEW_PLUGIN OR SURFELSPLATTING_BUILD_WHEEL))
  unset(SurfelSplattingCore_DIR CACHE) # perhaps of another prefix
  find_package(SurfelSplattingCore ${PROJECT_VERSION} EXACT REQUIRED
    PATHS "${SURFELSPLATTING_CORE_PREFIX}" NO_DEFAULT_PATH)
  add_library(SurfelSplattingCore ALIAS SurfelSplatting::Core)
else ()
  add_subdirectory("${PROJECT_SOURCE_DIR}/Core" Core)
endif ()

# The compiled part of the wheel: libraries and extension modules, all in the package's folder. The
# libraries of PyVista's VTK are in the folder beside it.
set(CMAKE_INSTALL_RPATH "$ORIGIN;$ORIGIN/../cvista")
vtk_module_build(
  MODULES               ${surfelsplatting_modules}
  PACKAGE               SurfelSplatting
  INSTALL_HEADERS       OFF
  LIBRARY_DESTINATION   surfelsplatting)
set(CVISTA_WRAP_UNITY ON) # the generated files of a module are compiled together
vtk_module_wrap_python(
  MODULES             ${surfelsplatting_modules}
  INSTALL_HEADERS     OFF
  PYTHON_PACKAGE      surfelsplatting
  MODULE_DESTINATION  .
  BUILD_STATIC        OFF)

set(surfelsplatting_vtk_package cvista)
configure_file(Wrapping/Python/surfelsplatting/version.py.in version.py @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/version.py" DESTINATION surfelsplatting)

# Licences of what is compiled in, or put beside by auditwheel.
foreach (package IN ITEMS libeigen3 libflann libimath liblz4 libopenexr libpcl libzstd)
  install(FILES "/usr/share/doc/${package}-dev/copyright"
    DESTINATION "${SKBUILD_METADATA_DIR}/licenses" RENAME "${package}.txt" OPTIONAL)
endforeach ()

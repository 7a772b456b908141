# Fails if the library for points calls a member of a class of VTK, or has one: it is linked with different
# VTKs, which have other ones.
#   cmake -DNM=<nm> -DLIBRARY=<libSurfelSplattingPoints.a> -P CheckWithoutVTK.cmake
execute_process(COMMAND "${NM}" -C "${LIBRARY}" OUTPUT_VARIABLE symbols RESULT_VARIABLE result)
if (NOT result EQUAL 0)
  message(FATAL_ERROR "${NM} cannot read ${LIBRARY}: ${result}")
endif ()
string(REGEX MATCHALL "[^\n]* (vtk[A-Za-z]+::|(vtable|typeinfo) for vtk)[^\n]*" found "${symbols}")
if (found)
  message(SEND_ERROR "${LIBRARY} uses VTK: ${found}")
endif ()
if (NOT symbols MATCHES " U SurfelGeometry::RunLoop")
  message(SEND_ERROR "${LIBRARY} has no loops")
endif ()

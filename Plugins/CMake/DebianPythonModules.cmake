# Debian 13 names ParaView's Python modules X.cpython-313-x86_64-linux-gnu.so, but ParaView's
# configuration stops where it does not find X.so, although nothing links them. CMake does not look
# for the file of a target that is marked as an XCFramework of Apple, in an existing folder.
file(GLOB_RECURSE files "/usr/lib/*/cmake/paraview-*/*Python*-targets-*.cmake")
foreach (file IN LISTS files)
  file(STRINGS "${file}" lines REGEX "_cmake_import_check_files_for_")
  foreach (line IN LISTS lines)
    string(REGEX REPLACE ".*_cmake_import_check_files_for_([^ ]+) .*" "\\1" target "${line}")
    set(_cmake_import_check_xcframework_for_${target} "${CMAKE_CURRENT_SOURCE_DIR}")
  endforeach ()
endforeach ()

# The target SurfelSplattingPoints: what the filters do with points, by PCL, Eigen and FLANN. It is compiled
# without VTK's headers, so that builds with different VTKs can link one; the modules supply the few
# functions of VTK that it calls (Common/VTKCalls.cxx, Arrays/PointColors.cxx). Of PCL only headers are used.
#
# The plugin and the wheel link an installed one, made from the same sources by the same compiler, if
# there is one in SURFELSPLATTING_CORE_PREFIX.
if (SURFELSPLATTING_CORE_PREFIX AND
    (SURFELSPLATTING_BUILD_PARAVIEW_PLUGIN OR SURFELSPLATTING_BUILD_WHEEL))
  unset(SurfelSplattingPoints_DIR CACHE) # perhaps of another prefix
  find_package(SurfelSplattingPoints QUIET PATHS "${SURFELSPLATTING_CORE_PREFIX}" NO_DEFAULT_PATH)
  if (SurfelSplattingPoints_FOUND)
    add_library(SurfelSplattingPoints ALIAS SurfelSplatting::Points)
    return()
  endif ()
endif ()

set(exact
  Cleaning/ColorVote.cxx
  Cleaning/LocalQuadric.cxx
  Neighbors/NearbyPoints.cxx
  Orientation/HeightCuts.cxx)
set(sources
  ${exact}
  Cleaning/CleaningProblem.cxx
  Cleaning/FoldFit.cxx
  Cleaning/HangingPoints.cxx
  Cleaning/NearCopies.cxx
  Cleaning/ScanDistance.cxx
  Cleaning/ScanRegistration.cxx
  Cleaning/ScanSplit.cxx
  Cleaning/Smoothing.cxx
  Cleaning/StrayPoints.cxx
  Cleaning/SurfaceDensity.cxx
  Estimation/CloudPlanes.cxx
  Estimation/ColorInterpolation.cxx
  Estimation/GivenNormals.cxx
  Estimation/IsolatedPoints.cxx
  Estimation/KernelSteering.cxx
  Estimation/LineFits.cxx
  Estimation/NearSheet.cxx
  Estimation/PlaneFitter.cxx
  Estimation/PointPlanes.cxx
  Estimation/ScanLines.cxx
  Estimation/ScannerView.cxx
  Estimation/SharpNormals.cxx
  Estimation/SheetColors.cxx
  Estimation/SurfaceHeights.cxx
  Estimation/SurfelKernel.cxx
  Estimation/ThinPoints.cxx
  Estimation/VoronoiCell.cxx
  Meshes/MeshParts.cxx
  Neighbors/AngularGap.cxx
  Neighbors/LatticeStep.cxx
  Neighbors/MortonGrid.cxx
  Neighbors/NeighborGraph.cxx
  Neighbors/NeighborSearch.cxx
  Normalization/KernelWeights.cxx
  Normalization/OwnerSheet.cxx
  Normalization/SheetKernels.cxx
  Normalization/SurfaceSamples.cxx
  Normalization/SurfelTable.cxx
  Orientation/ConsistentSets.cxx
  Orientation/Orientation.cxx
  Orientation/OrientationGraph.cxx
  Orientation/OutsideDecision.cxx
  Orientation/Rooms.cxx
  Orientation/ScannerSides.cxx
  Orientation/SignPropagation.cxx
  Orientation/ThinPlates.cxx
  Orientation/WindingNumber.cxx
  Partition/CloudRegions.cxx
  Scanners/BeamOrder.cxx
  Scanners/ScanPhase.cxx
  Scanners/ScanPlaces.cxx
  Scanners/ScanSteps.cxx)
list(TRANSFORM sources PREPEND "${CMAKE_CURRENT_LIST_DIR}/")
add_library(SurfelSplattingPoints STATIC ${sources})
target_link_libraries(SurfelSplattingPoints PUBLIC SurfelSplattingCore
  PRIVATE Eigen3::Eigen FLANN::FLANN)
target_include_directories(SurfelSplattingPoints SYSTEM PRIVATE
  "$<TARGET_PROPERTY:pcl_common,INTERFACE_INCLUDE_DIRECTORIES>")
# Makes square roots instructions, not calls that set errno, and lets loops with comparisons be
# vectorized. NaN and infinity keep their meaning.
target_compile_options(SurfelSplattingPoints PRIVATE
  -fno-math-errno -fno-trapping-math -fno-semantic-interposition)
# FLANN's search must call itself, not another copy of its templates that the loader finds. These
# files compute the same to the last bit on any processor: without products and sums in one step.
list(TRANSFORM exact PREPEND "${CMAKE_CURRENT_LIST_DIR}/")
set_source_files_properties("${CMAKE_CURRENT_LIST_DIR}/Neighbors/NeighborSearch.cxx" PROPERTIES
  COMPILE_OPTIONS "-fvisibility-inlines-hidden;-ffp-contract=off")
set_source_files_properties(${exact} PROPERTIES COMPILE_OPTIONS -ffp-contract=off)

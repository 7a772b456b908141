// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPointCloudCleaning
 * @brief   removes stray points, duplicates and noise of a scan
 *
 * Scans have points that belong to no surface. Drawn as surfels they would be discs. This filter
 * removes them, before vtkSurfelEstimation. The input is any vtkPointSet; its cells are ignored.
 * The output is a vtkPolyData with the points that are left, at the same coordinates and in the
 * same order, with their point data. If nothing is found, they are the input's own arrays.
 *
 * - Points that are not finite and exact duplicates are dropped. So are points beside another one
 *   that is ten times as near as the next, if more than 15 % of the points have one: copies with
 *   fewer digits, for example. Where normals are known, the two sides of a sheet stay.
 * - Stray points are found by the measure of pcl::StatisticalOutlierRemoval, the mean distance to
 *   the 16 nearest points, in comparison with that of these neighbours: changes of density, wires,
 *   edges and corners are kept. In sparse sets that fill space, the comparison is with the median
 *   of the cloud and with the surfaces nearest to the set.
 * - Noisy points move to the surface that PCL's moving least squares find (a quadric through 32 to
 *   160 neighbours, by the noise). Points of surfaces without noise are not moved at all: where at
 *   least one in ten of some 32768 points that are near each other is in a surface without noise,
 *   none of them moves. Two sheets become one if they have the same colours.
 * - A second scan, appended to the first one and a few spacings beside it, moves rigidly to it:
 *   along the normals, and along surfaces as far as their colours tell. It stays where it may be
 *   the other side of things: where colours differ, or some direction is unknown. Its points that
 *   then are at the place of a point of the first one are dropped as duplicates.
 * - Direct colours (the active scalars, or else the first point array, of unsigned char with three
 *   or four components) of noisy points get into their places by a vote of the neighbours, where
 *   noise along the surface has mixed them.
 * - Depth images whose 1/z is in whole steps, as those of the first Kinect, become smooth: points
 *   move along their rays by up to one and a half steps. That takes Columns and Viewpoint.
 *
 * What is dropped, moved or coloured anew is counted, and reported in one warning. The result does
 * not depend on the number of threads. Several processes clean one cloud together, as one process
 * would.
 *
 * Memory: 70 to 140 bytes per point, the most where points move; 80 more as a part of
 * vtkPointsToSurfels.
 *
 * @sa vtkSurfelEstimation
 */
#ifndef vtkPointCloudCleaning_h
#define vtkPointCloudCleaning_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"        // for the controller
#include "vtkSurfelFiltersModule.h" // for export macro

class vtkMultiProcessController;
class vtkPointSet;

namespace SurfelGeometry
{
class CleaningExecution;
struct CleaningCounts;
struct SearchedCloud;
}
namespace SurfelSplatting
{
class Ranks;
}

class VTKSURFELFILTERS_EXPORT vtkPointCloudCleaning : public vtkPolyDataAlgorithm
{
public:
  static vtkPointCloudCleaning* New();
  vtkTypeMacro(vtkPointCloudCleaning, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Whether stray points are removed, halos of photogrammetry, and mixed pixels of laser scanners
   * where points know their scanner (point array ToScanner) or Viewpoint is it. Default on.
   */
  vtkSetMacro(RemoveStrayPoints, vtkTypeBool);
  vtkGetMacro(RemoveStrayPoints, vtkTypeBool);
  vtkBooleanMacro(RemoveStrayPoints, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether noisy points move to a smooth surface, and their colours into their places. Default on.
   */
  vtkSetMacro(Smoothing, vtkTypeBool);
  vtkGetMacro(Smoothing, vtkTypeBool);
  vtkBooleanMacro(Smoothing, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Columns of a depth image, stored row by row; vtkPointCloudReader::GetDimensions() has them. 0,
   * the default: the points are no depth image. Smoothing must be on.
   */
  vtkSetClampMacro(Columns, int, 0, VTK_INT_MAX);
  vtkGetMacro(Columns, int);
  ///@}

  ///@{
  /**
   * Whether all points were scanned from Viewpoint, so that mixed pixels are removed, unless points
   * know their scanner. Default off.
   */
  vtkSetMacro(UseViewpoint, vtkTypeBool);
  vtkGetMacro(UseViewpoint, vtkTypeBool);
  vtkBooleanMacro(UseViewpoint, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Place of the sensor of a depth image, or of a scan from one place. Default 0, 0, 0.
   */
  vtkSetVector3Macro(Viewpoint, double);
  vtkGetVector3Macro(Viewpoint, double);
  ///@}

  ///@{
  /**
   * Whether the output has a point array CleaningShift with the vectors by which points were moved,
   * in world units, if any were. Default off.
   */
  vtkSetMacro(GenerateShifts, vtkTypeBool);
  vtkGetMacro(GenerateShifts, vtkTypeBool);
  vtkBooleanMacro(GenerateShifts, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether the second output holds the stray points with their point data. Default off.
   */
  vtkSetMacro(GenerateStrayPoints, vtkTypeBool);
  vtkGetMacro(GenerateStrayPoints, vtkTypeBool);
  vtkBooleanMacro(GenerateStrayPoints, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Counts of the last execution: points that were dropped because a coordinate is NaN, infinite or
   * beyond 1e17, or they are hidden (HIDDENPOINT in vtkGhostType, as blanked points of grids),
   * because an earlier point is at the same place, because they are stray, and because a second
   * scan has them where the first one has points, once it has moved there; then other points of the
   * second scan, which were moved, other points that were moved, points that got another colour,
   * and points that were left because they are no surface, where they fill space: foliage, or noise
   * of more than two spacings.
   */
  vtkGetMacro(NumberOfNonFinitePoints, vtkIdType);
  vtkGetMacro(NumberOfDuplicatePoints, vtkIdType);
  vtkGetMacro(NumberOfStrayPoints, vtkIdType);
  vtkGetMacro(NumberOfTwinPoints, vtkIdType);
  vtkGetMacro(NumberOfJoinedPoints, vtkIdType);
  vtkGetMacro(NumberOfMovedPoints, vtkIdType);
  vtkGetMacro(NumberOfRecoloredPoints, vtkIdType);
  vtkGetMacro(NumberOfThickPoints, vtkIdType);
  ///@}

  ///@{
  /**
   * The processes that clean one cloud together, or null: this process alone. All must execute the
   * filter with the same settings; each cleans its own depth images. Default: the global
   * vtkMultiProcessController, as in VTK's parallel filters.
   */
  void SetController(vtkMultiProcessController* controller);
  vtkMultiProcessController* GetController();
  ///@}

protected:
  vtkPointCloudCleaning();
  ~vtkPointCloudCleaning() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

  vtkTypeBool RemoveStrayPoints = 1;
  vtkTypeBool GenerateStrayPoints = 0;
  vtkTypeBool Smoothing = 1;
  int Columns = 0;
  vtkTypeBool UseViewpoint = 0;
  double Viewpoint[3] = { 0.0, 0.0, 0.0 };
  vtkTypeBool GenerateShifts = 0;

private:
  vtkPointCloudCleaning(const vtkPointCloudCleaning&) = delete;
  void operator=(const vtkPointCloudCleaning&) = delete;

  // The work of RequestData; 0 after an error.
  int Execute(vtkPointSet* input, vtkPolyData* output, vtkPolyData* strayPoints = nullptr);
  int Clean(vtkPointSet* input, vtkPolyData* output, vtkPolyData* strayPoints);
  bool CheckInput(vtkPointSet* input);
  void WarnOfTroubles();
#ifndef __VTK_WRAP__
  friend class vtkPartitionedSurfelEstimation;
  friend class vtkPointsToSurfels;
  bool CheckInputs(SurfelSplatting::Ranks& ranks, vtkPointSet* input);
  void Take(const SurfelGeometry::CleaningCounts& counts);
  void Write(SurfelGeometry::CleaningExecution& execution, vtkPointSet* input, vtkPolyData* output,
    vtkPolyData* strayPoints);
#endif

  vtkSmartPointer<vtkMultiProcessController> Controller;

  SurfelGeometry::SearchedCloud* Searched = nullptr; ///< what the next execution hands over, if any
  vtkIdType NumberOfNonFinitePoints = 0;
  vtkIdType NumberOfDuplicatePoints = 0;
  vtkIdType NumberOfStrayPoints = 0;
  vtkIdType NumberOfTwinPoints = 0;
  vtkIdType NumberOfJoinedPoints = 0;
  vtkIdType NumberOfMovedPoints = 0;
  vtkIdType NumberOfRecoloredPoints = 0;
  vtkIdType NumberOfThickPoints = 0;
};

#endif

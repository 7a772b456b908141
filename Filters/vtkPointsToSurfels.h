// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPointsToSurfels
 * @brief   from points to surfels that can be drawn: all filters in one
 *
 * Runs vtkPointCloudCleaning, vtkSurfelEstimation, vtkSurfelNormalization and vtkSurfelHierarchy,
 * one after another, with the settings of the filters that GetCleaning(), GetEstimation() and
 * GetNormalization() return; their counts are those of the last execution, and they tell by
 * StartEvent and EndEvent when their work begins and ends. The input is any vtkPointSet, the output
 * that of vtkSurfelHierarchy.
 *
 * Cleaning, estimation and normalization share the search for neighbours and the order of the
 * points, as long as cleaning has moved none of them, all look for the nearest ones, and for 20 at
 * most. The surfels are those of the single filters, except that a surfel's neighbours are those of
 * its point, from which the surfel is a fraction of a spacing away: on random points 3 weights in
 * 1000 differ by more than 1 %.
 *
 * Memory: about 250 bytes per point at the peak, output included; 12 more with given normals.
 *
 * Several processes: see SetController(). Each builds a hierarchy of its own surfels.
 *
 * @sa vtkPartitionedSurfelEstimation
 */
#ifndef vtkPointsToSurfels_h
#define vtkPointsToSurfels_h

#include "vtkPointsToSurfelsBase.h"
#include "vtkSurfelFiltersModule.h" // for export macro

#include <string> // for messages

class vtkMultiProcessController;
class vtkPointSet;
class vtkSurfelHierarchy;

class VTKSURFELFILTERS_EXPORT vtkPointsToSurfels : public vtkPointsToSurfelsBase
{
public:
  static vtkPointsToSurfels* New();
  vtkTypeMacro(vtkPointsToSurfels, vtkPointsToSurfelsBase);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /**
   * The last filter, for its counts.
   */
  vtkSurfelHierarchy* GetHierarchy() { return this->Hierarchy; }

  ///@{
  /**
   * Whether the output is a hierarchy; otherwise it is that of vtkSurfelNormalization.
   * Default on.
   */
  vtkSetMacro(BuildHierarchy, vtkTypeBool);
  vtkGetMacro(BuildHierarchy, vtkTypeBool);
  vtkBooleanMacro(BuildHierarchy, vtkTypeBool);
  ///@}

  ///@{
  /**
   * What UseSensor takes from the field arrays of points: the place of the sensor, world units, and
   * whether it is known; the columns of a depth image, or 0.
   */
  static bool FindViewpoint(vtkPointSet* points, double viewpoint[3]);
  static int FindColumns(vtkPointSet* points);
  ///@}

  /**
   * Sets the processes that make the surfels of one cloud together, for all filters; null: this
   * process alone. See vtkSurfelEstimation::SetController().
   */
  void SetController(vtkMultiProcessController* controller);

  vtkMTimeType GetMTime() override;

protected:
  vtkPointsToSurfels();
  ~vtkPointsToSurfels() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

  vtkTypeBool BuildHierarchy = 1;
  bool SeesBacksOfDepthImages = false; // with UseSensor; programs that turn the cloud need them

private:
  vtkPointsToSurfels(const vtkPointsToSurfels&) = delete;
  void operator=(const vtkPointsToSurfels&) = delete;

  class Execution;
  bool IsAlone();
  std::string CheckMemory(vtkPointSet* input);

  vtkNew<vtkSurfelHierarchy> Hierarchy;
};

#endif

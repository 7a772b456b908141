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

#include "vtkNew.h" // for the filters
#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelFiltersModule.h" // for export macro

#include <string> // for messages

class vtkMultiProcessController;
class vtkPointCloudCleaning;
class vtkPointSet;
class vtkSurfelEstimation;
class vtkSurfelHierarchy;
class vtkSurfelNormalization;

class VTKSURFELFILTERS_EXPORT vtkPointsToSurfels : public vtkPolyDataAlgorithm
{
public:
  static vtkPointsToSurfels* New();
  vtkTypeMacro(vtkPointsToSurfels, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The filters, for their settings and counts; they have no connections.
   */
  vtkPointCloudCleaning* GetCleaning() { return this->Cleaning; }
  vtkSurfelEstimation* GetEstimation() { return this->Estimation; }
  vtkSurfelNormalization* GetNormalization() { return this->Normalization; }
  vtkSurfelHierarchy* GetHierarchy() { return this->Hierarchy; }
  ///@}

  ///@{
  /**
   * Whether the points are cleaned first. Default on.
   */
  vtkSetMacro(CleanPoints, vtkTypeBool);
  vtkGetMacro(CleanPoints, vtkTypeBool);
  vtkBooleanMacro(CleanPoints, vtkTypeBool);
  ///@}

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
   * Whether what the input's field arrays ScanViewpoint, ScanBounds and ScanDimensions say of the
   * sensor (vtkPointCloudReader writes them; Documentation/DataContract.md) is used where nothing
   * else is set: the steps of a depth image are smoothed if GetCleaning() has no columns, and
   * surfels face the viewpoint if GetEstimation() has the orientation CONSISTENT without
   * UseViewpoint. Not for points that were moved, cut or merged. Where the field arrays tell no
   * viewpoint, surfels face the scanners to which the point array ToScanner leads, if there is one.
   * Default on.
   */
  vtkSetMacro(UseSensor, vtkTypeBool);
  vtkGetMacro(UseSensor, vtkTypeBool);
  vtkBooleanMacro(UseSensor, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Number of nearest neighbours from which a normal is estimated. Default 0: as GetEstimation()
   * says, but 30 for depth images, which are noisy along the line of sight.
   */
  vtkSetClampMacro(NumberOfNeighbors, int, 0, 256);
  vtkGetMacro(NumberOfNeighbors, int);
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

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

  vtkTypeBool CleanPoints = 1;
  vtkTypeBool BuildHierarchy = 1;
  vtkTypeBool UseSensor = 1;
  int NumberOfNeighbors = 0;

private:
  vtkPointsToSurfels(const vtkPointsToSurfels&) = delete;
  void operator=(const vtkPointsToSurfels&) = delete;

  class Execution;
  bool IsAlone();
  std::string CheckMemory(vtkPointSet* input);

  vtkNew<vtkPointCloudCleaning> Cleaning;
  vtkNew<vtkSurfelEstimation> Estimation;
  vtkNew<vtkSurfelNormalization> Normalization;
  vtkNew<vtkSurfelHierarchy> Hierarchy;
};

#endif

// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPointsToSurfelsBase
 * @brief   superclass of the filters that make surfels of points
 *
 * This class has the filters for cleaning, estimation and normalization, and the settings that are
 * those of all of them. The input is any vtkPointSet.
 *
 * @sa vtkPointsToSurfels vtkPartitionedSurfelEstimation
 */
#ifndef vtkPointsToSurfelsBase_h
#define vtkPointsToSurfelsBase_h

#include "vtkNew.h" // for the filters
#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"        // for the input
#include "vtkSurfelFiltersModule.h" // for export macro

class vtkFloatArray;
class vtkPointCloudCleaning;
class vtkPointSet;
class vtkSurfelEstimation;
class vtkSurfelNormalization;

namespace SurfelGeometry
{
struct ScanSensor;
}

class VTKSURFELFILTERS_EXPORT vtkPointsToSurfelsBase : public vtkPolyDataAlgorithm
{
public:
  vtkTypeMacro(vtkPointsToSurfelsBase, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The filters, for their settings and counts; they have no connections.
   */
  vtkPointCloudCleaning* GetCleaning() { return this->Cleaning; }
  vtkSurfelEstimation* GetEstimation() { return this->Estimation; }
  vtkSurfelNormalization* GetNormalization() { return this->Normalization; }
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
   * Whether what the input's field arrays ScanViewpoint, ScanBounds and ScanDimensions say of the
   * sensor (vtkPointCloudReader writes them; Documentation/DataContract.md) is used where nothing
   * else is set: the steps of a depth image are smoothed if GetCleaning() has no columns, and
   * surfels face the viewpoint if GetEstimation() has the orientation CONSISTENT without
   * UseViewpoint. Not for points that were moved, cut or merged. Where the field arrays tell no
   * viewpoint, surfels face the scanners to which the point array ToScanner leads, if there is one,
   * or those that FindScannersByOrder() finds, unless several processes have the pieces of the
   * cloud. Default on.
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

  /**
   * Finds from where the points were scanned, if they are in the order in which one scanner after
   * another has measured them: the steps of a scanner are nearly the same angle, also where one
   * surface ends and another begins behind it. Clouds that were shuffled, sorted or thinned at
   * random do not tell.
   * @param points double or float; those that are not finite are passed over
   * @param toScanner becomes the point array "ToScanner": vectors from the points to their
   * scanners, three components, world units, 0 where none is known
   * @return whether any scanner was found; if not, toScanner stays as it is
   */
  static bool FindScannersByOrder(vtkPointSet* points, vtkFloatArray* toScanner);

  vtkMTimeType GetMTime() override;

protected:
  vtkPointsToSurfelsBase();
  ~vtkPointsToSurfelsBase() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;

  /// The input; with the scanners that FindScannersByOrder() finds, if nothing else tells them.
  vtkSmartPointer<vtkPointSet> WithScanners(vtkPointSet* input, SurfelGeometry::ScanSensor& sensor);

  vtkTypeBool CleanPoints = 1;
  vtkTypeBool UseSensor = 1;
  int NumberOfNeighbors = 0;
  vtkNew<vtkPointCloudCleaning> Cleaning;
  vtkNew<vtkSurfelEstimation> Estimation;
  vtkNew<vtkSurfelNormalization> Normalization;

private:
  vtkPointsToSurfelsBase(const vtkPointsToSurfelsBase&) = delete;
  void operator=(const vtkPointsToSurfelsBase&) = delete;
};

#endif

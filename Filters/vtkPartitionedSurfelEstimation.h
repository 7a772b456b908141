// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPartitionedSurfelEstimation
 * @brief   normalized surfels of a cloud that is too large to process at once
 *
 * Cleans the cloud by vtkPointCloudCleaning, all at once, and cuts it into boxes of at most
 * PointsPerPart points. Runs vtkSurfelEstimation and vtkSurfelNormalization, with the settings of
 * GetEstimation() and GetNormalization(), on one box after another, each with a halo of points
 * around it, and keeps the surfels of the box itself. The input is a vtkPointSet.
 * The output is that of vtkSurfelNormalization: one surfel for each point that is not dropped, in
 * the order of the input, with its point data. Besides input and output (53 bytes per point) the
 * filter takes 12 bytes per point of the cloud, and for one part at a time the memory of
 * vtkSurfelEstimation (see there); before that, what the cleaning takes.
 *
 * The surfels are those of the whole cloud: the halo of a part is as wide as its neighbourhoods
 * reach. Single points whose neighbours may be farther away are counted (NumberOfDoubtfulSurfels).
 * Weights differ by the normalization's random samples.
 *
 * The outside of a surface cannot be decided from a part of it. So CONSISTENT orientation is
 * TWO_SIDED where no normals tell it; GetEstimation() has the worst NormalsUse of all parts. A
 * cloud of one part keeps CONSISTENT. Scanners tell the sides of parts, too (SCANNERS).
 *
 * @sa vtkSurfelEstimation vtkSurfelNormalization
 */
#ifndef vtkPartitionedSurfelEstimation_h
#define vtkPartitionedSurfelEstimation_h

#include "vtkPointsToSurfelsBase.h"
#include "vtkSurfelFiltersModule.h" // for export macro

#include <string> // for messages

class vtkPointSet;

class VTKSURFELFILTERS_EXPORT vtkPartitionedSurfelEstimation : public vtkPointsToSurfelsBase
{
public:
  static vtkPartitionedSurfelEstimation* New();
  vtkTypeMacro(vtkPartitionedSurfelEstimation, vtkPointsToSurfelsBase);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Largest number of points in a part (more if many share a coordinate). Default 10 million, range
   * 1000 to 2^30.
   */
  vtkSetClampMacro(PointsPerPart, vtkIdType, 1000, vtkIdType(1) << 30);
  vtkGetMacro(PointsPerPart, vtkIdType);
  ///@}

  ///@{
  /**
   * Counts of the last execution: parts; points that were dropped besides those that GetCleaning()
   * counts, as in vtkSurfelEstimation; surfels whose neighbours may lie beyond the halo of their
   * part.
   */
  vtkGetMacro(NumberOfParts, int);
  vtkGetMacro(NumberOfNonFinitePoints, vtkIdType);
  vtkGetMacro(NumberOfDuplicatePoints, vtkIdType);
  vtkGetMacro(NumberOfDoubtfulSurfels, vtkIdType);
  ///@}

protected:
  vtkPartitionedSurfelEstimation();
  ~vtkPartitionedSurfelEstimation() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

  vtkIdType PointsPerPart = 10000000;

private:
  vtkPartitionedSurfelEstimation(const vtkPartitionedSurfelEstimation&) = delete;
  void operator=(const vtkPartitionedSurfelEstimation&) = delete;

  class Execution;

  bool Clean(vtkPointSet* input, vtkPolyData* output, std::string& error);
  int EndEarly(const std::string& error);
  void WarnOfTroubles();

  int NumberOfParts = 0;
  vtkIdType NumberOfNonFinitePoints = 0;
  vtkIdType NumberOfDuplicatePoints = 0;
  vtkIdType NumberOfDoubtfulSurfels = 0;
};

#endif

// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPartitionedSurfelEstimation
 * @brief   normalized surfels of a cloud too large to be worked on at once
 *
 * Cuts the cloud into boxes of at most PointsPerPart points and runs vtkSurfelEstimation and
 * vtkSurfelNormalization on one after the other, each with the points about it; of the surfels,
 * those of the box itself are kept. Input is a vtkPointSet, output as vtkSurfelNormalization's: one
 * surfel for each point that is left, in the order of the input, with its point data. Besides input
 * and output (53 bytes a point) it takes 12 bytes a point and the memory of one part, where
 * vtkSurfelEstimation takes 340 bytes a point.
 *
 * The surfels are those of the whole cloud: a part's border is as wide as its neighbourhoods ask
 * for. Where single points have neighbours farther away than that, they are counted
 * (NumberOfDoubtfulSurfels). Weights differ by the normalization's random samples.
 *
 * What is outside cannot be told by a part: in place of CONSISTENT orientation the surfels are as
 * the normals that are given say, or two-sided. A cloud of one part is worked on as it is.
 *
 * @sa vtkSurfelEstimation vtkSurfelNormalization
 */
#ifndef vtkPartitionedSurfelEstimation_h
#define vtkPartitionedSurfelEstimation_h

#include "vtkNew.h" // for the filters
#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelFiltersModule.h" // for export macro

class vtkPointSet;
class vtkSurfelEstimation;
class vtkSurfelNormalization;

class VTKSURFELFILTERS_EXPORT vtkPartitionedSurfelEstimation : public vtkPolyDataAlgorithm
{
public:
  static vtkPartitionedSurfelEstimation* New();
  vtkTypeMacro(vtkPartitionedSurfelEstimation, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Points of a part, at most (more where many share a coordinate). Default 4 million, range 1000
   * to 2^30. Each takes about 400 bytes while its part is worked on.
   */
  vtkSetClampMacro(PointsPerPart, vtkIdType, 1000, vtkIdType(1) << 30);
  vtkGetMacro(PointsPerPart, vtkIdType);
  ///@}

  ///@{
  /**
   * The settings of all parts. These filters are not executed.
   */
  vtkSurfelEstimation* GetEstimation() { return this->Estimation; }
  vtkSurfelNormalization* GetNormalization() { return this->Normalization; }
  ///@}

  vtkMTimeType GetMTime() override;

  ///@{
  /**
   * Of the last execution: parts; points that were dropped, as in vtkSurfelEstimation; surfels
   * whose neighbours may lie beyond the border of their part.
   */
  vtkGetMacro(NumberOfParts, int);
  vtkGetMacro(NumberOfNonFinitePoints, vtkIdType);
  vtkGetMacro(NumberOfDuplicatePoints, vtkIdType);
  vtkGetMacro(NumberOfDoubtfulSurfels, vtkIdType);
  ///@}

protected:
  vtkPartitionedSurfelEstimation();
  ~vtkPartitionedSurfelEstimation() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

  vtkIdType PointsPerPart = 4000000;

private:
  vtkPartitionedSurfelEstimation(const vtkPartitionedSurfelEstimation&) = delete;
  void operator=(const vtkPartitionedSurfelEstimation&) = delete;

  class Execution;

  vtkNew<vtkSurfelEstimation> Estimation;
  vtkNew<vtkSurfelNormalization> Normalization;
  int NumberOfParts = 0;
  vtkIdType NumberOfNonFinitePoints = 0;
  vtkIdType NumberOfDuplicatePoints = 0;
  vtkIdType NumberOfDoubtfulSurfels = 0;
};

#endif

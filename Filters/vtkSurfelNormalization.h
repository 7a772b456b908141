// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelNormalization
 * @brief   weights surfels so that their kernels sum to one over the surface
 *
 * Scales each SurfelAreaVector by a weight (Documentation/DataContract.md), and adds SurfelOverlap;
 * nothing else of the surfels changes. The weights of Zwicker et al. 2001 and Ren, Pfister and
 * Zwicker 2002 make the sum one at the points. A point sits on the peak of its own kernel, so such
 * weights lose mass. Here the sum is one over the surface: at up to SamplesPerPoint samples around
 * each point, those for which the point is the nearest, by NumberOfIterations Richardson-Lucy
 * steps. The sum of the areas is then the area of the surface.
 *
 * Kernels of another sheet do not count: those whose plane is too far away (NormalOffset), those
 * whose normals differ by more than 134 degrees, and pairs of which only one surfel is two-sided.
 * At folds, as at the edges of boxes, kernels of the other side are those of the unrolled surface.
 * Where the plane is not farther than three times NormalOffset, sheets such as leaves and the
 * layers of a noisy scan overlap: in focus the nearest hides the others, but a lens blurs them
 * together, and their sum would be too large. SurfelOverlap is the share of its weight that a
 * surfel then loses: all of it behind another sheet, nothing in front. Two-sided surfels and noise,
 * of which none is in front, all lose the share of the sum that is not of their own sheet.
 *
 * The result does not depend on the number of threads, nor on a renderer's cut-off. Several
 * processes with a controller weight the surfels of one cloud together, as in vtkSurfelEstimation;
 * sums are measured over the whole cloud, total areas over a process's region. Memory: see
 * vtkSurfelEstimation.
 *
 * @sa vtkSurfelEstimation
 */
#ifndef vtkSurfelNormalization_h
#define vtkSurfelNormalization_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"        // for the controller
#include "vtkSurfelFiltersModule.h" // for export macro

class vtkMultiProcessController;
class vtkPolyData;

namespace SurfelGeometry
{
struct SurfelNeighbors;
}
namespace SurfelSplatting
{
class Ranks;
}

class VTKSURFELFILTERS_EXPORT vtkSurfelNormalization : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfelNormalization* New();
  vtkTypeMacro(vtkSurfelNormalization, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Samples around each surfel; those in its own cell count, about one in five. Default 16, range 1
   * to 256; 8 samples overestimate the total area by 1 %.
   */
  vtkSetClampMacro(SamplesPerPoint, int, 1, 256);
  vtkGetMacro(SamplesPerPoint, int);
  ///@}

  ///@{
  /**
   * Number of Richardson-Lucy steps. Default 12, range 0 (only measures) to 1000.
   */
  vtkSetClampMacro(NumberOfIterations, int, 0, 1000);
  vtkGetMacro(NumberOfIterations, int);
  ///@}

  ///@{
  /**
   * Number of nearest surfels whose kernels may reach a surfel's samples. Wider kernels need more:
   * they reach sqrt(2 Support) standard deviations. Default 20, range 6 to 255.
   * With 40, 2 to 4 in 1000 weights on random points changed by more than 1 %.
   */
  vtkSetClampMacro(NumberOfNeighbors, int, 6, 255);
  vtkGetMacro(NumberOfNeighbors, int);
  ///@}

  ///@{
  /**
   * Kernels end where their exponent q/2 reaches this: at sqrt(2 Support) standard deviations.
   * Default 4, range 1 to 8.
   */
  vtkSetClampMacro(Support, double, 1.0, 8.0);
  vtkGetMacro(Support, double);
  ///@}

  ///@{
  /**
   * Radius of the disc of samples in spacings (square roots of the area per point).
   * Default 1.2, range 0.5 to 3.
   */
  vtkSetClampMacro(SampleRadius, double, 0.5, 3.0);
  vtkGetMacro(SampleRadius, double);
  ///@}

  ///@{
  /**
   * A kernel counts at samples up to this many standard deviations off its plane.
   * Default 2, range 0.1 to 100.
   */
  vtkSetClampMacro(NormalOffset, double, 0.1, 100.0);
  vtkGetMacro(NormalOffset, double);
  ///@}

  ///@{
  /**
   * Bounds of a surfel's weight, for borders and outliers. Defaults 0.25
   * (range 0 to 1) and 4 (range 1 to 1000).
   */
  vtkSetClampMacro(MinimumFactor, double, 0.0, 1.0);
  vtkGetMacro(MinimumFactor, double);
  vtkSetClampMacro(MaximumFactor, double, 1.0, 1000.0);
  vtkGetMacro(MaximumFactor, double);
  ///@}

  /**
   * Takes over all settings of another filter; the controller stays.
   */
  void CopySettings(vtkSurfelNormalization* other);

  ///@{
  /**
   * The sum of the kernels over the samples before and after the last execution.
   */
  vtkGetMacro(MeanBefore, double);
  vtkGetMacro(StandardDeviationBefore, double);
  vtkGetMacro(MinimumBefore, double);
  vtkGetMacro(MaximumBefore, double);
  vtkGetMacro(MeanAfter, double);
  vtkGetMacro(StandardDeviationAfter, double);
  vtkGetMacro(MinimumAfter, double);
  vtkGetMacro(MaximumAfter, double);
  ///@}

  ///@{
  /**
   * Sum of the areas before and after the last execution, world units squared.
   */
  vtkGetMacro(TotalAreaBefore, double);
  vtkGetMacro(TotalAreaAfter, double);
  ///@}

  ///@{
  /**
   * Counts of the last execution: samples; surfels that were left unchanged because they are
   * unusable (values not finite, no area, no extent); and surfels with the weight 0, because
   * another surfel has the same position.
   */
  vtkGetMacro(NumberOfSamples, vtkIdType);
  vtkGetMacro(NumberOfUnusableSurfels, vtkIdType);
  vtkGetMacro(NumberOfDuplicateSurfels, vtkIdType);
  ///@}

  ///@{
  /**
   * The processes that have parts of one cloud, see vtkSurfelEstimation::SetController().
   */
  void SetController(vtkMultiProcessController* controller);
  vtkMultiProcessController* GetController();
  ///@}

protected:
  vtkSurfelNormalization();
  ~vtkSurfelNormalization() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

  int SamplesPerPoint = 16;
  int NumberOfIterations = 12;
  int NumberOfNeighbors = 20;
  double Support = 4.0;
  double SampleRadius = 1.2;
  double NormalOffset = 2.0;
  double MinimumFactor = 0.25;
  double MaximumFactor = 4.0;

private:
  vtkSurfelNormalization(const vtkSurfelNormalization&) = delete;
  void operator=(const vtkSurfelNormalization&) = delete;

  class Execution;
  void ResetReport();
  bool CheckInput(vtkPolyData* input);
  void WarnOfTroubles();
  int Execute(vtkPolyData* input, vtkPolyData* output);
  int ExecuteAlone(vtkPolyData* input, vtkPolyData* output);
#ifndef __VTK_WRAP__
  friend class vtkPointsToSurfels;
  int RequestDistributed(SurfelSplatting::Ranks& ranks, vtkPolyData* input, vtkPolyData* output);
#endif

  vtkSmartPointer<vtkMultiProcessController> Controller;
  SurfelGeometry::SurfelNeighbors* Neighbors = nullptr; ///< those of the next input, if any
  double MeanBefore = 0.0;
  double StandardDeviationBefore = 0.0;
  double MinimumBefore = 0.0;
  double MaximumBefore = 0.0;
  double MeanAfter = 0.0;
  double StandardDeviationAfter = 0.0;
  double MinimumAfter = 0.0;
  double MaximumAfter = 0.0;
  double TotalAreaBefore = 0.0;
  double TotalAreaAfter = 0.0;
  vtkIdType NumberOfSamples = 0;
  vtkIdType NumberOfUnusableSurfels = 0;
  vtkIdType NumberOfDuplicateSurfels = 0;
};

#endif

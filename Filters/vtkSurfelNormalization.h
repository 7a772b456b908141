// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelNormalization
 * @brief   weights surfels so that their kernels sum to one over the surface
 *
 * Scales each SurfelAreaVector by a weight (Documentation/DataContract.md); nothing else of the
 * surfels changes. The weights of Zwicker et al. 2001 and Ren, Pfister and Zwicker 2002 make the
 * sum one at the points. A point sits on the peak of its own kernel, so that such weights lose
 * mass; here the sum is one over the surface: at SamplesPerPoint places about each point, kept
 * where that point is the nearest one, by NumberOfIterations Richardson-Lucy steps. The total of
 * the areas then is the surface's area.
 *
 * Kernels of another sheet do not count: those whose plane is too far away (NormalOffset), that
 * face the other way, or of which only one is two-sided.
 *
 * The result does not depend on the number of threads, nor on any cut-off of a renderer. With a
 * controller of several processes all of them weight one cloud's surfels, as vtkSurfelEstimation
 * estimates them; sums are measured over all of it, total areas over a process's
 * region.
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
   * Samples drawn about each surfel, of which those in its own cell (about one in five) count.
   * Default 16, range 1 to 256: 8 overestimate the total area by 1 %.
   */
  vtkSetClampMacro(SamplesPerPoint, int, 1, 256);
  vtkGetMacro(SamplesPerPoint, int);
  ///@}

  ///@{
  /**
   * Richardson-Lucy steps. Default 12, range 0 (which only measures) to 1000.
   */
  vtkSetClampMacro(NumberOfIterations, int, 0, 1000);
  vtkGetMacro(NumberOfIterations, int);
  ///@}

  ///@{
  /**
   * Nearest surfels that are looked at about each surfel. Wider kernels need more: they reach
   * sqrt(2 Support) standard deviations. Default 24, range 6 to 256.
   */
  vtkSetClampMacro(NumberOfNeighbors, int, 6, 256);
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
   * A kernel counts at places up to this many standard deviations off its plane.
   * Default 2, range 0.1 to 100.
   */
  vtkSetClampMacro(NormalOffset, double, 0.1, 100.0);
  vtkGetMacro(NormalOffset, double);
  ///@}

  ///@{
  /**
   * Bounds of a surfel's weight, so that borders and outliers stay bounded. Defaults 0.25
   * (range 0 to 1) and 4 (range 1 to 1000).
   */
  vtkSetClampMacro(MinimumFactor, double, 0.0, 1.0);
  vtkGetMacro(MinimumFactor, double);
  vtkSetClampMacro(MaximumFactor, double, 1.0, 1000.0);
  vtkGetMacro(MaximumFactor, double);
  ///@}

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
   * Samples of the last execution; surfels that took no part and were left as they were (values
   * not finite, no area, no extent); and surfels whose weight became 0, because another surfel
   * has the same position.
   */
  vtkGetMacro(NumberOfSamples, vtkIdType);
  vtkGetMacro(NumberOfUnusableSurfels, vtkIdType);
  vtkGetMacro(NumberOfDuplicateSurfels, vtkIdType);
  ///@}

  ///@{
  /**
   * The processes that have parts of one cloud; see vtkSurfelEstimation::SetController().
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
  int NumberOfNeighbors = 24;
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
#ifndef __VTK_WRAP__
  int RequestDistributed(SurfelSplatting::Ranks& ranks, vtkPolyData* input, vtkPolyData* output);
#endif

  vtkSmartPointer<vtkMultiProcessController> Controller;
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

// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelEstimation
 * @brief   surfels from points: normals, sides, spacing and reconstruction kernels
 *
 * Turns the points of any vtkPointSet into surfels as Documentation/DataContract.md defines
 * them: positions relative to a local origin, the arrays SurfelCovariance, SurfelAreaVector,
 * SurfelTwoSided and SurfelOverlap (0 until the surfels are normalized), and every point array of
 * the input, with direct colours as InterpolateColors says. Cells of the input are ignored; the
 * output has one poly-vertex, so that any mapper can draw its points.
 *
 * Steps:
 * 1. Points that are not finite and exact duplicates are dropped.
 * 2. A k-d tree (FLANN's) finds the neighbours of each point: the NumberOfNeighbors nearest, or
 *    those within Radius. Their covariance gives the normal and the area that the point represents;
 *    the spacing is the square root of that area.
 * 3. Normals are turned outward, see OrientationMode. A surfel whose outside is unknown is marked
 *    two-sided: a wrong outside makes a hole in the picture.
 * 4. The reconstruction kernel is a Gaussian in the tangent plane, made from the point's Voronoi
 *    cell on the surface, or from the spacing alone: see KernelMode. Kernels of cells move along
 *    the normal by a part of the spacing, onto the surface that the normals describe: noise
 *    shrinks.
 *
 * Problems are counted (see the GetNumberOf... methods) and reported in one warning.
 *
 * The result does not depend on the number of threads.
 *
 * Memory: about 235 bytes per point at the peak, output included; vtkSurfelNormalization takes
 * less.
 *
 * Several processes with a controller, each with a part of a cloud (or nothing), estimate the
 * surfels of one cloud. The points are distributed by location: each process works on a region with
 * a halo around it, and the surfels return to the processes that have the points. Process 0 orients
 * the whole cloud, which takes it about 400 bytes for each point of the cloud. Each process counts
 * the problems of its region, but the dropped points of its own input.
 *
 * @sa vtkSurfelNormalization
 */
#ifndef vtkSurfelEstimation_h
#define vtkSurfelEstimation_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"        // for the controller
#include "vtkSurfelFiltersModule.h" // for export macro

#include <string> // for messages

class vtkMultiProcessController;
class vtkPointSet;
class vtkPolyData;

namespace SurfelGeometry
{
struct EstimationCounts;
struct EstimationSettings;
struct SearchedCloud;
struct SurfelNeighbors;
}
namespace SurfelSplatting
{
class Ranks;
}

class VTKSURFELFILTERS_EXPORT vtkSurfelEstimation : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfelEstimation* New();
  vtkTypeMacro(vtkSurfelEstimation, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum NeighborhoodModes
  {
    K_NEAREST = 0,
    RADIUS = 1
  };
  enum KernelModes
  {
    CIRCULAR = 0,
    ELLIPTICAL = 1,
    CELL = 2
  };
  enum OrientationModes
  {
    CONSISTENT = 0,
    VIEWPOINT = 1,
    AS_GIVEN = 2,
    TWO_SIDED = 3,
    SCANNERS = 4
  };
  enum NormalsUses
  {
    NO_NORMALS = 0,
    NORMALS_KEPT = 1,
    NORMALS_WITHOUT_SIDES = 2,
    NORMALS_DROPPED = 3
  };

  ///@{
  /**
   * Which neighbours of a point are used: the NumberOfNeighbors nearest (K_NEAREST, the default),
   * or all within Radius, but not more than the MaximumNumberOfNeighbors nearest (RADIUS). A
   * point with fewer than 6 within the radius uses its 6 nearest.
   */
  vtkSetClampMacro(NeighborhoodMode, int, K_NEAREST, RADIUS);
  vtkGetMacro(NeighborhoodMode, int);
  void SetNeighborhoodModeToKNearest() { this->SetNeighborhoodMode(K_NEAREST); }
  void SetNeighborhoodModeToRadius() { this->SetNeighborhoodMode(RADIUS); }
  ///@}

  ///@{
  /**
   * Number of nearest neighbours for K_NEAREST, without the point itself.
   * Default 16, range 4 to 256. More for noisy scans; fewer cost accuracy on thin tubes.
   */
  vtkSetClampMacro(NumberOfNeighbors, int, 4, 256);
  vtkGetMacro(NumberOfNeighbors, int);
  ///@}

  ///@{
  /**
   * Radius for RADIUS, world units. Default 0, which is an error in that mode.
   */
  vtkSetClampMacro(Radius, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(Radius, double);
  ///@}

  ///@{
  /**
   * Largest number of neighbours within Radius. Default 128, range 6 to 4096.
   */
  vtkSetClampMacro(MaximumNumberOfNeighbors, int, 6, 4096);
  vtkGetMacro(MaximumNumberOfNeighbors, int);
  ///@}

  ///@{
  /**
   * Shape of the kernels.
   * - CIRCULAR: round, with the standard deviation KernelScale times the spacing.
   * - ELLIPTICAL: of the same area, stretched like the distribution of the neighbours.
   * - CELL (default): area, centroid and covariance of the point's Voronoi cell on the surface,
   *   blurred by CellBlur, and long along edges of the colours (InterpolateColors). The surfel sits
   *   at the cell's centroid, a fraction of the spacing from the point, in its tangent plane. Cells
   *   tile the surface, so these kernels sum to one where the others leave holes and heaps. On
   *   random samplings the standard deviation of their sum is 0.13 before normalization; that of
   *   round kernels is 0.30 before and 0.18 after. At folds, as at the edges of boxes, the cells of
   *   both sides meet. Sharp pictures were 1.4 to 1.7 dB nearer to a ray tracer's.
   */
  vtkSetClampMacro(KernelMode, int, CIRCULAR, CELL);
  vtkGetMacro(KernelMode, int);
  void SetKernelModeToCircular() { this->SetKernelMode(CIRCULAR); }
  void SetKernelModeToElliptical() { this->SetKernelMode(ELLIPTICAL); }
  void SetKernelModeToCell() { this->SetKernelMode(CELL); }
  ///@}

  ///@{
  /**
   * For CIRCULAR and ELLIPTICAL: standard deviation of the kernel over the spacing. Default 0.5,
   * range 0.1 to 4. Below 0.45 the surface gets holes, above 0.6 it gets blurred.
   */
  vtkSetClampMacro(KernelScale, double, 0.1, 4.0);
  vtkGetMacro(KernelScale, double);
  ///@}

  ///@{
  /**
   * For CELL: standard deviation of the blur over the spacing. Default 0.28, range 0.1 to 4.
   * Below 0.2 the sum of the kernels ripples, above 0.4 the surface gets blurred.
   */
  vtkSetClampMacro(CellBlur, double, 0.1, 4.0);
  vtkGetMacro(CellBlur, double);
  ///@}

  ///@{
  /**
   * Largest ratio of a kernel's longer to its shorter axis. Default 4, range 1 to 100.
   */
  vtkSetClampMacro(MaximumAxisRatio, double, 1.0, 100.0);
  vtkGetMacro(MaximumAxisRatio, double);
  ///@}

  ///@{
  /**
   * Whether normals of the input (its active normals, or a point array "Normals") are kept.
   * Their signs are then the orientation too, unless OrientationMode is VIEWPOINT or TWO_SIDED.
   * Where the points around have another slope, and not by chance, kernels and area vectors follow
   * the points, so that no gaps open between surfels; the array of the normals stays as it is.
   * Points whose normal is zero or not finite get an estimated one.
   *
   * Unless OrientationMode is AS_GIVEN, or vtkPointsOnFaces took them from faces, a sample tells
   * whether they are those of the surface (see GetNormalsUse). If neighbours in one plane have
   * opposite ones, their signs tell nothing, and sides are those of points without normals. Normals
   * that are not across the planes of the points are not used. Default on.
   */
  vtkSetMacro(KeepNormals, vtkTypeBool);
  vtkGetMacro(KeepNormals, vtkTypeBool);
  vtkBooleanMacro(KeepNormals, vtkTypeBool);
  ///@}

  ///@{
  /**
   * With KeepNormals: the point array with the normals. Default none. If the input has no array of
   * this name, its active normals are used, or the array "Normals".
   */
  vtkSetStringMacro(NormalsArrayName);
  vtkGetStringMacro(NormalsArrayName);
  ///@}

  ///@{
  /**
   * Which side of a surfel is its outside.
   * - CONSISTENT (default): signs are propagated over neighbours; closed components, tubes whose
   *   ends stick in other things, and thin plates of two sheets are turned outward and are
   *   one-sided; rooms that were scanned from inside are turned inward; open or undecided ones are
   *   two-sided, unless UseViewpoint.
   * - VIEWPOINT: every surfel faces Viewpoint and is one-sided. For scans from one place.
   * - AS_GIVEN: the kept normals decide, one-sided. An error if there are none to keep.
   * - TWO_SIDED: every surfel is visible from both sides.
   * - SCANNERS: every surfel faces the scanner of its point, to which the vectors in the point
   * array ToScanner lead (Documentation/DataContract.md), and is one-sided. For scans from several
   *   places. Where a single point does not tell, at edges, in noise and where a scanner looks
   * along a surface, its neighbours decide; what nothing tells is two-sided. Given normals stay.
   */
  vtkSetClampMacro(OrientationMode, int, CONSISTENT, SCANNERS);
  vtkGetMacro(OrientationMode, int);
  void SetOrientationModeToConsistent() { this->SetOrientationMode(CONSISTENT); }
  void SetOrientationModeToViewpoint() { this->SetOrientationMode(VIEWPOINT); }
  void SetOrientationModeToAsGiven() { this->SetOrientationMode(AS_GIVEN); }
  void SetOrientationModeToTwoSided() { this->SetOrientationMode(TWO_SIDED); }
  void SetOrientationModeToScanners() { this->SetOrientationMode(SCANNERS); }
  ///@}

  ///@{
  /**
   * Position of the sensor, world units. Default (0, 0, 0). Used by VIEWPOINT, and by
   * CONSISTENT and TWO_SIDED if UseViewpoint is on.
   */
  vtkSetVector3Macro(Viewpoint, double);
  vtkGetVector3Macro(Viewpoint, double);
  ///@}

  ///@{
  /**
   * For CONSISTENT: components that are not closed face Viewpoint, one-sided, where more than
   * 80 % of their facing area agrees. For TWO_SIDED: the area vectors point to its side. Default
   * off.
   */
  vtkSetMacro(UseViewpoint, vtkTypeBool);
  vtkGetMacro(UseViewpoint, vtkTypeBool);
  vtkBooleanMacro(UseViewpoint, vtkTypeBool);
  ///@}

  ///@{
  /**
   * A point is isolated if the distance to its sixth neighbour exceeds IsolationFactor times the
   * median of that distance among its neighbours, or IsolationFactor squared times the median of
   * the whole cloud, or if it is off the planes of its neighbours, all of which are about as far,
   * half of IsolationFactor times the median of their distances. It gets the median spacing of its
   * neighbours, and is two-sided in CONSISTENT. So is a point whose neighbours lie in no plane, at
   * 2 IsolationFactor times the usual distance; it gets at most IsolationFactor times the usual
   * spacing. What is usual in the cloud does not count where a surface goes on that is as sparse.
   * Default 6, range 2 to 1000.
   */
  vtkSetClampMacro(IsolationFactor, double, 2.0, 1000.0);
  vtkGetMacro(IsolationFactor, double);
  ///@}

  ///@{
  /**
   * Whether direct colours (the active scalars, or else the first point array, of unsigned char
   * with three or four components) are changed so that the splatted surface has the colours of the
   * points at the points: kernels blur a texture, and c = s + (s - C[s]), where C[s] is the mean of
   * the neighbours' colours s under the kernels, undoes most of that. The mean over an area stays.
   * Kernels of CELL are also steered: up to 1.8 times as long along the edges of a texture, and
   * narrower across them by as much. Pictures are up to 3.1 dB nearer to a ray tracer's. Surfels
   * as input keep their colours, and get round kernels. Default on.
   */
  vtkSetMacro(InterpolateColors, vtkTypeBool);
  vtkGetMacro(InterpolateColors, vtkTypeBool);
  vtkBooleanMacro(InterpolateColors, vtkTypeBool);
  ///@}

  ///@{
  /**
   * The processes that have parts of one cloud. Executions are collective calls; all processes need
   * the same settings. Default: the global vtkMultiProcessController, as in VTK's parallel filters.
   * With none, or one of a single process, the filter works on this process's points alone.
   */
  void SetController(vtkMultiProcessController* controller);
  vtkMultiProcessController* GetController();
  ///@}

  /**
   * Takes over all settings of another filter; the controller stays.
   */
  void CopySettings(vtkSurfelEstimation* other);

  ///@{
  /**
   * Counts of the last execution.
   * - NonFinitePoints: dropped; a coordinate was NaN, infinite or beyond 1e17, or the point is
   *   hidden (HIDDENPOINT in vtkGhostType, as blanked points of grids).
   * - DuplicatePoints: dropped; same position as an earlier point.
   * - IsolatedPoints: kept with a bounded radius, see IsolationFactor.
   * - DegeneratePoints: kept; fewer than three neighbours or all of them on a line, so that
   *   the direction of the normal is arbitrary.
   * - InvalidNormals: points whose given normal was zero or not finite.
   * - TwoSidedSurfels, Components, ClosedComponents: in the output; only CONSISTENT and SCANNERS
   *   count components.
   */
  vtkGetMacro(NumberOfNonFinitePoints, vtkIdType);
  vtkGetMacro(NumberOfDuplicatePoints, vtkIdType);
  vtkGetMacro(NumberOfIsolatedPoints, vtkIdType);
  vtkGetMacro(NumberOfDegeneratePoints, vtkIdType);
  vtkGetMacro(NumberOfInvalidNormals, vtkIdType);
  vtkGetMacro(NumberOfTwoSidedSurfels, vtkIdType);
  vtkGetMacro(NumberOfComponents, vtkIdType);
  vtkGetMacro(NumberOfClosedComponents, vtkIdType);
  ///@}

  /**
   * What the last execution made of given normals: NO_NORMALS (there were none), NORMALS_KEPT,
   * NORMALS_WITHOUT_SIDES or NORMALS_DROPPED, see KeepNormals.
   */
  vtkGetMacro(NormalsUse, int);

  /**
   * What is wrong with given normals that were not kept as they are; empty: nothing.
   */
  std::string GetNormalsProblem() const;

  /**
   * Median spacing of the last execution's surfels, world units; 0 without any.
   */
  vtkGetMacro(MedianSpacing, double);

protected:
  vtkSurfelEstimation();
  ~vtkSurfelEstimation() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

  int NeighborhoodMode = K_NEAREST;
  int NumberOfNeighbors = 16;
  double Radius = 0.0;
  int MaximumNumberOfNeighbors = 128;
  int KernelMode = CELL;
  double KernelScale = 0.5;
  double CellBlur = 0.28;
  double MaximumAxisRatio = 4.0;
  vtkTypeBool KeepNormals = 1;
  char* NormalsArrayName = nullptr;
  int OrientationMode = CONSISTENT;
  double Viewpoint[3] = { 0.0, 0.0, 0.0 };
  vtkTypeBool UseViewpoint = 0;
  double IsolationFactor = 6.0;
  vtkTypeBool InterpolateColors = 1;

private:
  vtkSurfelEstimation(const vtkSurfelEstimation&) = delete;
  void operator=(const vtkSurfelEstimation&) = delete;

  bool CheckSettings(vtkPointSet* input);
  void WarnOfTroubles();
  int Execute(vtkPointSet* input, vtkPolyData* output);
#ifndef __VTK_WRAP__
  friend class vtkPointsToSurfels;
  friend class vtkPartitionedSurfelEstimation;
  SurfelGeometry::EstimationSettings GetSettings(vtkPointSet* input) const;
  void Take(const SurfelGeometry::EstimationCounts& counts);
  int ExecuteAlone(vtkPointSet* input, vtkPolyData* output);
  int RequestDistributed(SurfelSplatting::Ranks& ranks, vtkPointSet* input, vtkPolyData* output);
  bool CheckDistributedMemory(SurfelSplatting::Ranks& ranks, vtkIdType points, bool orients);
#endif

  vtkSmartPointer<vtkMultiProcessController> Controller;
  SurfelGeometry::SearchedCloud* Searched = nullptr;    ///< search in the next input, if known
  SurfelGeometry::SurfelNeighbors* Neighbors = nullptr; ///< what the next execution fills, if any
  bool IsPart = false; ///< whether the input is a part of a cloud, which does not tell the outside
  vtkIdType NumberOfNonFinitePoints = 0;
  vtkIdType NumberOfDuplicatePoints = 0;
  vtkIdType NumberOfIsolatedPoints = 0;
  vtkIdType NumberOfDegeneratePoints = 0;
  vtkIdType NumberOfInvalidNormals = 0;
  vtkIdType NumberOfTwoSidedSurfels = 0;
  vtkIdType NumberOfComponents = 0;
  vtkIdType NumberOfClosedComponents = 0;
  int NormalsUse = NO_NORMALS;
  double MedianSpacing = 0.0;
};

#endif

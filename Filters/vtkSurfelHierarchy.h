// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelHierarchy
 * @brief   level-of-detail hierarchy over surfels
 *
 * Surfaces that are blurred, or smaller than a pixel, can be drawn with fewer and larger splats.
 * This filter builds a binary hierarchy over the surfels (QSplat: Rusinkiewicz and Levoy 2000; for
 * depth of field Krivanek, Zara and Bouatouch 2003): each node has the moments of the surfels below
 * it, so that it is a surfel itself. With the output as its input, a vtkSurfelMapper draws a cut
 * through the hierarchy that suits the view; vtkSurfelSplatter::SetLODError controls how coarse it
 * is.
 *
 * The output is a vtkPolyData with the input's surfels and all of their point arrays, in the order
 * of the tree, and with the nodes above them in the field data (Documentation/DataContract.md). So
 * any VTK writer and reader preserves it, as do filters that keep the points and their order. If a
 * filter behind it has turned, moved or scaled all points, the mapper draws them there; if it has
 * selected some, the mapper warns and draws them without level of detail, and a second
 * vtkSurfelHierarchy gives them one. The hierarchy takes 48 bytes for each surfel besides the
 * surfel itself.
 *
 * Colours from a lookup table are mapped at the surfels, and the mapper averages them for the
 * nodes.
 *
 * One-sided and two-sided surfels never share a node. Surfels with non-finite values are left out
 * and counted. The result does not depend on the number of threads.
 *
 * @sa vtkSurfelEstimation vtkSurfelNormalization vtkSurfelMapper vtkSurfelSplatter
 */
#ifndef vtkSurfelHierarchy_h
#define vtkSurfelHierarchy_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelFiltersModule.h" // for export macro

#include <string> // for CheckInput

class vtkPointSet;
namespace SurfelGeometry
{
struct SurfelNeighbors;
}

class VTKSURFELFILTERS_EXPORT vtkSurfelHierarchy : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfelHierarchy* New();
  vtkTypeMacro(vtkSurfelHierarchy, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Counts of the last execution: leaves (surfels in the hierarchy), all nodes including leaves,
   * levels (1: leaves only), and surfels that were left out because their values are not finite.
   */
  vtkGetMacro(NumberOfLeaves, vtkIdType);
  vtkGetMacro(NumberOfNodes, vtkIdType);
  vtkGetMacro(NumberOfLevels, int);
  vtkGetMacro(NumberOfInvalidSurfels, vtkIdType);
  ///@}

  /**
   * The place in the world to which the coordinates of surfels are relative: the field array
   * SurfelOrigin, or 0, 0, 0 without one.
   */
  static void ReadOrigin(vtkPointSet* surfels, double origin[3]);

  /**
   * An error message if there is not enough free memory for a hierarchy of this many surfels and
   * for the data that a mapper adds; empty if there is enough or the amount is unknown.
   * withSurfels: the surfels do not exist yet, and the pipeline releases them once the hierarchy
   * exists.
   */
  static std::string CheckMemory(vtkIdType surfels, bool withSurfels);

protected:
  vtkSurfelHierarchy();
  ~vtkSurfelHierarchy() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkSurfelHierarchy(const vtkSurfelHierarchy&) = delete;
  void operator=(const vtkSurfelHierarchy&) = delete;

  class Execution;
  static std::string CheckInput(vtkPolyData* input);
  int Execute(vtkPolyData* input, vtkPolyData* output);
#ifndef __VTK_WRAP__
  const SurfelGeometry::SurfelNeighbors* Neighbors = nullptr; ///< with the order of the input
  friend class vtkPointsToSurfels;
#endif

  vtkIdType NumberOfLeaves = 0;
  vtkIdType NumberOfNodes = 0;
  int NumberOfLevels = 0;
  vtkIdType NumberOfInvalidSurfels = 0;
};

#endif

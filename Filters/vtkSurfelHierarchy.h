// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelHierarchy
 * @brief   level-of-detail hierarchy over surfels
 *
 * What is blurred, or smaller than a pixel, can be drawn by fewer and larger splats. This filter
 * builds a binary hierarchy over the surfels (QSplat: Rusinkiewicz and Levoy 2000; for depth of
 * field Krivanek, Zara and Bouatouch 2003): each node carries the moments of the surfels below it,
 * so that it is a surfel itself. A vtkSurfelMapper that is given the output draws a cut through the
 * hierarchy that suits the view; vtkSurfelSplatter::SetLODError says how coarse.
 *
 * The output is a vtkPolyData with the input's surfels and all of their point arrays, in the order
 * of the tree, and with the nodes above them in the field data (Documentation/DataContract.md). It
 * so survives any VTK writer and reader as well as filters that keep the points and their order;
 * what remains of a hierarchy after a filter that drops points is refused by the mapper. 48 bytes
 * for each surfel beside the surfel itself.
 *
 * Colours that a mapper finds through a lookup table are mapped at the surfels and averaged by the
 * mapper.
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

class VTKSURFELFILTERS_EXPORT vtkSurfelHierarchy : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfelHierarchy* New();
  vtkTypeMacro(vtkSurfelHierarchy, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Of the last execution: leaves (surfels that took part), all nodes with them, levels (1: leaves
   * only), and surfels that were left out, since their values are not finite.
   */
  vtkGetMacro(NumberOfLeaves, vtkIdType);
  vtkGetMacro(NumberOfNodes, vtkIdType);
  vtkGetMacro(NumberOfLevels, int);
  vtkGetMacro(NumberOfInvalidSurfels, vtkIdType);
  ///@}

  /**
   * What is wrong if the memory that is free does not hold the hierarchy of so many surfels, and
   * what a mapper makes of it; empty if it does, or where nobody knows. withSurfels: before there
   * are any, and for a pipeline that lets go of them when the hierarchy is there.
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

  vtkIdType NumberOfLeaves = 0;
  vtkIdType NumberOfNodes = 0;
  int NumberOfLevels = 0;
  vtkIdType NumberOfInvalidSurfels = 0;
};

#endif

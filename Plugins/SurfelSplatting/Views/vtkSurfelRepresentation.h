// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelRepresentation
 * @brief   "Surfel Splats": a point data set as surfels with depth of field, in any render view
 *
 * Surfels are drawn as they are. Points without the arrays of surfels become some first: normals,
 * kernels, weights and a level of detail are estimated with the filters' defaults, and a message
 * says so. The lens is the view's camera: its Camera Focal Disk and Camera Focal Distance. Blocks
 * of composite data are clouds of their own, with their visibility, colour and opacity.
 *
 * Where several processes render, each has its piece of the points; surfels at borders are
 * estimated with the neighbours' points, and all processes' surfels are one picture.
 *
 * @sa vtkSurfelViewActor
 */
#ifndef vtkSurfelRepresentation_h
#define vtkSurfelRepresentation_h

#include "vtkGeometryRepresentationWithFaces.h"
#include "vtkSurfelViewsModule.h" // for export macro

#include <cstddef> // for sizes
#include <memory>  // for the implementation

class vtkMultiProcessController;

class VTKSURFELVIEWS_EXPORT vtkSurfelRepresentation : public vtkGeometryRepresentationWithFaces
{
public:
  static vtkSurfelRepresentation* New();
  vtkTypeMacro(vtkSurfelRepresentation, vtkGeometryRepresentationWithFaces);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  int ProcessViewRequest(
    vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo) override;
  void SetVisibility(bool visible) override;

  /**
   * There is never a smaller piece for while the camera moves: fewer surfels are taken from the
   * hierarchy instead.
   */
  void SetSuppressLOD(bool) override { this->Superclass::SetSuppressLOD(true); }

  ///@{
  /**
   * What is in focus: 0 the camera's focal distance, 1 a point, 2 the view's centre of rotation;
   * without one the camera's. Default 0.
   */
  void SetFocusMode(int mode);
  void SetFocusPoint(double x, double y, double z);
  ///@}

  ///@{
  /**
   * Forwarded to vtkSurfelSplatter: see there.
   */
  void SetLensMode(int mode);
  void SetCircleOfConfusion(double radius);
  void SetLensCells(int cells);
  void SetLensSectors(int sectors);
  void SetKernel(int kernel);
  void SetLODMode(int mode);
  void SetLODError(double error);
  void SetColorByLevel(int byLevel);
  ///@}

protected:
  vtkSurfelRepresentation();
  ~vtkSurfelRepresentation() override;

  bool AddToView(vtkView* view) override;
  bool RemoveFromView(vtkView* view) override;
  bool NeedsOrderedCompositing() override;

private:
  vtkSurfelRepresentation(const vtkSurfelRepresentation&) = delete;
  void operator=(const vtkSurfelRepresentation&) = delete;

  void HidePolygons();
  void ShowClouds(std::size_t count);
  void UpdateClouds(vtkDataObject* delivered, vtkMultiProcessController* controller);

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif

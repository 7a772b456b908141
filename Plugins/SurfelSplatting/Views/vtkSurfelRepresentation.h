// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelRepresentation
 * @brief   "Surfel Splats": a point data set as surfels with depth of field, in any render view
 *
 * Surfels and Gaussians in space are drawn as they are; without colouring by an array, captures
 * show their harmonics. For points without such arrays, the representation first estimates normals,
 * kernels, weights and levels of detail with the filters' default settings, and reports it in a
 * message. The lens is set by the view's Camera Focal Disk and Camera Focal Distance. Each block of
 * composite data is a cloud with its own visibility, colour and opacity.
 *
 * An image along three axes that is coloured by a scalar of its points is drawn as a volume, with
 * the colours and opacities of the colour map, see vtkVolumeSplatting. With Shade it is lit, by the
 * material of the representation.
 *
 * If several processes render, each has a piece of the points. Surfels near the border of a piece
 * are estimated with the points of its neighbours, and all surfels end up in one picture.
 *
 * @sa vtkSurfelViewActor
 */
#ifndef vtkSurfelRepresentation_h
#define vtkSurfelRepresentation_h

#include "vtkGeometryRepresentationWithFaces.h"
#include "vtkSurfelViewsModule.h" // for export macro

#include <cstddef> // for sizes
#include <memory>  // for the implementation
#include <vector>  // for blocks

namespace SurfelViews
{
struct Block;
struct VolumeColors;
}
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
   * Always suppressed: while the camera moves, fewer surfels are drawn from the hierarchy, instead
   * of a decimated copy of the data.
   */
  void SetSuppressLOD(bool) override { this->Superclass::SetSuppressLOD(true); }

  ///@{
  /**
   * What to focus on: 0 the camera's focal distance, 1 a point, 2 the view's centre of rotation, or
   * as 0 if the view has none, 3 the surface in the middle (vtkSurfelSplatter::FOCUS_MIDDLE).
   * Default 3.
   */
  void SetFocusMode(int mode);
  void SetFocusPoint(double x, double y, double z);
  ///@}

  ///@{
  /**
   * Passed on to vtkSurfelSplatter; see there.
   */
  void SetLensMode(int mode);
  void SetCircleOfConfusion(double radius);
  void SetLensCells(int cells);
  void SetKernel(int kernel);
  void SetLODMode(int mode);
  void SetLODError(double error);
  void SetColorByLevel(int byLevel);
  ///@}

  /**
   * Whether surfels that have an outside are drawn from their backs, too. Default false.
   */
  void SetShowBacks(bool show);

  /**
   * Whether volumes are lit as if their scalars had surfaces. Default false.
   */
  void SetShade(bool shade);

protected:
  vtkSurfelRepresentation();
  ~vtkSurfelRepresentation() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;
  bool AddToView(vtkView* view) override;
  bool RemoveFromView(vtkView* view) override;
  bool NeedsOrderedCompositing() override;

private:
  vtkSurfelRepresentation(const vtkSurfelRepresentation&) = delete;
  void operator=(const vtkSurfelRepresentation&) = delete;

  void HidePolygons();
  void SetNumberOfClouds(std::size_t count);
  void UpdateBounds(vtkInformation* info);
  SurfelViews::VolumeColors FindVolumeColors();
  void ShowVolume(vtkInformationVector* input);
  std::vector<SurfelViews::Block> FindBlocks(vtkDataObject* data);
  void UpdateClouds(vtkDataObject* delivered, vtkMultiProcessController* controller);

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif

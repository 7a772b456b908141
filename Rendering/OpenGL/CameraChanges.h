// SPDX-License-Identifier: BSD-3-Clause
/**
 * A renderer's camera, changed for a while: moved within its lens, or seeing more. Internal to the
 * module.
 */
#pragma once

#include <vtkSmartPointer.h>

#include <vector>

class vtkCamera;
class vtkFrameBufferObjectBase;
class vtkProp;
class vtkRenderPass;
class vtkRenderState;
class vtkRenderer;

namespace SurfelSplatting
{
/// Tells a renderer's camera which eye it is: only its own rendering does, and VTK's passes leave
/// that out.
void UpdateStereo(vtkRenderer* renderer);

/// Gives a renderer another camera for as long as it lives.
class CameraSwap
{
public:
  CameraSwap(vtkRenderer* renderer, vtkCamera* camera);
  ~CameraSwap();
  CameraSwap(const CameraSwap&) = delete;
  CameraSwap& operator=(const CameraSwap&) = delete;

private:
  vtkRenderer* Renderer;
  vtkSmartPointer<vtkCamera> Own;
};

/// A camera that sees the same, whose projection is explicit: all that shapes a camera's projection
/// (window centre, user transform, shear, stereo) is in its matrix.
vtkSmartPointer<vtkCamera> CopyCamera(vtkCamera* camera, double aspect);

/// Moves a copy by (x, y) world units within the plane of its lens and shifts its picture by (u, v)
/// in normalised device coordinates.
void ShiftCamera(vtkCamera* copy, double x, double y, double u, double v);

/// Widens a copy's picture of size px by margin px on each side.
void WidenCamera(vtkCamera* copy, const int size[2], int margin);

/// All visible props of a renderer, also those that its cullers left out: a camera that was changed
/// may see them.
std::vector<vtkProp*> VisibleProps(vtkRenderer* renderer);

/// Renders them with a pass through another camera into a framebuffer, which is bound.
void RenderThrough(const vtkRenderState* state, vtkCamera* camera,
  vtkFrameBufferObjectBase* framebuffer, vtkRenderPass* pass);
}

// SPDX-License-Identifier: BSD-3-Clause
/**
 * Renders with a changed copy of a renderer's camera: moved within its lens, or with a wider view.
 * Internal to the module.
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
/// Sets the eye of a renderer's camera. Otherwise only vtkCamera::Render does this, which VTK's
/// passes do not call.
void UpdateStereo(vtkRenderer* renderer);

/// Gives a renderer another camera; its destructor restores the renderer's own.
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

/// Copies a camera so that it sees the same through an explicit projection matrix, which contains
/// everything that shapes the projection: window centre, user transform, shear, stereo.
vtkSmartPointer<vtkCamera> CopyCamera(vtkCamera* camera, double aspect);

/// Moves a copy by (x, y) world units within the plane of its lens and shifts its picture by (u, v)
/// in normalised device coordinates.
void ShiftCamera(vtkCamera* copy, double x, double y, double u, double v);

/// Widens the view of a copy, whose picture has the given size, by margin px on each side.
void WidenCamera(vtkCamera* copy, const int size[2], int margin);

/// All visible props of a renderer, also those that its cullers left out: a changed camera may see
/// them.
std::vector<vtkProp*> VisibleProps(vtkRenderer* renderer);

/// Renders props with a pass through another camera into a framebuffer, which must be bound.
void RenderThrough(const vtkRenderState* state, std::vector<vtkProp*> props, vtkCamera* camera,
  vtkFrameBufferObjectBase* framebuffer, vtkRenderPass* pass);
}

// SPDX-License-Identifier: BSD-3-Clause
/**
 * An offscreen framebuffer for passes to draw into: float colours (32 bits, or 16 bits if it is
 * multisampled) and 32-bit float depth. Internal to the module.
 */
#pragma once

#include "Rendering/OpenGL/OwningWindow.h"

#include <vtkNew.h>
#include <vtkSmartPointer.h>

class vtkFrameBufferObjectBase;
class vtkOpenGLFramebufferObject;
class vtkOpenGLRenderWindow;
class vtkRenderbuffer;
class vtkTextureObject;
class vtkWindow;

namespace SurfelSplatting
{
/// Samples per pixel of the current draw framebuffer; 0 if it is not multisampled.
int CurrentSamples();

class OffscreenFrame
{
public:
  OffscreenFrame();
  ~OffscreenFrame();

  /// Binds it for drawing and reading and sets viewport and scissor to it; its content is
  /// undefined. False, and nothing has changed, if it could not be made in this size.
  bool Begin(vtkOpenGLRenderWindow* window, int width, int height, int samples);

  /// The framebuffer for a vtkRenderState, between Begin and End.
  vtkFrameBufferObjectBase* Framebuffer();

  /// Binds the previous framebuffer again. If `resolve` is set and the frame is multisampled, the
  /// textures get the mean colour and the depth of one of the samples.
  void End(bool resolve = true);

  /// Textures of the last picture.
  vtkTextureObject* Color();
  vtkTextureObject* Depth();

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  void MakeObjects();
  bool Allocate(int width, int height, int samples);
  void Resolve();

  vtkOpenGLRenderWindow* Window = nullptr; // between Begin and End
  OwningWindow Owner;
  int Samples = 0;
  int Size[2] = { 0, 0 };
  int Viewport[4] = { 0, 0, 0, 0 };
  int Scissor[4] = { 0, 0, 0, 0 };
  vtkSmartPointer<vtkOpenGLFramebufferObject> Single, Multi;
  vtkNew<vtkTextureObject> SingleColor, SingleDepth;
  vtkSmartPointer<vtkRenderbuffer> MultiColor, MultiDepth;
};
}

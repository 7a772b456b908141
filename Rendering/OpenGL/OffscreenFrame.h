// SPDX-License-Identifier: BSD-3-Clause
/**
 * A framebuffer of one's own for passes to draw into: 16-bit or 32-bit float colours and depth,
 * with as many samples as wanted. Internal to the module.
 */
#pragma once

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
/// Samples of the framebuffer that is drawn into now: 0 where it is not multisampled.
int CurrentSamples();

enum class TextureKind
{
  Color, ///< RGBA, 32-bit float
  Depth  ///< 32-bit float
};

/// Gives a texture a size, where it has another one; false where it cannot be had.
bool FitTexture(vtkOpenGLRenderWindow* window, vtkTextureObject* texture, TextureKind kind,
  int width, int height);

class OffscreenFrame
{
public:
  OffscreenFrame();
  ~OffscreenFrame();

  /// Makes it what is drawn into and read from, viewport and scissor included; what is in it is
  /// undefined. False, and nothing has changed: it cannot be had in this size.
  bool Begin(vtkOpenGLRenderWindow* window, int width, int height, int samples);

  /// For a vtkRenderState, between Begin and End.
  vtkFrameBufferObjectBase* Framebuffer();

  /// Back to what was drawn into before. With several samples the textures get their mean, and the
  /// depth of one of them, where that is asked for.
  void End(bool resolve = true);

  /// Of the last picture.
  vtkTextureObject* Color();
  vtkTextureObject* Depth();

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  void MakeObjects();
  bool Allocate(int width, int height, int samples);
  void Resolve();

  vtkOpenGLRenderWindow* Window = nullptr; // between Begin and End
  int Samples = 0;
  int Size[2] = { 0, 0 };
  int Viewport[4] = { 0, 0, 0, 0 };
  int Scissor[4] = { 0, 0, 0, 0 };
  vtkSmartPointer<vtkOpenGLFramebufferObject> Single, Multi;
  vtkNew<vtkTextureObject> SingleColor, SingleDepth;
  vtkSmartPointer<vtkRenderbuffer> MultiColor, MultiDepth;
};
}

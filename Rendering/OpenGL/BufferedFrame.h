// SPDX-License-Identifier: BSD-3-Clause
/**
 * A frame in buffers of OpenGL's, which a graphics card reads by itself: with an H200, a window of
 * 1920 x 1080 px takes 1 ms longer than its frame, and 10 ms if pixels are copied from other
 * memory. Internal to the module.
 */
#pragma once

#include "Rendering/OpenGL/FrameQuad.h"
#include "Rendering/OpenGL/PassFrame.h"

#include <vtkNew.h>
#include <vtkWeakPointer.h>

class vtkOpenGLRenderWindow;
class vtkPixelBufferObject;
class vtkTextureObject;
class vtkWindow;

namespace SurfelSplatting
{
class BufferedFrame
{
public:
  BufferedFrame();
  ~BufferedFrame();

  /// Memory to write to.
  struct Memory
  {
    unsigned char* Color = nullptr; ///< [height][width][4] RGBA, [0, 255]; null: there is none
    float* Depth = nullptr;         ///< [height][width] new values of the depth buffer, [0, 1]
  };

  /// Whether a graphics card draws, and not the processor.
  static bool IsWorthwhile();

  /// Begins a frame.
  Memory Begin(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle);

  /// Ends it, and copies it into the current draw framebuffer. False if OpenGL could not.
  bool Draw(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle);

  /// Copies the last frame again. False if there is none of this size.
  bool DrawAgain(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  void ReleaseBuffers();

  vtkWeakPointer<vtkOpenGLRenderWindow> Window; // the buffers belong to its context
  int Width = 0, Height = 0;                    // of the frame in the textures
  vtkNew<vtkPixelBufferObject> Colors, Depths;
  vtkNew<vtkTextureObject> Color, Depth;
  FrameQuad Quad;
};
}

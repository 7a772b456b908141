// SPDX-License-Identifier: BSD-3-Clause
/**
 * Copies a picture into the textures of a framebuffer. Where nothing but one colour is under the
 * picture, this takes a fifth of the time of drawing it with Mesa's software OpenGL. Internal to
 * the module.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Rendering/OpenGL/PassFrame.h"

#include <cstdint>
#include <vector>

class vtkRenderer;

namespace SurfelSplatting
{
/// Whether a renderer has cleared its framebuffer to its background colour, and nothing else.
bool HasPlainBackground(vtkRenderer* renderer);

/// A frame in main memory.
struct FramePixels
{
  const float* Color = nullptr;    ///< [height][width][4] premultiplied RGBA
  const float* Depth = nullptr;    ///< [height][width] new values of the depth buffer, [0, 1]
  float Under[4] = { 0, 0, 0, 0 }; ///< colour below all of it, RGBA, [0, 1]
};

class FramebufferTextures
{
public:
  /**
   * Mixes a frame over its colour below, into a rectangle of the current draw framebuffer.
   * @param prepare called for ranges of pixels by several threads, before they are read: a pixel
   * that is still in the caches need not be read from memory twice
   * @return false, and nothing is copied or prepared, unless the framebuffer consists of textures
   * with one sample of colours of eight bits and of depth without stencil
   */
  bool Copy(
    const PixelRectangle& rectangle, const FramePixels& frame, const RangeFunction& prepare);

  /// Copies the frame of the last Copy again, which must not have changed.
  bool CopyAgain(const PixelRectangle& rectangle, const FramePixels& frame);

private:
  struct Attachments;
  void Upload(const PixelRectangle& rectangle, const FramePixels& frame, const Attachments& to);

  std::vector<unsigned char> Bytes;
  std::vector<std::uint32_t> Depths; // empty: the framebuffer takes floats
};
}

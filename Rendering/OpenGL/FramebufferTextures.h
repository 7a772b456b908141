// SPDX-License-Identifier: BSD-3-Clause
/**
 * Copies a picture with nothing but one colour under it into a framebuffer of textures, as bytes.
 * With Mesa's software OpenGL this takes a fifth of the time of drawing it; a graphics card gets it
 * through buffers. Internal to the module.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Rendering/OpenGL/BufferedFrame.h"
#include "Rendering/OpenGL/PassFrame.h"

#include <cstddef>
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
  bool Copy(const PassFrame& target, const FramePixels& frame, const RangeFunction& prepare);

  /// Copies the frame of the last Copy again, which must not have changed.
  bool CopyAgain(const PassFrame& target, const FramePixels& frame);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  struct Attachments;
  struct Destination;
  static void Write(std::size_t pixels, const FramePixels& frame, const RangeFunction& prepare,
    const Destination& to);
  void Upload(const PixelRectangle& rectangle, const FramePixels& frame, const Attachments& to);

  BufferedFrame Buffers; // for a graphics card; the others are empty then
  std::vector<unsigned char> Bytes;
  std::vector<std::uint32_t> Depths; // empty: the framebuffer takes floats
};
}

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace SurfelSplatting
{
/// A picture in the caller's memory, rows from bottom to top.
struct Frame
{
  int Width = 0;
  int Height = 0;
  /// [Height][Width][4] RGBA, premultiplied, linear; alpha = coverage times opacity.
  /// Null if only the layers are wanted.
  float* Color = nullptr;
  /// [Height][Width] distance along the view direction to the layer in which alpha passes one half,
  /// world units; 0 where it never does. Null only if Color is.
  float* Depth = nullptr;
};
}

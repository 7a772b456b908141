// SPDX-License-Identifier: BSD-3-Clause
/**
 * Image of the opaque props of a renderer that are not surfels: their colours and depths in the
 * frame, and in a margin from which they blur into it. The splatter shows them through the lens.
 * Internal to the module.
 */
#pragma once

#include "Core/Base/Ranks.h"
#include "Rendering/OpenGL/FrameBlit.h"
#include "Rendering/OpenGL/FrameFinish.h"
#include "Rendering/OpenGL/PropMargin.h"
#include "Rendering/Scene/SceneView.h"

#include <vector>

class vtkProp;
class vtkRenderPass;
class vtkRenderer;
class vtkWindow;

namespace SurfelSplatting
{
/// Whether a renderer shows any prop in 3D space that is not surfels.
bool HasOtherProps(vtkRenderer* renderer, bool opaqueOnly);

/**
 * Call its methods in this order in a frame: Begin or StaySharp; render the props; ReadDepth; Read;
 * splat with OccluderDepth and BlurredImage; on rank 0 BeginFinish and Finish, on other ranks
 * ClearGathered.
 */
class PropImage
{
public:
  /// Whether colours are sRGB codes of the light that is blurred and mixed.
  void SetLinearLight(bool linear) { this->Image.LinearLight = linear; }

  /// Whether nothing but a colour is in the framebuffer before the props are drawn.
  void SetPlainBackground(bool plain) { this->Pixels.IsPlain = plain; }

  /// Call before the props are drawn, if they are not to be blurred.
  void StaySharp() { this->Margin = 0; }

  /**
   * Call before the props are drawn, if they are to be blurred. Chooses the margin to draw around
   * the frame and reads the background. Collective if there are ranks. False if the background
   * could not be read or there is not enough memory: the props stay sharp.
   */
  bool Begin(const PassFrame& frame, const SceneView& view, Ranks* ranks);

  /// Whether the lens blurs any of the props.
  bool IsBlurred() const { return this->Margin > 0; }

  /// Call after the props were drawn, instead of ReadDepth and Read, if there are none.
  void ReadNothing();

  /// Call after the props were drawn. False if their depth could not be read: they then hide
  /// nothing.
  bool ReadDepth(const PassFrame& frame);

  /**
   * Reads the colours of the props, and draws and reads the margin around the frame, if they are
   * blurred or have to be sent to rank 0. Collective if there are ranks: gathers the nearest prop
   * of each pixel on rank 0. False if this rank's colours could not be read or there is not enough
   * memory: the props stay sharp.
   * @param delegate draws the props beyond the frame, with as many samples as the frame has
   */
  bool Read(const PassFrame& frame, Ranks* ranks, vtkRenderPass* delegate);

  /// Whether the props of all ranks have been gathered on rank 0.
  bool IsGathered() const { return this->Gathered; }

  /// [height][width] distance of the props along the view direction, world units; infinity where
  /// there are none. Null if there are none at all.
  const float* OccluderDepth() const
  {
    return this->Pixels.Distances.empty() ? nullptr : this->Pixels.Distances.data();
  }

  /// The image for the splatter; null if the props stay sharp or the image is on rank 0.
  const DepthImage* BlurredImage() const { return this->HasImage ? &this->Image : nullptr; }

  /// Reads the colours of all that was drawn, if Read was not needed. False if it could not be
  /// done.
  bool ReadColor(const PassFrame& frame)
  {
    return this->Blit.ReadColor(frame.Window, frame.Rectangle, this->Pixels.Color);
  }

  /**
   * Begins to finish the frame: props that were splatted are no longer there.
   * @param isWhole whether the finished colours are to contain all that is seen
   */
  void BeginFinish(const SplattedPicture& picture, bool isWhole)
  {
    this->Finisher.Begin(picture, this->Image, isWhole, this->Pixels);
  }

  /**
   * Finishes the pixels [begin, end); threads may finish different ones.
   * @param deepest largest window depth of pixels with any colour
   */
  void Finish(const SplattedPicture& picture, const DepthRange& range, float deepest,
    std::size_t begin, std::size_t end)
  {
    this->Finisher.Finish(picture, range, deepest, begin, end);
  }

  /// [height][width] the smaller window depth of props and splats, where Finish has been called.
  const float* FinishedDepth() const { return this->Pixels.WindowDepth.data(); }

  /// [height][width][4] the finished colours if they are whole: the splatter's picture over the
  /// props where they stayed sharp, and over the background where they were splatted.
  const float* FinishedColor() const { return this->Pixels.Color.data(); }

  /// On ranks other than 0: clears the props that are in the picture of rank 0. Translucent props
  /// and volumes, which have no depth, stay.
  void ClearGathered(const PassFrame& frame);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  bool ReadImage(const PassFrame& frame, bool shares, vtkRenderPass* delegate);
  void MakeMixedOpaque();
  bool FindBackdrop() const;
  void Gather(Ranks& ranks, Message own, bool hasProps, const DepthRange& range);

  FrameBlit Blit;
  PropPixels Pixels;
  PropMargin Beside{ Blit };
  FrameFinish Finisher;
  DepthImage Image;
  int Margin = 0;        // px on each side
  bool HasImage = false; // the image is complete
  bool Gathered = false;
};
}

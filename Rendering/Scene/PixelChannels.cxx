// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/PixelChannels.h"

#include "Core/Picture/LayerTally.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/SceneAdapter.h"
#include "vtkSurfelSplatter.h"

#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSMPTools.h>

#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// A point array of the picture.
float* AddArray(vtkImageData* picture, const char* name, int components)
{
  vtkNew<vtkFloatArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(picture->GetNumberOfPoints());
  picture->GetPointData()->AddArray(array);
  return array->GetPointer(0);
}

template <typename Function>
void ForPixels(vtkImageData* picture, const Function& function)
{
  vtkSMPTools::For(0, picture->GetNumberOfPoints(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType p = begin; p < end; ++p)
    {
      function(p);
    }
  });
}

/// A picture of the scene in other colours, [height][width][4].
std::vector<float> PaintScene(Paint colors, const SplatContext& context,
  const std::vector<SurfelCloud>& clouds, const float* limit, Splatter& splatter, LayerSink* sink)
{
  SplatContext painted = context;
  painted.Colors = colors;
  const std::size_t pixels = static_cast<std::size_t>(context.Camera.Width) * context.Camera.Height;
  std::vector<float> color(4 * pixels), depth(pixels);
  const Frame frame{ context.Camera.Width, context.Camera.Height, color.data(), depth.data() };
  splatter.Render(painted, clouds, SMPExecutor(), frame, limit, sink);
  return color;
}

/// The mean of (n + 1) / 2 over what is seen, made a unit vector.
void SetNormals(vtkImageData* picture, const std::vector<float>& mean, float* normals)
{
  ForPixels(picture, [&](vtkIdType p) {
    const float* m = &mean[4 * p];
    float n[3];
    float square = 0.0f;
    for (int i = 0; i < 3; ++i)
    {
      n[i] = 2.0f * m[i] - m[3];
      square += n[i] * n[i];
    }
    const float scale = square > 0.0f ? 1.0f / std::sqrt(square) : 0.0f;
    for (int i = 0; i < 3; ++i)
    {
      normals[3 * p + i] = scale * n[i];
    }
  });
}

void AddCirclesOfConfusion(const SplatContext& context, vtkImageData* picture)
{
  const float* depth =
    vtkFloatArray::SafeDownCast(picture->GetPointData()->GetArray("Depth"))->GetPointer(0);
  float* confusion = AddArray(picture, Arrays::CircleOfConfusion, 1);
  const Lens& lens = context.Optics;
  const double f =
    context.Camera.Parallel ? 0.0 : std::sqrt(std::abs(context.Camera.Fx * context.Camera.Fy));
  ForPixels(picture, [&](vtkIdType p) {
    const double z = depth[p];
    const double radius = z > 0.0 ? f * lens.RelativeCircleOfConfusion(z) : 0.0;
    confusion[p] = static_cast<float>(z < lens.FocalDistance ? -radius : radius);
  });
}
}

void AddChannels(int channels, const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const float* limit, Splatter& splatter, vtkImageData* picture)
{
  using Channels = vtkSurfelSplatter;
  if (channels & Channels::CHANNEL_CIRCLE_OF_CONFUSION)
  {
    AddCirclesOfConfusion(context, picture);
  }
  const bool tallied = channels & (Channels::CHANNEL_COVERAGE | Channels::CHANNEL_FRAGMENTS);
  if (tallied || channels & Channels::CHANNEL_NORMAL)
  {
    std::vector<float> coverage(tallied ? picture->GetNumberOfPoints() : 0);
    std::vector<float> fragments(coverage.size());
    LayerTally tally(tallied ? context.Camera.Width : 0, tallied ? context.Camera.Height : 0,
      coverage.data(), fragments.data());
    const std::vector<float> mean =
      PaintScene(Paint::Normals, context, clouds, limit, splatter, tallied ? &tally : nullptr);
    if (channels & Channels::CHANNEL_NORMAL)
    {
      SetNormals(picture, mean, AddArray(picture, Arrays::Normal, 3));
    }
    if (channels & Channels::CHANNEL_COVERAGE)
    {
      tally.Finish();
      std::copy(coverage.begin(), coverage.end(), AddArray(picture, Arrays::Coverage, 1));
    }
    if (channels & Channels::CHANNEL_FRAGMENTS)
    {
      std::copy(fragments.begin(), fragments.end(), AddArray(picture, Arrays::Fragments, 1));
    }
  }
  if (channels & Channels::CHANNEL_LEVEL)
  {
    const std::vector<float> mean =
      PaintScene(Paint::LevelNumbers, context, clouds, limit, splatter, nullptr);
    float* level = AddArray(picture, Arrays::Level, 1);
    ForPixels(picture, [&](vtkIdType p) {
      const float alpha = mean[4 * p + 3];
      level[p] =
        alpha > 0.0f ? static_cast<float>(LargestPaintedLevel) * mean[4 * p] / alpha : -1.0f;
    });
  }
}
}

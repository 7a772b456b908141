// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/PixelChannels.h"

#include "Core/Picture/LayerTally.h"
#include "Core/Picture/MedianDepths.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/PictureArrays.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkSMPTools.h>

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Adds a point array to the picture; returns its values, still to be set.
float* AddArray(vtkImageData* picture, const char* name, int components)
{
  const auto array = NewPixelArray(name, components, picture->GetNumberOfPoints());
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

/// Renders the scene in other colours, [height][width][4].
std::vector<float> PaintScene(const PaintedScene& scene, Paint colors, LayerSink* sink = nullptr)
{
  SplatContext context = scene.Context;
  context.Colors = colors;
  const View& view = context.Camera;
  const std::size_t pixels = static_cast<std::size_t>(view.Width) * view.Height;
  std::vector<float> color(4 * pixels), depth(pixels);
  RenderTarget target = Frame{ view.Width, view.Height, color.data(), depth.data() };
  target.OccluderDepth = scene.OccluderDepth;
  target.Sink = sink;
  scene.Painter.Render(context, scene.Clouds, SMPExecutor(), target);
  return color;
}

/// Shorter mean normals are rounding of the normal 0.
constexpr float LeastNormal = 1e-3f;

/// Computes unit normals n from the mean of (n + 1) / 2 over what is seen.
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
    const float least = LeastNormal * m[3];
    const float scale = square > least * least ? 1.0f / std::sqrt(square) : 0.0f;
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

/// Adds normals, coverage and fragments, which one further frame gives.
void AddTallied(const PixelChannels& channels, const PaintedScene& scene, vtkImageData* picture)
{
  const View& view = scene.Context.Camera;
  const bool tallied = channels.Coverage || channels.Fragments;
  std::vector<float> coverage(tallied ? picture->GetNumberOfPoints() : 0);
  std::vector<float> fragments(coverage.size());
  LayerTally tally(
    tallied ? view.Width : 0, tallied ? view.Height : 0, coverage.data(), fragments.data());
  const std::vector<float> mean = PaintScene(scene, Paint::Normals, tallied ? &tally : nullptr);
  if (channels.Normal)
  {
    SetNormals(picture, mean, AddArray(picture, Arrays::Normal, 3));
  }
  if (channels.Coverage)
  {
    tally.Finish();
    std::copy(coverage.begin(), coverage.end(), AddArray(picture, Arrays::Coverage, 1));
  }
  if (channels.Fragments)
  {
    std::copy(fragments.begin(), fragments.end(), AddArray(picture, Arrays::Fragments, 1));
  }
}
}

void AddChannels(const PixelChannels& channels, const PaintedScene& scene, vtkImageData* picture)
{
  if (channels.CircleOfConfusion)
  {
    AddCirclesOfConfusion(scene.Context, picture);
  }
  if (channels.Normal || channels.Coverage || channels.Fragments)
  {
    AddTallied(channels, scene, picture);
  }
  if (channels.Level)
  {
    const std::vector<float> mean = PaintScene(scene, Paint::LevelNumbers);
    float* level = AddArray(picture, Arrays::Level, 1);
    ForPixels(picture, [&](vtkIdType p) {
      const float alpha = mean[4 * p + 3];
      level[p] = alpha > 0.0f ? static_cast<float>(MaxPaintedLevel) * mean[4 * p] / alpha : -1.0f;
    });
  }
  if (channels.MedianDepth)
  {
    SplatContext whole = scene.Context;
    whole.Sampling = ApertureSampling();
    MedianDepths depths(
      whole.Camera.Width, whole.Camera.Height, AddArray(picture, Arrays::MedianDepth, 1));
    PaintScene({ whole, scene.Clouds, scene.OccluderDepth, scene.Painter }, whole.Colors, &depths);
  }
}
}

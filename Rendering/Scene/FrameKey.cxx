// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/FrameKey.h"

#include <vtkMatrix4x4.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>

#include <cstring>

namespace SurfelSplatting
{
FrameKey::FrameKey(const std::vector<SceneItem>& items, const SceneView& view,
  const SplatContext& context, vtkMTimeType settings)
{
  this->Values.push_back(settings);
  this->AddView(context);
  for (const Light& light : context.Lights)
  {
    this->AddLight(light);
  }
  for (const SceneItem& item : items)
  {
    this->AddItem(item);
  }
  if (view.PropStamp)
  {
    this->Values.insert(this->Values.end(), view.PropStamp->begin(), view.PropStamp->end());
    return;
  }
  if (view.OccluderDepth)
  {
    const std::size_t pixels = static_cast<std::size_t>(view.Size[0]) * view.Size[1];
    this->OccluderDepth.assign(view.OccluderDepth, view.OccluderDepth + pixels);
  }
  if (const DepthImage* props = view.PropImage)
  {
    const std::size_t pixels = static_cast<std::size_t>(view.Size[0] + 2 * props->Margin) *
      (view.Size[1] + 2 * props->Margin);
    this->PropDepth.assign(props->Depth, props->Depth + pixels);
    this->PropColor.assign(props->Colors, props->Colors + 4 * pixels);
  }
}

void FrameKey::AddView(const SplatContext& context)
{
  const View& v = context.Camera;
  this->Add(v.WorldToCamera);
  for (const double value : { v.Parallel ? 1.0 : 0.0, v.Fx, v.Fy, v.Cx, v.Cy,
         static_cast<double>(v.Width), static_cast<double>(v.Height), v.Near, v.Far,
         context.Optics.Radius, context.Optics.FocalDistance,
         static_cast<double>(context.Sampling.Count), context.Sampling.Pinholes ? 1.0 : 0.0,
         context.Cut.Error, static_cast<double>(context.Lights.size()) })
  {
    this->Add(value);
  }
}

void FrameKey::AddLight(const Light& light)
{
  for (const auto* vector : { &light.Color, &light.Position, &light.Direction, &light.Attenuation })
  {
    for (const double value : *vector)
    {
      this->Add(value);
    }
  }
  for (const double value : { light.Positional ? 1.0 : 0.0, light.ConeCosine,
         light.LoneHeadlight ? 1.0 : 0.0, light.Exponent })
  {
    this->Add(value);
  }
}

void FrameKey::AddItem(const SceneItem& item)
{
  // No two objects ever have the same MTime, so that their addresses are not needed.
  this->Values.push_back(item.Mapper->GetMTime());
  this->Values.push_back(item.Mapper->GetInput() ? item.Mapper->GetInput()->GetMTime() : 0);
  this->Values.push_back(item.Property->GetMTime());
  for (int i = 0; i < 16; ++i)
  {
    this->Add(item.Matrix->GetData()[i]);
  }
}

void FrameKey::Add(const Affine3& transform)
{
  for (int i = 0; i < 3; ++i)
  {
    for (const double value : transform.L[i])
    {
      this->Add(value);
    }
    this->Add(transform.T[i]);
  }
}

void FrameKey::Add(double value)
{
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  this->Values.push_back(bits);
}

bool FrameKey::operator==(const FrameKey& other) const
{
  // Compared bit by bit, so that infinity and NaN equal themselves.
  const auto same = [](const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() &&
      (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
  };
  return this->Values == other.Values && same(this->OccluderDepth, other.OccluderDepth) &&
    same(this->PropDepth, other.PropDepth) && same(this->PropColor, other.PropColor);
}
}

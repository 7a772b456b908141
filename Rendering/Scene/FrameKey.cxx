// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/FrameKey.h"

#include "Core/Splats/DepthImageSurfels.h"
#include "vtkSurfelMapper.h"

#include <vtkMatrix4x4.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>

#include <cstring>

namespace SurfelSplatting
{
FrameKey::FrameKey(const std::vector<vtkSurfelSplatter::Item>& items,
  const vtkSurfelSplatter::View& view, const SplatContext& context, vtkMTimeType settings)
{
  this->Values.push_back(settings);
  this->AddView(context);
  for (const Light& light : context.Lights)
  {
    this->AddLight(light);
  }
  for (const vtkSurfelSplatter::Item& item : items)
  {
    this->AddItem(item);
  }
  if (view.OccluderDepth)
  {
    const std::size_t pixels = static_cast<std::size_t>(view.Size[0]) * view.Size[1];
    this->OccluderDepth.assign(view.OccluderDepth, view.OccluderDepth + pixels);
  }
  if (const DepthImage* others = view.Others)
  {
    const std::size_t wide = static_cast<std::size_t>(view.Size[0] + 2 * others->Margin) *
      (view.Size[1] + 2 * others->Margin);
    this->OthersDepth.assign(others->Depth, others->Depth + wide);
    this->OthersColor.assign(others->Colors, others->Colors + 4 * wide);
  }
}

void FrameKey::AddView(const SplatContext& context)
{
  const View& v = context.Camera;
  this->Add(v.WorldToCamera);
  for (const double value :
    { v.Parallel ? 1.0 : 0.0, v.Fx, v.Fy, v.Cx, v.Cy, static_cast<double>(v.Width),
      static_cast<double>(v.Height), v.Near, v.Far, context.Optics.Radius,
      context.Optics.FocalDistance, context.Cut.Error, static_cast<double>(context.Lights.size()) })
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

void FrameKey::AddItem(const vtkSurfelSplatter::Item& item)
{
  // MTimes are never given twice, so that objects need not be told apart by their addresses.
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
  // Bit by bit: infinity and NaN are values like others.
  const auto same = [](const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() &&
      (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
  };
  return this->Values == other.Values && same(this->OccluderDepth, other.OccluderDepth) &&
    same(this->OthersDepth, other.OthersDepth) && same(this->OthersColor, other.OthersColor);
}
}

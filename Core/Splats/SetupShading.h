// SPDX-License-Identifier: BSD-3-Clause
/**
 * Of SetupImplementation.h: light and colour.
 */
#pragma once

#include "Core/Splats/SetupBatch.h"
#include "Core/Splats/SetupConstants.h"

namespace SurfelSplatting
{
namespace
{
/// Shading.cxx, Incidence, without spots.
SURFELSPLATTING_INLINE Reals Incidence(const SetupLight& light, const Reals3& p, Reals3& toLight)
{
  if (!light.Positional)
  {
    toLight = { ToReals(-light.Direction[0]), ToReals(-light.Direction[1]),
      ToReals(-light.Direction[2]) };
    return ToReals(1.0);
  }
  toLight = { light.Position[0] - p.X, light.Position[1] - p.Y, light.Position[2] - p.Z };
  const Reals distance = Norm(toLight);
  const Reals inverse = distance > 0.0 ? 1.0 / distance : Reals{};
  toLight = { toLight.X * inverse, toLight.Y * inverse, toLight.Z * inverse };
  const double* a = light.Attenuation;
  const Reals falloff = a[0] + a[1] * distance + a[2] * distance * distance;
  const Reals strength = falloff > 0.0 ? 1.0 / falloff : ToReals(1.0);
  return distance > 0.0 ? strength : Reals{};
}

SURFELSPLATTING_INLINE Reals Power(const Reals& base, double exponent)
{
  if (exponent == 1.0)
  {
    return base;
  }
  Reals power;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    power[l] = __builtin_pow(base[l], exponent);
  }
  return power;
}

/// MakeShading: light is Base + Share times the colour.
SURFELSPLATTING_INLINE void MakeShading(const SetupJob& job, Batch& b)
{
  for (int c = 0; c < 3; ++c)
  {
    b.Base[c] = Reals{};
    b.Share[c] = ToReals(1.0);
  }
  if (!job.Lit)
  {
    return;
  }
  const Reals sign = (b.BackSide ? ToReals(-1.0) : ToReals(1.0)) / Norm(b.Area);
  const Reals3 normal{ b.Area.X * sign, b.Area.Y * sign, b.Area.Z * sign };
  Reals3 toViewer{ Reals{}, Reals{}, ToReals(-1.0) };
  if (!job.Parallel)
  {
    const Reals inverse = -1.0 / Norm(b.P);
    toViewer = { b.P.X * inverse, b.P.Y * inverse, b.P.Z * inverse };
  }
  Reals diffuse[3] = {}, specular[3] = {};
  for (std::size_t i = 0; i < job.NumberOfLights; ++i)
  {
    const SetupLight& light = job.Lights[i];
    Reals3 toLight;
    Reals strength = Incidence(light, b.P, toLight);
    const Reals cosine = Dot(normal, toLight);
    strength = (strength > 0.0) & (cosine > 0.0) ? strength : Reals{};
    Reals highlight = {};
    if (job.Specular > 0.0)
    {
      const Reals reflected = light.LoneHeadlight
        ? cosine
        : 2.0 * cosine * Dot(normal, toViewer) - Dot(toLight, toViewer);
      highlight = reflected > 0.0 ? Power(Larger(reflected, Reals{}), job.SpecularPower) : Reals{};
    }
    for (int c = 0; c < 3; ++c)
    {
      diffuse[c] += strength > 0.0 ? strength * cosine * light.Color[c] : Reals{};
      specular[c] += strength > 0.0 ? strength * highlight * light.Color[c] : Reals{};
    }
  }
  const bool ownColor = job.ColorsUChar || job.ColorsFloat;
  for (int c = 0; c < 3; ++c)
  {
    const double ambient = ownColor ? 0.0 : job.Ambient * job.AmbientColor[c];
    b.Base[c] = ambient + job.Specular * job.SpecularColor[c] * specular[c];
    b.Share[c] = (ownColor ? job.Ambient : 0.0) + job.Diffuse * diffuse[c];
  }
}

/// To [0, high]; NaN and infinity stay what they are, to be found by IsRepresentable.
SURFELSPLATTING_INLINE Reals ClampColor(const Reals& x, double high)
{
  return IsFinite(x) ? Smaller(Larger(x, Reals{}), ToReals(high)) : x;
}

/// SurfelCloud::Color of surfels.
SURFELSPLATTING_INLINE void GatherColors(
  const SetupJob& job, const std::size_t* index, Reals color[4])
{
  for (int l = 0; l < RealLaneCount; ++l)
  {
    for (int i = 0; i < 4; ++i)
    {
      if (job.ColorsUChar)
      {
        color[i][l] = job.ColorsUChar[4 * index[l] + i] / 255.0;
      }
      else if (job.ColorsFloat)
      {
        color[i][l] = job.ColorsFloat[4 * index[l] + i];
      }
    }
  }
  if (job.Opacities)
  {
    color[3] *= Gather(job.Opacities, index, 1);
  }
}

/// SurfelCloud::Color of nodes above the leaves.
SURFELSPLATTING_INLINE void GatherNodeColors(
  const SetupJob& job, const std::size_t* index, Reals color[4])
{
  const std::size_t first = job.NumberOfSurfels;
  if (!job.NodeColors)
  {
    const HierarchyNode* nodes = job.Nodes;
    color[3] = ToReals(FillLanes<Ints>([=](int l) { return nodes[index[l] - first].Opacity; }));
    color[3] *= 1.0 / PackedOne;
    return;
  }
  const NodeColor* nodes[RealLaneCount];
  for (int l = 0; l < RealLaneCount; ++l)
  {
    nodes[l] = job.NodeColors + (index[l] - first);
  }
  const Reals unit =
    ToReals(FillLanes<Floats>([&](int l) { return nodes[l]->ColorUnit; })) / PackedOne;
  for (int c = 0; c < 3; ++c)
  {
    color[c] = unit * ToReals(FillLanes<Ints>([&](int l) { return nodes[l]->Color[c]; }));
  }
  color[3] = ToReals(FillLanes<Ints>([&](int l) { return nodes[l]->Opacity; })) * (1.0 / PackedOne);
}

/// SurfelCloud::Color, shaded.
SURFELSPLATTING_INLINE void SetColor(
  const SetupJob& job, const std::size_t* index, int level, Batch& b)
{
  Reals c[4] = { ToReals(job.Color[0]), ToReals(job.Color[1]), ToReals(job.Color[2]),
    ToReals(1.0) };
  level > 0 ? GatherNodeColors(job, index, c) : GatherColors(job, index, c);
  constexpr double largest = LargestColor;
  b.Red = ClampColor(b.Base[0] + b.Share[0] * c[0], largest);
  b.Green = ClampColor(b.Base[1] + b.Share[1] * c[1], largest);
  b.Blue = ClampColor(b.Base[2] + b.Share[2] * c[2], largest);
  b.Opacity = ClampColor(c[3] * job.Opacity, 1.0);
}
}
}

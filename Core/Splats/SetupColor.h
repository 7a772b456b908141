// SPDX-License-Identifier: BSD-3-Clause
/**
 * Third stage of the set-up: computes the shaded colours of the surfels.
 */
#pragma once

#include "Core/Simd/Rows.h"
#include "Core/Splats/SetupBatch.h"
#include "Core/Splats/SetupConstants.h"

#include <cstddef>

namespace SurfelSplatting
{
template <class Real>
struct SurfelColors
{
  Real Red, Green, Blue, Opacity;
  ShadedColor<Real> Shaded;
};

template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> DirectionToViewer(
  const SetupJob& job, const PlacedSurfels<Real>& s)
{
  Vector3Of<Real> toViewer{ Real{}, Real{}, Uniform<Real>(-1.0) };
  if (!job.Camera.Parallel)
  {
    const Real inverse = -1.0 / Norm(s.P);
    toViewer = { s.P.X * inverse, s.P.Y * inverse, s.P.Z * inverse };
  }
  return toViewer;
}

template <class Real>
SURFELSPLATTING_INLINE ShadedColor<Real> ShadeSurfels(
  const SetupJob& job, const PlacedSurfels<Real>& s)
{
  if (!job.Shading.Surface.Lit)
  {
    const Real one = Uniform<Real>(1.0);
    return { { Real{}, Real{}, Real{} }, { one, one, one } };
  }
  const Real sign = (s.BackSide ? Uniform<Real>(-1.0) : Uniform<Real>(1.0)) / Norm(s.Area);
  const Vector3Of<Real> normal{ s.Area.X * sign, s.Area.Y * sign, s.Area.Z * sign };
  return Shade(job.Shading, Facet<Real>{ s.P, normal, DirectionToViewer(job, s) });
}

/// Mean normals of a volume's Gaussians or nodes, local, length 0 to 1.
template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> GatherMeanNormals(
  const SurfelCloud& cloud, const BatchIndices<Real>& index)
{
  if (index.Level == 0)
  {
    const Vector3Of<Real> n = GatherVectors(cloud.Normals, index);
    const Real length = Norm(n), shorten = length > 1.0 ? 1.0 / length : Uniform<Real>(1.0);
    return { shorten * n.X, shorten * n.Y, shorten * n.Z }; // NaN stays
  }
  const auto row = [&](int l) { return cloud.Nodes + (index[l] - cloud.NumberOfSurfels); };
  const Vector3Of<Real> n = PackedNormals(LoadColumns<Real>(16, row), LoadColumns<Real>(32, row));
  constexpr double unit = 1.0 / PackedOne;
  return { unit * n.X, unit * n.Y, unit * n.Z };
}

/// Shades a volume's Gaussians, nodes or pairs that merge. Normals are covectors; a transform does
/// not change how much they agree.
template <class Real>
SURFELSPLATTING_INLINE ShadedColor<Real> ShadeGaussians(
  const SetupJob& job, const BatchIndices<Real>& index, const PlacedSurfels<Real>& s)
{
  Vector3Of<Real> mean = GatherMeanNormals(job.Cloud, index);
  if (index.Merging > 0.0)
  {
    // Both signs look alike; the parent may have the other one.
    const Vector3Of<Real> parent = GatherMeanNormals(job.Cloud, index.AtParents());
    const Real t = Uniform<Real>(ShareOfChildren(index));
    const Real own = Dot(mean, parent) < 0.0 ? -t : t, given = 1.0 - t;
    mean = { own * mean.X + given * parent.X, own * mean.Y + given * parent.Y,
      own * mean.Z + given * parent.Z };
  }
  const Vector3Of<Real> n = Multiply(job.AreaToCamera, mean);
  const Real length = Norm(n);
  const Real scale = length > 0.0 ? Norm(mean) / length : length; // NaN stays
  return ShadeMeanNormal(job.Shading,
    Facet<Real>{ s.P, { scale * n.X, scale * n.Y, scale * n.Z }, DirectionToViewer(job, s) });
}

/// Reads the colours and opacities of surfels, without the cloud's opacity. If the cloud has none,
/// `color` is left unchanged.
template <class Real>
SURFELSPLATTING_INLINE void GatherColors(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, Real (&color)[4])
{
  if (cloud.ColorsUChar)
  {
    const auto c = LoadColumns<Real, 4>(0, [&](int l) { return cloud.ColorsUChar + 4 * index[l]; });
    for (int i = 0; i < 4; ++i)
    {
      color[i] = c.Byte(0, i) * (1.0 / 255.0);
    }
  }
  else if (cloud.ColorsFloat)
  {
    const auto c = LoadColumns<Real>(0, [&](int l) { return cloud.ColorsFloat + 4 * index[l]; });
    for (int i = 0; i < 4; ++i)
    {
      color[i] = c.Float(i);
    }
  }
  if (cloud.Opacities)
  {
    color[3] *= Gather(cloud.Opacities, index, 1);
  }
}

/// Reads the colours and opacities of nodes above the leaves; only the opacities of those that have
/// harmonics.
template <class Real>
SURFELSPLATTING_INLINE void GatherNodeColors(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, Real (&color)[4])
{
  const std::size_t first = cloud.NumberOfSurfels;
  if (!cloud.NodeColors || cloud.Harmonics)
  {
    const HierarchyNode* nodes = cloud.Nodes;
    color[3] =
      GatherInts<Real>([&](int l) { return nodes[index[l] - first].Opacity; }) * (1.0 / PackedOne);
    return;
  }
  static_assert(offsetof(NodeColor, Color) == 8 && offsetof(NodeColor, Opacity) == 14 &&
      offsetof(NodeColor, Moment) == 16 && sizeof(NodeColor) == 36,
    "parts of a row");
  const auto c = LoadColumns<Real>(0, [&](int l) { return cloud.NodeColors + (index[l] - first); });
  const Real unit = c.Float(0) * (1.0 / PackedOne);
  color[0] = unit * c.LowShort(2);
  color[1] = unit * c.HighShort(2);
  color[2] = unit * c.LowShort(3);
  color[3] = c.HighUnsigned(3) * (1.0 / PackedOne);
}

/// First moments of the colours of nodes, local units; 0 for surfels.
template <class Real>
SURFELSPLATTING_INLINE void GatherNodeMoments(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, Vector3Of<Real> (&moments)[3])
{
  const auto row = [&](int l) { return cloud.NodeColors + (index[l] - cloud.NumberOfSurfels); };
  const auto m = LoadColumns<Real>(16, row);
  const auto last = LoadColumns<Real, 4>(32, row);
  const Real unit = LoadColumns<Real, 4>(4, row).Float(0) * (1.0 / PackedOne);
  moments[0] = { unit * m.LowShort(0), unit * m.HighShort(0), unit * m.LowShort(1) };
  moments[1] = { unit * m.HighShort(1), unit * m.LowShort(2), unit * m.HighShort(2) };
  moments[2] = { unit * m.LowShort(3), unit * m.HighShort(3), unit * last.LowShort(0) };
}

/// First moments of the colours of nodes or of pairs that merge, local units.
/// @param moments zero before, and after for surfels, which have none
template <class Real>
SURFELSPLATTING_INLINE void GatherColorMoments(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, Vector3Of<Real> (&moments)[3])
{
  if (index.Level > 0)
  {
    GatherNodeMoments(cloud, index, moments);
  }
  if (index.Merging > 0.0)
  {
    Vector3Of<Real> parents[3];
    GatherNodeMoments(cloud, index.AtParents(), parents);
    const Real rest = Uniform<Real>(1.0 - index.Merging);
    for (int c = 0; c < 3; ++c)
    {
      moments[c] = Mixed(parents[c], moments[c], rest);
    }
  }
}

/// Colours a surfel by the normal of its visible side, in world space. Normals are covectors: the
/// transpose transforms them from camera to world space. Gaussians in space get the normal 0.
template <class Real>
SURFELSPLATTING_INLINE void PaintNormals(
  const SetupJob& job, const PlacedSurfels<Real>& s, Real (&color)[4])
{
  if (job.Cloud.IsInSpace())
  {
    color[0] = color[1] = color[2] = Uniform<Real>(0.5);
    return;
  }
  const auto& m = job.WorldToCamera;
  const Vector3Of<Real>& a = s.Area;
  const Vector3Of<Real> n = { m[0][0] * a.X + m[1][0] * a.Y + m[2][0] * a.Z,
    m[0][1] * a.X + m[1][1] * a.Y + m[2][1] * a.Z, m[0][2] * a.X + m[1][2] * a.Y + m[2][2] * a.Z };
  const Real half = (s.BackSide ? Uniform<Real>(-0.5) : Uniform<Real>(0.5)) / Norm(n);
  color[0] = 0.5 + half * n.X;
  color[1] = 0.5 + half * n.Y;
  color[2] = 0.5 + half * n.Z;
}

/// Easily distinguished colours of the levels, starting at the finest; they repeat (the paper's
/// figure 5).
constexpr double LevelColors[8][3] = { { 0.85, 0.85, 0.85 }, { 0.30, 0.55, 0.95 },
  { 0.20, 0.75, 0.45 }, { 0.95, 0.85, 0.25 }, { 0.95, 0.55, 0.20 }, { 0.85, 0.25, 0.25 },
  { 0.70, 0.35, 0.80 }, { 0.45, 0.30, 0.20 } };

template <class Real>
SURFELSPLATTING_INLINE void PaintLevel(const SetupJob& job, int level, Real (&color)[4])
{
  const bool number = job.Colors == Paint::LevelNumbers;
  for (int c = 0; c < 3; ++c)
  {
    color[c] = Uniform<Real>(LevelColors[level % 8][c]);
    if (number)
    {
      color[c] = Uniform<Real>(c == 0 ? level / MaxPaintedLevel : 0.0);
    }
  }
}

/// Clamps to [0, high]. NaN and infinity are kept, so that IsRepresentable finds them.
template <class Real>
SURFELSPLATTING_INLINE Real ClampColor(const Real& x, double high)
{
  return IsFinite(x) ? Smaller(Larger(x, Real{}), Uniform<Real>(high)) : x;
}

/// Colours of Gaussians by their first Count harmonics, which is a constant so that each byte is at
/// a constant place.
/// @param direction from the lens's centre, unit length, local
template <int Count, class Real, class Function>
SURFELSPLATTING_INLINE void ColorByHarmonics(
  const Vector3Of<Real>& direction, Function&& row, Real (&color)[4])
{
  static_assert(offsetof(PackedHarmonics, Unit) == 12 && offsetof(PackedHarmonics, Rest) == 16,
    "a part of a row, and one for each channel");
  Real basis[MaxHarmonics];
  EvaluateHarmonics<Real>(direction, Count, basis);
  const Columns<Real> floats = LoadColumns<Real>(0, row);
  for (int c = 0; c < 3; ++c)
  {
    const Columns<Real> rest = LoadColumns<Real>(16 + 16 * c, row);
    Real sum{};
    for (int k = 1; k < Count; ++k)
    {
      sum += basis[k] * rest.SignedByte(k / 4, k % 4);
    }
    // The rest is like one harmonic with the coefficient Unit.
    const Real harmonics[MaxHarmonics]{ basis[0], sum };
    color[c] = ColorOfHarmonics(harmonics, 2, [&](int k) { return floats.Float(k == 0 ? c : 3); });
  }
}

/// Colours of Gaussians by their harmonics for the direction from the lens's centre.
template <class Real>
SURFELSPLATTING_INLINE void GatherHarmonics(const SetupJob& job, const BatchIndices<Real>& index,
  const PlacedSurfels<Real>& s, Real (&color)[4])
{
  const auto row = [&](int l) { return job.Cloud.Harmonics + index[l]; };
  const Vector3Of<Real> ahead{ Real{}, Real{}, Uniform<Real>(1.0) };
  const Vector3Of<Real> d = Multiply(job.CameraToLocal, job.Camera.Parallel ? ahead : s.P);
  const Real inverse = 1.0 / Larger(Norm(d), Uniform<Real>(1e-300));
  const Vector3Of<Real> direction{ d.X * inverse, d.Y * inverse, d.Z * inverse };
  switch (job.Cloud.NumberOfHarmonics)
  {
    case 1:
      return ColorByHarmonics<1>(direction, row, color);
    case 4:
      return ColorByHarmonics<4>(direction, row, color);
    case 9:
      return ColorByHarmonics<9>(direction, row, color);
    default:
      return ColorByHarmonics<MaxHarmonics>(direction, row, color);
  }
}

/// Unshaded colours and opacities of surfels or nodes.
template <class Real>
SURFELSPLATTING_INLINE void GatherPaint(const SetupJob& job, const BatchIndices<Real>& index,
  const PlacedSurfels<Real>& s, Real (&color)[4])
{
  for (int i = 0; i < 4; ++i)
  {
    color[i] = Uniform<Real>(i < 3 ? job.Color[i] : 1.0);
  }
  index.Level > 0 ? GatherNodeColors(job.Cloud, index, color)
                  : GatherColors(job.Cloud, index, color);
  if (job.Cloud.Harmonics)
  {
    GatherHarmonics(job, index, s, color);
  }
  if (job.Colors == Paint::LevelColors || job.Colors == Paint::LevelNumbers)
  {
    PaintLevel(job, index.Level, color);
  }
}

template <class Real>
SURFELSPLATTING_INLINE SurfelColors<Real> Color(
  const SetupJob& job, const BatchIndices<Real>& index, const PlacedSurfels<Real>& s)
{
  Real c[4];
  GatherPaint(job, index, s, c);
  if (index.Merging > 0.0)
  {
    Real parent[4];
    GatherPaint(job, index.AtParents(), s, parent);
    const Real t = Uniform<Real>(ShareOfChildren(index));
    for (int i = 0; i < 4; ++i)
    {
      c[i] = Mixed(parent[i], c[i], t);
    }
  }
  if (job.Colors == Paint::Normals)
  {
    PaintNormals(job, s, c);
  }
  SurfelColors<Real> colors;
  const ShadedColor<Real>& shaded = colors.Shaded = job.Shading.Surface.Lit && job.Cloud.Normals
    ? ShadeGaussians(job, index, s)
    : ShadeSurfels(job, s);
  constexpr double largest = MaxSplatColor;
  colors.Red = ClampColor(shaded.Base[0] + shaded.Share[0] * c[0], largest);
  colors.Green = ClampColor(shaded.Base[1] + shaded.Share[1] * c[1], largest);
  colors.Blue = ClampColor(shaded.Base[2] + shaded.Share[2] * c[2], largest);
  colors.Opacity = ClampColor(c[3] * job.Cloud.Opacity, 1.0);
  return colors;
}
}

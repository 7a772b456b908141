// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SplatMaker.h"

#include "Core/Base/MemoryGuard.h"
#include "Core/Lens/GaussianFootprint.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
void PrefetchBytes(const void* begin, std::size_t bytes)
{
  constexpr std::size_t line = 64;
  for (std::size_t offset = 0; offset < bytes; offset += line)
  {
    __builtin_prefetch(static_cast<const char*>(begin) + offset);
  }
  __asm__ volatile(""); // GCC 12 drops calls of functions that only prefetch
}
}

void SplatMaker::Set(
  const SplatContext& context, const SurfelCloud& cloud, const SetupTarget& target)
{
  this->Target = context.ScalarSetup ? &SetupTargetScalar : &target;
  this->Job = SetupJob();
  this->Job.Cloud = cloud;
  this->Job.PaperDetail = cloud.LeafCovariances && context.Cut.Rule == CutRule::Paper;
  this->Job.Colors = context.Colors;
  this->SetTransforms(context.Camera);
  this->SetOptics(context);
  this->SetLights(context.Lights, cloud.Surface);
}

void SplatMaker::SetTransforms(const View& view)
{
  SetupJob& j = this->Job;
  j.Camera = view;
  const Affine3 localToCamera = Affine3::Compose(view.WorldToCamera, this->Job.Cloud.LocalToWorld);
  const double determinant = localToCamera.Determinant();
  j.Stretch = std::abs(determinant);
  const std::array<Vector3, 3> areaToCamera = localToCamera.AreaMatrix();
  for (int i = 0; i < 3; ++i)
  {
    j.Translation[i] = localToCamera.T[i];
    for (int k = 0; k < 3; ++k)
    {
      j.Linear[i][k] = localToCamera.L[i][k];
      j.AreaToCamera[i][k] = areaToCamera[i][k];
      j.CameraToLocal[k][i] = j.Stretch > 0.0 ? areaToCamera[i][k] / j.Stretch : 0.0;
      j.WorldToCamera[i][k] = view.WorldToCamera.L[i][k];
    }
  }
}

void SplatMaker::SetOptics(const SplatContext& context)
{
  SetupJob& j = this->Job;
  const SplatSettings& settings = context.Settings;
  j.LensRadius = context.Optics.Radius;
  j.InverseFocalDistance = 1.0 / context.Optics.FocalDistance;
  j.Shape = context.Optics.Shape;
  j.Shape.XY *= j.Camera.Fx * j.Camera.Fy < 0.0 ? -1.0 : 1.0;
  j.ShapeRoot = j.Shape.Root();
  j.LeastShape = j.Shape.Smallest();
  j.LargestShape = j.Shape.Largest();
  j.Kernel = settings.Kernel;
  j.WeighsLens = context.HasLens();
  j.Gaussian = TruncatedGaussian(settings.Cutoff);
  j.KeepsMass = settings.KeepCaptureMass;
  j.Prefilter = j.Cloud.IsInSpace() ? SpacePrefilter
    : j.Cloud.Prefilter > 0.0       ? j.Cloud.Prefilter
                                    : settings.Prefilter;
  j.DefocusFactor = DefocusVariance(settings.Kernel, 1.0, j.Gaussian);
  j.CoarseGrids = context.CoarseGrids && !j.Cloud.IsInSpace();
  j.GaussianRuns = context.GaussianRuns && context.HasLens();
  j.DepthBuffered = context.DepthBuffered;
}

void SplatMaker::SetLights(const std::vector<Light>& lights, const Material& material)
{
  SetupJob& j = this->Job;
  for (int c = 0; c < 3; ++c)
  {
    j.Color[c] = material.Color[c];
  }
  if (!material.Lit || j.Colors != Paint::Own || (j.Cloud.IsInSpace() && !j.Cloud.Normals))
  {
    return;
  }
  this->Lights = lights;
  j.Shading = { material, j.Cloud.ColorsUChar || j.Cloud.ColorsFloat, this->Lights.data(),
    this->Lights.size() };
}

template <typename Function>
void SplatMaker::ForMemory(
  const CutRange& run, std::size_t skip, std::size_t count, const Function& function) const
{
  const SurfelCloud& c = this->Job.Cloud;
  const auto forElements = [&function](const auto* array, std::size_t begin, std::size_t size) {
    if (array)
    {
      function(array + begin, sizeof(*array) * size);
    }
  };
  const auto forNodes = [&](std::size_t begin, std::size_t size) {
    forElements(c.Nodes, begin - c.NumberOfSurfels, size);
    forElements(c.NodeColors, begin - c.NumberOfSurfels, size);
  };
  if (run.Merging > 0.0f)
  {
    forNodes(run.Parents + skip / 2, count / 2 + 1);
  }
  const std::size_t begin = run.Begin + skip;
  forElements(c.Harmonics, begin, count);
  if (run.Level > 0)
  {
    forNodes(begin, count);
    return;
  }
  forElements(c.PositionsFloat, 3 * begin, 3 * count);
  forElements(c.PositionsDouble, 3 * begin, 3 * count);
  forElements(c.Covariances, 6 * begin, 6 * count);
  forElements(c.AreaVectors, 3 * begin, 3 * count);
  forElements(c.Densities, begin, count);
  forElements(c.Normals, 3 * begin, 3 * count);
  forElements(c.TwoSided, begin, count);
  forElements(c.Overlaps, begin, count);
  forElements(c.Opacities, begin, count);
  forElements(c.ColorsUChar, 4 * begin, 4 * count);
  forElements(c.ColorsFloat, 4 * begin, 4 * count);
}

void SplatMaker::Prefetch(const CutRange& run) const
{
  this->ForMemory(
    run, 0, run.Count, [](const void* begin, std::size_t bytes) { PrefetchBytes(begin, bytes); });
}

void SplatMaker::Announce(const CutRange& run) const
{
  if (const MemoryGuard* guard = this->Job.Cloud.Guard)
  {
    this->ForMemory(run, 0, run.Count,
      [guard](const void* begin, std::size_t bytes) { guard->Announce(begin, bytes); });
  }
}

void SplatMaker::Check(const CutRange& run, std::size_t skip, std::size_t count) const
{
  const MemoryGuard* guard = this->Job.Cloud.Guard;
  this->ForMemory(
    run, skip, count, [guard](const void* begin, std::size_t bytes) { guard->Need(begin, bytes); });
}
}

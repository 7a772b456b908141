// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SplatMaker.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// What the set-up kernels do not know.
bool NeedsMakeSplat(const SplatContext& context, const SurfelCloud& cloud)
{
  const bool spots = cloud.Surface.Lit &&
    std::any_of(context.Lights.begin(), context.Lights.end(),
      [](const Light& light) { return light.Positional && light.ConeCosine > -1.0; });
  const bool paper = cloud.Clusters && context.Cut.Rule == CutRule::Paper;
  return context.ScalarSetup || context.Colors != Paint::Own || paper || spots;
}
}

void SplatMaker::Set(
  const SplatContext& context, const SurfelCloud& cloud, const SetupTarget& kernel)
{
  this->Context = &context;
  this->Gaussian.emplace(context.Settings.Cutoff);
  this->Cloud.emplace(context.Camera, cloud);
  this->Kernel = &kernel;
  this->OneByOne = NeedsMakeSplat(context, cloud);
  this->Lights.clear();
  this->Job = SetupJob();
  this->SetCloud(cloud);
  this->SetOptics();
  this->SetLights(cloud.Surface);
}

void SplatMaker::SetCloud(const SurfelCloud& cloud)
{
  SetupJob& j = this->Job;
  j.PositionsFloat = cloud.PositionsFloat;
  j.PositionsDouble = cloud.PositionsDouble;
  j.Covariances = cloud.Covariances;
  j.AreaVectors = cloud.AreaVectors;
  j.Opacities = cloud.Opacities;
  j.TwoSided = cloud.TwoSided;
  j.ColorsUChar = cloud.ColorsUChar;
  j.ColorsFloat = cloud.ColorsFloat;
  j.Nodes = cloud.Nodes;
  j.NodeColors = cloud.NodeColors;
  j.NumberOfSurfels = cloud.NumberOfSurfels;
  j.Opacity = cloud.Opacity;
  for (int i = 0; i < 3; ++i)
  {
    j.Translation[i] = this->Cloud->LocalToCamera.T[i];
    for (int k = 0; k < 3; ++k)
    {
      j.Linear[i][k] = this->Cloud->LocalToCamera.L[i][k];
      j.AreaToCamera[i][k] = this->Cloud->AreaToCamera[i][k];
    }
  }
}

void SplatMaker::SetOptics()
{
  SetupJob& j = this->Job;
  const View& view = this->Context->Camera;
  const Lens& lens = this->Context->Optics;
  const SplatSettings& settings = this->Context->Settings;
  j.Parallel = view.Parallel;
  j.Fx = view.Fx;
  j.Fy = view.Fy;
  j.Cx = view.Cx;
  j.Cy = view.Cy;
  j.Near = view.Near;
  j.Far = view.Far;
  j.Width = view.Width;
  j.Height = view.Height;
  j.LensRadius = lens.Radius;
  j.InverseFocalDistance = 1.0 / lens.FocalDistance;
  j.Gaussian = settings.Kernel == KernelType::Gaussian;
  j.Offsets = !j.Gaussian && !this->Context->Sectors;
  j.Prefilter = settings.Prefilter;
  j.Support = this->Gaussian->Support();
  j.Mass = this->Gaussian->Mass;
  j.Tau = this->Gaussian->Tau;
  j.DefocusFactor = DefocusVariance(settings.Kernel, 1.0, *this->Gaussian);
  j.CoarseGrids = this->Context->CoarseGrids;
  j.DepthBuffered = this->Context->DepthBuffered;
}

void SplatMaker::SetLights(const Material& material)
{
  SetupJob& j = this->Job;
  for (int c = 0; c < 3; ++c)
  {
    j.Color[c] = material.Color[c];
    j.AmbientColor[c] = material.AmbientColor[c];
    j.SpecularColor[c] = material.SpecularColor[c];
  }
  j.Lit = material.Lit;
  if (!material.Lit)
  {
    return;
  }
  j.Ambient = material.Ambient;
  j.Diffuse = material.Diffuse;
  j.Specular = material.Specular;
  j.SpecularPower = material.SpecularPower;
  for (const Light& light : this->Context->Lights)
  {
    SetupLight l{};
    for (int i = 0; i < 3; ++i)
    {
      l.Color[i] = light.Color[i];
      l.Position[i] = light.Position[i];
      l.Direction[i] = light.Direction[i];
      l.Attenuation[i] = light.Attenuation[i];
    }
    l.Positional = light.Positional;
    l.LoneHeadlight = light.LoneHeadlight;
    this->Lights.push_back(l);
  }
  j.Lights = this->Lights.data();
  j.NumberOfLights = this->Lights.size();
}

namespace
{
/// Elements [begin, begin + count) of an array, or nothing of none.
void PrefetchElements(const void* array, std::size_t size, std::size_t begin, std::size_t count)
{
  constexpr std::size_t line = 64;
  if (!array)
  {
    return;
  }
  const char* first = static_cast<const char*>(array) + size * begin;
  for (std::size_t offset = 0; offset < size * count; offset += line)
  {
    __builtin_prefetch(first + offset);
  }
}
}

void SplatMaker::Prefetch(std::size_t begin, std::size_t count, int level) const
{
  const SetupJob& j = this->Job;
  if (level > 0)
  {
    PrefetchElements(j.Nodes, sizeof(HierarchyNode), begin - j.NumberOfSurfels, count);
    PrefetchElements(j.NodeColors, sizeof(NodeColor), begin - j.NumberOfSurfels, count);
    return;
  }
  PrefetchElements(j.PositionsFloat, 3 * sizeof(float), begin, count);
  PrefetchElements(j.Covariances, 6 * sizeof(float), begin, count);
  PrefetchElements(j.AreaVectors, 3 * sizeof(float), begin, count);
  PrefetchElements(j.Opacities, sizeof(float), begin, count);
  PrefetchElements(j.ColorsUChar, 4, begin, count);
}

void SplatMaker::Make(std::size_t begin, std::size_t count, int level, SplatOutput& output) const
{
  if (this->OneByOne)
  {
    this->MakeOneByOne(begin, count, level, output);
    return;
  }
  this->Kernel->MakeSplats(this->Job, begin, count, level, output);
}

void SplatMaker::MakeOneByOne(
  std::size_t begin, std::size_t count, int level, SplatOutput& output) const
{
  for (std::size_t i = begin; i < begin + count; ++i)
  {
    SplatRecord record;
    const SplatStatus status =
      MakeSplat(*this->Context, *this->Gaussian, *this->Cloud, i, level, record);
    output.Invalid += status == SplatStatus::Invalid ? 1 : 0;
    if (status != SplatStatus::Visible)
    {
      continue;
    }
    Splat& s = record.S;
    if (s.Gradient != NoGradient)
    {
      const std::size_t gradient = output.FirstGradient + output.NumberOfGradients++;
      s.Gradient = static_cast<std::int32_t>(gradient);
      output.Gradients[gradient] = record.Gradient;
    }
    output.Splats[output.Count] = s;
    output.Boxes[output.Count] = record.Box;
    output.Nears[output.Count] = s.Near;
    if (output.Slopes)
    {
      output.Slopes[output.Count] = record.Slope;
    }
    if (output.GridLevels)
    {
      output.GridLevels[output.Count] = static_cast<unsigned char>(record.GridLevel);
    }
    output.Levels |= 1u << record.GridLevel;
    if (record.GridLevel > 0)
    {
      output.LargestCoarseColor = std::max({ output.LargestCoarseColor, s.Red, s.Green, s.Blue });
    }
    output.Blurred += record.Blurred ? 1 : 0;
    ++output.Count;
  }
}
}

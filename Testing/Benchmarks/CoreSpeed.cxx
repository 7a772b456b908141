// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the stages of a frame cost: set-up per surfel with every instruction set, the frame with
 * one and two threads, with and without detail, against a plain z-buffer splatter and against the
 * method without any of this (ScalarSplatter.h). One line of JSON.
 *
 *   CoreSpeed [surfels = 1000000] [pixels = 1024] [frames = 9]
 */
#include "Core/Simd/InstructionSet.h"
#include "Core/Splats/SplatMaker.h"
#include "ScalarSplatter.h"
#include "TestScene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

using namespace SurfelSplatting;

namespace
{
double Milliseconds(const std::function<void()>& function)
{
  const auto start = std::chrono::steady_clock::now();
  function();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
    .count();
}

double Median(std::vector<double> values)
{
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// A bumpy, closed surface about (0, 0, 3), its colours in patches; equal areas.
TestCloud MakeSurface(int surfels)
{
  TestCloud cloud;
  const double golden = 2.399963229728653;
  for (int i = 0; i < surfels; ++i)
  {
    const Vector3 d = SurfelTesting::UnitSpherePoint(1.0 - 2.0 * (i + 0.5) / surfels, golden * i);
    TestSurfel s;
    const double bump = 1.0 + 0.08 * std::sin(9 * d[0]) * std::sin(9 * d[1]) * std::sin(9 * d[2]);
    s.Position = { bump * d[0], bump * d[1], bump * d[2] + 3.0 };
    // Normal of the surface r(d) d: r d minus the tangential gradient of r.
    const Vector3 sine{ std::sin(9 * d[0]), std::sin(9 * d[1]), std::sin(9 * d[2]) };
    Vector3 g{ std::cos(9 * d[0]) * sine[1] * sine[2], sine[0] * std::cos(9 * d[1]) * sine[2],
      sine[0] * sine[1] * std::cos(9 * d[2]) };
    const double radial = Dot(g, d);
    for (int c = 0; c < 3; ++c)
    {
      s.Normal[c] = bump * d[c] - 0.08 * 9.0 * (g[c] - radial * d[c]);
    }
    const double length = Norm(s.Normal);
    s.Normal = { s.Normal[0] / length, s.Normal[1] / length, s.Normal[2] / length };
    s.Area = 4.0 * 3.14159265 / surfels;
    s.SigmaU = s.SigmaV = 0.5 * std::sqrt(s.Area);
    for (int c = 0; c < 3; ++c)
    {
      s.Color[c] = static_cast<float>(0.5 + 0.4 * std::sin(40.0 * d[c]));
    }
    cloud.Add(s);
  }
  return cloud;
}

/// Nanoseconds per surfel of the set-up alone, one thread.
double SetupTime(const SplatContext& context, const SurfelCloud& cloud, const SetupTarget& kernel,
  std::size_t surfels, int repeats)
{
  constexpr std::size_t chunk = 4096;
  SplatList list;
  list.Clear();
  list.Resize(chunk);
  SplatMaker maker;
  maker.Set(context, cloud, kernel);
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i)
  {
    times.push_back(Milliseconds([&] {
      for (std::size_t begin = 0; begin < surfels; begin += chunk)
      {
        SplatOutput output = list.OutputAt(0);
        const std::size_t count = std::min(chunk, surfels - begin);
        maker.Make({ begin, static_cast<std::uint32_t>(count), 0 }, output);
      }
    }));
  }
  return 1e6 * Median(times) / static_cast<double>(surfels);
}

/// Share of the pixels that differ by more than that.
double ShareOff(const Picture& a, const Picture& b, double most)
{
  std::size_t off = 0;
  for (std::size_t i = 0; i < a.Color.size(); i += 4)
  {
    double largest = 0.0;
    for (std::size_t c = i; c < i + 4; ++c)
    {
      largest = std::max(largest, std::abs(static_cast<double>(a.Color[c]) - b.Color[c]));
    }
    off += largest > most ? 1 : 0;
  }
  return 4.0 * static_cast<double>(off) / static_cast<double>(a.Color.size());
}

struct Way
{
  std::string Name;
  SplatContext Context;
  SurfelCloud Cloud;
  unsigned int Threads;
  std::vector<double> Times;
  FrameStatistics Stats{}; // of the last frame
};

/// All ways by turns, so that what slows the machine slows all of them.
void Measure(std::vector<Way>& ways, int frames, Picture& picture)
{
  for (int i = 0; i <= frames; ++i)
  {
    for (Way& way : ways)
    {
      static std::vector<std::pair<const Way*, std::unique_ptr<Splatter>>> splatters;
      auto own = std::find_if(splatters.begin(), splatters.end(),
        [&way](const auto& entry) { return entry.first == &way; });
      if (own == splatters.end())
      {
        splatters.emplace_back(&way, std::make_unique<Splatter>());
        own = splatters.end() - 1;
      }
      Splatter& splatter = *own->second;
      const ThreadExecutor executor(way.Threads);
      const double time =
        Milliseconds([&] { splatter.Render(way.Context, { way.Cloud }, executor, picture.Get()); });
      way.Stats = splatter.Statistics();
      if (i > 0) // the first one allocates
      {
        way.Times.push_back(time);
      }
    }
  }
}

void Print(const Way& way)
{
  const FrameStatistics& s = way.Stats;
  std::printf("%s\"%s\": {\"ms\": %.2f, \"threads\": %u, \"splats\": %llu, \"pairs\": %llu, "
              "\"fragments\": %llu, \"selection\": %.2f, \"setup\": %.2f, \"coarse\": %.2f, "
              "\"binning\": %.2f, \"sort\": %.2f, \"raster\": %.2f}",
    ",\n  ", way.Name.c_str(), Median(way.Times), way.Threads,
    static_cast<unsigned long long>(s.Splats), static_cast<unsigned long long>(s.Pairs),
    static_cast<unsigned long long>(s.Fragments), s.SelectionMilliseconds, s.SetupMilliseconds,
    s.CoarseMilliseconds, s.BinningMilliseconds, s.SortMilliseconds, s.RasterMilliseconds);
}

std::vector<std::pair<const char*, const SetupTarget*>> Kernels()
{
  std::vector<std::pair<const char*, const SetupTarget*>> kernels{ { "baseline",
    &SetupTargetBaseline } };
#ifdef SURFELSPLATTING_X86_TARGETS
  const InstructionSet best = DetectInstructionSet();
  if (best != InstructionSet::Baseline)
  {
    kernels.emplace_back("avx2", &SetupTargetAVX2);
  }
  if (best == InstructionSet::AVX512)
  {
    kernels.emplace_back("avx512", &SetupTargetAVX512);
  }
#endif
  return kernels;
}
}

int main(int argc, char* argv[])
{
  const int surfels = argc > 1 ? std::atoi(argv[1]) : 1000000;
  const int pixels = argc > 2 ? std::atoi(argv[2]) : 1024;
  const int frames = argc > 3 ? std::atoi(argv[3]) : 9;
  if (surfels < 100 || pixels < 16 || frames < 1)
  {
    std::fprintf(stderr, "CoreSpeed [surfels >= 100] [pixels >= 16] [frames >= 1]\n");
    return 2;
  }
  const TestCloud cloud = MakeSurface(surfels);
  const TestHierarchy hierarchy(cloud, ThreadExecutor(2));
  const SurfelCloud nodes = hierarchy.Get();
  SurfelCloud leaves = nodes;
  leaves.Clusters = nullptr;

  SplatContext sharp;
  sharp.Camera.Width = sharp.Camera.Height = pixels;
  sharp.Camera.Fx = sharp.Camera.Fy = 1.2 * pixels;
  sharp.Camera.Cx = sharp.Camera.Cy = 0.5 * pixels;
  sharp.Camera.Near = 1e-3;
  SplatContext blurred = sharp;
  blurred.Optics.FocalDistance = 2.2;
  blurred.Optics.Radius = 0.1;

  std::printf("{\n  \"surfels\": %d, \"pixels\": %d, \"setup_ns\": {", surfels, pixels);
  for (const SplatContext& context : { sharp, blurred })
  {
    SplatContext scalar = context;
    scalar.ScalarSetup = true;
    const char* lens = context.Optics.Radius > 0.0 ? "lens" : "pinhole";
    std::printf("%s\"%s scalar\": %.1f", &context == &sharp ? "" : " ", lens,
      SetupTime(scalar, leaves, SetupTargetBaseline, leaves.NumberOfSurfels, 3));
    for (const auto& [name, kernel] : Kernels())
    {
      std::printf(", \"%s %s\": %.1f", lens, name,
        SetupTime(context, leaves, *kernel, leaves.NumberOfSurfels, 5));
    }
    std::printf(context.Optics.Radius > 0.0 ? "}" : ",");
  }

  SplatContext buffered = sharp, unhidden = sharp, scalarSetup = sharp;
  buffered.DepthBuffered = true;
  unhidden.SkipHidden = false;
  scalarSetup.ScalarSetup = true;
  std::vector<Way> ways{ { "default", sharp, nodes, 2, {} }, { "one thread", sharp, nodes, 1, {} },
    { "z-buffer", buffered, nodes, 2, {} }, { "hidden too", unhidden, nodes, 2, {} },
    { "scalar set-up", scalarSetup, nodes, 2, {} }, { "no detail", sharp, leaves, 2, {} },
    { "no detail, one thread", sharp, leaves, 1, {} },
    { "no detail, z-buffer", buffered, leaves, 2, {} }, { "lens", blurred, nodes, 2, {} },
    { "lens, one thread", blurred, nodes, 1, {} }, { "lens, no detail", blurred, leaves, 2, {} } };
  Picture picture(pixels, pixels);
  Measure(ways, frames, picture);
  for (const Way& way : ways)
  {
    Print(way);
  }
  const double scalar = Milliseconds([&] { RenderScalar(sharp, { leaves }, picture.Get()); });
  std::printf(",\n  \"scalar, unsorted\": {\"ms\": %.1f}", scalar);

  // What is compared must draw the same thing.
  Picture layers(pixels, pixels), nearest(pixels, pixels);
  Splatter splatter;
  splatter.Render(sharp, { leaves }, ThreadExecutor(2), layers.Get());
  splatter.Render(buffered, { leaves }, ThreadExecutor(2), nearest.Get());
  const double offScalar = ShareOff(layers, picture, MinTransmittance + 1e-3),
               offNearest = ShareOff(layers, nearest, 0.1);
  std::printf(
    ",\n  \"pixels off\": {\"scalar\": %.2g, \"z-buffer\": %.2g}\n}\n", offScalar, offNearest);
  return offScalar == 0.0 ? 0 : 1;
}

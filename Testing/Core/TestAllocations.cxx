// SPDX-License-Identifier: BSD-3-Clause
/**
 * A steady frame allocates nothing: pinhole and lens, with and without detail, coarse grids, what
 * is hidden, sectors, and lit. Counted by the program's own operator new.
 */
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

using namespace SurfelSplatting;

namespace
{
std::atomic<long> Allocations{ 0 };

void* Allocate(std::size_t size, std::size_t alignment)
{
  ++Allocations;
  const std::size_t rounded = (size + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, rounded > 0 ? rounded : alignment);
  if (!memory)
  {
    throw std::bad_alloc();
  }
  return memory;
}
}

void* operator new(std::size_t size)
{
  return Allocate(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size)
{
  return Allocate(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment)
{
  return Allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment)
{
  return Allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept
{
  std::free(memory);
}
void operator delete[](void* memory) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept
{
  std::free(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
  std::free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept
{
  std::free(memory);
}

namespace
{
TestCloud MakeBall()
{
  TestCloud cloud;
  Random random(5);
  for (int i = 0; i < 20000; ++i)
  {
    TestSurfel s;
    s.Normal = random.Direction();
    s.Position = { s.Normal[0], s.Normal[1], s.Normal[2] + 3.0 };
    s.SigmaU = s.SigmaV = 0.013;
    s.Area = 12.566 / 20000;
    s.Opacity = 0.9f;
    cloud.Add(s);
  }
  cloud.Surface.Lit = true;
  return cloud;
}

TestCloud MakeVolume()
{
  TestCloud cloud;
  cloud.Kind = CloudKind::Volume;
  Random random(6);
  for (int i = 0; i < 5000; ++i)
  {
    TestGaussian g;
    const std::array<double, 3> p = random.Direction();
    g.Position = { p[0], p[1], p[2] + 3.0 };
    cloud.Add(g);
  }
  return cloud;
}

void CheckSteady(
  const SplatContext& context, const SurfelCloud& cloud, bool hasLimit, const char* what)
{
  Picture picture(128, 128);
  const std::vector<float> limit(128 * 128, 3.0f);
  const std::vector<SurfelCloud> clouds{ cloud };
  const SerialExecutor executor;
  Splatter splatter;
  RenderTarget target = picture.Get();
  target.OccluderDepth = hasLimit ? limit.data() : nullptr;
  const auto render = [&] { splatter.Render(context, clouds, executor, target); };
  render();
  render(); // buffers that have grown once get room to spare
  Allocations = 0;
  render();
  const long count = Allocations;
  if (count != 0)
  {
    std::printf("%s: %ld allocations\n", what, count);
  }
  CHECK(count == 0);
}
}

TEST_CASE("Steady frames")
{
  const TestCloud cloud = MakeBall();
  const TestHierarchy hierarchy(cloud);
  SplatContext sharp;
  sharp.Camera = PinholeView(128, 128, 150.0);
  sharp.Lights.resize(2);
  SplatContext blurred = sharp;
  blurred.Optics.Radius = 0.3;
  blurred.Optics.FocalDistance = 2.0;
  SplatContext paper = blurred, leaves = blurred, fine = blurred;
  paper.Settings.Kernel = KernelType::Gaussian; // no first moments
  leaves.Cut.Error = 0.0;
  fine.CoarseGrids = fine.SkipHidden = false;
  CheckSteady(sharp, hierarchy.Get(), false, "pinhole");
  CheckSteady(sharp, cloud.Get(), false, "pinhole, no detail");
  CheckSteady(sharp, hierarchy.Get(), true, "pinhole, other props");
  CheckSteady(blurred, hierarchy.Get(), false, "lens");
  CheckSteady(leaves, hierarchy.Get(), false, "lens, leaves");
  CheckSteady(fine, hierarchy.Get(), false, "lens, nothing skipped");
  CheckSteady(blurred, cloud.Get(), false, "lens, no detail");
  CheckSteady(blurred, hierarchy.Get(), true, "lens, other props");
  CheckSteady(paper, hierarchy.Get(), true, "paper's kernel, other props");
  const TestCloud volume = MakeVolume();
  const TestHierarchy volumeHierarchy(volume);
  CheckSteady(sharp, volume.Get(), false, "volume, pinhole");
  CheckSteady(blurred, volume.Get(), true, "volume, lens, other props");
  CheckSteady(blurred, volumeHierarchy.Get(), false, "volume, lens, nodes");
}

// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/CentralSplats.h"

#include "Core/Base/CoarseLevels.h"

#include <algorithm>
#include <thread>

namespace SurfelSplatting
{
namespace
{
/// Places of a run: whole groups.
std::size_t PlacesOf(const CutRange& run)
{
  constexpr std::size_t group = CentralOutput::Group;
  return (run.Count + group - 1) / group * group;
}

constexpr float Far = 1e30f;
constexpr ReachAlong Nowhere{ Far, -Far, Far, -Far };
constexpr ReachAlong Anywhere{ -Far, Far, 0.0f, 0.0f };

/// Extends a group's bounds. What is not finite is to be counted through all cells: anywhere.
void Include(const CentralOutput& central, std::size_t i, GroupReach& reach)
{
  const float cell = *central.At(CentralOutput::Cell, i);
  if (!(cell >= 1.0f))
  {
    reach = cell < 0.0f ? GroupReach{ Anywhere, Anywhere } : reach;
    return;
  }
  // Cells of a grid begin at half of one, and their tents reach the neighbours of those that are
  // covered.
  constexpr float margin = 2.0f;
  const float origin = cell > 1.0f ? static_cast<float>(CoarseOrigin) : 0.0f;
  using Field = CentralOutput::Field;
  const auto include = [&](Field center, Field half, Field shift, ReachAlong& along) {
    const float x = *central.At(center, i) - origin, size = *central.At(half, i) + margin;
    const float displacement = cell * *central.At(shift, i);
    along = { std::min(along.Low, cell * (x - size)), std::max(along.High, cell * (x + size)),
      std::min(along.Least, displacement), std::max(along.Most, displacement) };
  };
  include(Field::X, Field::HalfWidth, Field::ShiftX, reach.X);
  include(Field::Y, Field::HalfHeight, Field::ShiftY, reach.Y);
}

/// Rounds towards 0, since the bounds have a margin. NaN, of a splat that is nowhere, is far away.
int WholePixel(float x)
{
  constexpr float farthest = 1e9f;
  return static_cast<int>(x > -farthest ? std::min(x, farthest) : -farthest);
}
}

PixelBox GroupReach::From(const CellOfLens& cell) const
{
  const ReachAlong &x = this->X, &y = this->Y;
  const float u = static_cast<float>(cell.X), v = static_cast<float>(cell.Y);
  return { WholePixel(x.Low + std::min(u * x.Least, u * x.Most)),
    WholePixel(y.Low + std::min(v * y.Least, v * y.Most)),
    WholePixel(x.High + std::max(u * x.Least, u * x.Most)),
    WholePixel(y.High + std::max(v * y.Least, v * y.Most)) };
}

void CentralSplats::Clear(const SplatContext& whole)
{
  this->Context = &whole;
  this->Splats.Clear();
  this->Gradients.Clear();
  this->Fields.Clear();
  this->Reaches.Clear();
}

void CentralSplats::Add(std::vector<CutRange>& runs)
{
  const std::size_t first = this->Splats.Size();
  std::size_t size = first;
  for (CutRange& run : runs)
  {
    run.Central = size;
    size += PlacesOf(run);
  }
  this->Splats.Resize(size);
  this->Gradients.Resize(size);
  // A vector may be read from anywhere in a run.
  this->Fields.Resize(CentralOutput::NumberOfFields * size + CentralOutput::Group);
  const std::size_t count = size / CentralOutput::Group;
  this->Reaches.Resize(count);
  if (this->NumberOfStates < count)
  {
    auto states = std::make_unique<std::atomic<unsigned char>[]>(count);
    for (std::size_t i = 0; i < first / CentralOutput::Group; ++i)
    {
      states[i].store(this->States[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
    }
    this->States.swap(states);
    this->NumberOfStates = count;
  }
  for (const CutRange& run : runs)
  {
    this->States[run.Central / CentralOutput::Group].store(NotStarted, std::memory_order_relaxed);
  }
}

void CentralSplats::SetCell(const Vector3& center, double radius)
{
  const double whole = this->Context->Optics.Radius;
  this->Current = { center[0] / whole, center[1] / whole, radius / whole };
}

CentralOutput CentralSplats::At(const CutRange& run)
{
  return { &this->Splats[run.Central], this->Gradients.Data(), run.Central,
    &this->Fields[CentralOutput::NumberOfFields * run.Central], PlacesOf(run) };
}

/// True if the caller has to make the run; waits while another thread does.
bool CentralSplats::Begin(const CutRange& run)
{
  std::atomic<unsigned char>& state = this->States[run.Central / CentralOutput::Group];
  unsigned char seen = state.load(std::memory_order_acquire);
  if (seen == NotStarted &&
    state.compare_exchange_strong(seen, InProgress, std::memory_order_acquire))
  {
    return true;
  }
  while (state.load(std::memory_order_acquire) != Ready)
  {
    std::this_thread::yield();
  }
  return false;
}

void CentralSplats::End(const CutRange& run)
{
  this->States[run.Central / CentralOutput::Group].store(Ready, std::memory_order_release);
}

/// Ends a run that could not be made, without splats.
void CentralSplats::Leave(const CutRange& run)
{
  const CentralOutput output = this->At(run);
  std::fill_n(output.At(CentralOutput::Cell, 0), output.Stride, 0.0f);
  this->Bound(run);
  this->End(run);
}

void CentralSplats::Bound(const CutRange& run)
{
  const CentralOutput output = this->At(run);
  for (std::size_t first = 0; first < run.Count; first += CentralOutput::Group)
  {
    GroupReach reach{ Nowhere, Nowhere };
    const std::size_t end = std::min<std::size_t>(run.Count, first + CentralOutput::Group);
    for (std::size_t i = first; i < end; ++i)
    {
      Include(output, i, reach);
    }
    this->Reaches[(run.Central + first) / CentralOutput::Group] = reach;
  }
}

bool CentralSplats::Prefetch(const CutRange& run) const
{
  if (this->States[run.Central / CentralOutput::Group].load(std::memory_order_relaxed) != Ready)
  {
    return false;
  }
  constexpr std::size_t floatsPerLine = 64 / sizeof(float);
  const float* fields = &this->Fields[CentralOutput::NumberOfFields * run.Central];
  const std::size_t group = run.Central / CentralOutput::Group;
  for (std::size_t i = 0; i < PlacesOf(run) / CentralOutput::Group; ++i)
  {
    __builtin_prefetch(&this->Reaches[group + i]);
  }
  for (std::size_t i = 0; i < CentralOutput::NumberOfFields * PlacesOf(run); i += floatsPerLine)
  {
    __builtin_prefetch(fields + i);
  }
  return true;
}
}

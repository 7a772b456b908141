// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Surfels/SurfelSamples.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

namespace SurfelSplatting
{
namespace
{
/// Keys of points, and an eighth more, so that enough are among the smallest.
constexpr std::uint64_t Keys = std::uint64_t{ 9 } << 29;

std::size_t StepOf(std::size_t count, std::size_t most)
{
  return std::max<std::size_t>(1, count / most);
}

/// Products with odd numbers carry every bit upwards.
std::uint32_t KeyOfPosition(const Vector3& position)
{
  constexpr std::uint32_t factors[3] = { 0x9E3779B1u, 0x85EBCA77u, 0xC2B2AE3Du };
  std::uint32_t key = 0;
  for (int c = 0; c < 3; ++c)
  {
    const auto value = static_cast<float>(position[c]);
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    key ^= bits * factors[c];
  }
  return (key ^ key >> 15) * 0x2C1B3C6Du;
}
}

std::size_t NumberOfSamples(std::size_t count, std::size_t most)
{
  const std::size_t step = StepOf(count, most);
  return (count + step - 1) / step;
}

std::vector<std::size_t> ChooseSamples(const SurfelCloud& cloud, std::size_t most)
{
  const std::size_t count = cloud.NumberOfSurfels;
  const std::size_t step = StepOf(count, most);
  const std::size_t wanted = NumberOfSamples(count, most);
  std::vector<std::pair<std::uint32_t, std::size_t>> some;
  for (std::size_t i = 0; step > 1 && i < count; ++i)
  {
    const std::uint32_t key = KeyOfPosition(cloud.Position(i));
    if (key < Keys / step)
    {
      some.emplace_back(key, i);
    }
  }
  std::vector<std::size_t> samples(wanted);
  if (step == 1 || some.size() < wanted)
  {
    for (std::size_t k = 0; k < wanted; ++k)
    {
      samples[k] = k * step;
    }
    return samples;
  }
  std::nth_element(some.begin(), some.begin() + (wanted - 1), some.end());
  std::transform(some.begin(), some.begin() + wanted, samples.begin(),
    [](const auto& sample) { return sample.second; });
  std::sort(samples.begin(), samples.end());
  return samples;
}
}

// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/ColorVote.h"

#include "Core/Simd/Multiversion.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// The weights' standard deviation over that of the places, and the weight of the point itself:
/// with 1 and 1, noise of one spacing costs a bunny 0.2 dB more, with 2 and 1 as much.
constexpr float VoteReach = 1.5f, OwnWeight = 3.0f;

/// Distances at which the variogram is measured, spacings.
constexpr float NearDistance = 1.0f, FarDistances[] = { 1.5f, 2.5f };

/// Shares of noise in the variogram at one spacing: noise of half a spacing in all directions has
/// hardly any, and needs no vote; noise of one spacing has a third.
constexpr float LeastNoise = 0.15f, FullNoise = 0.25f;

/// What each colour costs: the weighted sum of its differences from all.
SURFEL_MULTIVERSION void FindCosts(const float* __restrict red, const float* __restrict green,
  const float* __restrict blue, const float* __restrict weights, int count, float* __restrict costs)
{
  std::fill_n(costs, count, 0.0f);
  for (int k = 0; k < count; ++k)
  {
    const float r = red[k], g = green[k], b = blue[k], weight = weights[k];
    for (int i = 0; i < count; ++i)
    {
      costs[i] += weight * (std::abs(red[i] - r) + std::abs(green[i] - g) + std::abs(blue[i] - b));
    }
  }
}
}

void ColorVote::Add(float u, float v, const Vector3& color)
{
  this->U[this->Count] = u;
  this->V[this->Count] = v;
  this->Red[this->Count] = static_cast<float>(color[0]);
  this->Green[this->Count] = static_cast<float>(color[1]);
  this->Blue[this->Count] = static_cast<float>(color[2]);
  ++this->Count;
}

float ColorVote::SquaredDistance(int i, int k) const
{
  const float u = this->U[i] - this->U[k], v = this->V[i] - this->V[k];
  return u * u + v * v;
}

ColorVariogram ColorVote::Measure() const
{
  DistanceBin near, far;
  for (int i = 0; i < this->Count; ++i)
  {
    for (int k = i + 1; k < this->Count; ++k)
    {
      const float distance = std::sqrt(this->SquaredDistance(i, k));
      if (distance > FarDistances[1] || (distance > NearDistance && distance < FarDistances[0]))
      {
        continue;
      }
      const float r = this->Red[i] - this->Red[k], g = this->Green[i] - this->Green[k];
      const float b = this->Blue[i] - this->Blue[k];
      (distance > NearDistance ? far : near).Add(r * r + g * g + b * b, distance);
    }
  }
  return ColorVariogram(near, far);
}

float ColorVote::Displacement(const ColorVariogram& sum)
{
  return std::clamp((sum.ShareOfNoise() - LeastNoise) / (FullNoise - LeastNoise), 0.0f, 1.0f);
}

void ColorVote::Choose(float displacement, unsigned char* result) const
{
  const float deviation = VoteReach * displacement, scale = -0.5f / (deviation * deviation);
  float weights[Capacity], costs[Capacity];
  for (int k = 0; k < this->Count; ++k)
  {
    weights[k] = std::exp(scale * this->SquaredDistance(0, k));
  }
  weights[0] *= OwnWeight;
  FindCosts(this->Red, this->Green, this->Blue, weights, this->Count, costs);
  const auto chosen = std::min_element(costs, costs + this->Count) - costs;
  result[0] = static_cast<unsigned char>(this->Red[chosen]);
  result[1] = static_cast<unsigned char>(this->Green[chosen]);
  result[2] = static_cast<unsigned char>(this->Blue[chosen]);
}
}

// SPDX-License-Identifier: BSD-3-Clause
/**
 * How much of the differences between colours is noise. The variogram, the mean squared difference
 * of two colours at a distance, grows from zero, unless each point has noise of its own or is out
 * of its place: then it starts with a step, the nugget (Matheron 1963, "Principles of
 * geostatistics").
 */
#pragma once

#include <algorithm>

namespace SurfelGeometry
{
/// Sums over pairs of points at about the same distance.
struct DistanceBin
{
  float Differences = 0.0f; // squared, 8 bits
  float Distances = 0.0f;   // spacings
  float Count = 0.0f;

  void Add(float squaredDifference, float distance)
  {
    this->Differences += squaredDifference;
    this->Distances += distance;
    ++this->Count;
  }
};

/// A straight line through the variogram at two distances, 8 bits squared. Lines of many places are
/// added.
struct ColorVariogram
{
  float Nugget = 0.0f; // at distance 0; below 0 where colours are smooth
  float AtOneSpacing = 0.0f;

  ColorVariogram() = default;

  /// Zero if a bin is empty, or both have about the same distance.
  ColorVariogram(const DistanceBin& near, const DistanceBin& far)
  {
    const float place = near.Distances / std::max(near.Count, 1.0f);
    const float distance = far.Distances / std::max(far.Count, 1.0f) - place;
    if (near.Count > 0.0f && far.Count > 0.0f && distance > LeastDistance)
    {
      const float difference = near.Differences / near.Count;
      const float slope = (far.Differences / far.Count - difference) / distance;
      this->Nugget = difference - place * slope;
      this->AtOneSpacing = difference + (1.0f - place) * slope;
    }
  }

  void Add(const ColorVariogram& other)
  {
    this->Nugget += other.Nugget;
    this->AtOneSpacing += other.AtOneSpacing;
  }

  /// Share of the nugget in the differences at one spacing, 0 to 1.
  float ShareOfNoise() const
  {
    return this->Nugget > 0.0f ? this->Nugget / std::max(this->AtOneSpacing, this->Nugget) : 0.0f;
  }

private:
  static constexpr float LeastDistance = 0.25f; // between the bins, spacings
};
}

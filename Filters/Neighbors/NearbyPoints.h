// SPDX-License-Identifier: BSD-3-Clause
/**
 * The points about a place, which one query of the tree has found. They answer the queries from
 * points near this place: several times faster than the tree, with the same answers.
 */
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace SurfelGeometry
{
/// A neighbour as an integer. Distances are not negative: their bits are in the same order. So the
/// keys are in the order of the distances, and of the ids where these are equal.
inline std::uint64_t KeyOf(float squaredDistance, int id)
{
  std::uint32_t bits;
  std::memcpy(&bits, &squaredDistance, sizeof bits);
  return static_cast<std::uint64_t>(bits) << 32 | static_cast<std::uint32_t>(id);
}

inline int IdOf(std::uint64_t key)
{
  return static_cast<int>(key & 0xffffffffu);
}

inline float SquaredDistanceOf(std::uint64_t key)
{
  const auto bits = static_cast<std::uint32_t>(key >> 32);
  float result;
  std::memcpy(&result, &bits, sizeof result);
  return result;
}

class NearbyPoints
{
public:
  /// Begins with no points. They will be all those of the cloud at less than `reach` from `center`.
  void Begin(const float center[3], float reach);
  void Add(int id, const float* position)
  {
    if (this->Count == this->Ids.size())
    {
      this->Grow();
    }
    this->X[this->Count] = position[0];
    this->Y[this->Count] = position[1];
    this->Z[this->Count] = position[2];
    this->Ids[this->Count++] = id;
  }

  /// To be called if some were left out: all searches fail.
  void Forget() { this->Reach = -1.0f; }

  std::size_t Size() const { return this->Count; }

  /// Finds the `wanted` points nearest to a place, sorted. Returns false if the cloud may have
  /// nearer ones.
  /// @param likely squared distance within which they probably are; it changes only the time
  /// @param found their keys; more may follow
  bool FindNearest(
    const float place[3], int wanted, float likely, std::vector<std::uint64_t>& found);

private:
  void Grow();
  int Select(float limit);

  float Center[3];
  float Reach = -1.0f;
  std::size_t Count = 0; // of the points; the arrays may be larger
  std::vector<float> X, Y, Z, Squared;
  std::vector<int> Ids;
  std::vector<std::uint64_t> Keys;
};
}

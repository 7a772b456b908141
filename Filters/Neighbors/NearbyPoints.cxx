// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Neighbors/NearbyPoints.h"

#include "Core/Simd/Multiversion.h"

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// Share of a distance that rounding may cost, and more.
constexpr float Rounding = 1e-4f;

/// Below this, squares of distances lose digits.
constexpr float LeastSquare = 1e-30f;

/// More keys are sorted faster by buckets, and more in one bucket by std::sort.
constexpr int MostRanked = 64, MostInserted = 16;
constexpr int MostBuckets = 512;

/// In the order of FLANN's sum, so that all distances are the same to the last bit.
void FindSquares(const float place[3], const float* __restrict x, const float* __restrict y,
  const float* __restrict z, int count, float* __restrict squared)
{
  for (int k = 0; k < count; ++k)
  {
    const float dx = x[k] - place[0], dy = y[k] - place[1], dz = z[k] - place[2];
    squared[k] = dx * dx + dy * dy + dz * dz;
  }
}

/// Sorts distinct keys by counting the smaller ones of each: no branch depends on their order.
SURFEL_MULTIVERSION void SortByRank(
  const std::uint64_t* __restrict keys, int count, std::uint64_t* __restrict sorted)
{
  for (int i = 0; i < count; ++i)
  {
    const auto key = static_cast<std::int64_t>(keys[i]); // the sign bit is that of a distance: 0
    std::int64_t rank = 0;
    for (int k = 0; k < count; ++k)
    {
      rank += static_cast<std::int64_t>(keys[k]) < key ? 1 : 0;
    }
    sorted[rank] = keys[i];
  }
}

void SortBucket(std::uint64_t* begin, std::uint64_t* end)
{
  if (end - begin > MostInserted)
  {
    std::sort(begin, end);
    return;
  }
  for (std::uint64_t* next = begin + 1; next < end; ++next)
  {
    const std::uint64_t key = *next;
    std::uint64_t* to = next;
    for (; to > begin && to[-1] > key; --to)
    {
      *to = to[-1];
    }
    *to = key;
  }
}

/// Sorts distinct keys, from the smallest to number `wanted` at least. The squared distances of the
/// points of a surface are spread evenly, so that each bucket has about one.
/// @param limit squared distance of none is larger
void SortByBuckets(
  const std::uint64_t* keys, int count, int wanted, float limit, std::uint64_t* sorted)
{
  int ends[MostBuckets];
  const int buckets = std::min(count, MostBuckets);
  const float scale = static_cast<float>(buckets) / std::max(limit, LeastSquare);
  const auto bucketOf = [&](std::uint64_t key) {
    return std::min(static_cast<int>(scale * SquaredDistanceOf(key)), buckets - 1);
  };
  std::fill_n(ends, buckets, 0);
  for (int k = 0; k < count; ++k)
  {
    ++ends[bucketOf(keys[k])];
  }
  int sum = 0;
  for (int b = 0; b < buckets; ++b)
  {
    const int size = ends[b];
    ends[b] = sum; // first its beginning
    sum += size;
  }
  for (int k = 0; k < count; ++k)
  {
    sorted[ends[bucketOf(keys[k])]++] = keys[k];
  }
  for (int b = 0, begin = 0; begin < wanted; begin = ends[b++])
  {
    SortBucket(sorted + begin, sorted + ends[b]);
  }
}
}

void NearbyPoints::Begin(const float center[3], float reach)
{
  std::copy_n(center, 3, this->Center);
  this->Reach = reach * reach > LeastSquare ? reach : -1.0f;
  this->Count = 0;
}

void NearbyPoints::Grow()
{
  const std::size_t capacity = std::max<std::size_t>(256, 2 * this->Count);
  for (std::vector<float>* values : { &this->X, &this->Y, &this->Z, &this->Squared })
  {
    values->resize(capacity);
  }
  this->Ids.resize(capacity);
  this->Keys.resize(capacity + 1);
}

/// Puts the keys of the points within a squared distance into Keys. Returns their number.
int NearbyPoints::Select(float limit)
{
  int count = 0;
  for (std::size_t k = 0; k < this->Count; ++k)
  {
    this->Keys[static_cast<std::size_t>(count)] = KeyOf(this->Squared[k], this->Ids[k]);
    count += this->Squared[k] <= limit ? 1 : 0;
  }
  return count;
}

bool NearbyPoints::FindNearest(
  const float place[3], int wanted, float likely, std::vector<std::uint64_t>& found)
{
  const float x = place[0] - this->Center[0], y = place[1] - this->Center[1],
              z = place[2] - this->Center[2];
  // All points within this distance of the place are here: the triangle inequality.
  const float sure =
    (1.0f - Rounding) * this->Reach - (1.0f + Rounding) * std::sqrt(x * x + y * y + z * z);
  if (!(sure > 0.0f) || this->Count < static_cast<std::size_t>(wanted))
  {
    return false;
  }
  FindSquares(place, this->X.data(), this->Y.data(), this->Z.data(), static_cast<int>(this->Count),
    this->Squared.data());
  float limit = std::min(likely, sure * sure);
  int count = this->Select(limit);
  if (count < wanted && likely < sure * sure)
  {
    limit = sure * sure;
    count = this->Select(limit);
  }
  if (count < wanted)
  {
    return false;
  }
  if (found.size() < static_cast<std::size_t>(count))
  {
    found.resize(static_cast<std::size_t>(count));
  }
  if (count <= MostRanked)
  {
    SortByRank(this->Keys.data(), count, found.data());
  }
  else
  {
    SortByBuckets(this->Keys.data(), count, wanted, limit, found.data());
  }
  return true;
}
}

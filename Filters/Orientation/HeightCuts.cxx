// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/HeightCuts.h"

#include "Core/Simd/Multiversion.h"

#include <algorithm>

namespace SurfelGeometry
{
namespace
{
constexpr int MaxPoints = KeptNeighbors + 1;

/// The largest power of two below MaxPoints.
constexpr int FirstStep = 16;
static_assert(FirstStep < MaxPoints && MaxPoints <= 2 * FirstStep);

/// One value for each direction.
typedef double Row __attribute__((vector_size(8 * CutLanes)));

struct Heights
{
  Row Of[MaxPoints]; // each point
  Row Sums, Squares;
};

/// Sorts the heights along each direction: Batcher's merge exchange (Knuth, "The Art of Computer
/// Programming" 3, algorithm 5.2.2 M). No branch depends on the heights.
inline void Sort(int count, Heights& heights)
{
  for (int p = FirstStep; p > 0; p /= 2)
  {
    int r = 0, d = p;
    for (int q = FirstStep;; q /= 2)
    {
      for (int i = 0; i < count - d; ++i)
      {
        if ((i & p) == r)
        {
          const Row a = heights.Of[i], b = heights.Of[i + d];
          heights.Of[i] = b < a ? b : a;
          heights.Of[i + d] = b < a ? a : b;
        }
      }
      if (q == p)
      {
        break;
      }
      d = q - p;
      r = p;
    }
  }
}

inline void FindHeights(
  const PlatePoints& points, const Row& x, const Row& y, const Row& z, Heights& heights)
{
  heights.Sums = heights.Squares = Row{};
  for (int k = 0; k < points.Count; ++k)
  {
    const Vector3& p = points.At[k];
    const Row height = p[0] * x + p[1] * y + p[2] * z;
    heights.Of[k] = height;
    heights.Sums += height;
    heights.Squares += height * height;
  }
}

/// The best cuts of sorted heights, by the numbers of points below.
struct Cuts
{
  Row Within, Numbers, Below; // Below: sums of the heights

  inline void Find(const Heights& heights, int count)
  {
    const Row zero{};
    Row below = zero;
    this->Within = zero + std::numeric_limits<double>::infinity();
    this->Numbers = zero + MinOnSheet;
    this->Below = zero;
    for (int k = 1; k <= count - MinOnSheet; ++k)
    {
      below += heights.Of[k - 1];
      if (k < MinOnSheet)
      {
        continue;
      }
      const Row above = heights.Sums - below;
      const Row within =
        (heights.Squares - below * below / double(k) - above * above / double(count - k)) /
        double(count);
      const auto isLess = within < this->Within;
      this->Within = isLess ? (within > zero ? within : zero) : this->Within;
      this->Numbers = isLess ? zero + double(k) : this->Numbers;
      this->Below = isLess ? below : this->Below;
    }
  }
};

}

SURFEL_MULTIVERSION SURFEL_FLATTEN void CutHeights(
  const PlatePoints& points, const Vector3* directions, int count, Split* splits)
{
  Row x, y, z;
  for (int l = 0; l < CutLanes; ++l)
  {
    const Vector3& direction = directions[std::min(l, count - 1)];
    x[l] = direction[0];
    y[l] = direction[1];
    z[l] = direction[2];
  }
  Heights heights;
  FindHeights(points, x, y, z, heights);
  Sort(points.Count, heights);
  Cuts cuts;
  cuts.Find(heights, points.Count);
  for (int l = 0; l < count; ++l)
  {
    const double k = cuts.Numbers[l], below = cuts.Below[l];
    const auto next = static_cast<int>(k);
    splits[l].Within = cuts.Within[l];
    splits[l].Gap = (heights.Sums[l] - below) / (points.Count - k) - below / k;
    splits[l].Limit = 0.5 * (heights.Of[next - 1][l] + heights.Of[next][l]);
  }
}
}

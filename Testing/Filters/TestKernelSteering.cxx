// SPDX-License-Identifier: BSD-3-Clause
// Kernels are long along the edges of a texture, and still sum to one.
#include "SheetTesting.h"

#include "vtkUnsignedCharArray.h"

#include <functional>

using namespace SurfelTesting;

namespace
{
/// A sheet with the colours of a function.
vtkSmartPointer<vtkPolyData> MakeColoredSheet(
  double jitter, const std::function<double(const Vec&)>& colorAt)
{
  auto data = ToPolyData(MakeSheet(jitter));
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("Colors");
  colors->SetNumberOfComponents(3);
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    Vec p;
    data->GetPoint(i, p.data());
    const double color = std::floor(colorAt(p) + 0.5);
    colors->InsertNextTuple3(color, color, 100.0);
  }
  data->GetPointData()->SetScalars(colors);
  return data;
}

bool IsInside(const Vec& p)
{
  return p[0] > 0.1 && p[0] < 0.9 && p[1] > 0.1 && p[1] < 0.9;
}

/// Means of area and variances in two directions, over the surfels whose place is chosen.
struct MeanKernel
{
  double Across = 0.0, Along = 0.0, Area = 0.0;

  MeanKernel(vtkPolyData* data, double angle, const std::function<bool(const Vec&)>& choose)
  {
    const Surfels surfels(data);
    const double c = std::cos(angle), s = std::sin(angle);
    int count = 0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      if (IsInside(surfels.Position(i)) && choose(surfels.Position(i)))
      {
        const auto v = surfels.Covariance(i);
        this->Across += c * c * v[0] + s * s * v[1] + 2.0 * c * s * v[3];
        this->Along += s * s * v[0] + c * c * v[1] - 2.0 * c * s * v[3];
        this->Area += surfels.Area(i);
        ++count;
      }
    }
    REQUIRE(count > 20);
    this->Across /= count;
    this->Along /= count;
    this->Area /= count;
  }

  double Ratio() const { return this->Along / this->Across; }
};

/// Sums of the kernels at random places.
Spread Sums(vtkPolyData* data, const std::function<bool(const Vec&)>& choose)
{
  const Surfels surfels(data);
  Random random(5);
  std::vector<double> sums;
  while (sums.size() < 600)
  {
    const double x = random(), y = random();
    if (IsInside({ x, y, 0 }) && choose({ x, y, 0 }))
    {
      sums.push_back(surfels.Sum({ x, y, 0 }, { 0, 0, 1 }));
    }
  }
  return Spread(sums);
}

bool Anywhere(const Vec&)
{
  return true;
}
}

TEST_CASE("Edge")
{
  for (const double angle : { 0.0, 0.5, 1.4 })
  {
    CAPTURE(angle);
    const auto distance = [angle](const Vec& p) {
      return std::cos(angle) * (p[0] - 0.5) + std::sin(angle) * (p[1] - 0.5);
    };
    const auto data =
      MakeColoredSheet(0.5, [&distance](const Vec& p) { return distance(p) < 0.0 ? 60.0 : 200.0; });
    const auto result = MakeSurfels(data, true);
    const MeanKernel near(
      result, angle, [&](const Vec& p) { return std::abs(distance(p)) < Spacing; });
    const MeanKernel far(
      result, angle, [&](const Vec& p) { return std::abs(distance(p)) > 4.0 * Spacing; });
    const MeanKernel turned(
      result, angle + 0.25 * Pi, [&](const Vec& p) { return std::abs(distance(p)) < Spacing; });
    // r^4 of a step is some 5; the variance of the cells is not stretched as much as the metric.
    CHECK(near.Ratio() > 3.0);
    CHECK(near.Ratio() < 7.0);
    CHECK(Near(turned.Ratio(), 1.0, 0.2));
    CHECK(Near(far.Ratio(), 1.0, 0.05));
    CHECK(Near(near.Area / far.Area, 1.0, 0.03));
  }
}

/// A fold between two colours is no edge of a texture: a long kernel of one side would show through
/// the other.
TEST_CASE("Fold")
{
  const auto color = [](const Vec& p) { return p[0] < 0.5 ? 60.0 : 200.0; };
  const auto isNear = [](const Vec& p) { return std::abs(p[0] - 0.5) < Spacing; };
  const auto flat = MakeColoredSheet(0.5, color), folded = MakeColoredSheet(0.5, color);
  for (vtkIdType i = 0; i < folded->GetNumberOfPoints(); ++i)
  {
    Vec p;
    folded->GetPoint(i, p.data());
    p[2] = -1.2 * std::max(0.0, p[0] - 0.5); // 50 degrees
    folded->GetPoints()->SetPoint(i, p.data());
  }
  const MeanKernel edge(MakeSurfels(flat, true), 0.0, isNear);
  const MeanKernel fold(MakeSurfels(folded, true), 0.0, isNear);
  CHECK(fold.Along < 0.8 * edge.Along); // 0.74; 1.15 if the fold counts like an edge
}

/// Where the metric changes, at the corners of checkers, there are no holes and no heaps.
TEST_CASE("Sum")
{
  const auto color = [](const Vec& p) {
    return std::fmod(std::floor(8.0 * p[0]) + std::floor(8.0 * p[1]), 2.0) == 0.0 ? 60.0 : 200.0;
  };
  const auto isCorner = [](const Vec& p) {
    const double dx = 8.0 * p[0] - std::round(8.0 * p[0]);
    const double dy = 8.0 * p[1] - std::round(8.0 * p[1]);
    return std::hypot(dx, dy) < 8.0 * 2.0 * Spacing;
  };
  const auto data = MakeColoredSheet(1.0, color); // in squares of a spacing: gaps of up to three
  const auto plain = MakeSurfels(data, false), steered = MakeSurfels(data, true);
  for (const bool corners : { false, true })
  {
    CAPTURE(corners);
    const auto choose = corners ? std::function<bool(const Vec&)>(isCorner) : Anywhere;
    const Spread before = Sums(plain, choose), after = Sums(steered, choose);
    CHECK(Near(after.Mean, 1.0, 0.02));
    CHECK(after.Deviation < 1.35 * before.Deviation);
    CHECK(after.Minimum > 0.75 * before.Minimum);
  }
}

/// Without an edge, kernels are what they were, bit by bit.
TEST_CASE("OneColor")
{
  const auto data = MakeColoredSheet(0.8, [](const Vec&) { return 120.0; });
  const auto plain = MakeSurfels(data, false), steered = MakeSurfels(data, true);
  for (const char* name :
    { SurfelSplatting::Arrays::Covariance, SurfelSplatting::Arrays::AreaVector })
  {
    vtkDataArray* before = plain->GetPointData()->GetArray(name);
    vtkDataArray* after = steered->GetPointData()->GetArray(name);
    for (vtkIdType i = 0; i < before->GetNumberOfValues(); ++i)
    {
      const int components = before->GetNumberOfComponents();
      const auto component = static_cast<int>(i % components);
      REQUIRE(before->GetComponent(i / components, component) ==
        after->GetComponent(i / components, component));
    }
  }
}

/// Noise has no direction: hardly any kernel is stretched.
TEST_CASE("Noise")
{
  Random random(8);
  const auto data =
    MakeColoredSheet(0.5, [&random](const Vec&) { return 60.0 + 100.0 * random(); });
  const auto plain = MakeSurfels(data, false), steered = MakeSurfels(data, true);
  const auto meanRatio = [](vtkPolyData* made) {
    const Surfels surfels(made);
    double sum = 0.0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      const auto v = surfels.Covariance(i);
      const double half = std::hypot(0.5 * (v[0] - v[1]), v[3]), mean = 0.5 * (v[0] + v[1]);
      sum += std::sqrt((mean + half) / (mean - half)) / static_cast<double>(surfels.Count());
    }
    return sum;
  };
  CHECK(meanRatio(steered) < 1.2 * meanRatio(plain));
}

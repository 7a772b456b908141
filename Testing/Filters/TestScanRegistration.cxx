// SPDX-License-Identifier: BSD-3-Clause
// A second scan moves to the first, if nothing tells that it is the other side of things.
#include "CleaningTesting.h"


#include <algorithm>

using namespace SurfelTesting;

namespace
{
/// Two scans of one thing: other samples of it, moved by a spacing and a half and turned a little.
struct TwoScans
{
  std::vector<Vec> Points, True; // True: where those of the second scan are
  std::vector<unsigned char> Shades;
  size_t First = 0;
  double Spacing = 0.0;

  enum Thing
  {
    Ball,        // its normals tell about all motions but turns
    StripedWall, // the stripes tell about one direction
    Chequered,   // colours tell about all directions along the wall
    Plain,       // nothing does
    Leaf         // its sides differ in colour
  };

  explicit TwoScans(Thing thing)
    : Of(thing)
  {
    this->Add(2);
    this->First = this->Points.size();
    this->Add(3);
    this->True = this->Points;
    const double angle = thing == Ball || thing == Leaf ? 0.0 : this->Spacing;
    for (size_t i = this->First; i < this->Points.size(); ++i)
    {
      const Vec p = this->Points[i];
      this->Points[i] = { p[0] - angle * p[1] + 0.7 * this->Spacing,
        p[1] + angle * p[0] - 0.8 * this->Spacing, p[2] + this->Spacing };
    }
  }

  /// How far points of the second scan are from where they should be, spacings: the distance that
  /// 1 % of them exceed. Of the first points beyond the border of the other scan, nothing tells
  /// that they are no longer the first scan's.
  /// @param along false: only across the surface
  double Error(vtkPolyData* data, bool along) const
  {
    vtkDataArray* ids = data->GetPointData()->GetArray("Id");
    std::vector<double> errors;
    for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
    {
      const auto id = static_cast<size_t>(ids->GetComponent(i, 0));
      if (id >= this->First)
      {
        Vec p;
        data->GetPoint(i, p.data());
        const Vec error = Minus(p, this->True[id]);
        const Vec normal = this->Of == Ball ? this->True[id] : Vec{ 0, 0, 1 };
        errors.push_back((along ? Length(error) : std::abs(Dot(error, normal))) / this->Spacing);
      }
    }
    std::sort(errors.begin(), errors.end());
    return errors[static_cast<size_t>(0.99 * static_cast<double>(errors.size()))];
  }

private:
  void Add(unsigned seed)
  {
    Sampled sheet;
    if (this->Of == Ball)
    {
      sheet = MakeSphere(1.0, 8000, Random(seed));
      this->Spacing = std::sqrt(4.0 * Pi / 8000);
    }
    else
    {
      this->Spacing = 0.02;
      sheet = MakeRectangle(
        { -1, -1, 0 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 2, this->Spacing, 0.5, Random(seed));
    }
    for (const Vec& p : sheet.Points)
    {
      const bool x = std::sin(16.0 * p[0]) > 0.0, y = std::sin(16.0 * p[1]) > 0.0;
      const bool light = this->Of == Plain ||
        (this->Of == Leaf             ? this->First > 0
            : this->Of == StripedWall ? x
                                      : x != y);
      this->Points.push_back(p);
      this->Shades.push_back(light ? 200 : 60);
    }
  }

  Thing Of;
};
}

TEST_CASE("Two scans")
{
  struct Case
  {
    TwoScans::Thing Thing;
    bool HasColors, IsJoined;
  };
  for (const Case& c : { Case{ TwoScans::Ball, false, true }, Case{ TwoScans::Ball, true, true },
         Case{ TwoScans::Chequered, true, true }, Case{ TwoScans::Chequered, false, false },
         Case{ TwoScans::StripedWall, true, false }, Case{ TwoScans::Plain, true, false },
         Case{ TwoScans::Leaf, true, false } })
  {
    const TwoScans scans(c.Thing);
    const auto data =
      WithShades(scans.Points, c.HasColors ? scans.Shades : std::vector<unsigned char>());
    AddIds(data);
    vtkNew<vtkPointCloudCleaning> cleaning;
    const Messages said(cleaning);
    cleaning->SetInputData(data);
    cleaning->Update();
    CAPTURE(c.Thing);
    CAPTURE(c.HasColors);
    const auto second = static_cast<double>(scans.Points.size() - scans.First);
    if (!c.IsJoined)
    {
      CHECK(cleaning->GetNumberOfJoinedPoints() == 0);
      CHECK(cleaning->GetNumberOfTwinPoints() == 0);
      continue;
    }
    REQUIRE(said.Warnings.size() == 1);
    CHECK(said.Warnings[0].find("points of a second scan moved to the first") != std::string::npos);
    const vtkIdType found = cleaning->GetNumberOfJoinedPoints() + cleaning->GetNumberOfTwinPoints();
    CHECK(cleaning->GetNumberOfTwinPoints() > 0);
    CHECK(cleaning->GetNumberOfDuplicatePoints() == 0);
    CHECK(Near(1.0 * found, second, 0.002 * second));
    CHECK(cleaning->GetNumberOfJoinedPoints() > 0.5 * second);
    CHECK(cleaning->GetNumberOfMovedPoints() == 0);
    // Places across the surface are known better than along it.
    CHECK(scans.Error(cleaning->GetOutput(), false) < 0.02);
    CHECK((c.Thing == TwoScans::Ball || scans.Error(cleaning->GetOutput(), true) < 0.4));
    cleaning->SmoothingOff();
    cleaning->Update();
    CHECK(cleaning->GetOutput()->GetPoints() == data->GetPoints());
    CHECK(cleaning->GetNumberOfJoinedPoints() == 0);
  }
}

TEST_CASE("Several processes")
{
  const TwoScans ball(TwoScans::Ball), wall(TwoScans::Chequered);
  CHECK(CompareWithProcesses(ball.Points) > 4000);
  CHECK(CompareWithProcesses(wall.Points, wall.Shades) > 8500);
}

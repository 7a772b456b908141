// SPDX-License-Identifier: BSD-3-Clause
// Mixed pixels of laser scanners are stray points, where the scanner is known, and so are halos of
// photogrammetry; what is thin, sparse or seen at a grazing angle stays.
#include "CleaningTesting.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkPointCloudCleaning.h"
#include "vtkPointsToSurfels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

using namespace SurfelTesting;

namespace
{
/// What a beam has measured.
enum Kind
{
  Surface,
  Between, // on a floor, before or behind something that stands on it
  Thin,    // on something thin
  Blended, // between two surfaces, but within two spacings of one
  Mixed    // off both
};

struct LaserScan
{
  Vec Scanner;
  std::vector<Vec> Points;
  std::vector<Kind> Kinds; // [n]
};

/// Discs and a twig before a wall, which have shadows on it. Where the beam meets a rim, the point
/// may be anywhere between the disc and the wall.
class ScanOfDiscs : public LaserScan
{
public:
  static constexpr double Spacing = 0.01; // on the wall
  static constexpr double TwigDepth = 0.5;

  /// @param mixes whether it may
  explicit ScanOfDiscs(bool mixes)
  {
    this->Scanner = { 1.5, 1.5, 4.0 };
    Random random(8);
    for (int row = 0; row < 300; ++row)
    {
      for (int column = 0; column < 300; ++column)
      {
        const Vec wall{ Spacing * (column + 0.2 * random()), Spacing * (row + 0.2 * random()),
          0.0 };
        const double mixing = mixes ? random() : 0.0;
        this->AddBeam(wall, mixing, random());
      }
    }
  }

private:
  /// Where the beam to a point of the wall is at this depth before it.
  Vec At(const Vec& wall, double depth) const
  {
    const double share = depth / this->Scanner[2];
    return { wall[0] + share * (this->Scanner[0] - wall[0]),
      wall[1] + share * (this->Scanner[1] - wall[1]), depth };
  }

  void Add(const Vec& wall, double depth, Kind kind)
  {
    this->Points.push_back(this->At(wall, depth));
    this->Kinds.push_back(kind);
  }

  void AddBeam(const Vec& wall, double mixing, double share)
  {
    const Vec twig = this->At(wall, TwigDepth);
    if (std::abs(twig[0] - 1.5) < 0.015 && twig[1] < 1.3)
    {
      this->Add(wall, TwigDepth, Thin);
      return;
    }
    // 36 discs of different sizes and distances.
    for (int k = 0; k < 36; ++k)
    {
      const int column = k % 6, row = k / 6;
      const double size = 0.08 + 0.02 * ((column + 2 * row) % 5);
      const double depth = 0.1 + 0.05 * ((2 * column + row) % 5);
      const Vec centre{ 0.5 * column + 0.25, 0.5 * row + 0.25, depth };
      const double toRim = Length(Minus(this->At(wall, depth), centre)) - size;
      if (std::abs(toRim) < 0.5 * Spacing && mixing > 0.5)
      {
        const double z = share * depth;
        this->Add(wall, z, std::min(z, depth - z) > 2.0 * Spacing ? Mixed : Blended);
        return;
      }
      if (toRim < 0.0)
      {
        this->Add(wall, depth, Surface);
        return;
      }
    }
    this->Add(wall, 0.0, Surface);
  }
};

/// A scanner 1.7 m above a floor of 40 m, with a fence across it and grass before that; range noise
/// of 2 mm.
class ScanOfFloor : public LaserScan
{
public:
  static constexpr double Step = 0.002; // between beams
  static constexpr double FenceAt = 14.0, FenceTop = 1.2, GrassAt = 6.0;

  ScanOfFloor()
  {
    this->Scanner = { 0.0, 0.0, 1.7 };
    Random random(9);
    for (double pitch = -0.6; pitch < -1.7 / 40.0; pitch += Step)
    {
      for (double yaw = -0.2; yaw < 0.2; yaw += Step)
      {
        const Vec way{ std::cos(pitch) * std::sin(yaw), std::cos(pitch) * std::cos(yaw),
          std::sin(pitch) };
        const double noise = 0.004 * (random() + random() - 1.0);
        this->AddBeam(way, noise);
      }
    }
  }

private:
  Vec Along(const Vec& way, double range) const
  {
    return { this->Scanner[0] + range * way[0], this->Scanner[1] + range * way[1],
      this->Scanner[2] + range * way[2] };
  }

  static bool IsBlade(const Vec& p, int row)
  {
    const double cell = std::floor(p[0] / 0.015);
    const double hash = 43758.5 * std::sin(12.9898 * cell + 78.233 * row);
    const double chance = hash - std::floor(hash);
    return chance < 0.1 && p[2] < 0.05 + chance;
  }

  void AddBeam(const Vec& way, double noise)
  {
    double range = -this->Scanner[2] / way[2];
    const double y = range * way[1];
    const bool isBeside = std::abs(y - FenceAt) < 0.25 || (y > GrassAt && y < GrassAt + 2.0);
    Kind kind = isBeside ? Between : Surface;
    const double toFence = FenceAt / way[1];
    const Vec fence = this->Along(way, toFence);
    const bool isPost = std::abs(fence[0] - 0.2 * std::round(fence[0] / 0.2)) < 0.04;
    if (toFence < range && isPost && fence[2] < FenceTop)
    {
      range = toFence;
      kind = Thin;
    }
    for (int row = 0; row < 20; ++row)
    {
      const double toRow = (GrassAt + 0.1 * row) / way[1];
      if (toRow < range && IsBlade(this->Along(way, toRow), row))
      {
        range = toRow;
        kind = Thin;
      }
    }
    this->Points.push_back(this->Along(way, range + noise));
    this->Kinds.push_back(kind);
  }
};

/// A dark plate before a wall, from which one beam in five comes back. The scanner looks along it
/// at 18 degrees.
class ScanOfPlate : public LaserScan
{
public:
  static constexpr double Spacing = 0.01; // on the wall
  static constexpr double Returns = 0.2;

  ScanOfPlate()
  {
    this->Scanner = { 1.5, 1.5, 4.0 };
    Random random(10);
    for (int row = 0; row < 200; ++row)
    {
      for (int column = 0; column < 200; ++column)
      {
        const double x = 0.5 + Spacing * column, y = 0.5 + Spacing * row;
        // The plate is at x = 1 + 0.45 z.
        const double slope = 0.25 * (1.5 - x);
        const double z = (x - 1.0) / (0.45 - slope);
        const bool isPlate = z > 0.0 && z < 0.3 && y > 1.0 && y < 2.0;
        if (isPlate && random() < Returns)
        {
          const double depth = z + 0.002 * (random() - 0.5);
          this->Points.push_back({ x + slope * depth, y + 0.25 * (1.5 - y) * depth, depth });
          this->Kinds.push_back(Thin);
        }
        this->Points.push_back({ x, y, 0.002 * (random() - 0.5) });
        this->Kinds.push_back(Surface);
      }
    }
  }
};

/// A board half-way to a wall: at its rim, most beams measure any depth between both. So the points
/// of the curtain have none but each other as neighbours.
class ScanOfBoard : public LaserScan
{
public:
  ScanOfBoard()
  {
    this->Scanner = { 1.0, 1.0, 4.0 };
    Random random(12);
    for (int row = 0; row < 200; ++row)
    {
      for (int column = 0; column < 200; ++column)
      {
        const bool isRim = (column == 60 || column == 140) && row < 150;
        const bool isBoard = column > 60 && column < 140 && row < 150;
        const bool isMixed = isRim && random() < 0.7;
        const double depth = isMixed ? 2.0 * random() : isBoard ? 2.0 : 0.0, share = 0.25 * depth;
        const double x = 0.01 * (column + 0.2 * random()), y = 0.01 * (row + 0.2 * random());
        this->Points.push_back({ x + share * (1.0 - x), y + share * (1.0 - y), depth });
        this->Kinds.push_back(!isMixed           ? Surface
            : std::min(depth, 2.0 - depth) > 0.1 ? Mixed
                                                 : Blended);
      }
    }
  }
};

/// A ball on a floor with random points, a sparse leaf before the ball, and some points off the
/// ball and the floor by up to 8 spacings. No scanner.
class CloudWithHalo : public LaserScan
{
public:
  static constexpr double Spacing = 0.01; // of ball and floor

  /// @param share of the points that are off the surfaces
  explicit CloudWithHalo(double share)
  {
    Random random(11);
    const auto height = [&] { return random() < share ? 8.0 * Spacing * random() : 0.0; };
    for (int k = 0; k < 40000; ++k)
    {
      this->Add({ 2.0 * random() - 1.0, 2.0 * random() - 1.0, 0.0 }, { 0.0, 0.0, 1.0 }, height());
    }
    for (int k = 0; k < 31000; ++k)
    {
      const double z = 2.0 * random() - 1.0, turn = 2.0 * Pi * random();
      const double side = std::sqrt(1.0 - z * z);
      const Vec normal{ side * std::cos(turn), side * std::sin(turn), z };
      this->Add({ 0.5 * normal[0], 0.5 * normal[1], 0.7 + 0.5 * normal[2] }, normal, height());
    }
    // Four times as far apart, three spacings before the ball and away from it.
    for (int k = 0; k < 500; ++k)
    {
      const double along = random(), across = random();
      this->Points.push_back({ 0.53 + along, 0.4 * across - 0.2, 0.7 + 0.5 * along });
      this->Kinds.push_back(Thin);
    }
  }

private:
  void Add(const Vec& foot, const Vec& normal, double height)
  {
    this->Points.push_back(
      { foot[0] + height * normal[0], foot[1] + height * normal[1], foot[2] + height * normal[2] });
    this->Kinds.push_back(height > 4.0 * Spacing ? Mixed : height > 0.0 ? Blended : Surface);
  }
};

/// Points of each kind that were removed.
std::array<vtkIdType, 5> Removed(const LaserScan& scan, bool knowsScanner)
{
  const auto data =
    WithScanner(ToPolyData(scan.Points, VTK_DOUBLE), knowsScanner ? &scan.Scanner : nullptr);
  AddIds(data);
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages quiet(cleaning);
  cleaning->SmoothingOff();
  cleaning->GenerateStrayPointsOn();
  cleaning->SetInputData(data);
  cleaning->Update();
  vtkDataArray* ids = cleaning->GetOutput(1)->GetPointData()->GetArray("Id");
  std::array<vtkIdType, 5> removed{};
  for (vtkIdType k = 0; ids && k < ids->GetNumberOfTuples(); ++k)
  {
    ++removed[scan.Kinds[static_cast<size_t>(ids->GetComponent(k, 0))]];
  }
  return removed;
}

double CountOf(const LaserScan& scan, Kind kind)
{
  return static_cast<double>(std::count(scan.Kinds.begin(), scan.Kinds.end(), kind));
}
}

TEST_CASE("Mixed pixels are removed")
{
  const ScanOfDiscs scan(true);
  const auto removed = Removed(scan, true);
  const double mixed = CountOf(scan, Mixed);
  CAPTURE(mixed);
  CAPTURE(removed[Blended]);
  CHECK(mixed > 500);
  CHECK(3.0 * removed[Mixed] >= 2.0 * mixed); // others are in planes of the surfaces beside them
  CHECK(removed[Surface] <= 0.001 * CountOf(scan, Surface));
  CHECK(removed[Thin] == 0);
}

TEST_CASE("Rims, shadows and a twig stay")
{
  const ScanOfDiscs scan(false);
  const auto removed = Removed(scan, true);
  CHECK(removed[Surface] == 0);
  CHECK(removed[Thin] == 0);
}

TEST_CASE("A far floor, a fence and grass stay")
{
  const ScanOfFloor scan;
  const auto before = Removed(scan, false), removed = Removed(scan, true);
  const double thin = CountOf(scan, Thin);
  CAPTURE(thin);
  CHECK(thin > 2000);
  CHECK(removed[Surface] == before[Surface]);
  // Blades of two or three points stand before others and behind others.
  CHECK(removed[Thin] - before[Thin] <= 0.03 * thin);
  // So do the rows of the floor at the foot of the fence, and what is seen of it between blades.
  CHECK(removed[Between] - before[Between] <= 0.05 * CountOf(scan, Between));
}

TEST_CASE("The few points of a dark plate stay")
{
  const ScanOfPlate scan;
  const auto before = Removed(scan, false), removed = Removed(scan, true);
  CAPTURE(CountOf(scan, Thin));
  CHECK(CountOf(scan, Thin) > 200);
  CHECK(removed[Surface] == before[Surface]);
  // At its rim there are too few others to see that it is a plane.
  CHECK(removed[Thin] - before[Thin] <= 0.05 * CountOf(scan, Thin));
}

TEST_CASE("A scanner that is nowhere is as none")
{
  const ScanOfDiscs scan(true);
  const auto without = Removed(scan, false);
  CHECK(without[Surface] == 0);
  CHECK(without[Thin] == 0);
  LaserScan odd = scan;
  for (const double value : { static_cast<double>(NAN), static_cast<double>(INFINITY) })
  {
    odd.Scanner = { value, value, value };
    CHECK(Removed(odd, true) == without);
  }
}

TEST_CASE("Halos are removed")
{
  for (const double share : { 0.05, 0.1 })
  {
    CAPTURE(share);
    const CloudWithHalo cloud(share);
    const auto removed = Removed(cloud, false);
    const double off = CountOf(cloud, Mixed);
    CAPTURE(off);
    CAPTURE(removed[Blended]);
    CHECK(removed[Mixed] >= 0.9 * off);
    CHECK(removed[Surface] == 0);
    CHECK(removed[Thin] <= 0.03 * CountOf(cloud, Thin));
  }
}

TEST_CASE("Clouds without halos stay")
{
  const CloudWithHalo cloud(0.0);
  const auto removed = Removed(cloud, false);
  CHECK(removed[Surface] == 0);
  CHECK(removed[Thin] <= 0.02 * CountOf(cloud, Thin)); // its ends
}

TEST_CASE("Curtains of mixed pixels are removed")
{
  const ScanOfBoard scan;
  const auto before = Removed(scan, false), removed = Removed(scan, true);
  const double mixed = CountOf(scan, Mixed);
  CHECK(mixed > 150);
  CHECK(removed[Mixed] >= 0.8 * mixed);
  CHECK(removed[Mixed] > before[Mixed]);
  CHECK(removed[Surface] == 0);
}

/// Points that know together from where they were scanned are as those that know it each for
/// itself.
TEST_CASE("One viewpoint")
{
  const ScanOfBoard scan;
  const auto removed = Removed(scan, true);
  const auto data = ToPolyData(scan.Points, VTK_DOUBLE);
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages quiet(cleaning);
  cleaning->SmoothingOff();
  cleaning->UseViewpointOn();
  cleaning->SetViewpoint(scan.Scanner.data());
  cleaning->SetInputData(data);
  cleaning->Update();
  const auto all = std::accumulate(removed.begin(), removed.end(), vtkIdType{ 0 });
  CHECK(cleaning->GetNumberOfStrayPoints() == all);
  vtkNew<vtkDoubleArray> viewpoint, bounds;
  viewpoint->SetName("ScanViewpoint");
  viewpoint->SetNumberOfComponents(3);
  viewpoint->InsertNextTuple(scan.Scanner.data());
  bounds->SetName("ScanBounds");
  bounds->SetNumberOfComponents(6);
  bounds->InsertNextTuple(data->GetBounds());
  data->GetFieldData()->AddArray(viewpoint);
  data->GetFieldData()->AddArray(bounds);
  vtkNew<vtkPointsToSurfels> surfels;
  const Messages quietToo(surfels);
  surfels->GetCleaning()->SmoothingOff();
  surfels->SetInputData(data);
  surfels->Update();
  CHECK(data->GetNumberOfPoints() - surfels->GetOutput()->GetNumberOfPoints() == all);
  CHECK(surfels->GetCleaning()->GetUseViewpoint() == 0); // as it was before
}

/// Sparse points in a plane that contains the lines of sight: a curtain, if one scanner has seen
/// them all.
TEST_CASE("A far roof that several scanners have seen stays")
{
  constexpr int roof = 600, rows = 240, columns = 160;
  Random random(12);
  std::vector<Vec> points;
  for (int k = 0; k < roof; ++k)
  {
    const double x = 4.0 * random(), y = 20.0 + 6.0 * random();
    points.push_back({ x, y, 3.0 });
  }
  for (int k = 0; k < rows * columns; ++k) // a loft below it
  {
    points.push_back({ 0.025 * (k % columns), 20.0 + 0.025 * (k / columns), 2.45 });
  }
  const auto removedOf = [&](int scanners) {
    const auto data = ToPolyData(points, VTK_DOUBLE);
    vtkNew<vtkFloatArray> ways;
    ways->SetName("ToScanner");
    ways->SetNumberOfComponents(3);
    for (size_t k = 0; scanners > 0 && k < points.size(); ++k)
    {
      const Vec way = Minus({ 2.0 * (k % scanners), -5.0, 2.0 }, points[k]);
      ways->InsertNextTuple(way.data());
    }
    data->GetPointData()->SetVectors(scanners > 0 ? ways.GetPointer() : nullptr);
    vtkNew<vtkPointCloudCleaning> cleaning;
    const Messages quiet(cleaning);
    cleaning->SmoothingOff();
    cleaning->SetInputData(data);
    cleaning->Update();
    return cleaning->GetNumberOfStrayPoints();
  };
  CHECK(removedOf(1) > roof / 2 + removedOf(0));
  CHECK(removedOf(3) == removedOf(0)); // as of a scan whose scanners are not known
}

TEST_CASE("Several processes remove the same points")
{
  const ScanOfDiscs scan(true);
  CHECK(CompareWithProcesses(scan.Points, {}, &scan.Scanner) > 0.5 * CountOf(scan, Mixed));
  const ScanOfBoard board;
  CHECK(CompareWithProcesses(board.Points, {}, &board.Scanner) > 0.8 * CountOf(board, Mixed));
  const CloudWithHalo cloud(0.05);
  CHECK(CompareWithProcesses(cloud.Points) > 0.9 * CountOf(cloud, Mixed));
}

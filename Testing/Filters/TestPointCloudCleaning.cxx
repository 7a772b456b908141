// SPDX-License-Identifier: BSD-3-Clause
// Stray points are removed, whatever the density; noise is smoothed; clean clouds stay as they are.
#include "CleaningTesting.h"

#include "vtkPointCloudCleaning.h"
#include "vtkUnsignedCharArray.h"

#include <limits>

using namespace SurfelTesting;

namespace
{
void Clean(const std::vector<Vec>& points, const char* what)
{
  INFO(std::string(what));
  const auto data = ToPolyData(points);
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages said(cleaning);
  cleaning->SetInputData(data);
  cleaning->Update();
  CHECK(cleaning->GetNumberOfStrayPoints() == 0);
  CHECK(cleaning->GetNumberOfMovedPoints() == 0);
  CHECK(cleaning->GetNumberOfThickPoints() == 0);
  CHECK(cleaning->GetOutput()->GetPoints() == data->GetPoints());
  CHECK(said.Warnings.empty());
  CHECK(said.Errors.empty());
}

/// A ball on a wall whose density changes by 16, and stray points in a box about them, which are
/// the last ones.
struct Scan
{
  std::vector<Vec> Points;
  size_t Good;

  Scan(double share, const Vec& shift)
  {
    Random random(5);
    this->Points = MakeSphere(1.0, 30000, Random(2)).Points;
    const Sampled dense =
      MakeRectangle({ -2, -2, -1 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 4, 0.015, 0.4, Random(3));
    const Sampled sparse =
      MakeRectangle({ 0, -2, -1 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 4, 0.06, 0.4, Random(4));
    this->Points.insert(this->Points.end(), dense.Points.begin(), dense.Points.end());
    this->Points.insert(this->Points.end(), sparse.Points.begin(), sparse.Points.end());
    this->Good = this->Points.size();
    const size_t strays = static_cast<size_t>(share * this->Good);
    for (size_t i = 0; i < strays; ++i)
    {
      const double x = random(), y = random(), z = random();
      this->Points.push_back({ 4 * x - 2, 4 * y - 2, 3 * z - 1.5 });
    }
    for (Vec& p : this->Points)
    {
      p = { p[0] + shift[0], p[1] + shift[1], p[2] + shift[2] };
    }
  }
};
}

TEST_CASE("Clean")
{
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 };
  Clean(MakeSphere(1.0, 5000, Random(1)).Points, "ball");
  Clean(MakeBox(1.0, 0.7, 0.3, 0.02, Random(1)).Points, "box");
  Clean(MakeTube(0.1, 3.0, 0.05, true, Random(1)).Points, "thin tube");
  Clean(MakeRectangle({ 0, 0, 0 }, x, 1, y, 1, 0.02, 1.0, Random(1)).Points, "random points");

  Sampled leaf = MakeRectangle({ 0, 0, 0 }, x, 1, y, 1, 0.02, 0.5, Random(1));
  leaf.Append(MakeRectangle({ 0, 0, 0.018 }, x, 1, y, 1, 0.02, 0.5, Random(2)));
  Clean(leaf.Points, "leaf of two sides");

  Sampled border = MakeRectangle({ -1, 0, 0 }, x, 1, y, 1, 0.01, 0.5, Random(1));
  border.Append(MakeRectangle({ 0, 0, 0 }, x, 1, y, 1, 0.08, 0.5, Random(2)));
  Clean(border.Points, "64 times the density at once");

  Sampled wire = MakeRectangle({ 0, 0, 0 }, x, 1, y, 1, 0.02, 0.5, Random(1));
  for (int i = 0; i < 100; ++i)
  {
    wire.Add({ 0.5, 0.5, 0.02 * i }, x);
  }
  Clean(wire.Points, "wire that stands on a plane");

  std::vector<Vec> few(10, Vec{ 0, 0, 0 });
  for (int i = 0; i < 10; ++i)
  {
    few[i] = { 1.0 * i * i, 0, 0 };
  }
  Clean(few, "few points");
  Clean({}, "no points");
}

TEST_CASE("Stray points")
{
  // The more there are, the nearer they are to each other.
  for (const double share : { 0.01, 0.05 })
  {
    for (const double shift : { 0.0, 5e6 })
    {
      const Scan scan(share, { shift, 0.5 * shift, 0.0 });
      const auto data = ToPolyData(scan.Points, VTK_DOUBLE);
      AddIds(data);
      vtkNew<vtkPointCloudCleaning> cleaning;
      const Messages said(cleaning);
      cleaning->GenerateStrayPointsOn();
      cleaning->SetInputData(data);
      cleaning->Update();
      CAPTURE(share);
      CAPTURE(shift);
      vtkPolyData* kept = cleaning->GetOutput();
      vtkDataArray* left = kept->GetPointData()->GetArray("Id");
      size_t good = 0;
      for (vtkIdType i = 0; i < kept->GetNumberOfPoints(); ++i)
      {
        const size_t id = static_cast<size_t>(left->GetComponent(i, 0));
        good += id < scan.Good ? 1 : 0;
        Vec p;
        kept->GetPoint(i, p.data());
        REQUIRE(p == scan.Points[id]); // exactly where it was, in the order of the input
      }
      CHECK(good == scan.Good);
      const double strays = static_cast<double>(scan.Points.size() - scan.Good);
      // Those that are left are in the surface or nearer to it than its own spacing.
      CHECK(cleaning->GetNumberOfStrayPoints() > 0.9 * strays);
      CHECK(cleaning->GetOutput(1)->GetNumberOfPoints() == cleaning->GetNumberOfStrayPoints());
      REQUIRE(said.Warnings.size() == 1);
      CHECK(said.Warnings[0].find("stray points removed") != std::string::npos);
      cleaning->RemoveStrayPointsOff();
      cleaning->Update();
      CHECK(cleaning->GetOutput()->GetPoints() == data->GetPoints());
    }
  }
}

/// Normally distributed, of variance 1 (Box and Muller).
double Gaussian(Random& random)
{
  const double length = std::sqrt(-2.0 * std::log(1.0 - random()));
  return length * std::cos(2.0 * Pi * random());
}

/// Points of the unit sphere with Gaussian noise of this many spacings.
std::vector<Vec> NoisySphere(int count, double share)
{
  const double deviation = share * std::sqrt(4.0 * Pi / count);
  Random random(9);
  std::vector<Vec> points = MakeSphere(1.0, count, Random(2)).Points;
  for (Vec& p : points)
  {
    for (double& x : p)
    {
      x += deviation * Gaussian(random);
    }
  }
  return points;
}

TEST_CASE("Noise")
{
  constexpr int count = 20000;
  for (const double share : { 0.3, 1.0 }) // standard deviation in spacings
  {
    for (const double shift : { 0.0, 5e6 })
    {
      std::vector<Vec> points = NoisySphere(count, share);
      double before = 0.0;
      for (Vec& p : points)
      {
        before += std::pow(Length(p) - 1.0, 2) / count;
        p[0] += shift;
      }
      const auto data = ToPolyData(points, VTK_DOUBLE);
      vtkNew<vtkPointCloudCleaning> cleaning;
      const Messages said(cleaning);
      cleaning->GenerateShiftsOn();
      cleaning->SetInputData(data);
      cleaning->Update();
      CAPTURE(share);
      CAPTURE(shift);
      vtkPolyData* smooth = cleaning->GetOutput();
      CHECK(cleaning->GetNumberOfMovedPoints() > 0.99 * count);
      CHECK(cleaning->GetNumberOfThickPoints() == 0);
      REQUIRE(said.Warnings.size() == 1);
      CHECK(said.Warnings[0].find("noisy points moved") != std::string::npos);
      REQUIRE(smooth->GetNumberOfPoints() == count - cleaning->GetNumberOfStrayPoints());
      CHECK(cleaning->GetNumberOfStrayPoints() < 0.001 * count);
      double after = 0.0, length = 0.0;
      for (vtkIdType i = 0; i < smooth->GetNumberOfPoints(); ++i)
      {
        Vec p, moved;
        smooth->GetPoint(i, p.data());
        smooth->GetPointData()->GetArray("CleaningShift")->GetTuple(i, moved.data());
        p[0] -= shift;
        after += std::pow(Length(p) - 1.0, 2) / count;
        length += Dot(moved, moved) / count;
      }
      // A quadric through n points has at its middle about 4 / n of their variance.
      CHECK(after / before < 6.0 / (share < 1.0 ? 32 : 100));
      CHECK(Near(std::sqrt(length / before), 1.0, 0.1));
      cleaning->SmoothingOff();
      cleaning->RemoveStrayPointsOff();
      cleaning->Update();
      CHECK(smooth->GetPoints() == data->GetPoints());
    }
  }
}

TEST_CASE("Too much noise")
{
  vtkNew<vtkPointCloudCleaning> cleaning;
  const auto data = ToPolyData(NoisySphere(5000, 4.0));
  cleaning->SetInputData(data);
  cleaning->Update();
  const vtkIdType kept = cleaning->GetOutput()->GetNumberOfPoints();
  CHECK(kept > 4900);
  CHECK(cleaning->GetNumberOfMovedPoints() == 0);
  CHECK(cleaning->GetNumberOfThickPoints() == kept);
  cleaning->SmoothingOff();
  cleaning->Update();
  CHECK(cleaning->GetNumberOfThickPoints() == 0); // nobody has looked
}

/// Two halves of a sheet, of one colour each, with noise of one spacing; in all directions it mixes
/// their colours, along the normals it does not.
struct NoisyHalves
{
  std::vector<Vec> Points;
  std::vector<unsigned char> Shades;
  static constexpr double Spacing = 0.02;

  explicit NoisyHalves(bool isAcross)
  {
    const Sampled sheet =
      MakeRectangle({ -1, -1, 0 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 2, Spacing, 0.5, Random(1));
    Random random(2);
    for (Vec p : sheet.Points)
    {
      this->Shades.push_back(ShadeAt(p));
      const Vec noise{ Gaussian(random), Gaussian(random), Gaussian(random) };
      for (int c = isAcross ? 2 : 0; c < 3; ++c)
      {
        p[c] += Spacing * noise[c];
      }
      this->Points.push_back(p);
    }
  }

  static unsigned char ShadeAt(const Vec& p) { return std::sin(20.0 * p[0]) > 0.0 ? 200 : 40; }

  /// Share of the points whose colour is not that of their place.
  static double Wrong(vtkPolyData* data)
  {
    double wrong = 0.0;
    for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
    {
      Vec p;
      data->GetPoint(i, p.data());
      wrong += data->GetPointData()->GetScalars()->GetComponent(i, 0) != ShadeAt(p) ? 1.0 : 0.0;
    }
    return wrong / static_cast<double>(data->GetNumberOfPoints());
  }
};

TEST_CASE("Colours of noisy points")
{
  for (const bool isAcross : { false, true })
  {
    const NoisyHalves halves(isAcross);
    const auto data = WithShades(halves.Points, halves.Shades);
    vtkNew<vtkPointCloudCleaning> cleaning;
    const Messages said(cleaning);
    cleaning->SetInputData(data);
    cleaning->Update();
    const double before = NoisyHalves::Wrong(data);
    const double after = NoisyHalves::Wrong(cleaning->GetOutput());
    CAPTURE(isAcross);
    CAPTURE(before);
    CAPTURE(after);
    REQUIRE(said.Warnings.size() == 1);
    const auto count = static_cast<double>(data->GetNumberOfPoints());
    CHECK(cleaning->GetNumberOfMovedPoints() > 0.99 * count);
    if (isAcross)
    {
      CHECK(cleaning->GetNumberOfRecoloredPoints() == 0);
      continue;
    }
    CHECK(before > 0.08);
    CHECK(after < 0.6 * before);
    CHECK(cleaning->GetNumberOfRecoloredPoints() > (before - after) * count);
    CHECK(said.Warnings[0].find("colours of noisy points") != std::string::npos);
    cleaning->SmoothingOff();
    cleaning->Update();
    CHECK(NoisyHalves::Wrong(cleaning->GetOutput()) == before);
  }
}

/// A crown whose leaves have a few points each fills space: it is no surface with noise.
TEST_CASE("Foliage")
{
  Random random(4);
  std::vector<Vec> points;
  for (int leaf = 0; leaf < 3000; ++leaf)
  {
    // A parallelogram with edges u and v.
    const Vec corner{ random(), random(), random() };
    const Vec u{ random() - 0.5, random() - 0.5, random() - 0.5 };
    const Vec v{ random() - 0.5, random() - 0.5, random() - 0.5 };
    for (int k = 0; k < 8; ++k)
    {
      const double a = 0.07 * random(), b = 0.07 * random();
      points.push_back({ corner[0] + a * u[0] + b * v[0], corner[1] + a * u[1] + b * v[1],
        corner[2] + a * u[2] + b * v[2] });
    }
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  const auto data = ToPolyData(points);
  cleaning->SetInputData(data);
  cleaning->Update();
  CHECK(cleaning->GetNumberOfMovedPoints() == 0);
  CHECK(cleaning->GetNumberOfStrayPoints() <= 0.01 * points.size());
  CHECK(cleaning->GetNumberOfThickPoints() == cleaning->GetOutput()->GetNumberOfPoints());
}

/// A spruce as a laser sees it: a trunk with noise, and needles in tufts along boughs that are
/// flatter than a ball. What is no surface stays where it is; the trunk is smoothed.
TEST_CASE("Boughs")
{
  Random random(6);
  std::vector<Vec> points;
  constexpr int needles = 24000, bark = 6000;
  for (int bough = 0; bough < 60; ++bough)
  {
    const double height = 2.0 + 6.0 * random(), angle = 2.0 * Pi * random();
    for (int tuft = 0; tuft < 20; ++tuft)
    {
      const double along = 0.3 + 1.2 * random(), aside = 0.25 * along * Gaussian(random);
      const double droop = height - 0.2 * along + 0.05 * Gaussian(random);
      for (int k = 0; k < needles / 60 / 20; ++k)
      {
        points.push_back(
          { along * std::cos(angle) - aside * std::sin(angle) + 0.03 * Gaussian(random),
            along * std::sin(angle) + aside * std::cos(angle) + 0.03 * Gaussian(random),
            droop + 0.03 * Gaussian(random) });
      }
    }
  }
  for (int k = 0; k < bark; ++k)
  {
    const double angle = 2.0 * Pi * random(), radius = 0.2 + 0.03 * Gaussian(random);
    points.push_back({ radius * std::cos(angle), radius * std::sin(angle), 8.0 * random() });
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  const auto data = ToPolyData(points);
  cleaning->RemoveStrayPointsOff();
  cleaning->GenerateShiftsOn();
  cleaning->SetInputData(data);
  cleaning->Update();
  int moved[2] = { 0, 0 };
  vtkDataArray* shifts = cleaning->GetOutput()->GetPointData()->GetArray("CleaningShift");
  REQUIRE(shifts);
  REQUIRE(shifts->GetNumberOfTuples() == needles + bark);
  for (int i = 0; i < needles + bark; ++i)
  {
    Vec shift;
    shifts->GetTuple(i, shift.data());
    moved[i < needles ? 0 : 1] += Length(shift) > 0.0 ? 1 : 0;
  }
  CAPTURE(moved[0]);
  CAPTURE(moved[1]);
  CHECK(moved[0] < 0.5 * needles);
  CHECK(moved[1] > 0.6 * bark);
  CHECK(cleaning->GetNumberOfThickPoints() > 0.5 * needles);
}

/// 30,000 points of a square in the plane z = 0, a spacing apart on average.
/// @param noise across it, spacings
std::vector<Vec> NoisyPlane(double noise, Random& random)
{
  std::vector<Vec> points;
  for (int i = 0; i < 30000; ++i)
  {
    points.push_back({ 173.0 * random(), 173.0 * random(), noise * Gaussian(random) });
  }
  return points;
}

/// A noisy wall, and before it boards with the same noise and one colour. The noise of the wall
/// tells that these are no sheets with more noise: their faces stay apart.
TEST_CASE("Boards before a noisy wall")
{
  Random random(8);
  constexpr double noise = 0.15, half = 1.0; // spacings
  constexpr int boards = 20, boardPoints = 320;
  std::vector<Vec> points = NoisyPlane(noise, random);
  const int wall = static_cast<int>(points.size());
  for (int i = 0; i < boards * boardPoints; ++i)
  {
    const double off = half + noise * Gaussian(random), at = 8.0 * (i / boardPoints);
    points.push_back({ at + (i % 2 == 0 ? off : -off), 20.0 * random(), 20.0 + 8.0 * random() });
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages said(cleaning);
  cleaning->RemoveStrayPointsOff();
  cleaning->SetInputData(ToPolyData(points));
  cleaning->Update();
  std::vector<double> heights, faces;
  for (int i = 0; i < wall + boards * boardPoints; ++i)
  {
    double p[3];
    cleaning->GetOutput()->GetPoint(i, p);
    (i < wall ? heights : faces)
      .push_back(i < wall ? p[2] : std::abs(p[0] - 8.0 * ((i - wall) / boardPoints)));
  }
  CHECK(Spread(heights).Deviation < 0.5 * noise);
  CHECK(Spread(faces).Mean > 0.95 * half);
}

/// A noisy floor, and above it two layers of wires that cross, with the same noise. The quadric
/// through both layers is no surface: the points stay at their wires.
TEST_CASE("Wires above a noisy floor")
{
  Random random(9);
  constexpr double noise = 0.25, half = 0.8, apart = 3.0; // spacings
  constexpr int wires = 40, wirePoints = 160;
  std::vector<Vec> points = NoisyPlane(noise, random);
  const int floor = static_cast<int>(points.size());
  const auto heightOf = [](int wire) { return 30.0 + (wire % 2 == 0 ? half : -half); };
  for (int i = 0; i < wires * wirePoints; ++i)
  {
    const int wire = i / wirePoints;
    const double along = 0.5 * (i % wirePoints), beside = apart * (wire / 2);
    const double at = beside + noise * Gaussian(random);
    const double height = heightOf(wire) + noise * Gaussian(random);
    points.push_back(wire % 2 == 0 ? Vec{ along, at, height } : Vec{ at, along, height });
  }
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages said(cleaning);
  cleaning->RemoveStrayPointsOff();
  cleaning->SetInputData(ToPolyData(points));
  cleaning->Update();
  std::vector<double> heights, misses;
  for (int i = 0; i < floor + wires * wirePoints; ++i)
  {
    double p[3];
    cleaning->GetOutput()->GetPoint(i, p);
    (i < floor ? heights : misses)
      .push_back(i < floor ? p[2] : p[2] - heightOf((i - floor) / wirePoints));
  }
  CHECK(Spread(heights).Deviation < 0.5 * noise);
  CHECK(Spread(misses).Deviation < 1.5 * noise);
}

TEST_CASE("Two sheets")
{
  // Two scans with the same pattern become one; a leaf with two colours stays.
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 };
  constexpr double gap = 0.02; // one spacing
  Sampled sheets = MakeRectangle({ 0, 0, 0 }, x, 2, y, 2, 0.02, 0.5, Random(1));
  const size_t below = sheets.Points.size();
  sheets.Append(MakeRectangle({ 0, 0, gap }, x, 2, y, 2, 0.02, 0.5, Random(2)));
  for (const bool isLeaf : { true, false })
  {
    vtkNew<vtkUnsignedCharArray> colors;
    colors->SetName("RGB");
    colors->SetNumberOfComponents(3);
    for (size_t i = 0; i < sheets.Points.size(); ++i)
    {
      const bool light = isLeaf ? i < below : std::fmod(sheets.Points[i][0], 0.2) < 0.1;
      colors->InsertNextTuple3(light ? 220 : 60, light ? 200 : 120, 40);
    }
    const auto data = ToPolyData(sheets.Points);
    data->GetPointData()->SetScalars(colors);
    vtkNew<vtkPointCloudCleaning> cleaning;
    const Messages said(cleaning);
    cleaning->SetInputData(data);
    cleaning->Update();
    CAPTURE(isLeaf);
    CHECK((cleaning->GetNumberOfMovedPoints() == 0) == isLeaf);
    std::vector<double> heights;
    for (vtkIdType i = 0; i < cleaning->GetOutput()->GetNumberOfPoints(); ++i)
    {
      heights.push_back(cleaning->GetOutput()->GetPoint(i)[2]);
    }
    CHECK(Near(Spread(heights).Mean, 0.5 * gap, 0.01 * gap));
    CHECK((Spread(heights).Deviation < 0.2 * gap) == !isLeaf);
  }
}

TEST_CASE("Duplicates and NaN")
{
  std::vector<Vec> points = MakeSphere(1.0, 500, Random(1)).Points;
  points.insert(points.begin(), { 0.0, std::numeric_limits<double>::quiet_NaN(), 0.0 });
  points.push_back(points[7]);
  points.push_back(points[7]);
  vtkNew<vtkPointCloudCleaning> cleaning;
  const Messages said(cleaning);
  cleaning->SetInputData(ToPolyData(points));
  cleaning->Update();
  CHECK(cleaning->GetNumberOfNonFinitePoints() == 1);
  CHECK(cleaning->GetNumberOfDuplicatePoints() == 2);
  CHECK(cleaning->GetNumberOfStrayPoints() == 0);
  CHECK(cleaning->GetOutput()->GetNumberOfPoints() == 500);
  REQUIRE(said.Warnings.size() == 1);
  CHECK(said.Warnings[0].find(
          "1 point with NaN or infinite coordinates, or hidden, dropped; 2 duplicates "
          "dropped.") != std::string::npos);
}

TEST_CASE("Several processes")
{
  CHECK(CompareWithProcesses(Scan(0.02, { 0, 0, 0 }).Points) > 1000);
  CHECK(CompareWithProcesses(NoisySphere(20000, 0.5)) > 19000);
  CHECK(CompareWithProcesses(NoisySphere(5000, 4.0)) > 4900);
  const NoisyHalves halves(false);
  CHECK(CompareWithProcesses(halves.Points, halves.Shades) > 9000);
  CHECK(CompareWithProcesses({}) == 0);
  CHECK(CompareWithProcesses({ { 1, 2, 3 }, { 2, 3, 4 } }) == 0);
  // A leaf, whose sides only their colours tell apart, in processes that have one side each.
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 };
  Sampled leaf = MakeRectangle({ 0, 0, 0 }, x, 2, y, 2, 0.02, 0.5, Random(1));
  std::vector<unsigned char> shades(leaf.Points.size(), 40);
  leaf.Append(MakeRectangle({ 0, 0, 0.02 }, x, 2, y, 2, 0.02, 0.5, Random(2)));
  shades.resize(leaf.Points.size(), 200);
  CHECK(CompareWithProcesses(leaf.Points, shades) == 0);
  for (size_t i = 0; i < shades.size(); ++i)
  {
    shades[i] = std::fmod(leaf.Points[i][0], 0.2) < 0.1 ? 200 : 40; // two scans of one pattern
  }
  CHECK(CompareWithProcesses(leaf.Points, shades) > 10000);
}

TEST_CASE("Threads")
{
  Scan scan(0.05, { 0, 0, 0 });
  Random random(3);
  for (Vec& p : scan.Points)
  {
    p[2] += 0.03 * random();
  }
  const auto sums = WithThreads({ 1, 2, 8 }, [&] {
    vtkNew<vtkPointCloudCleaning> cleaning;
    const Messages said(cleaning);
    cleaning->SetInputData(ToPolyData(scan.Points));
    cleaning->Update();
    CHECK(cleaning->GetNumberOfMovedPoints() > 0);
    double sum = 0.0;
    for (vtkIdType i = 0; i < cleaning->GetOutput()->GetNumberOfPoints(); ++i)
    {
      Vec p;
      cleaning->GetOutput()->GetPoint(i, p.data());
      sum += (1.0 + i % 7) * (p[0] + 2 * p[1] + 3 * p[2]);
    }
    return sum;
  });
  CHECK(sums[0] == sums[1]);
  CHECK(sums[0] == sums[2]);
}

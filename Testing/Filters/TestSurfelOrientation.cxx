// SPDX-License-Identifier: BSD-3-Clause
// Outsides: closed things are turned outward and are one-sided, open or doubtful ones are
// two-sided.
#include "SurfelTesting.h"

#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkSurfelEstimation.h"

using namespace SurfelTesting;

namespace
{
/// Shares of a range of points.
struct Sides
{
  double Right = 0.0, Wrong = 0.0, TwoSided = 0.0;
};

Sides CountSides(const Surfels& surfels, const Sampled& truth, size_t begin, size_t end)
{
  Sides sides;
  for (size_t i = begin; i < end; ++i)
  {
    double& share = surfels.IsTwoSided(i)
      ? sides.TwoSided
      : (Dot(surfels.Normal(i), truth.Normals[i]) > 0.0 ? sides.Right : sides.Wrong);
    share += 1.0 / (end - begin);
  }
  return sides;
}

Sides Estimate(const Sampled& truth, vtkSurfelEstimation* estimation)
{
  estimation->SetInputData(ToPolyData(truth.Points));
  estimation->Update();
  return CountSides(Surfels(estimation->GetOutput()), truth, 0, truth.Points.size());
}

Sampled Turned(const Sampled& surface) // z becomes x
{
  Sampled result;
  for (size_t i = 0; i < surface.Points.size(); ++i)
  {
    const Vec& p = surface.Points[i];
    const Vec& n = surface.Normals[i];
    result.Add({ p[2], p[0], p[1] }, { n[2], n[0], n[1] });
  }
  return result;
}

TEST_CASE("Closed")
{
  const Sampled surfaces[] = {
    MakeSphere(1.0, 10000, Random(1)), MakeBox(1.0, 0.7, 0.4, 0.02, Random(2)),
    MakeTube(0.05, 2.0, 0.012, true, Random(3)),  // thin
    MakeTube(0.05, 2.0, 0.012, false, Random(4)), // thin, open at its ends
    MakeBox(1.0, 1.0, 0.08, 0.02, Random(5)),     // thin plate
  };
  for (const Sampled& surface : surfaces)
  {
    vtkNew<vtkSurfelEstimation> estimation;
    const Sides sides = Estimate(surface, estimation);
    CHECK(sides.Right >= 0.995);
    CHECK(sides.Wrong <= 0.001);
    CHECK(estimation->GetNumberOfClosedComponents() >= 1);
  }
}

/// A box of 5 x 4 x 2.5 without what a cupboard hides, which stands in the corner at 0, and its
/// sides; its normals point to where the air is.
Sampled MakeRoom(double scale, double cupboard)
{
  constexpr double pitch = 0.05;
  Sampled room;
  const auto isHidden = [&](const Vec& p) {
    return p[0] < cupboard && p[1] < cupboard && p[2] < cupboard;
  };
  const auto add = [&](const Vec& corner, const Vec& u, double a, const Vec& v, double b) {
    const Sampled side = MakeRectangle(corner, u, a, v, b, pitch, 1.0, Random(11));
    for (size_t i = 0; i < side.Points.size(); ++i)
    {
      if (!isHidden(side.Points[i]))
      {
        const Vec& p = side.Points[i];
        room.Add({ scale * p[0], scale * p[1], scale * p[2] }, side.Normals[i]);
      }
    }
  };
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 }, z{ 0, 0, 1 };
  const double c = cupboard;
  add({ 0, 0, 0 }, x, 5, y, 4);
  add({ 0, 0, 2.5 }, y, 4, x, 5);
  add({ 0, 0, 0 }, y, 4, z, 2.5);
  add({ 5, 0, 0 }, z, 2.5, y, 4);
  add({ 0, 0, 0 }, z, 2.5, x, 5);
  add({ 0, 4, 0 }, x, 5, z, 2.5);
  if (c > 0.0)
  {
    add({ 0, 0, c }, x, c, y, c);
    add({ c, 0, 0 }, y, c, z, c);
    add({ 0, c, 0 }, z, c, x, c);
  }
  return room;
}

/// A flat ball that sticks out of a plinth, whose faces go on within the ball: the ball is closed,
/// the plinth is not. Random points. Returns the sides of those of the plinth outside of the ball.
Sides SidesOfPlinth(int seed)
{
  constexpr double size[3] = { 1.0, 1.0, 0.5 }, radius = 0.45, pitch = 0.0185;
  const Vec middle{ 0.5, 0.5, 0.55 };
  Random random(seed);
  Sampled truth;
  std::size_t visible = 0;
  const auto isInBall = [&](const Vec& p) {
    return std::hypot(p[0] - middle[0], p[1] - middle[1], 2.0 * (p[2] - middle[2])) < 1.1 * radius;
  };
  for (const bool isHidden : { false, true }) // those within the ball last
  {
    for (int face = 0; face < 6; ++face)
    {
      const int z = face / 2, x = (z + 1) % 3, y = (z + 2) % 3;
      const auto count = static_cast<int>(size[x] * size[y] / (pitch * pitch));
      for (int k = 0; k < count; ++k)
      {
        Vec p{}, n{};
        p[x] = size[x] * random();
        p[y] = size[y] * random();
        p[z] = face % 2 * size[z];
        n[z] = face % 2 != 0 ? 1.0 : -1.0;
        if (isInBall(p) == isHidden)
        {
          truth.Add(p, n);
        }
      }
    }
    if (!isHidden)
    {
      visible = truth.Points.size();
    }
  }
  const Sampled ball = MakeSphere(radius, 4000, Random(seed + 100));
  for (const Vec& p : ball.Points)
  {
    truth.Add({ p[0] + middle[0], p[1] + middle[1], 0.5 * p[2] + middle[2] }, p);
  }
  vtkNew<vtkSurfelEstimation> estimation;
  Estimate(truth, estimation);
  return CountSides(Surfels(estimation->GetOutput()), truth, 0, visible);
}

/// At the edges of open faces there is no outside, though something closed is beside them: 8 % of
/// the points had a wrong one.
TEST_CASE("Edges of open faces")
{
  for (const int seed : { 1, 2, 3 })
  {
    CAPTURE(seed);
    CHECK(SidesOfPlinth(seed).Wrong <= 0.003);
  }
}

/// A room is seen from inside: if something is wholly in it, or if its cupboard is below and it is
/// as high as a room. Others are boxes.
TEST_CASE("Rooms")
{
  const auto facing = [](const Sampled& room, const Sampled& content) -> std::string {
    Sampled all = room;
    all.Append(content);
    vtkNew<vtkSurfelEstimation> estimation;
    Estimate(all, estimation);
    const Surfels surfels(estimation->GetOutput());
    const size_t walls = room.Points.size();
    if (!content.Points.empty())
    {
      CHECK(CountSides(surfels, all, walls, all.Points.size()).Right > 0.97);
    }
    const Sides sides = CountSides(surfels, all, 0, walls);
    return sides.Right > 0.97 ? "in" : (sides.Wrong > 0.97 ? "out" : "unclear");
  };
  const Sampled nothing;
  Sampled ball = MakeSphere(0.4, 2000, Random(12));
  ball.Shift({ 2.5, 2, 1 });
  Sampled beside = MakeSphere(0.4, 2000, Random(12));
  beside.Shift({ 6, 2, 1 });
  CHECK(facing(MakeRoom(1.0, 0.0), nothing) == "out");
  CHECK(facing(MakeRoom(1.0, 1.5), nothing) == "in");
  CHECK(facing(MakeRoom(0.1, 1.5), nothing) == "out");
  CHECK(facing(MakeRoom(1.0, 0.0), ball) == "in");
  CHECK(facing(MakeRoom(1.0, 0.0), beside) == "out");
  // Noise takes points of a box inside, and what pokes into it goes on outside.
  Sampled noisy = MakeRoom(1.0, 0.0), statue = MakeSphere(0.8, 5000, Random(14));
  Random noise(15);
  for (Vec& p : noisy.Points)
  {
    for (double& x : p)
    {
      x += 0.025 * noise.Uniform(-1.7, 1.7);
    }
  }
  statue.Shift({ 2.5, 2, 2.3 });
  CHECK(facing(noisy, nothing) == "out");
  CHECK(facing(MakeRoom(1.0, 0.0), statue) == "out");
  // Of a sphere in a sphere nothing is level. MakeSphere's normals are outward, and stay.
  CHECK(facing(MakeSphere(2.0, 20000, Random(13)), MakeSphere(0.4, 2000, Random(12))) == "in");
}

/// Each set of a cloud takes its time to be told from a room.
TEST_CASE("The search for rooms reports progress")
{
  Sampled balls = MakeSphere(1.0, 2000, Random(16)), other = balls;
  other.Shift({ 5, 0, 0 });
  balls.Append(other);
  vtkNew<vtkSurfelEstimation> estimation;
  int reports = 0;
  vtkNew<vtkCallbackCommand> count;
  count->SetClientData(&reports);
  count->SetCallback([](vtkObject* caller, unsigned long, void* number, void*) {
    const double progress = static_cast<vtkAlgorithm*>(caller)->GetProgress();
    *static_cast<int*>(number) += progress > 0.831 && progress < 0.849 ? 1 : 0; // rooms
  });
  estimation->AddObserver(vtkCommand::ProgressEvent, count);
  Estimate(balls, estimation);
  CHECK(reports == 1); // between the balls
}

/// Noise cuts the parts of two boxes that are inside of each other off those outside: still neither
/// is a room. MakeRoom's normals are inward.
TEST_CASE("Boxes in one another")
{
  Sampled boxes = MakeRoom(1.0, 0.0), other = MakeRoom(1.0, 0.0);
  other.Shift({ 2.5, 2, 1.25 });
  boxes.Append(other);
  Random noise(16);
  for (Vec& p : boxes.Points)
  {
    for (double& x : p)
    {
      x += 0.025 * noise.Uniform(-1.7, 1.7);
    }
  }
  vtkNew<vtkSurfelEstimation> estimation;
  Estimate(boxes, estimation);
  const Surfels surfels(estimation->GetOutput());
  CHECK(CountSides(surfels, boxes, 0, boxes.Points.size()).Right < 0.05);
}

/// A sphere with a hole at its bottom is closed; half a sphere is not.
TEST_CASE("Holes")
{
  for (const double cut : { -0.9, 0.0 })
  {
    const Sampled full = MakeSphere(1.0, 20000, Random(6));
    Sampled open;
    for (size_t i = 0; i < full.Points.size(); ++i)
    {
      if (full.Points[i][2] > cut)
      {
        open.Add(full.Points[i], full.Normals[i]);
      }
    }
    vtkNew<vtkSurfelEstimation> estimation;
    const Sides sides = Estimate(open, estimation);
    if (cut < -0.5)
    {
      CHECK(sides.Right >= 0.99);
    }
    else
    {
      CHECK(sides.TwoSided >= 0.99);
    }
  }
}

TEST_CASE("Open")
{
  Sampled wave;
  Random random(7);
  for (int i = 0; i < 20000; ++i)
  {
    const double x = 4.0 * random(), y = 4.0 * random();
    wave.Add({ x, y, 0.2 * std::sin(3.0 * x) * std::cos(2.0 * y) }, { 0, 0, 1 });
  }
  const Sampled plane =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.01, 1.0, Random(8));
  for (const Sampled& surface : { wave, plane })
  {
    vtkNew<vtkSurfelEstimation> estimation;
    CHECK(Estimate(surface, estimation).TwoSided >= 0.9999);
    // A viewpoint that all of it faces decides.
    estimation->SetViewpoint(2, 2, -30);
    estimation->UseViewpointOn();
    const Sides seen = Estimate(surface, estimation);
    CHECK(seen.Wrong >= 0.9999); // all of them face down, where the viewpoint is
    // One in its plane does not.
    estimation->SetViewpoint(100, 2, 0);
    CHECK(Estimate(surface, estimation).TwoSided >= 0.9999);
  }
}

/// Things near each other: each its own verdict.
TEST_CASE("Scene")
{
  Sampled scene = MakeTube(0.05, 2.0, 0.012, true, Random(9));
  scene.Shift({ 0.5, 0.5, 0.0 });
  const size_t first = scene.Points.size();
  Sampled across = Turned(MakeTube(0.05, 2.0, 0.012, true, Random(10)));
  across.Shift({ -0.5, 0.65, 1.0 }); // passes the first tube at a distance of 0.05
  scene.Append(across);
  const size_t second = scene.Points.size();
  scene.Append(MakeRectangle(
    { -0.5, 0, -0.05 }, { 1, 0, 0 }, 2, { 0, 1, 0 }, 2, 0.015, 1.0, Random(11))); // floor
  vtkNew<vtkSurfelEstimation> estimation;
  Estimate(scene, estimation);
  const Surfels surfels(estimation->GetOutput());
  CHECK(CountSides(surfels, scene, 0, first).Right >= 0.995);
  CHECK(CountSides(surfels, scene, first, second).Right >= 0.995);
  CHECK(CountSides(surfels, scene, second, scene.Points.size()).TwoSided >= 0.9999);
  CHECK(estimation->GetNumberOfComponents() == 3);
}

/// Surfaces that cross: no verdict runs across the crossing, and next to nothing is wrong.
TEST_CASE("Crossing")
{
  Sampled sheets =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.01, 1.0, Random(12));
  sheets.Append(
    MakeRectangle({ 0.5, 0, -0.5 }, { 0, 1, 0 }, 1, { 0, 0, 1 }, 1, 0.01, 1.0, Random(13)));
  vtkNew<vtkSurfelEstimation> estimation;
  CHECK(Estimate(sheets, estimation).TwoSided >= 0.999);

  Sampled tubes = MakeTube(0.1, 2.0, 0.015, true, Random(14));
  tubes.Shift({ 0, 0, -1.0 });
  Sampled across = Turned(MakeTube(0.1, 2.0, 0.015, true, Random(15)));
  across.Shift({ -1.0, 0.06, 0.0 });
  tubes.Append(across);
  const Sides crossing = Estimate(tubes, estimation);
  CHECK(crossing.Right >= 0.9);
  CHECK(crossing.Wrong <= 0.01);

  Sampled ball = MakeSphere(1.0, 20000, Random(16)); // sunk into a floor
  ball.Append(
    MakeRectangle({ -2, -2, -0.4 }, { 1, 0, 0 }, 4, { 0, 1, 0 }, 4, 0.025, 1.0, Random(17)));
  Estimate(ball, estimation);
  const Surfels surfels(estimation->GetOutput());
  const Sides sphere = CountSides(surfels, ball, 0, 20000);
  CHECK(sphere.Wrong <= 0.01);
  CHECK(CountSides(surfels, ball, 20000, ball.Points.size()).TwoSided >= 0.95);
}

TEST_CASE("Modes")
{
  const Sampled sphere = MakeSphere(1.0, 5000, Random(18));
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetViewpoint(0, 0, 5);
  estimation->SetOrientationModeToViewpoint();
  estimation->UseViewpointOn(); // without effect here
  for (bool isTwoSided : { false, true })
  {
    if (isTwoSided)
    {
      estimation->SetOrientationModeToTwoSided();
    }
    Estimate(sphere, estimation);
    const Surfels surfels(estimation->GetOutput());
    vtkIdType wrong = 0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      const Vec toward = Minus({ 0, 0, 5 }, surfels.Position(i));
      const bool isAway = Dot(toward, surfels.Normal(i)) < 0.0;
      wrong += surfels.IsTwoSided(i) != isTwoSided || isAway ? 1 : 0;
    }
    CHECK(wrong == 0);
  }
  estimation->UseViewpointOff();
  CHECK(Estimate(sphere, estimation).TwoSided >= 0.9999);
  CHECK(estimation->GetNumberOfTwoSidedSurfels() == 5000);

  estimation->SetOrientationModeToAsGiven();
  {
    auto data = ToPolyData(sphere.Points);
    AddNormals(data, sphere.Normals);
    estimation->SetInputData(data);
    estimation->Update();
    const Sides given =
      CountSides(Surfels(estimation->GetOutput()), sphere, 0, sphere.Points.size());
    CHECK(given.Right >= 0.9999);
    // Normals from another array point inward.
    vtkNew<vtkDoubleArray> inward;
    inward->DeepCopy(data->GetPointData()->GetNormals());
    inward->SetName("inward");
    for (vtkIdType i = 0; i < inward->GetNumberOfValues(); ++i)
    {
      inward->SetValue(i, -inward->GetValue(i));
    }
    data->GetPointData()->AddArray(inward);
    estimation->SetNormalsArrayName("inward");
    estimation->Update();
    const Sides named =
      CountSides(Surfels(estimation->GetOutput()), sphere, 0, sphere.Points.size());
    CHECK(named.Right <= 0.0001);
    estimation->SetNormalsArrayName("missing");
    estimation->Update();
    CHECK(CountSides(Surfels(estimation->GetOutput()), sphere, 0, sphere.Points.size()).Right >=
      0.9999);
    estimation->SetNormalsArrayName(nullptr);
  }
  Messages messages(estimation);
  estimation->SetInputData(ToPolyData(sphere.Points));
  estimation->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("AS_GIVEN") != std::string::npos);
  CHECK(estimation->GetOutput()->GetNumberOfPoints() == 0);
}
}

namespace
{
/// A ball over a square, whose first points are those of the ball.
struct BallAndFloor
{
  Sampled All = MakeBallAndWall(20000, -1.5, 0.02);

  /// Sides with these normals given, of the ball or of the square.
  template <typename Normal>
  Sides Given(vtkSurfelEstimation* estimation, bool ofBall, Normal&& normal) const
  {
    std::vector<Vec> normals;
    for (size_t i = 0; i < this->All.Points.size(); ++i)
    {
      normals.push_back(normal(this->All.Points[i], this->All.Normals[i]));
    }
    auto data = ToPolyData(this->All.Points);
    AddNormals(data, normals);
    estimation->SetInputData(data);
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    return ofBall ? CountSides(surfels, this->All, 0, 20000)
                  : CountSides(surfels, this->All, 20000, this->All.Points.size());
  }
};

Vec Times(double a, const Vec& n)
{
  return { a * n[0], a * n[1], a * n[2] };
}
}

/// Signs of given normals that neighbours contradict tell nothing: sides are those without normals.
TEST_CASE("Given normals that point to both sides")
{
  const BallAndFloor scene;
  vtkNew<vtkSurfelEstimation> estimation;
  Messages messages(estimation);
  Random random(21);
  const auto byChance = [&](const Vec&, const Vec& n) { return Times(random() < 0.5 ? -1 : 1, n); };
  const auto half = [](const Vec& p, const Vec& n) { return Times(p[0] < 0.0 ? -1 : 1, n); };
  const auto patches = [](const Vec& p, const Vec& n) {
    const double cell = std::floor(3.0 * p[0]) + std::floor(3.0 * p[1]) + std::floor(3.0 * p[2]);
    return Times(std::fmod(std::abs(cell), 3.0) == 0.0 ? -1 : 1, n);
  };
  const auto few = [&](const Vec&, const Vec& n) { return Times(random() < 0.04 ? -1 : 1, n); };
  for (const bool ofBall : { true, false })
  {
    for (const Sides& sides :
      { scene.Given(estimation, ofBall, byChance), scene.Given(estimation, ofBall, half),
        scene.Given(estimation, ofBall, patches), scene.Given(estimation, ofBall, few) })
    {
      CHECK((ofBall ? sides.Right : sides.TwoSided) >= 0.99);
      CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_WITHOUT_SIDES);
    }
  }
  CHECK(messages.Warnings.size() == 8);
  CHECK(messages.Warnings.back().find("both sides of one surface") != std::string::npos);
  estimation->SetOrientationModeToAsGiven();
  CHECK(scene.Given(estimation, true, byChance).Wrong >= 0.4);
  CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_KEPT);
  CHECK(messages.Warnings.size() == 8);
}

/// Normals that are not across the surface are not used; noise of ten degrees is no reason.
TEST_CASE("Given normals of something else")
{
  const BallAndFloor scene;
  vtkNew<vtkSurfelEstimation> estimation;
  Messages messages(estimation);
  Random random(22);
  const auto noisy = [&](double noise) {
    return [&random, noise](const Vec&, const Vec& n) {
      return Vec{ n[0] + noise * (2.0 * random() - 1.0), n[1] + noise * (2.0 * random() - 1.0),
        n[2] + noise * (2.0 * random() - 1.0) };
    };
  };
  const auto sideways = [](const Vec&, const Vec&) { return Vec{ 1, 0, 0 }; };
  const auto swapped = [](const Vec&, const Vec& n) { return Vec{ n[1], n[2], n[0] }; };
  for (const Sides& sides : { scene.Given(estimation, true, sideways),
         scene.Given(estimation, true, swapped), scene.Given(estimation, true, noisy(10.0)) })
  {
    CHECK(sides.Right >= 0.99);
    CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_DROPPED);
  }
  CHECK(messages.Warnings.size() == 3);
  CHECK(messages.Warnings.back().find("not those of the surface") != std::string::npos);
  const auto inward = [](const Vec&, const Vec& n) { return Times(-100, n); };
  CHECK(scene.Given(estimation, true, inward).Wrong >= 0.99);
  CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_KEPT);
  CHECK(scene.Given(estimation, true, noisy(0.17)).Right >= 0.99);
  CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_KEPT);
  CHECK(messages.Warnings.size() == 3);
  estimation->KeepNormalsOff();
  CHECK(scene.Given(estimation, true, inward).Right >= 0.99);
  CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NO_NORMALS);
}

/// The two sides of a leaf have opposite normals, whether it has any thickness or not.
TEST_CASE("Given normals of both sides of a leaf")
{
  const double pitch = 0.01;
  for (const double thickness : { 1e-3 * pitch, 0.9 * pitch })
  {
    Sampled leaf =
      MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, pitch, 1.0, Random(23));
    const size_t front = leaf.Points.size();
    Sampled back = thickness < 0.1 * pitch
      ? leaf
      : MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, pitch, 1.0, Random(24));
    back.Shift({ 0, 0, -thickness });
    for (Vec& n : back.Normals)
    {
      n = Times(-1, n);
    }
    leaf.Append(back);
    auto data = ToPolyData(leaf.Points);
    AddNormals(data, leaf.Normals);
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(data);
    estimation->Update();
    CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_KEPT);
    const Surfels surfels(estimation->GetOutput());
    CHECK(CountSides(surfels, leaf, 0, front).Right >= 0.9999);
    CHECK(CountSides(surfels, leaf, front, leaf.Points.size()).Right >= 0.9999);
  }
}

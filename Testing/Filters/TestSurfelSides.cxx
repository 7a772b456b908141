// SPDX-License-Identifier: BSD-3-Clause
// Sides of thin things whose axes are known: tubes alone, across each other, with an end in a wall
// or in another tube, and leaves of two sheets.
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"

using namespace SurfelTesting;

namespace
{
constexpr double Radii[] = { 1.3, 1.5, 1.7, 2.0, 2.5, 3.0, 4.5, 6.0 }; // spacings
constexpr int Seeds = 3;

/// Below this radius a tube may be two-sided, or wrong.
constexpr double SmallestRadius = 1.5;

/// A thing in which one verdict counts: points from `Begin` to `End` of the scene.
struct Patch
{
  size_t Begin, End;
};

struct Scene
{
  Sampled Surface;
  std::vector<Patch> Patches;

  void Add(const Sampled& thing)
  {
    const size_t begin = this->Surface.Points.size();
    this->Surface.Append(thing);
    this->Patches.push_back({ begin, this->Surface.Points.size() });
  }
};

/// z becomes `axis`, then 0 becomes `origin`.
Sampled Placed(const Sampled& thing, const Vec& axis, const Vec& origin)
{
  const double length = Length(axis);
  const Vec w{ axis[0] / length, axis[1] / length, axis[2] / length };
  const double sign = w[2] < 0.0 ? -1.0 : 1.0; // Duff et al. 2017
  const double a = -1.0 / (sign + w[2]);
  const Vec u{ 1.0 + sign * w[0] * w[0] * a, sign * w[0] * w[1] * a, -sign * w[0] };
  const Vec v{ w[0] * w[1] * a, sign + w[1] * w[1] * a, -w[1] };
  const auto turn = [&](const Vec& p) {
    return Vec{ p[0] * u[0] + p[1] * v[0] + p[2] * w[0], p[0] * u[1] + p[1] * v[1] + p[2] * w[1],
      p[0] * u[2] + p[1] * v[2] + p[2] * w[2] };
  };
  Sampled result;
  for (size_t i = 0; i < thing.Points.size(); ++i)
  {
    result.Add(turn(thing.Points[i]), turn(thing.Normals[i]));
  }
  result.Shift(origin);
  return result;
}

/// An open tube whose middle is at `middle`; the spacing is 1.
Sampled Tube(double radius, double length, const Vec& axis, const Vec& middle, Random& random)
{
  const Random own(static_cast<int>(1e6 * random()));
  const double half = 0.5 * length / Length(axis);
  return Placed(MakeTube(radius, length, 1.0, false, own), axis,
    { middle[0] - half * axis[0], middle[1] - half * axis[1], middle[2] - half * axis[2] });
}

struct Verdicts
{
  int Wrong = 0, Undecided = 0, All = 0;
};

/// A patch is wrong if a tenth of it faces inward and is not two-sided (more than what lies inside
/// other things), undecided if half of it is two-sided.
Verdicts Count(const Scene& scene)
{
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(scene.Surface.Points));
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  Verdicts verdicts;
  for (const Patch& patch : scene.Patches)
  {
    double wrong = 0.0, twoSided = 0.0;
    for (size_t i = patch.Begin; i < patch.End; ++i)
    {
      const bool isTwoSided = surfels.IsTwoSided(i);
      twoSided += isTwoSided ? 1.0 : 0.0;
      wrong += !isTwoSided && Dot(surfels.Normal(i), scene.Surface.Normals[i]) < 0.0 ? 1.0 : 0.0;
    }
    const double count = static_cast<double>(patch.End - patch.Begin);
    verdicts.Wrong += wrong > 0.1 * count ? 1 : 0;
    verdicts.Undecided += twoSided > 0.5 * count ? 1 : 0;
    ++verdicts.All;
  }
  return verdicts;
}

/// Counts over all seeds, and checks them where the radius is large enough.
template <typename Make>
void CheckTubes(double allowedUndecided, Make&& make)
{
  for (const double radius : Radii)
  {
    Verdicts sum;
    for (int seed = 1; seed <= Seeds; ++seed)
    {
      Random random(seed);
      const Verdicts verdicts = Count(make(radius, random));
      sum.Wrong += verdicts.Wrong;
      sum.Undecided += verdicts.Undecided;
      sum.All += verdicts.All;
    }
    CAPTURE(radius);
    if (radius >= SmallestRadius)
    {
      CHECK(sum.Wrong == 0);
      CHECK(sum.Undecided <= allowedUndecided * sum.All);
    }
  }
}

TEST_CASE("Free tubes")
{
  CheckTubes(0.0, [](double r, Random& random) {
    Scene scene;
    scene.Add(Tube(r, 20 * r, { 0.2, 0.3, 1 }, { 0, 0, 0 }, random));
    scene.Add(Tube(r, 20 * r, { 0.5, -0.3, 0.4 }, { 30 * r, 0, 0 }, random));
    return scene;
  });
}

/// Axes that meet, pass each other at less than a radius, and touch; at right angles and less.
TEST_CASE("Crossing tubes")
{
  for (const double distance : { 0.0, 0.7, 2.0 })
  {
    for (const double lean : { 0.0, 0.8 })
    {
      CAPTURE(distance);
      CAPTURE(lean);
      CheckTubes(0.0, [&](double r, Random& random) {
        Scene scene;
        scene.Add(Tube(r, 24 * r, { 0, 0, 1 }, { 0, 0, 0 }, random));
        scene.Add(Tube(r, 24 * r, { 1, 0, lean }, { 0, distance * r, 0 }, random));
        return scene;
      });
    }
  }
}

TEST_CASE("Ends in other things")
{
  CheckTubes(0.0, [](double r, Random& random) { // a twig of half the radius on a branch
    Scene scene;
    scene.Add(Tube(2 * r, 40 * r, { 0, 0, 1 }, { 0, 0, 0 }, random));
    scene.Add(Tube(r, 12 * r, { 1, 0, 0.5 }, { 7 * r, 0, 3.5 * r }, random));
    return scene;
  });
  CheckTubes(0.34, [](double r, Random& random) { // a peg in a wall, which has no outside
    Scene scene;
    scene.Add(Tube(r, 16 * r, { 0.3, 0.2, 1 }, { 0, 0, 7 * r }, random));
    scene.Surface.Append(MakeRectangle({ -12 * r, -12 * r, 0 }, { 1, 0, 0 }, 24 * r, { 0, 1, 0 },
      24 * r, 1.0, 1.0, Random(static_cast<int>(1e6 * random()))));
    return scene;
  });
}

/// Two sheets, bent, 0.9 spacings apart: each is seen from its own side only, and has its own
/// direction.
TEST_CASE("Leaves")
{
  for (int seed = 1; seed <= Seeds; ++seed)
  {
    Random random(seed);
    Scene scene;
    for (const double side : { 1.0, -1.0 })
    {
      Sampled sheet;
      for (int x = 0; x < 50; ++x)
      {
        for (int y = 0; y < 50; ++y)
        {
          const double u = x + random(), v = y + random();
          const Vec normal{ -0.2 * std::cos(0.05 * u), 0, 1 };
          const double length = Length(normal);
          sheet.Add({ u, v, 4.0 * std::sin(0.05 * u) + 0.45 * side },
            { side * normal[0] / length, 0, side * normal[2] / length });
        }
      }
      scene.Add(sheet);
    }
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(ToPolyData(scene.Surface.Points));
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    const auto count = static_cast<vtkIdType>(scene.Surface.Points.size());
    vtkIdType right = 0, wrong = 0;
    double tilt = 0.0;
    for (vtkIdType i = 0; i < count; ++i)
    {
      const double cosine = Dot(surfels.Normal(i), scene.Surface.Normals[i]);
      right += !surfels.IsTwoSided(i) && cosine > 0.0 ? 1 : 0;
      wrong += !surfels.IsTwoSided(i) && cosine < 0.0 ? 1 : 0;
      tilt += std::acos(std::min(1.0, std::abs(cosine))) * 180.0 / Pi / static_cast<double>(count);
    }
    CHECK(right >= 0.97 * count);
    CHECK(wrong <= 0.02 * count);
    CHECK(tilt <= 5.0);
  }
}

/// A noisy sheet is not a leaf, neither is a step, nor a sheet between two layers of voxels.
TEST_CASE("Not leaves")
{
  Random random(1);
  Sampled noisy, step, voxels;
  for (int x = 0; x < 80; ++x)
  {
    for (int y = 0; y < 80; ++y)
    {
      const double u = x + random(), v = y + random();
      const double noise = random() + random() + random() - 1.5; // half a spacing
      noisy.Add({ u, v, noise }, { 0, 0, 1 });
      step.Add({ u, v, u > 40.0 ? 0.9 : 0.0 }, { 0, 0, 1 });
      for (const int layer : { 0, 1 })
      {
        if (random() < 0.9)
        {
          voxels.Add({ 100 + 0.05 * x, -30 + 0.05 * y, 7 + 0.05 * layer }, { 0, 0, 1 });
        }
      }
    }
  }
  for (const Sampled& surface : { noisy, step, voxels })
  {
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(ToPolyData(surface.Points));
    estimation->Update();
    CHECK(estimation->GetNumberOfTwoSidedSurfels() >= 0.99 * surface.Points.size());
  }
}
}

// SPDX-License-Identifier: BSD-3-Clause
/**
 * The set-up of every instruction set that this machine has, against that of one surfel at a time:
 * every lens, kernel, grid and light, levels of a hierarchy, and values that are no
 * numbers.
 */
#include "Core/Splats/SplatMaker.h"
#include "TargetUnderTest.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

using namespace SurfelSplatting;

namespace
{
/// Room for the splats of one call.
struct Output
{
  explicit Output(std::size_t size, bool footprints)
    : Splats(size)
    , Boxes(size)
    , Orders(size)
    , Footprints(size)
    , GridLevels(size)
    , Gradients(size)
  {
    this->To.Splats = this->Splats.data();
    this->To.Boxes = this->Boxes.data();
    this->To.Orders = this->Orders.data();
    this->To.Footprints = footprints ? this->Footprints.data() : nullptr;
    this->To.GridLevels = this->GridLevels.data();
    this->To.Gradients = this->Gradients.data();
    this->To.FirstGradient = 0;
  }

  std::vector<Splat> Splats;
  std::vector<PixelBox> Boxes;
  std::vector<float> Orders;
  std::vector<LensFootprint> Footprints;
  std::vector<unsigned char> GridLevels;
  std::vector<SplatGradient> Gradients;
  SplatOutput To{};
};

/// Fields that are equal but for the last bit of a float and, where terms cancel, of the doubles
/// that they were rounded from.
template <typename Fields>
void CheckFields(const Fields& a, const Fields& b, const char* what)
{
  constexpr std::size_t size = sizeof(Fields) / sizeof(float);
  float x[size], y[size];
  std::memcpy(x, &a, sizeof(Fields));
  std::memcpy(y, &b, sizeof(Fields));
  float largest = 0.0f;
  for (std::size_t i = 0; i < size; ++i)
  {
    largest = std::max(largest, std::abs(y[i]));
  }
  for (std::size_t i = 0; i < size; ++i)
  {
    const double tolerance = 2.4e-7 * std::abs(y[i]) + 1e-11 * largest;
    INFO(what, ", field ", i);
    CHECK_NEAR(x[i], y[i], tolerance);
  }
}

void Compare(const SetupTarget& kernel, const SplatContext& context, const SurfelCloud& cloud,
  const CutRange& run)
{
  SplatContext scalar = context;
  scalar.ScalarSetup = true;
  Output expected(run.Count, context.HasLens()), actual(run.Count, context.HasLens());
  SplatMaker maker;
  maker.Set(scalar, cloud);
  maker.Make(run, expected.To);
  maker.Set(context, cloud, kernel);
  maker.Make(run, actual.To);
  CHECK(actual.To.Count == expected.To.Count);
  CHECK(actual.To.Invalid == expected.To.Invalid);
  CHECK(actual.To.Blurred == expected.To.Blurred);
  CHECK(actual.To.Levels == expected.To.Levels);
  CHECK(actual.To.NumberOfGradients == expected.To.NumberOfGradients);
  CHECK_NEAR(actual.To.LargestCoarseColor, expected.To.LargestCoarseColor,
    3e-7 * expected.To.LargestCoarseColor);
  if (actual.To.Count != expected.To.Count)
  {
    return;
  }
  for (std::size_t i = 0; i < expected.To.Count; ++i)
  {
    Splat a = actual.Splats[i], b = expected.Splats[i];
    CHECK(a.Gradient == b.Gradient);
    if (HasGradient(b))
    {
      const auto place = static_cast<std::size_t>(b.Gradient);
      CheckFields(actual.Gradients[place], expected.Gradients[place], "gradient");
    }
    a.Gradient = b.Gradient = 0;
    CheckFields(a, b, "splat");
    CHECK(actual.Orders[i] >= actual.Splats[i].Near);
    CHECK_NEAR(actual.Orders[i], expected.Orders[i], 3e-7 * std::abs(expected.Orders[i]));
    CHECK(std::memcmp(&actual.Boxes[i], &expected.Boxes[i], sizeof(PixelBox)) == 0);
    CHECK(actual.GridLevels[i] == expected.GridLevels[i]);
    if (context.HasLens())
    {
      const LensFootprint &u = actual.Footprints[i], &v = expected.Footprints[i];
      CheckFields(std::array<float, 8>{ u.MeanX, u.MeanY, u.PerForm, u.Area, u.AreaX, u.AreaY,
                    u.Back, u.Share },
        std::array<float, 8>{
          v.MeanX, v.MeanY, v.PerForm, v.Area, v.AreaX, v.AreaY, v.Back, v.Share },
        "footprint");
    }
  }
}

/// Cells of a lens, ellipses.
void CompareCells(const SetupTarget& kernel, const SplatContext& context, const SurfelCloud& cloud,
  const CutRange& run)
{
  for (const SubAperture& cell : DivideLens(context.Camera, context.Optics, { 3 }))
  {
    SplatContext part = context;
    part.Camera = cell.Camera;
    part.Optics = cell.Optics;
    Compare(kernel, part, cloud, run);
  }
}

/// Surfels before and behind the camera, inside and outside of the picture, from points to disks
/// that fill it, some of them seen from behind, some not numbers.
TestCloud MakeCloud(int surfels, Random& random)
{
  TestCloud cloud;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < surfels; ++i)
  {
    TestSurfel s;
    s.Position = { random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-0.5, 6) };
    s.Normal = random.Direction();
    s.SigmaU = std::pow(10.0, random.Uniform(-5, 0));
    s.SigmaV = s.SigmaU * random.Uniform(0.1, 1.0);
    s.Area = 12.0 * s.SigmaU * s.SigmaV;
    for (float& c : s.Color)
    {
      c = static_cast<float>(random.Uniform(0, 1));
    }
    s.Opacity = static_cast<float>(random.Uniform(0, 1));
    s.TwoSided = random.Integer(0, 1) == 1;
    s.Overlap = std::max(random.Integer(-255, 255), 0);
    cloud.Add(s);
    if (random.Integer(0, 40) == 0)
    {
      cloud.AreaVectors[3 * static_cast<std::size_t>(i) + 1] = nan;
    }
    if (random.Integer(0, 40) == 0)
    {
      cloud.Colors[4 * static_cast<std::size_t>(i) + 1] = std::numeric_limits<float>::infinity();
    }
  }
  return cloud;
}

std::vector<Light> SomeLights()
{
  Light headlight;
  headlight.LoneHeadlight = true;
  Light lamp;
  lamp.Positional = true;
  lamp.Position = { 1, 2, 0.5 };
  lamp.Attenuation = { 0.5, 0.1, 0.2 };
  lamp.Color = { 0.2, 0.9, 0.5 };
  Light sun;
  sun.Direction = { 0.6, 0.0, 0.8 };
  Light spot = lamp;
  spot.Position = { -1, 0.5, 0 };
  spot.Direction = { 0, 0, 1 };
  spot.ConeCosine = 0.7;
  spot.Exponent = 3.0;
  return { headlight, lamp, sun, spot };
}

/// Every way of looking at a cloud.
std::vector<SplatContext> Contexts()
{
  std::vector<SplatContext> contexts;
  for (int i = 0; i < 64; ++i)
  {
    SplatContext c;
    c.Camera = PinholeView(300, 200, 250.0);
    c.Camera.Fy = 240.0;
    c.Camera.Parallel = i % 8 == 7;
    const double radii[] = { 0.0, 1e-4, 0.02, 0.3 };
    c.Optics.Radius = radii[i / 2 % 4];
    c.Optics.FocalDistance = 2.5;
    c.Settings.Kernel = i % 2 == 0 ? KernelType::PearsonII : KernelType::Gaussian;
    c.CoarseGrids = i / 8 % 2 == 0;
    c.DepthBuffered = !c.CoarseGrids && i / 32 == 1;
    c.Lights = SomeLights();
    contexts.push_back(c);
  }
  for (const Paint paint : { Paint::LevelColors, Paint::LevelNumbers, Paint::Normals })
  {
    contexts.push_back(contexts[4]);
    contexts.back().Colors = paint;
  }
  for (const int paper : { 0, 1, 5, 37, 39 })
  {
    contexts.push_back(contexts[static_cast<std::size_t>(paper)]);
    contexts.back().Cut.Rule = CutRule::Paper;
  }
  return contexts;
}

void TestSurfels(const SetupTarget& kernel)
{
  Random random(11);
  TestCloud cloud = MakeCloud(403, random);
  cloud.LocalToWorld.L[0] = { 0.9, 0.1, -0.2 };
  cloud.LocalToWorld.T = { 0.1, -0.2, 0.3 };
  cloud.Opacity = 0.9;
  for (const SplatContext& context : Contexts())
  {
    SurfelCloud c = cloud.Get();
    Compare(kernel, context, c, { 0, static_cast<std::uint32_t>(c.NumberOfSurfels), 0 });
    c.Surface.Lit = true;
    c.Surface.Ambient = 0.2;
    c.Surface.Diffuse = 0.7;
    c.Surface.Specular = 0.3;
    c.Surface.SpecularPower = 12.0;
    c.Surface.SpecularColor = { 1.0, 0.5, 0.25 };
    Compare(kernel, context, c, { 3, 57, 0 });
    c.ColorsFloat = nullptr;
    c.TwoSided = nullptr;
    c.Overlaps = nullptr;
    c.Opacities = nullptr;
    c.Surface.Color = { 0.3, 0.6, 0.9 };
    c.Surface.SpecularPower = 1.0;
    Compare(kernel, context, c, { 1, 101, 0 });
    const std::vector<unsigned char> bytes(4 * c.NumberOfSurfels, 77);
    c.ColorsUChar = bytes.data();
    Compare(kernel, context, c, { 0, 1, 0 });
    Compare(kernel, context, c, { 5, 64, 0 });
  }
}

/// Nodes have floats as positions, gradients, and a blur that fills gaps.
void TestNodes(const SetupTarget& kernel)
{
  Random random(12);
  TestCloud surfels;
  for (int i = 0; i < 4000; ++i)
  {
    TestSurfel s;
    s.Normal = random.Direction();
    s.Position = { s.Normal[0], s.Normal[1], s.Normal[2] + 3.0 };
    s.SigmaU = s.SigmaV = 0.03;
    s.Area = 12.566 / 4000;
    s.Overlap = random.Integer(0, 255);
    for (float& c : s.Color)
    {
      c = static_cast<float>(random.Uniform(0, 1));
    }
    surfels.Add(s);
  }
  const TestHierarchy hierarchy(surfels);
  const SurfelCloud nodes = hierarchy.Get();
  for (const SplatContext& context : Contexts())
  {
    const HierarchyLayout& layout = hierarchy.Order.Layout;
    for (int level = 0; level < layout.NumberOfLevels(); ++level)
    {
      const std::size_t count = layout.Count(level, 0);
      CutRange run{ layout.Begin(level, 0), static_cast<std::uint32_t>(count),
        static_cast<std::uint32_t>(level) };
      Compare(kernel, context, nodes, run);
      if (context.HasLens())
      {
        CompareCells(kernel, context, nodes, run);
      }
      if (level + 1 < layout.NumberOfLevels())
      {
        run.Merging = 0.05f + 0.1f * static_cast<float>(level % 8);
        run.Parents = layout.Begin(level + 1, 0);
        Compare(kernel, context, nodes, run);
        if (context.HasLens())
        {
          CompareCells(kernel, context, nodes, run);
        }
      }
    }
  }
}

/// Gaussians in space of all ranks, their nodes and merging pairs, with harmonics.
void TestGaussians(const SetupTarget& kernel, CloudKind kind, bool isShaded)
{
  Random random(13);
  TestCloud cloud;
  cloud.Kind = kind;
  cloud.HasNormals = cloud.Surface.Lit = isShaded;
  cloud.Surface.Ambient = 0.2;
  cloud.Surface.Specular = 0.3;
  cloud.Surface.SpecularPower = 12.0;
  cloud.NumberOfHarmonics = 9;
  for (int i = 0; i < 603; ++i)
  {
    TestGaussian g;
    const double sigma = std::pow(10.0, random.Uniform(-4, -0.5));
    g.Position = { random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-0.5, 6) };
    g.Covariance = RandomCovariance(
      { sigma, random.Integer(0, 4) == 0 ? 0.0 : 0.5 * sigma, 0.2 * sigma }, random);
    g.Density =
      static_cast<float>(random.Uniform(-0.1, 1.2) / (kind == CloudKind::Volume ? sigma : 1.0));
    g.Color = { { 0.1f, 0.5f, 0.9f, static_cast<float>(random()) } };
    g.Normal = random.Direction();
    g.Normal[0] *= 0.5 * i / 603;
    cloud.Add(g);
    for (int k = 0; k < 27; ++k)
    {
      cloud.Harmonics.push_back(static_cast<float>(random.Uniform(-1, 1)));
    }
  }
  cloud.LocalToWorld.L[0] = { 0.9, 0.1, -0.2 };
  const TestHierarchy hierarchy(cloud);
  const SurfelCloud tree = hierarchy.Get();
  const HierarchyLayout& layout = hierarchy.Order.Layout;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cloud.Densities[5] = cloud.Covariances[100] = cloud.Colors[801] = cloud.Normals[77] = nan;
  for (SplatContext context : Contexts())
  {
    context.GaussianRuns = context.Settings.KeepCaptureMass = context.CoarseGrids;
    SurfelCloud leaves = cloud.Get();
    Compare(kernel, context, leaves, { 0, static_cast<std::uint32_t>(leaves.NumberOfSurfels), 0 });
    leaves.ColorsFloat = nullptr;
    Compare(kernel, context, leaves, { 3, 57, 0 });
    for (int level = 0; level + 1 < layout.NumberOfLevels(); ++level)
    {
      CutRange run{ layout.Begin(level, 1), static_cast<std::uint32_t>(layout.Count(level, 1)),
        static_cast<std::uint32_t>(level) };
      Compare(kernel, context, tree, run);
      run.Merging = 0.05f + 0.1f * static_cast<float>(level % 8);
      run.Parents = layout.Begin(level + 1, 1);
      Compare(kernel, context, tree, run);
    }
  }
}

const SetupTarget* const Targets[] = { &SetupTargetBaseline,
#ifdef SURFELSPLATTING_X86_TARGETS
  &SetupTargetAVX2, &SetupTargetAVX512
#endif
};
}

/// The program's argument is baseline, avx2 or avx512.
TEST_CASE("Setup targets")
{
  if (const SetupTarget* target = TargetUnderTest(Targets))
  {
    TestSurfels(*target);
    TestNodes(*target);
    TestGaussians(*target, CloudKind::Capture, false);
    TestGaussians(*target, CloudKind::Volume, false);
    TestGaussians(*target, CloudKind::Volume, true);
  }
}

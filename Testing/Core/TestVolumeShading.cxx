// SPDX-License-Identifier: BSD-3-Clause
/**
 * Volumes that are lit by the mean normals of their Gaussians: the formulas written out here, what
 * pictures and hierarchies make of them, and input that nobody should send.
 */
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace SurfelSplatting;

namespace
{
Vector3Of<double> Lane(const Vector3& v)
{
  return { v[0], v[1], v[2] };
}

Material SomeMaterial()
{
  Material material;
  material.Lit = true;
  material.Ambient = 0.1;
  material.Diffuse = 0.7;
  material.Specular = 0.4;
  material.SpecularPower = 20.0;
  return material;
}

/// ShadeMeanNormal, for the colour 1.
double ShadeOne(
  const Material& material, const Light& light, const Vector3& mean, const Vector3& toViewer)
{
  const ShadedColor<double> shaded = ShadeMeanNormal(Lighting{ material, true, &light, 1 },
    Facet<double>{ { 0, 0, 1 }, Lane(mean), Lane(toViewer) });
  return shaded.Base[0] + shaded.Share[0];
}

/// Toksvig's highlight of the cosine c; short normals have hardly any.
double Highlight(double c, double power, double length)
{
  const double wider = length * power / (length + power * (1.0 - length));
  const double fade = std::min(1.0, 4.0 * length);
  return fade * (1.0 + wider) / (1.0 + power) * std::pow(std::max(0.0, c), wider);
}

/// vtkEncodedGradientShader: Lambert and (n.h)^p, of the side that faces the viewer.
TEST_CASE("Against VTK's ray caster")
{
  Random random(1);
  int lit = 0;
  for (int i = 0; i < 2000; ++i)
  {
    const Material material = SomeMaterial();
    Light light;
    light.Direction = random.Direction();
    const Vector3 l = -1.0 * light.Direction, v = random.Direction();
    const double length = i % 2 == 0 ? 1.0 : random();
    Vector3 n = random.Direction();
    const double found = ShadeOne(material, light, length * n, v);
    n = Dot(n, v) < 0.0 ? -1.0 * n : n;
    const Vector3 h = Normalized({ l[0] + v[0], l[1] + v[1], l[2] + v[2] });
    double expected = material.Ambient;
    if (Dot(n, l) > 0.0)
    {
      ++lit;
      expected += length * material.Diffuse * Dot(n, l) +
        material.Specular * Highlight(Dot(n, h), material.SpecularPower, length);
    }
    CHECK_NEAR(found, expected, 1e-12);
  }
  CHECK(lit > 500);
}

/// The mean over normals about a direction is that of their mean: exactly for diffuse light, nearly
/// for highlights, which are 40 times as bright without the widening.
TEST_CASE("Normals that differ")
{
  Random random(2);
  Material material = SomeMaterial();
  Light light;
  light.LoneHeadlight = true;
  for (const double spread : { 0.1, 0.25, 0.4 })
  {
    for (const double specular : { 0.0, 0.4 })
    {
      material.Specular = specular;
      Vector3 sum{ 0, 0, 0 };
      double mean = 0.0;
      constexpr int count = 40000;
      for (int i = 0; i < count; ++i)
      {
        const double r = spread * std::sqrt(-2.0 * std::log(1.0 - random()));
        const double angle = random.Uniform(0.0, 2.0 * Pi);
        const Vector3 n = Normalized({ r * std::cos(angle), r * std::sin(angle), -1.0 });
        sum = { sum[0] + n[0] / count, sum[1] + n[1] / count, sum[2] + n[2] / count };
        mean += ShadeOne(material, light, n, { 0, 0, -1 }) / count;
      }
      const double found = ShadeOne(material, light, sum, { 0, 0, -1 });
      CHECK_NEAR(found, mean, specular > 0.0 ? 0.03 * mean : 1e-12);
    }
  }
}

TEST_CASE("Lone headlight, and odd normals")
{
  Material material = SomeMaterial();
  Light light;
  light.LoneHeadlight = true;
  const Vector3 v{ 0, 0, -1 };
  const double expected = 0.1 + 0.5 * 0.7 * 0.8 + 0.4 * Highlight(0.8, 20.0, 0.5);
  CHECK_NEAR(ShadeOne(material, light, { 0.3, 0.0, -0.4 }, v), expected, 1e-15);
  CHECK_NEAR(ShadeOne(material, light, { 0.3, 0.0, 0.4 }, v), expected, 1e-15);
  CHECK_NEAR(ShadeOne(material, light, { 0, 0, 0 }, v), 0.1, 0.0);    // ambient only
  CHECK_NEAR(ShadeOne(material, light, { 0, 0, -9 }, v), 1.2, 1e-15); // counts as 1
  CHECK(std::isnan(ShadeOne(material, light, { 0, 0, std::nan("") }, v)));
  // A light opposite to the viewer: there is no half vector.
  light.LoneHeadlight = false;
  light.Direction = { 0, 0, -1 };
  CHECK_NEAR(ShadeOne(material, light, { 0, 0, -1 }, v), 0.1, 0.0);
  CHECK_NEAR(ShadeOne(material, light, { 1, 0, 0 }, v), 0.1, 1e-12);
  // A power of 0 is the same everywhere.
  material.SpecularPower = 0.0;
  light = Light();
  light.LoneHeadlight = true;
  CHECK_NEAR(ShadeOne(material, light, { 0.6, 0, -0.8 }, v), 0.1 + 0.7 * 0.8 + 0.4, 1e-15);
  CHECK_NEAR(ShadeOne(material, light, { 0, 0, 0 }, v), 0.1, 0.0);
}

TestCloud OneGaussian(const Vector3& normal)
{
  TestCloud cloud;
  cloud.Kind = CloudKind::Volume;
  cloud.HasNormals = true;
  cloud.Surface = SomeMaterial();
  TestGaussian g;
  g.Density = 20.0f;
  g.Covariance = { 0.01, 0.01, 0.01, 0, 0, 0 };
  g.Position = { 0, 0, 2 };
  g.Normal = normal;
  cloud.Add(g);
  return cloud;
}

SplatContext ContextWith(const Light& light)
{
  SplatContext context;
  context.Camera = PinholeView(61, 61, 100.0);
  context.Optics.FocalDistance = 2.0;
  context.Lights.push_back(light);
  return context;
}

double RedAtCentre(const SplatContext& context, const SurfelCloud& cloud)
{
  const Picture picture = RenderPicture(context, { cloud });
  REQUIRE(picture.At(30, 30, 3) > 0.5f);
  return picture.At(30, 30, 0) / picture.At(30, 30, 3);
}

/// The cloud's transform turns normals as covectors, and does not change their length.
TEST_CASE("Pictures of one Gaussian")
{
  Light light;
  light.LoneHeadlight = true; // along z
  const SplatContext context = ContextWith(light);
  const auto expected = [](double c, double length) {
    return 0.1 + length * 0.7 * c + 0.4 * Highlight(c, 20.0, length);
  };
  TestCloud cloud = OneGaussian({ 0.3, 0.0, 0.4 });
  CHECK_NEAR(RedAtCentre(context, cloud.Get()), expected(0.8, 0.5), 1e-6); // floats
  cloud.LocalToWorld.L[2] = { 0, 0, -2.0 };                                // z / 2 in normals
  cloud.LocalToWorld.T[2] = 6.0;
  const double c = 0.2 / std::hypot(0.3, 0.2);
  CHECK_NEAR(RedAtCentre(context, cloud.Get()), expected(c, 0.5), 1e-6);
  // Through the lens, and as the root of a tree, too.
  SplatContext blurred = context;
  blurred.Optics = { 0.1, 1.5 };
  CHECK_NEAR(RedAtCentre(blurred, TestHierarchy(cloud).Get()), expected(c, 0.5), 1e-5);

  // Neither unlit volumes nor those without normals are shaded.
  SurfelCloud plain = cloud.Get();
  plain.Normals = nullptr;
  CHECK_NEAR(RedAtCentre(context, plain), 1.0, 1e-6);
  cloud.Surface.Lit = false;
  CHECK_NEAR(RedAtCentre(context, cloud.Get()), 1.0, 1e-6);
  CHECK(Same(RenderPicture(context, { plain }), RenderPicture(context, { cloud.Get() })));
}

/// Gaussians of a bumpy layer; normals about z with random signs, which do not matter.
TestCloud Layer(int across, std::uint64_t seed, bool signs)
{
  Random random(seed);
  TestCloud cloud;
  cloud.Kind = CloudKind::Volume;
  cloud.HasNormals = true;
  cloud.Surface = SomeMaterial();
  for (int i = 0; i < across * across; ++i)
  {
    TestGaussian g;
    const double spacing = 1.0 / across, sigma = 0.6 * spacing;
    g.Position = { (i % across + 0.5) * spacing - 0.5, (i / across + 0.5) * spacing - 0.5,
      2.0 + 0.02 * random() };
    g.Covariance = { sigma * sigma, sigma * sigma, 0.2 * sigma * sigma, 0, 0, 0 };
    g.Density = static_cast<float>(1.5 / sigma);
    const Vector3 n = Normalized({ random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), -1.0 });
    g.Normal = (signs && random.Integer(0, 1) == 1 ? -1.0 : 1.0) * random.Uniform(0.8, 1.0) * n;
    cloud.Add(g);
  }
  return cloud;
}

TEST_CASE("Nodes have the mean normal, whatever the signs")
{
  const TestCloud cloud = Layer(16, 3, true);
  const SurfelCloud leaves = cloud.Get();
  Vector3 sum{ 0, 0, 0 };
  double mass = 0.0;
  for (std::size_t i = 0; i < leaves.NumberOfSurfels; ++i)
  {
    const float* n = leaves.Normals + 3 * i;
    const double m = leaves.Area(i) * (n[2] > 0.0f ? -1.0 : 1.0);
    mass += leaves.Area(i);
    sum = { sum[0] + m * n[0], sum[1] + m * n[1], sum[2] + m * n[2] };
  }
  const TestHierarchy hierarchy(cloud);
  const SurfelCloud tree = hierarchy.Get();
  const std::size_t root = hierarchy.NumberOfNodes() - 1;
  Vector3 found = tree.AreaVector(root);
  found = found[2] > 0.0 ? -1.0 * found : found;
  for (int k = 0; k < 3; ++k)
  {
    CHECK_NEAR(found[k] / mass, sum[k] / mass, 1.0 / PackedOne + 1e-6);
  }
}

/// Normals change colours only: not which nodes are drawn, nor their opacity.
TEST_CASE("Level of detail")
{
  Light light;
  light.LoneHeadlight = true;
  SplatContext context = ContextWith(light);
  context.Camera = PinholeView(80, 80, 120.0);
  for (const double radius : { 0.0, 0.15 })
  {
    context.Optics = { radius, 1.4 };
    context.Cut.Error = 3.0;
    const TestCloud cloud = Layer(96, 5, false);
    TestCloud mixed = cloud, plain = cloud;
    for (std::size_t i = 0; i < mixed.Normals.size() / 3; i += 2)
    {
      for (std::size_t k = 0; k < 3; ++k)
      {
        mixed.Normals[3 * i + k] *= -1.0f;
      }
    }
    plain.HasNormals = false;
    const Picture all = RenderPicture(context, cloud);
    const Picture nodes = RenderPicture(context, { TestHierarchy(cloud).Get() });
    const Picture unlit = RenderPicture(context, { TestHierarchy(plain).Get() });
    const Picture other = RenderPicture(context, { TestHierarchy(mixed).Get() });
    double sumAll = 0.0, sumNodes = 0.0, sumOther = 0.0, sumAlpha = 0.0;
    for (std::size_t i = 0; i < all.Color.size(); i += 4)
    {
      CHECK(nodes.Color[i + 3] == unlit.Color[i + 3]);
      sumAll += all.Color[i];
      sumNodes += nodes.Color[i];
      sumOther += other.Color[i];
      sumAlpha += all.Color[i + 3];
    }
    CHECK(sumAll < 0.95 * sumAlpha);
    // Measured 1.05 and 1.07; 1.29 and 1.39 if highlights were not widened.
    CHECK_NEAR(sumNodes / sumAll, 1.0, 0.1);
    CHECK_NEAR(sumOther / sumNodes, 1.0, 0.01);
    CHECK(Same(nodes, RenderPicture(context, { TestHierarchy(cloud).Get() }, ThreadExecutor(3))));
  }
}

/// A picture without NaN or infinity, whatever the normals; nodes leave such Gaussians out.
TEST_CASE("Odd normals")
{
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                  infinity = std::numeric_limits<float>::infinity();
  Light light;
  light.Direction = { 0.6, 0.0, 0.8 };
  const SplatContext context = ContextWith(light);
  TestCloud odd = Layer(20, 7, true), none = odd;
  for (const float value : { nan, infinity, -infinity })
  {
    for (std::size_t i = 0; i < 400; i += 3)
    {
      odd.Normals[3 * i + i % 3] = value;
      none.Densities[i] = 0.0f;
    }
    Picture picture(61, 61);
    Splatter splatter;
    splatter.Render(context, { odd.Get() }, SerialExecutor(), picture.Get());
    CHECK(Same(picture, RenderPicture(context, none)));
    CHECK(splatter.Statistics().InvalidSurfels == 134);
    CHECK(TestHierarchy(odd).Order.NumberOfInvalidSurfels == 134);
  }
  for (const float value : { 3e38f, 1e-45f, -1e20f })
  {
    TestCloud huge = none;
    std::fill(huge.Normals.begin(), huge.Normals.end(), value);
    const TestHierarchy hierarchy(huge);
    for (const SurfelCloud& cloud : { huge.Get(), hierarchy.Get() })
    {
      const Picture picture = RenderPicture(context, { cloud });
      CHECK(std::all_of(picture.Color.begin(), picture.Color.end(),
        [](float x) { return x >= 0.0f && x <= 1.3f; }));
    }
  }
}
}

// SPDX-License-Identifier: BSD-3-Clause
#include "TestScene.h"

#include "Core/Surfels/NodeMoments.h"
#include "Testing/Shared/TestRun.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace SurfelSplatting
{
void Tangents(const Vector3& normal, Vector3& u, Vector3& v)
{
  const Vector3 axis = std::abs(normal[0]) < 0.6 ? Vector3{ 1, 0, 0 } : Vector3{ 0, 1, 0 };
  u = Cross(normal, axis);
  const double length = Norm(u);
  u = { u[0] / length, u[1] / length, u[2] / length };
  v = Cross(normal, u);
}

TestSurfel SquareSurfel(const Vector3& position, double side, double coverage)
{
  TestSurfel s;
  s.Position = position;
  s.SigmaU = s.SigmaV = 0.5 * side;
  s.Area = coverage * side * side;
  return s;
}

void TestCloud::Add(const TestSurfel& s)
{
  Vector3 u, v;
  Tangents(s.Normal, u, v);
  const double uu = s.SigmaU * s.SigmaU, vv = s.SigmaV * s.SigmaV;
  const int order[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 0, 1 }, { 1, 2 }, { 0, 2 } };
  for (const auto& ij : order)
  {
    this->Covariances.push_back(
      static_cast<float>(uu * u[ij[0]] * u[ij[1]] + vv * v[ij[0]] * v[ij[1]]));
  }
  for (int i = 0; i < 3; ++i)
  {
    this->Positions.push_back(s.Position[i]);
    this->AreaVectors.push_back(static_cast<float>(s.Area * s.Normal[i]));
  }
  this->Colors.insert(this->Colors.end(), s.Color.begin(), s.Color.end());
  this->Opacities.push_back(s.Opacity);
  this->TwoSided.push_back(s.TwoSided ? 1 : 0);
  this->Overlaps.push_back(static_cast<unsigned char>(s.Overlap));
}

Symmetric3 RandomCovariance(const Vector3& sigma, Random& random)
{
  Symmetric3 s{};
  Vector3 axes[3] = { random.Direction() };
  Tangents(axes[0], axes[1], axes[2]);
  for (int i = 0; i < 3; ++i)
  {
    AddOuterProduct(s, axes[i], sigma[i] * sigma[i]);
  }
  return s;
}

void TestCloud::Add(const TestGaussian& g)
{
  const Symmetric3& s = g.Covariance;
  for (const double x : { s.XX, s.YY, s.ZZ, s.XY, s.YZ, s.XZ })
  {
    this->Covariances.push_back(static_cast<float>(x));
  }
  this->Positions.insert(this->Positions.end(), g.Position.begin(), g.Position.end());
  this->AreaVectors.insert(this->AreaVectors.end(), 3, 0.0f); // not read
  this->Colors.insert(this->Colors.end(), g.Color.begin(), g.Color.end());
  this->Opacities.push_back(1.0f);
  this->TwoSided.push_back(1);
  this->Overlaps.push_back(0);
  this->Densities.push_back(g.Density);
  this->Normals.insert(this->Normals.end(), g.Normal.begin(), g.Normal.end());
}

SurfelCloud TestCloud::Get() const
{
  SurfelCloud cloud;
  cloud.NumberOfSurfels = this->TwoSided.size();
  cloud.Kind = this->Kind;
  cloud.Densities = cloud.IsInSpace() ? this->Densities.data() : nullptr;
  cloud.Normals = this->HasNormals ? this->Normals.data() : nullptr;
  cloud.PositionsDouble = this->Positions.data();
  cloud.Covariances = this->Covariances.data();
  cloud.AreaVectors = this->AreaVectors.data();
  cloud.Opacities = this->Opacities.data();
  cloud.ColorsFloat = this->Colors.data();
  cloud.TwoSided = this->TwoSided.data();
  cloud.Overlaps = this->Overlaps.data();
  cloud.Opacity = this->Opacity;
  cloud.LocalToWorld = this->LocalToWorld;
  cloud.Surface = this->Surface;
  return cloud;
}

TestHierarchy::TestHierarchy(const TestCloud& cloud, const Executor& executor)
  : LocalToWorld(cloud.LocalToWorld)
  , Surface(cloud.Surface)
  , Kind(cloud.Kind)
  , HasNormals(cloud.HasNormals)
  , NumberOfHarmonics(cloud.NumberOfHarmonics)
{
  const SurfelCloud surfels = cloud.Get();
  this->Order = MakeKdTreeOrder(surfels, executor);
  const HierarchyLayout& layout = this->Order.Layout;
  std::vector<float> harmonics;
  for (const std::uint32_t i : this->Order.Surfels)
  {
    const auto append = [i](const float* values, std::size_t components, std::vector<float>& to) {
      to.insert(to.end(), values + components * i, values + components * (i + 1));
    };
    const Vector3 p = surfels.Position(i);
    this->Positions.insert(this->Positions.end(), p.begin(), p.end());
    append(surfels.Covariances, 6, this->Covariances);
    append(surfels.AreaVectors, 3, this->AreaVectors);
    append(surfels.Opacities, 1, this->Opacities);
    append(surfels.ColorsFloat, 4, this->LeafColors);
    this->TwoSided.push_back(surfels.TwoSided[i]);
    this->Overlaps.push_back(surfels.Overlaps[i]);
    if (surfels.IsInSpace())
    {
      append(surfels.Densities, 1, this->Densities);
      append(cloud.Normals.data(), 3, this->Normals);
      append(
        cloud.Harmonics.data(), 3 * static_cast<std::size_t>(cloud.NumberOfHarmonics), harmonics);
    }
  }
  this->Nodes.resize(layout.NumberOfInnerNodes());
  FillNodes(this->Get(), layout, executor, this->Nodes.data());
  this->LeafCovariances = MakeLeafCovariances(this->Get(), layout, executor);
  this->Colors.resize(this->Nodes.size());
  FillNodeColors(this->Get(), layout, FindUncovered(this->Get(), layout, executor), executor,
    this->Colors.data());
  this->Table = ClusterBounds(this->Get(), layout, executor);
  if (cloud.NumberOfHarmonics > 0)
  {
    this->Harmonics =
      PackHarmonics(this->Get(), layout, harmonics.data(), cloud.NumberOfHarmonics, executor);
  }
}

SurfelCloud TestHierarchy::Get() const
{
  SurfelCloud cloud;
  cloud.NumberOfSurfels = this->Order.Layout.NumberOfLeaves();
  cloud.PositionsFloat = this->Positions.data();
  cloud.Covariances = this->Covariances.data();
  cloud.AreaVectors = this->AreaVectors.data();
  cloud.TwoSided = this->TwoSided.data();
  cloud.Overlaps = this->Overlaps.data();
  cloud.Opacities = this->Opacities.data();
  cloud.ColorsFloat = this->LeafColors.data();
  cloud.Nodes = this->Nodes.data();
  cloud.NodeColors = this->Colors.data();
  cloud.Kind = this->Kind;
  cloud.Densities = this->Kind == CloudKind::Surfels ? nullptr : this->Densities.data();
  cloud.Normals = this->HasNormals ? this->Normals.data() : nullptr;
  cloud.Harmonics = this->Harmonics.empty() ? nullptr : this->Harmonics.data();
  cloud.NumberOfHarmonics = this->NumberOfHarmonics;
  cloud.LeafCovariances = this->LeafCovariances.data();
  cloud.Clusters = &this->Table;
  cloud.LocalToWorld = this->LocalToWorld;
  cloud.Surface = this->Surface;
  return cloud;
}

Picture::Picture(int width, int height)
  : Width(width)
  , Height(height)
  , Color(static_cast<std::size_t>(width) * height * 4, std::numeric_limits<float>::quiet_NaN())
  , Depth(static_cast<std::size_t>(width) * height, std::numeric_limits<float>::quiet_NaN())
{
}

Frame Picture::Get()
{
  return { this->Width, this->Height, this->Color.data(), this->Depth.data() };
}

SplatContext TestContext()
{
  SplatContext context;
  context.Settings.Kernel =
    SurfelTesting::ThisRun.Variant == "gaussian" ? KernelType::Gaussian : KernelType::PearsonII;
  return context;
}

View PinholeView(int width, int height, double focalLength)
{
  View view;
  view.Width = width;
  view.Height = height;
  view.Fx = view.Fy = focalLength;
  view.Cx = 0.5 * width;
  view.Cy = 0.5 * height;
  view.Near = 1e-3;
  return view;
}

Picture RenderPicture(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const float* occluderDepth, LayerSink* sink)
{
  Picture picture(context.Camera.Width, context.Camera.Height);
  RenderTarget target = picture.Get();
  target.OccluderDepth = occluderDepth;
  target.Sink = sink;
  Splatter().Render(context, clouds, executor, target);
  return picture;
}

Picture RenderPicture(const SplatContext& context, const TestCloud& cloud)
{
  return RenderPicture(context, std::vector<SurfelCloud>{ cloud.Get() });
}

std::array<double, 3> Shade(const Material& material, const std::vector<Light>& lights,
  const std::array<double, 3>& color, const std::array<double, 3>& ambientColor,
  const Vector3& position, const Vector3& normal, const Vector3& toViewer)
{
  if (!material.Lit)
  {
    return color;
  }
  Lighting lighting{ material, false, lights.data(), lights.size() };
  lighting.Surface.AmbientColor = ambientColor;
  const auto lane = [](const Vector3& v) { return Vector3Of<double>{ v[0], v[1], v[2] }; };
  const ShadedColor<double> shaded =
    Shade(lighting, Facet<double>{ lane(position), lane(normal), lane(toViewer) });
  std::array<double, 3> result;
  for (int c = 0; c < 3; ++c)
  {
    result[c] = shaded.Base[c] + shaded.Share[c] * color[c];
  }
  return result;
}

double LargestDifference(const Picture& a, const Picture& b)
{
  double largest = 0.0;
  for (std::size_t i = 0; i < a.Color.size(); ++i)
  {
    largest = std::max<double>(largest, std::abs(a.Color[i] - b.Color[i]));
  }
  return largest;
}

double MeanSquareDifference(const Picture& a, const Picture& b)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < a.Color.size(); ++i)
  {
    const double d = a.Color[i] - b.Color[i];
    sum += d * d;
  }
  return sum / static_cast<double>(a.Color.size());
}

bool IsSane(const Picture& picture)
{
  for (std::size_t i = 0; i < picture.Color.size(); ++i)
  {
    const float x = picture.Color[i];
    if (!(x >= 0.0f && std::isfinite(x) && (i % 4 < 3 || x <= 1.0f)))
    {
      return false;
    }
  }
  return std::all_of(
    picture.Depth.begin(), picture.Depth.end(), [](float z) { return std::isfinite(z); });
}

double SumOfAlpha(const Picture& picture)
{
  double sum = 0.0;
  for (std::size_t i = 3; i < picture.Color.size(); i += 4)
  {
    sum += picture.Color[i];
  }
  return sum;
}

bool Same(const Picture& a, const Picture& b)
{
  return std::memcmp(a.Color.data(), b.Color.data(), a.Color.size() * sizeof(float)) == 0 &&
    std::memcmp(a.Depth.data(), b.Depth.data(), a.Depth.size() * sizeof(float)) == 0;
}
}

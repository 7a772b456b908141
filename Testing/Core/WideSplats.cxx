// SPDX-License-Identifier: BSD-3-Clause
#include "WideSplats.h"

#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "WholeLens.h"

#include <algorithm>
#include <cmath>

namespace WideSplats
{
Splat SplatOf(const Wide& w)
{
  Splat s{};
  s.A = s.B = 1e-30f;
  s.X = 8.0f + std::sqrt(-2.0f * std::log(w.Kernel) / s.A); // exp(-A x^2 / 2) = Kernel
  s.Y = 8.0f;
  s.Shape = -1.0f;
  s.Weight = w.Weight / w.Kernel;
  if (w.Steepness > 0.0f)
  {
    const float u = std::min(w.Steepness, 1.0f);
    s.Shape = static_cast<float>(SmoothShape) + w.Steepness;
    s.Weight = w.Weight / (u * u * (3.0f - 2.0f * u));
  }
  s.Near = w.Near;
  s.Far = w.Far;
  s.Gradient = NoGradient;
  s.Red = w.Red;
  s.Opacity = w.Opacity;
  return s;
}

void FillList(const std::vector<Wide>& splats, bool onLens, SplatList& list, TileBins& bins)
{
  list.Clear(onLens);
  for (const Wide& w : splats)
  {
    list.Add(SplatOf(w), { 0, 0, Size, Size });
    if (onLens)
    {
      list.Footprints[list.Splats.Size() - 1] = WholeLens(w.PointX, w.PointY, 0.0f);
    }
  }
  BinSplats(list, 0, { Size, Size }, SerialExecutor(), bins);
  SortBins(SerialExecutor(), bins);
}

Pixel Draw(const std::vector<Wide>& splats, bool onLens)
{
  SplatList list;
  TileBins bins;
  FillList(splats, onLens, list, bins);
  RecordingSink sink(Size, Size);
  Picture picture(Size, Size);
  TileRaster raster;
  RasterSettings settings{ 5.0f, 1.0f };
  settings.LensRadius = onLens ? Blur : 0.0f;
  raster.Set(settings, nullptr, &sink, false);
  raster.Render(list, bins, 0, picture.Get());
  for (int i = 0; i < Size * Size; ++i)
  {
    CHECK(picture.Color[4 * i] == picture.Color[0]);
    CHECK(picture.Color[4 * i + 3] == picture.Color[3]);
  }
  double red = 0.0, alpha = 0.0;
  for (const VisibleLayer& part : sink.Parts[0])
  {
    red += part.Red;
    alpha += part.Alpha;
    CHECK(part.Alpha > 0.0f);
    CHECK(part.Coverage >= 0.0f);
    CHECK(part.Coverage <= 1.0f);
  }
  CHECK_NEAR(red, picture.Color[0], 1e-6);
  CHECK_NEAR(alpha, picture.Color[3], 1e-6);
  return { picture.Color[0], picture.Color[3], picture.Depth[0] };
}

double Difference(const Pixel& a, const Pixel& b)
{
  return std::max(std::abs(a.Red - b.Red), std::abs(a.Alpha - b.Alpha));
}
}

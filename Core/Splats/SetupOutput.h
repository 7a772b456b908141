// SPDX-License-Identifier: BSD-3-Clause
/**
 * Last stage of the set-up: places splats on the screen and writes them.
 */
#pragma once

#include "Core/Splats/SetupColor.h"
#include "Core/Splats/SetupFootprint.h"

namespace SurfelSplatting
{
/// Centre on the screen or on a coarse grid, and bounding box of the kernel's support.
template <class Real>
struct ScreenPlaces
{
  Real X, Y;
  IntOf<Real> X0, Y0, X1, Y1;

  SURFELSPLATTING_INLINE RowParts<Real> Boxes() const
  {
    return { this->X0, this->Y0, this->X1, this->Y1 };
  }
};
static_assert(sizeof(PixelBox) == sizeof(RowPart), "X0, Y0, X1, Y1");

/// First pixel whose centre is not left of x, in [0, size]. Clamping before rounding up gives the
/// same result, since the size is a whole number.
template <class Real>
SURFELSPLATTING_INLINE IntOf<Real> FirstPixel(const Real& x, const Real& size)
{
  const Real inside = Smaller(Larger(x - 0.5, Real{}), size);
  const IntOf<Real> whole = ConvertLanes<IntOf<Real>>(inside);
  const Real part = inside > WidenInt<Real>(whole) ? Uniform<Real>(1.0) : Real{};
  return whole + ConvertLanes<IntOf<Real>>(part);
}

/// Number of pixels or cells along x or y.
template <class Real>
SURFELSPLATTING_INLINE Real GridSize(int pixels, const Real& cell)
{
  return FillLanes<Real>(LaneTypes<Real>::Count, [&](int l) {
    const int c = static_cast<int>(LaneAt(cell, l));
    return c == 1 ? pixels : CoarseSize(pixels, c);
  });
}

/// @param cell of the grids, px; 1: the picture
/// @param s Alive becomes false for surfels whose support misses the picture
template <class Real>
SURFELSPLATTING_INLINE ScreenPlaces<Real> PlaceOnScreen(const SetupJob& job, PlacedSurfels<Real>& s,
  const Real& cell, const ResamplingKernelOf<Real>& kernel)
{
  const View& view = job.Camera;
  const Real scale = 1.0 / cell;
  ScreenPlaces<Real> place{};
  place.X = view.Fx * s.P.X * s.InverseZ + view.Cx;
  place.Y = view.Fy * s.P.Y * s.InverseZ + view.Cy;
  Real width = Uniform<Real>(view.Width), height = Uniform<Real>(view.Height);
  const MaskOf<Real> coarse = cell > 1.0;
  if (AnyLane<Real>(coarse))
  {
    place.X = coarse ? scale * place.X + CoarseOrigin : place.X;
    place.Y = coarse ? scale * place.Y + CoarseOrigin : place.Y;
    width = GridSize(view.Width, cell);
    height = GridSize(view.Height, cell);
  }
  const Real halfWidth = scale * kernel.HalfWidth, halfHeight = scale * kernel.HalfHeight;
  place.X0 = FirstPixel<Real>(place.X - halfWidth, width);
  place.Y0 = FirstPixel<Real>(place.Y - halfHeight, height);
  place.X1 = FirstPixel<Real>(place.X + halfWidth, width);
  place.Y1 = FirstPixel<Real>(place.Y + halfHeight, height);
  s.Alive &= ConvertLanes<MaskOf<Real>>((place.X0 < place.X1) & (place.Y0 < place.Y1));
  return place;
}

/// The range and the slope of a splat's depth, and the depth by which it is sorted.
template <class Real>
struct SplatDepths
{
  Real Near, Far, SlopeX, SlopeY;
  Real Order; ///< >= Near
};

/// |x| <= limit; false for NaN.
template <class Real>
SURFELSPLATTING_INLINE MaskOf<Real> Within(const Real& x, double limit)
{
  return Magnitude(x) <= limit;
}

/// Everything that the set-up has computed for a batch.
template <class Real>
struct SplatBatch
{
  PlacedSurfels<Real>& Surfels;
  const LensBlur<Real>& Blur;
  ScreenFootprints<Real>& Footprints;
  const ResamplingKernelOf<Real>& Kernel;
  const ScreenPlaces<Real>& Places;
  const Real& Weight;
  const SplatDepths<Real>& Depths;
  const SurfelColors<Real>& Colors;
};

/// Sums are tested, which takes less time: none of their terms is larger, or not finite.
template <class Real>
SURFELSPLATTING_INLINE MaskOf<Real> IsRepresentable(const SplatBatch<Real>& b)
{
  const Real places = Magnitude(b.Places.X) + Magnitude(b.Places.Y) + Magnitude(b.Kernel.K) +
    Magnitude(b.Kernel.A) + Magnitude(b.Kernel.B);
  const Real depths = Magnitude(b.Depths.Near) + Magnitude(b.Depths.Far) +
    Magnitude(b.Depths.SlopeX) + Magnitude(b.Depths.SlopeY);
  const Real colors = b.Colors.Red + b.Colors.Green + b.Colors.Blue + b.Colors.Opacity;
  return (places <= MaxSplatCoordinate) & (depths <= MaxSplatDepth) &
    Within(b.Weight, MaxSplatWeight) & IsFinite(colors);
}

/// How a colour changes over a footprint.
template <class Real>
struct ColorSlope
{
  Real MomentX, MomentY; ///< M h, px
  Real X, Y;             ///< W^-1 M h, per px

  /// @param moment h, first moment of the colour in camera space
  /// @param inverseDeterminant 1 / det W, times a factor of X and Y if wanted
  SURFELSPLATTING_INLINE ColorSlope(
    const ScreenFootprints<Real>& f, const Vector3Of<Real>& moment, const Real& inverseDeterminant)
    : MomentX(f.Jacobian.XX * moment.X + f.Jacobian.XZ * moment.Z)
    , MomentY(f.Jacobian.YY * moment.Y + f.Jacobian.YZ * moment.Z)
    , X(inverseDeterminant * (f.W.YY * this->MomentX - f.W.XY * this->MomentY))
    , Y(inverseDeterminant * (f.W.XX * this->MomentY - f.W.XY * this->MomentX))
  {
  }
};

/// First moment of the colour on the screen, W^-1 M H', in the units of the raster: px or cells.
/// Removes lanes whose gradient is too large, or too small to be seen, from Tilted.
template <class Real>
SURFELSPLATTING_INLINE void MakeGradients(const SetupJob& job, const BatchIndices<Real>& index,
  SplatBatch<Real>& b, FloatOf<Real> (&gradient)[6])
{
  ScreenFootprints<Real>& f = b.Footprints;
  const FootprintOf<Real>& w = f.W;
  Vector3Of<Real> moments[3] = {}; // surfels have none
  GatherColorMoments(job.Cloud, index, moments);
  const Real scale = b.Kernel.Tilt * w.InverseRoot * w.InverseRoot;
  Real variance{}; // of the splat's colour, where it is largest of the three
  for (int c = 0; c < 3; ++c)
  {
    const Real& share = b.Colors.Shaded.Share[c];
    const ColorSlope<Real> slope(f, Multiply(job.Linear, moments[c]), share * scale);
    const Real &hx = slope.MomentX, &hy = slope.MomentY, &x = slope.X, &y = slope.Y;
    f.Tilted &= Within(x, MaxSplatColor) & Within(y, MaxSplatColor);
    variance = Larger(variance, share * b.Kernel.Tilt * (x * hx + y * hy));
    gradient[c] = Narrow<Real>(x * f.Cell);
    gradient[3 + c] = Narrow<Real>(y * f.Cell);
  }
  f.Tilted &= variance > LeastColorDeviation * LeastColorDeviation;
}

/// Splats of a batch in single precision; lengths in px or cells.
template <class Real>
struct SplatFields
{
  RowParts<Real> Parts[4];

  SURFELSPLATTING_INLINE explicit SplatFields(const SplatBatch<Real>& b)
    : Parts{ Footprint(b), Range(b), DepthAndRed(b), Rest(b) }
  {
  }

private:
  static_assert(offsetof(Splat, K) == 12 && offsetof(Splat, B) == 16 &&
      offsetof(Splat, Far) == 28 && offsetof(Splat, Gradient) == 32 && offsetof(Splat, Red) == 44 &&
      offsetof(Splat, Green) == 48 && offsetof(Splat, Shape) == 60,
    "first and last columns of the parts");

  SURFELSPLATTING_INLINE static RowParts<Real> Footprint(const SplatBatch<Real>& b)
  {
    const Real& cell = b.Footprints.Cell;
    return { Narrow<Real>(b.Places.X), Narrow<Real>(b.Places.Y),
      Narrow<Real>(b.Kernel.A * cell * cell), Narrow<Real>(b.Kernel.K) };
  }
  SURFELSPLATTING_INLINE static RowParts<Real> Range(const SplatBatch<Real>& b)
  {
    const Real& cell = b.Footprints.Cell;
    return { Narrow<Real>(b.Kernel.B * cell * cell), Narrow<Real>(b.Weight),
      Narrow<Real>(b.Depths.Near), Narrow<Real>(b.Depths.Far) };
  }
  SURFELSPLATTING_INLINE static RowParts<Real> DepthAndRed(const SplatBatch<Real>& b)
  {
    const Real& cell = b.Footprints.Cell;
    return { IntOf<Real>{} + NoGradient, Narrow<Real>(b.Depths.SlopeX * cell),
      Narrow<Real>(b.Depths.SlopeY * cell), Narrow<Real>(b.Colors.Red) };
  }
  SURFELSPLATTING_INLINE static RowParts<Real> Rest(const SplatBatch<Real>& b)
  {
    return { Narrow<Real>(b.Colors.Green), Narrow<Real>(b.Colors.Blue),
      Narrow<Real>(b.Colors.Opacity), Narrow<Real>(b.Kernel.Shape) };
  }
};

/// Fetches the memory of a batch's splats while they are made: it is not in the caches, and the
/// stores would wait.
template <class Real>
SURFELSPLATTING_INLINE void PrepareToWrite(const SplatOutput& output)
{
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    __builtin_prefetch(&output.Splats[output.Count + l], 1);
  }
  if (output.Footprints)
  {
    for (int l = 0; l < LaneTypes<Real>::Count; l += 2)
    {
      __builtin_prefetch(&output.Footprints[output.Count + l], 1);
    }
  }
}

/// Records the grids of the splats that were written last, from splat `first` on.
template <class Real>
SURFELSPLATTING_INLINE void NoteGrids(
  const MaskOf<Real>& alive, const Real& cells, std::size_t first, SplatOutput& output)
{
  if (!AnyLane<Real>(alive & (cells > 1.0)))
  {
    output.Levels |= output.Count > first ? 1 : 0;
    for (std::size_t i = first; output.GridLevels && i < output.Count; ++i)
    {
      output.GridLevels[i] = 0;
    }
    return;
  }
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    if (LaneAt(alive, l))
    {
      const Splat& s = output.Splats[first];
      const int level = LevelOfCell(static_cast<int>(LaneAt(cells, l)));
      if (output.GridLevels)
      {
        output.GridLevels[first] = static_cast<unsigned char>(level);
      }
      output.Levels |= 1u << level;
      if (level > 0)
      {
        const float rg = s.Red > s.Green ? s.Red : s.Green, rgb = rg > s.Blue ? rg : s.Blue;
        float& largest = output.LargestCoarseColor;
        largest = rgb > largest ? rgb : largest;
      }
      ++first;
    }
  }
}

/// Writes the gradients of the batch's splats, which begin at splat `first`.
template <class Real>
SURFELSPLATTING_INLINE void WriteGradients(const SetupJob& job, const BatchIndices<Real>& index,
  SplatBatch<Real>& b, std::size_t first, SplatOutput& output)
{
  FloatOf<Real> g[6];
  MakeGradients(job, index, b, g);
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    if (LaneAt(b.Surfels.Alive, l))
    {
      Splat& s = output.Splats[first++];
      if (LaneAt(b.Footprints.Tilted, l))
      {
        const std::size_t place = output.FirstGradient + output.NumberOfGradients++;
        s.Gradient = static_cast<std::int32_t>(place);
        output.Gradients[place] = { LaneAt(g[0], l), LaneAt(g[1], l), LaneAt(g[2], l),
          LaneAt(g[3], l), LaneAt(g[4], l), LaneAt(g[5], l) };
      }
    }
  }
}

/// What of the lens a splat's fragments are seen through, as LensFootprint has it: the regression
/// of u on the offset from the centre (LensVisibility.h).
template <class Real>
struct LensRegression
{
  Real MeanX, MeanY, PerForm;
  Real Area, AreaX, AreaY;
  Real Share; ///< l

  SURFELSPLATTING_INLINE LensRegression(const SetupJob& job, const SplatBatch<Real>& b)
  {
    const double f = __builtin_sqrt(__builtin_fabs(job.Camera.Fx * job.Camera.Fy));
    const Real confusion = f * b.Blur.Signed, quarter = 0.25 * confusion;
    const FootprintOf<Real>& w = b.Footprints.W;
    const VisibleAreaOf<Real>& v = b.Surfels.Visible;
    const LensShape& root = job.ShapeRoot;
    // M'v, the slope of v.u, and L v.
    const Real x = root.XX * v.X + root.XY * v.Y, y = root.XY * v.X + root.YY * v.Y;
    const Real perDeterminant = quarter * w.InverseRoot * w.InverseRoot;
    // Half the trace of C^2/4 S W^-1.
    const double xx = root.XX * root.XX + root.XY * root.XY, xy = root.XY * (root.XX + root.YY),
                 yy = root.XY * root.XY + root.YY * root.YY;
    const Real trace = xx * w.YY - 2.0 * xy * w.XY + yy * w.XX;
    this->Share = Smaller(2.0 * quarter * perDeterminant * trace, Uniform<Real>(1.0));
    const Real slopeX = perDeterminant * (w.YY * x - w.XY * y);
    const Real slopeY = perDeterminant * (w.XX * y - w.XY * x);
    const Real shareX = confusion * (root.XX * slopeX + root.XY * slopeY);
    const Real shareY = confusion * (root.XY * slopeX + root.YY * slopeY);
    const Real squared = Larger(v.X * v.X + v.Y * v.Y, Uniform<Real>(1e-30));
    const Real share = Smaller(
      (shareX * v.X + shareY * v.Y) / squared, Uniform<Real>(1.0)); // of the area's variance
    // m is along v.
    const MeanVisibleArea<Real> mean = MeanOverLens(v);
    const Real along = (mean.X * v.X + mean.Y * v.Y) / squared;
    this->MeanX = mean.X - along * shareX;
    this->MeanY = mean.Y - along * shareY;
    this->PerForm = quarter / (b.Kernel.B * w.YY * b.Footprints.Cell);
    this->SetArea(b, { slopeX, slopeY }, share, mean.Area, 4.0 * mean.Area * along);
  }

private:
  struct Slope
  {
    Real X, Y;
  };

  /**
   * Where l = 1, the pixel tells u, and the area is that of u. Where l = 0 it does not, and the
   * best line over all of the lens counts. The weight l^2 of the first is closest to the mean over
   * 400 points of the lens, for surfels of any slope; with l, those that only a part of the lens
   * sees are 5 to 10 % farther away.
   * @param share l, of the variance of the area that depends on the pixel
   * @param mean of the area over the lens @param steep slope of the best line, over that of the
   * area where it is seen
   */
  SURFELSPLATTING_INLINE void SetArea(const SplatBatch<Real>& b, const Slope& slope,
    const Real& share, const Real& mean, const Real& steep)
  {
    const Real known = share * share;
    const Real scale = b.Footprints.Cell * (steep + known * (1.0 - steep));
    this->Area = mean + known * (b.Surfels.Visible.Base - mean);
    this->AreaX = scale * slope.X;
    this->AreaY = scale * slope.Y;
  }
};

/// LensFootprints or SpaceFootprints of a batch (LensVisibility.h), in single precision.
template <class Real>
struct FootprintRows
{
  RowParts<Real> Parts[2];
};

template <class Real>
SURFELSPLATTING_INLINE FootprintRows<Real> LensFootprints(
  const SetupJob& job, const SplatBatch<Real>& b)
{
  static_assert(offsetof(LensFootprint, Area) == 12 && offsetof(LensFootprint, AreaX) == 16 &&
      offsetof(LensFootprint, Back) == 24,
    "first and last columns of the parts");
  const LensRegression<Real> lens(job, b);
  return { { { Narrow<Real>(lens.MeanX), Narrow<Real>(lens.MeanY), Narrow<Real>(lens.PerForm),
               Narrow<Real>(lens.Area) },
    { Narrow<Real>(lens.AreaX), Narrow<Real>(lens.AreaY),
      Narrow<Real>(b.Surfels.Visible.TwoSided ? Uniform<Real>(1.0) : Real{}),
      Narrow<Real>(lens.Share) } } };
}

/// Writes what the lanes that are alive have. Of the others, the next lane overwrites it: a branch
/// could not be predicted.
/// @param write function(lane, i): writes that of a lane as the i-th
/// @param first of the batch's splats @return behind the last one
template <class Real, class Function>
SURFELSPLATTING_INLINE std::size_t WriteAlive(
  const MaskOf<Real>& alive, int count, std::size_t first, Function&& write)
{
  for (int l = 0; l < count; ++l)
  {
    write(l, first);
    first += LaneAt(alive, l) ? 1 : 0;
  }
  return first;
}

/// @param first of the batch's splats
template <class Real>
SURFELSPLATTING_INLINE void WriteFootprints(const FootprintRows<Real>& rows,
  const MaskOf<Real>& alive, int count, std::size_t first, SplatOutput& output)
{
  LensFootprint* const footprints = output.Footprints;
  WriteAlive<Real>(
    alive, count, first, [&](int l, std::size_t i) { StoreRow(rows.Parts, l, footprints + i); });
}

/// @param first of the batch's splats
SURFELSPLATTING_INLINE void NoteDelays(std::size_t first, SplatOutput& output)
{
  for (std::size_t i = first; i < output.Count; ++i)
  {
    const float delay = output.Orders[i] - output.Splats[i].Near;
    output.LargestDelay = delay > output.LargestDelay ? delay : output.LargestDelay;
  }
}

/// Writes the splats of the lanes that are alive and representable.
template <class Real>
SURFELSPLATTING_INLINE void Write(
  const SetupJob& job, const BatchIndices<Real>& index, SplatBatch<Real>& b, SplatOutput& output)
{
  MaskOf<Real>& alive = b.Surfels.Alive;
  const MaskOf<Real> representable = IsRepresentable(b);
  b.Surfels.Invalid |= alive & Not(representable);
  alive &= representable;
  const SplatFields<Real> fields(b);
  const RowParts<Real> boxes = b.Places.Boxes();
  const FloatOf<Real> orders = Narrow<Real>(b.Depths.Order);
  const std::size_t first = output.Count;
  Splat* const splats = output.Splats;
  PixelBox* const pixels = output.Boxes;
  float* const depths = output.Orders;
  output.Count = WriteAlive<Real>(alive, index.Count, first, [&](int l, std::size_t i) {
    StoreRow(fields.Parts, l, splats + i);
    boxes.Store(l, pixels + i);
    depths[i] = LaneAt(orders, l);
  });
  output.Blurred += CountLanes<Real>(alive & (b.Blur.ConfusionX > 0.0));
  if (AnyLane<Real>(alive & (b.Depths.Order > b.Depths.Near)))
  {
    NoteDelays(first, output);
  }
  NoteGrids(alive, b.Footprints.Cell, first, output);
  if (AnyLane<Real>(alive & b.Footprints.Tilted))
  {
    WriteGradients(job, index, b, first, output);
  }
  if (output.Footprints && !job.Cloud.IsInSpace())
  {
    WriteFootprints(LensFootprints(job, b), alive, index.Count, first, output);
  }
}
}

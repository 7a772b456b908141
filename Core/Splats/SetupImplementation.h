// SPDX-License-Identifier: BSD-3-Clause
/**
 * Included by the translation units of SetupTarget.h, once for each instruction set. The steps are
 * those of SplatSetup.cxx, which says what they are and where they are from.
 */
#include "Core/Base/CoarseLevels.h"
#include "Core/Splats/SetupBatch.h"
#include "Core/Splats/SetupConstants.h"
#include "Core/Splats/SetupShading.h"

namespace SurfelSplatting
{
namespace
{
constexpr double TwicePi = 6.28318530717958648;

/// Lens::MeanApertureSample.
SURFELSPLATTING_INLINE void MeanApertureSample(
  const SetupJob& job, const Batch& b, Reals& x, Reals& y)
{
  const Reals scale = job.LensRadius / (-4.0 * Dot(b.Area, b.P));
  x = scale * b.Area.X;
  y = scale * b.Area.Y;
  const Reals length = SquareRoot(x * x + y * y);
  const Reals limit = length > 0.25 ? 0.25 / length : ToReals(1.0);
  x *= limit;
  y *= limit;
}

/// MakeBlur.
SURFELSPLATTING_INLINE void MakeBlur(const SetupJob& job, int level, Batch& b)
{
  const double fx = __builtin_fabs(job.Fx), fy = __builtin_fabs(job.Fy);
  b.ConfusionX = b.ConfusionY = b.SignedC = b.OffsetX = b.OffsetY = Reals{};
  b.VarianceX = b.VarianceY = ToReals(job.Prefilter);
  if (!job.Parallel && job.LensRadius > 0.0)
  {
    b.SignedC = job.LensRadius * (job.InverseFocalDistance - b.InverseZ);
    b.ConfusionX = fx * Magnitude(b.SignedC);
    b.ConfusionY = fy * Magnitude(b.SignedC);
    b.VarianceX += job.DefocusFactor * b.ConfusionX * b.ConfusionX;
    b.VarianceY += job.DefocusFactor * b.ConfusionY * b.ConfusionY;
    if (job.Offsets)
    {
      Reals x, y;
      MeanApertureSample(job, b, x, y);
      b.OffsetX = job.Fx * b.SignedC * x;
      b.OffsetY = job.Fy * b.SignedC * y;
    }
  }
  if (level > 0)
  {
    const Reals perDepth = LeastNodeBlur * b.InverseZ;
    const Reals spacing = perDepth * perDepth * Norm(b.Area);
    b.VarianceX = Larger(b.VarianceX, fx * fx * spacing);
    b.VarianceY = Larger(b.VarianceY, fy * fy * spacing);
  }
}

/// ProjectionJacobian, ProjectCovariance and Footprint.
SURFELSPLATTING_INLINE void Project(const SetupJob& job, Batch& b)
{
  if (job.Parallel)
  {
    b.MX0 = ToReals(job.Fx);
    b.MY1 = ToReals(job.Fy);
    b.MX2 = b.MY2 = Reals{};
  }
  else
  {
    b.MX0 = job.Fx * b.InverseZ;
    b.MY1 = job.Fy * b.InverseZ;
    b.MX2 = -b.MX0 * b.P.X * b.InverseZ;
    b.MY2 = -b.MY1 * b.P.Y * b.InverseZ;
  }
  const Reals sxx = b.XX * b.MX0 + b.XZ * b.MX2, sxz = b.XZ * b.MX0 + b.ZZ * b.MX2;
  const Reals syx = b.XY * b.MY1 + b.XZ * b.MY2, syy = b.YY * b.MY1 + b.YZ * b.MY2;
  const Reals syz = b.YZ * b.MY1 + b.ZZ * b.MY2;
  const Reals pxx = Larger(b.MX0 * sxx + b.MX2 * sxz, Reals{});
  const Reals pyy = Larger(b.MY1 * syy + b.MY2 * syz, Reals{});
  b.WXY = b.MX0 * syx + b.MX2 * syz;
  const Reals projected = Larger(pxx * pyy - b.WXY * b.WXY, Reals{});
  b.Determinant = projected + b.VarianceX * pyy + b.VarianceY * pxx + b.VarianceX * b.VarianceY;
  b.WYY = pyy + b.VarianceY;
  b.InverseWYY = 1.0 / b.WYY;
  b.InverseRoot = 1.0 / SquareRoot(b.Determinant);
  b.WXX = (b.Determinant + b.WXY * b.WXY) * b.InverseWYY;
  const Reals isotropic =
    job.Fx * job.Fx == job.Fy * job.Fy ? b.VarianceX : SquareRoot(b.VarianceX * b.VarianceY);
  b.Smooth = Smaller(isotropic * b.InverseRoot, ToReals(1.0));
}

/// ChooseGrid, and what the grid takes of W.
SURFELSPLATTING_INLINE void ChooseGrid(Batch& b)
{
  const Reals half = 0.5 * (b.WXX + b.WYY), difference = 0.5 * (b.WXX - b.WYY);
  const Reals smallest =
    b.Determinant / (half + SquareRoot(difference * difference + b.WXY * b.WXY));
  b.Cell = ToReals(1.0);
  for (int level = LowestCoarseLevel; level <= HighestCoarseLevel; ++level)
  {
    const double least = CoarseCellsPerDeviation * (1 << level);
    b.Cell = smallest >= least * least ? ToReals(1 << level) : b.Cell;
  }
  if (!AnyOf(b.Alive & (b.Cell > 1.0)))
  {
    b.Cell = ToReals(1.0);
    return;
  }
  const Reals confusion = Larger(b.ConfusionX, b.ConfusionY);
  const Reals sharp = SquareRoot(Larger(smallest - 0.25 * confusion * confusion, Reals{}));
  const RealMask finer = (b.Cell > 1.0) & ~(b.Cell <= GridCellsPerDeviation * sharp);
  b.Tilted &= ~finer | (0.5 * b.Cell <= GridCellsPerDeviation * sharp);
  const Reals lowest = ToReals(1 << LowestCoarseLevel);
  b.Cell = finer ? (b.Cell > lowest ? 0.5 * b.Cell : ToReals(1.0)) : b.Cell;

  const RealMask coarse = b.Cell > 1.0;
  const Reals softness = LeastSoftness * b.Cell;
  const Reals softened = Smaller(b.SquaredConfusion, 4.0 * (smallest - softness * softness));
  b.SquaredConfusion = coarse ? softened : b.SquaredConfusion;
  const Reals variance = b.Cell * b.Cell / 6.0;
  const Reals determinant = b.Determinant + variance * variance - variance * (b.WXX + b.WYY);
  const Reals yy = b.WYY - variance;
  b.Determinant = coarse ? determinant : b.Determinant;
  b.WYY = coarse ? yy : b.WYY;
  b.WXX = coarse ? (determinant + b.WXY * b.WXY) / yy : b.WXX;
  b.InverseWYY = 1.0 / b.WYY;
  b.InverseRoot = 1.0 / SquareRoot(b.Determinant);
}

/// MakeSmoothKernel's q0, kappa q0 and mass.
SURFELSPLATTING_INLINE void SmoothStep(
  const Reals& exponent, Reals& reach, Reals& steepness, Reals& mass)
{
  const Reals n = Larger(exponent, Reals{});
  const Reals k = 8.0 * (n + 2.0) / (n + 3.0);
  const Reals middle = 3.0 + SquareRoot(Larger(9.0 - 1.5 * k, Reals{}));
  const Reals width = SquareRoot(5.0 * Larger(4.0 * middle - middle * middle, Reals{}));
  const Reals half = Larger(width, ToReals(1e-3));
  const Reals a = 1.0 / 15.0 - 0.01 * k, c = 0.05 * k - 1.0 / 3.0, d = 0.4 - 0.0625 * k;
  const Reals root = (-c - SquareRoot(Larger(c * c - 4.0 * a * d, Reals{}))) / (2.0 * a);
  const Reals m = 1.0 - 0.5 * root;
  const Reals sharp = 2.0 * m / (0.25 - 0.1 * root);
  const RealMask plateau = n < 0.857;
  reach = plateau ? middle + half : sharp;
  steepness = plateau ? (middle + half) / (2.0 * half) : root;
  mass = plateau ? middle : sharp * root * root * m;
}

/// RoundPearsonExponent.
SURFELSPLATTING_INLINE Reals RoundExponent(const Reals& n)
{
  Reals r = n < 3.5 ? ToReals(3.0) : ToReals(4.0);
  r = n < 2.5 ? ToReals(2.0) : r;
  r = n < 1.5 ? ToReals(1.0) : r;
  r = n < 0.75 ? ToReals(0.5) : r;
  r = n < 0.375 ? ToReals(0.25) : r;
  return n < 0.125 ? Reals{} : r;
}

/// ChooseKernel.
SURFELSPLATTING_INLINE void ChooseKernel(const SetupJob& job, Batch& b)
{
  Reals reach = ToReals(job.Support / job.Tau); // q0, in units of W
  b.Peak = job.Tau / (job.Mass * TwicePi) * b.InverseRoot;
  b.Shape = ToReals(-1.0);
  b.Tilt = ToReals(1.0);
  Reals scale = ToReals(job.Tau); // of the inverse of W in q
  const Reals squared = b.SquaredConfusion;
  const RealMask blurred = squared != 0.0;
  if (!job.Gaussian && AnyOf(b.Alive & blurred))
  {
    const Reals trace = b.WXX + b.WYY;
    const Reals spread = squared * squared * (3.0 * trace * trace - 4.0 * b.Determinant);
    const Reals exponent = 384.0 * b.Determinant * b.Determinant / spread - 3.0;
    const RealMask smooth = blurred & b.Tilted & (exponent < 1.95);
    const RealMask pearson = blurred & ~smooth & (exponent <= 6.0);
    const Reals n = RoundExponent(exponent), q0 = 2.0 * (n + 2.0), inverse = 1.0 / q0;
    reach = pearson ? q0 : reach;
    scale = pearson ? job.Support * inverse : scale;
    b.Peak = pearson ? (n + 1.0) * inverse * (2.0 / TwicePi) * b.InverseRoot : b.Peak;
    b.Shape = pearson ? n : b.Shape;
    b.Tilt = pearson ? 2.0 * n * inverse : b.Tilt;
    if (AnyOf(smooth))
    {
      Reals end, steepness, mass;
      SmoothStep(exponent, end, steepness, mass);
      reach = smooth ? end : reach;
      scale = smooth ? job.Support / end : scale;
      b.Peak = smooth ? (2.0 / TwicePi) * b.InverseRoot / mass : b.Peak;
      b.Shape = smooth ? 16.0 + steepness : b.Shape;
      b.Tilt = smooth ? 12.0 * steepness / end : b.Tilt;
    }
  }
  b.A = scale * b.WYY * b.InverseRoot * b.InverseRoot;
  b.K = -b.WXY * b.InverseWYY;
  b.B = scale * b.InverseWYY;
  b.HalfWidth = SquareRoot(reach * b.WXX);
  b.HalfHeight = SquareRoot(reach * b.WYY);
}

/// FirstPixel: clamped before it is rounded up, which is the same for whole sizes.
SURFELSPLATTING_INLINE Ints FirstPixel(const Reals& x, const Reals& size)
{
  const Reals inside = Smaller(Larger(x - 0.5, Reals{}), size);
  const Ints whole = __builtin_convertvector(inside, Ints);
  const RealMask below = __builtin_convertvector(whole, Reals) < inside;
  return whole - __builtin_convertvector(below, Ints);
}

/// Pixels or cells in a direction.
SURFELSPLATTING_INLINE Reals GridSize(int pixels, const Reals& cell)
{
  Reals size;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    const int c = static_cast<int>(cell[l]);
    size[l] = c == 1 ? pixels : (pixels + c - 1) / c + 1;
  }
  return size;
}

/// SetPlace: centre and box.
SURFELSPLATTING_INLINE void SetPlace(const SetupJob& job, Batch& b, Ints box[4])
{
  const RealMask coarse = b.Cell > 1.0;
  b.X = job.Fx * b.P.X * b.InverseZ + job.Cx + b.OffsetX;
  b.Y = job.Fy * b.P.Y * b.InverseZ + job.Cy + b.OffsetY;
  Reals width = ToReals(job.Width), height = ToReals(job.Height), scale = ToReals(1.0);
  if (AnyOf(coarse))
  {
    scale = 1.0 / b.Cell;
    b.X = coarse ? scale * b.X + CoarseOrigin : b.X;
    b.Y = coarse ? scale * b.Y + CoarseOrigin : b.Y;
    width = GridSize(job.Width, b.Cell);
    height = GridSize(job.Height, b.Cell);
  }
  box[0] = FirstPixel(b.X - scale * b.HalfWidth, width);
  box[1] = FirstPixel(b.Y - scale * b.HalfHeight, height);
  box[2] = FirstPixel(b.X + scale * b.HalfWidth, width);
  box[3] = FirstPixel(b.Y + scale * b.HalfHeight, height);
  b.Alive &= __builtin_convertvector((box[0] < box[2]) & (box[1] < box[3]), RealMask);
}

/// RippleCompensation and weight.
SURFELSPLATTING_INLINE void Weigh(const SetupJob& job, Batch& b)
{
  // cos^2 = along^2 / all, of the angle between normal and line of sight.
  const Reals along = job.Parallel ? b.Area.Z : Dot(b.Area, b.P);
  Reals all = Dot(b.Area, b.Area);
  all *= job.Parallel ? ToReals(1.0) : Dot(b.P, b.P);
  const Reals loss = RippleLoss * (1.0 - b.Smooth) * Smaller(along * along, all);
  b.Weight = b.Deposit * b.Peak * all / (all - loss);
  b.Invalid |= b.Alive & (b.Weight != b.Weight);
  b.Alive &= b.Weight >= SmallestWeight;
}

/// SetDepth.
SURFELSPLATTING_INLINE void SetDepth(const SetupJob& job, Batch& b)
{
  const Reals minors =
    b.XX * b.YY - b.XY * b.XY + b.YY * b.ZZ - b.YZ * b.YZ + b.XX * b.ZZ - b.XZ * b.XZ;
  const Reals trace = b.XX + b.YY + b.ZZ;
  const Reals largest = 0.5 * (trace + SquareRoot(Larger(trace * trace - 4.0 * minors, Reals{})));
  const Reals halfRange = DepthExtentAlongZ * SquareRoot(Larger(b.ZZ, Reals{})) +
    DepthExtentIsotropic * SquareRoot(Larger(largest, Reals{}));
  b.Near = b.P.Z - halfRange;
  b.Far = b.P.Z + halfRange;
  const Reals cx = b.MX0 * b.XZ + b.MX2 * b.ZZ, cy = b.MY1 * b.YZ + b.MY2 * b.ZZ;
  Reals xx = b.WXX, yy = b.WYY, determinant = b.Determinant;
  if (job.DepthBuffered)
  {
    const Reals x = b.MX0 * (b.MX0 * b.XX + 2.0 * b.MX2 * b.XZ) + b.MX2 * b.MX2 * b.ZZ;
    const Reals y = b.MY1 * (b.MY1 * b.YY + 2.0 * b.MY2 * b.YZ) + b.MY2 * b.MY2 * b.ZZ;
    const Reals sharp = x * y - b.WXY * b.WXY;
    const RealMask plane = sharp > LeastPlane * x * y;
    xx = plane ? x : xx;
    yy = plane ? y : yy;
    determinant = plane ? sharp : determinant;
  }
  const Reals inverse = 1.0 / determinant;
  b.DepthX = (yy * cx - b.WXY * cy) * inverse;
  b.DepthY = (xx * cy - b.WXY * cx) * inverse;
}

SURFELSPLATTING_INLINE RealMask Within(const Reals& x, double limit)
{
  return Magnitude(x) <= limit;
}

/// Representable.
SURFELSPLATTING_INLINE RealMask IsRepresentable(const Batch& b)
{
  return Within(b.X, LargestCoordinate) & Within(b.Y, LargestCoordinate) &
    Within(b.K, LargestCoordinate) & Within(b.A, LargestCoordinate) &
    Within(b.B, LargestCoordinate) & Within(b.Weight, LargestWeight) &
    Within(b.Near, LargestDepth) & Within(b.Far, LargestDepth) & Within(b.DepthX, LargestDepth) &
    Within(b.DepthY, LargestDepth) & IsFinite(b.Red) & IsFinite(b.Green) & IsFinite(b.Blue) &
    IsFinite(b.Opacity);
}

/// MakeGradient; the lanes whose gradient is used are left in Tilted.
SURFELSPLATTING_INLINE void MakeGradient(
  const SetupJob& job, const std::size_t* index, Batch& b, Floats gradient[6])
{
  const NodeColor* nodes[RealLaneCount];
  for (int l = 0; l < RealLaneCount; ++l)
  {
    nodes[l] = job.NodeColors + (index[l] - job.NumberOfSurfels);
  }
  const Reals unit = ToReals(FillLanes<Floats>([&](int l) { return nodes[l]->MomentUnit; }));
  const Reals scale = b.Tilt * b.InverseRoot * b.InverseRoot * (unit / PackedOne);
  for (int c = 0; c < 3; ++c)
  {
    const Reals3 local{ ToReals(FillLanes<Ints>([&](int l) { return nodes[l]->Moment[c][0]; })),
      ToReals(FillLanes<Ints>([&](int l) { return nodes[l]->Moment[c][1]; })),
      ToReals(FillLanes<Ints>([&](int l) { return nodes[l]->Moment[c][2]; })) };
    const Reals3 moment{ Dot(job.Linear[0], local), Dot(job.Linear[1], local),
      Dot(job.Linear[2], local) };
    const Reals hx = b.MX0 * moment.X + b.MX2 * moment.Z;
    const Reals hy = b.MY1 * moment.Y + b.MY2 * moment.Z;
    const Reals x = b.Share[c] * scale * (b.WYY * hx - b.WXY * hy);
    const Reals y = b.Share[c] * scale * (b.WXX * hy - b.WXY * hx);
    b.Tilted &= Within(x, LargestColor) & Within(y, LargestColor);
    gradient[c] = ToFloats(x * b.Cell);
    gradient[3 + c] = ToFloats(y * b.Cell);
  }
}

/// MakeSlope.
SURFELSPLATTING_INLINE void MakeSlope(const SetupJob& job, const Batch& b, Floats slope[3])
{
  slope[0] = slope[1] = slope[2] = Floats{};
  if (job.Parallel || job.LensRadius == 0.0)
  {
    return;
  }
  Reals x, y;
  MeanApertureSample(job, b, x, y);
  const double f = __builtin_sqrt(__builtin_fabs(job.Fx * job.Fy));
  const Reals point = 0.25 * f * b.SignedC * b.InverseRoot * b.Cell;
  slope[0] = ToFloats(point);
  slope[1] = ToFloats(4.0 * x * point);
  slope[2] = ToFloats(4.0 * y * point);
}

SURFELSPLATTING_INLINE int GridLevel(int cell)
{
  int level = 0;
  while ((1 << level) < cell)
  {
    ++level;
  }
  return level;
}

/// Writes the lanes that are alive.
SURFELSPLATTING_INLINE void Write(
  const SetupJob& job, const std::size_t* index, Batch& b, const Ints box[4], SplatOutput& output)
{
  const Reals squared = b.Cell * b.Cell;
  const Floats f[] = { ToFloats(b.X), ToFloats(b.Y), ToFloats(b.A * squared), ToFloats(b.K),
    ToFloats(b.B * squared), ToFloats(b.Weight), ToFloats(b.Near), ToFloats(b.Far),
    ToFloats(b.DepthX * b.Cell), ToFloats(b.DepthY * b.Cell), ToFloats(b.Red), ToFloats(b.Green),
    ToFloats(b.Blue), ToFloats(b.Opacity), ToFloats(b.Shape) };
  Floats gradient[6], slope[3];
  const bool gradients = AnyOf(b.Alive & b.Tilted);
  if (gradients)
  {
    MakeGradient(job, index, b, gradient);
  }
  if (output.Slopes)
  {
    MakeSlope(job, b, slope);
  }
  for (int l = 0; l < RealLaneCount; ++l)
  {
    if (!b.Alive[l])
    {
      continue;
    }
    Splat& s = output.Splats[output.Count];
    s.X = f[0][l];
    s.Y = f[1][l];
    s.A = f[2][l];
    s.K = f[3][l];
    s.B = f[4][l];
    s.Weight = f[5][l];
    s.Near = f[6][l];
    s.Far = f[7][l];
    s.Gradient = NoGradient;
    s.DepthX = f[8][l];
    s.DepthY = f[9][l];
    s.Red = f[10][l];
    s.Green = f[11][l];
    s.Blue = f[12][l];
    s.Opacity = f[13][l];
    s.Shape = f[14][l];
    if (gradients && b.Tilted[l])
    {
      const std::size_t g = output.FirstGradient + output.NumberOfGradients++;
      s.Gradient = static_cast<std::int32_t>(g);
      output.Gradients[g] = { gradient[0][l], gradient[1][l], gradient[2][l], gradient[3][l],
        gradient[4][l], gradient[5][l] };
    }
    output.Boxes[output.Count] = { box[0][l], box[1][l], box[2][l], box[3][l] };
    output.Nears[output.Count] = f[6][l];
    if (output.Slopes)
    {
      output.Slopes[output.Count] = { slope[0][l], slope[1][l], slope[2][l] };
    }
    const int level = GridLevel(static_cast<int>(b.Cell[l]));
    if (output.GridLevels)
    {
      output.GridLevels[output.Count] = static_cast<unsigned char>(level);
    }
    output.Levels |= 1u << level;
    if (level > 0)
    {
      const float rg = s.Red > s.Green ? s.Red : s.Green, rgb = rg > s.Blue ? rg : s.Blue;
      output.LargestCoarseColor = rgb > output.LargestCoarseColor ? rgb : output.LargestCoarseColor;
    }
    output.Blurred += b.ConfusionX[l] > 0.0 ? 1 : 0;
    ++output.Count;
  }
}

SURFELSPLATTING_INLINE std::size_t CountLanes(const RealMask& mask)
{
  std::size_t count = 0;
  for (int l = 0; l < RealLaneCount; ++l)
  {
    count += mask[l] ? 1 : 0;
  }
  return count;
}

/// MakeSplat of as many surfels as there are lanes.
SURFELSPLATTING_INLINE void MakeBatch(const SetupJob& job, const std::size_t* index,
  const RealMask& present, int level, SplatOutput& output)
{
  Batch b;
  Place(job, index, present, level, b);
  if (AnyOf(b.Alive))
  {
    MakeBlur(job, level, b);
    Project(job, b);
    b.Tilted = b.Alive & (level > 0 && job.NodeColors ? -1 : 0);
    b.Cell = ToReals(1.0);
    b.SquaredConfusion = b.ConfusionX * b.ConfusionY;
    if (job.CoarseGrids)
    {
      ChooseGrid(b);
    }
    ChooseKernel(job, b);
    Ints box[4];
    SetPlace(job, b, box);
    Weigh(job, b);
    if (AnyOf(b.Alive))
    {
      SetDepth(job, b);
      MakeShading(job, b);
      SetColor(job, index, level, b);
      const RealMask representable = IsRepresentable(b);
      b.Invalid |= b.Alive & ~representable;
      b.Alive &= representable;
      Write(job, index, b, box, output);
    }
  }
  output.Invalid += CountLanes(b.Invalid);
}

void MakeSplats(
  const SetupJob& job, std::size_t begin, std::size_t count, int level, SplatOutput& output)
{
  for (std::size_t i = 0; i < count; i += RealLaneCount)
  {
    std::size_t index[RealLaneCount];
    RealMask present;
    for (int l = 0; l < RealLaneCount; ++l)
    {
      const bool inside = i + l < count;
      index[l] = begin + (inside ? i + l : count - 1);
      present[l] = inside ? -1 : 0;
    }
    MakeBatch(job, index, present, level, output);
  }
}
}
}

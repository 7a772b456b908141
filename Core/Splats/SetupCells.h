// SPDX-License-Identifier: BSD-3-Clause
/**
 * Last stage of the set-up where a lens is divided (CentralSplats.h): writes what cells of one
 * shape share, and makes the splats of a cell from that.
 */
#pragma once

#include "Core/Splats/SetupOutput.h"

namespace SurfelSplatting
{
/// What is beyond the picture from the lens's centre may be in that of a cell.
template <class Real>
SURFELSPLATTING_INLINE ScreenPlaces<Real> PlaceOnScreen(const SetupJob& job, PlacedSurfels<Real>& s,
  const Real& cell, const ResamplingKernelOf<Real>& /* kernel */, const CentralOutput&)
{
  return CenterOnScreen(job.Camera, s, cell);
}

/// Nothing: these are written once for all cells.
template <class Real>
SURFELSPLATTING_INLINE void PrepareToWrite(const CentralOutput&)
{
}

/// Writes the fields of all lanes.
template <class Real>
SURFELSPLATTING_INLINE void WriteFields(
  const SetupJob& job, const SplatBatch<Real>& b, const CentralOutput& output)
{
  const auto write = [&output](CentralOutput::Field field, const Real& x) {
    const FloatOf<Real> narrow = Narrow<Real>(x);
    __builtin_memcpy(output.At(field, output.Next), &narrow, sizeof(narrow));
  };
  const Real& cell = b.Footprints.Cell;
  const Real one = Uniform<Real>(1.0), scale = one / cell;
  const Real shift = scale * b.Blur.Signed * (job.WeighedRadius / job.LensRadius);
  const LensShare<Real> lens(job, b);
  const VisibleAreaOf<Real>& v = b.Surfels.Visible;
  write(CentralOutput::X, b.Places.X);
  write(CentralOutput::Y, b.Places.Y);
  write(CentralOutput::ShiftX, job.Camera.Fx * shift);
  write(CentralOutput::ShiftY, job.Camera.Fy * shift);
  write(CentralOutput::HalfWidth, scale * b.Kernel.HalfWidth);
  write(CentralOutput::HalfHeight, scale * b.Kernel.HalfHeight);
  write(CentralOutput::Near, b.Depths.Near);
  write(CentralOutput::Weight, b.Weight);
  write(CentralOutput::Area, v.Base);
  write(CentralOutput::AreaX, v.X);
  write(CentralOutput::AreaY, v.Y);
  write(CentralOutput::TwoSided, v.TwoSided ? one : Real{});
  write(CentralOutput::PerPixel, lens.PerCell);
  write(CentralOutput::Share, lens.Share);
  write(CentralOutput::Cell, cell);
}

template <class Real>
SURFELSPLATTING_INLINE void Write(
  const SetupJob& job, const BatchIndices<Real>& index, SplatBatch<Real>& b, CentralOutput& output)
{
  WriteFields(job, b, output);
  const SplatFields<Real> fields(b);
  FloatOf<Real> g[6] = {};
  const bool tilted = AnyLane<Real>(b.Surfels.Alive & b.Footprints.Tilted);
  if (tilted)
  {
    MakeGradients(job, index, b, g);
  }
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    if (LaneAt(b.Surfels.Alive, l))
    {
      const std::size_t place = output.Next + l;
      fields.Store(l, output.Splats[place]);
      if (tilted && LaneAt(b.Footprints.Tilted, l))
      {
        const std::size_t gradient = output.First + place;
        output.Splats[place].Gradient = static_cast<std::int32_t>(gradient);
        output.Gradients[gradient] = { LaneAt(g[0], l), LaneAt(g[1], l), LaneAt(g[2], l),
          LaneAt(g[3], l), LaneAt(g[4], l), LaneAt(g[5], l) };
      }
    }
  }
}

template <class Real>
SURFELSPLATTING_INLINE void EndBatch(const PlacedSurfels<Real>& s, CentralOutput& output)
{
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    if (!LaneAt(s.Alive, l))
    {
      *output.At(CentralOutput::Cell, output.Next + l) = LaneAt(s.Invalid, l) ? -1.0f : 0.0f;
    }
  }
  output.Next += LaneTypes<Real>::Count;
}

/// The area that points of a cell see, over the largest one there.
/// @param share becomes the largest one, over the largest one of the whole lens
template <class Real>
SURFELSPLATTING_INLINE VisibleAreaOf<Real> SeenFromCell(
  const SetupJob& job, const VisibleAreaOf<Real>& whole, const CellOfLens& cell, Real& share)
{
  const Real base = whole.Base + cell.X * whole.X + cell.Y * whole.Y;
  const MaskOf<Real> back = (base < 0.0) & whole.TwoSided;
  Real x = whole.X, y = whole.Y, length = 1.0 - whole.Base;
  if (job.LeastShape < 1.0)
  {
    ToUnitDisc(job.ShapeRoot, x, y);
    length = SquareRoot(x * x + y * y);
  }
  share = (back ? -base : base) + cell.Radius * length;
  const Real inverse =
    (back ? Uniform<Real>(-1.0) : Uniform<Real>(1.0)) / (share > 0.0 ? share : Uniform<Real>(1.0));
  const Real slope = cell.Radius * inverse;
  return { base * inverse, slope * x, slope * y, whole.TwoSided };
}

/// The pixels that a splat may change. @param cell size of its grid's cells, px; 1: the picture
SURFELSPLATTING_INLINE PixelBox ReachOf(const PixelBox& box, int cell)
{
  // Cell i is centred at i cells and reaches its neighbours.
  return cell == 1
    ? box
    : PixelBox{ (box.X0 - 1) * cell, (box.Y0 - 1) * cell, box.X1 * cell, box.Y1 * cell };
}

/// Appends those of `count` splats, or as many as Real has lanes, that a cell sees.
template <class Real>
SURFELSPLATTING_INLINE void SeeBatch(const SetupJob& job, const CellOfLens& at,
  const CentralOutput& central, std::size_t first, std::size_t count, SplatOutput& output)
{
  const auto read = [&](CentralOutput::Field field) {
    FloatOf<Real> x;
    __builtin_memcpy(&x, central.At(field, first), sizeof(x));
    return Widen<Real>(x);
  };
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    __builtin_prefetch(&central.Splats[first + l]);
  }
  PrepareToWrite<Real>(output);
  const Real kind = read(CentralOutput::Cell), one = Uniform<Real>(1.0);
  MaskOf<Real> alive = kind >= 1.0;
  if (count < LaneTypes<Real>::Count)
  {
    alive &= GatherMask<Real>([&](int l) { return static_cast<std::size_t>(l) < count; });
  }
  const Real cell = alive ? kind : one, shiftX = read(CentralOutput::ShiftX);
  ScreenPlaces<Real> place;
  place.X = read(CentralOutput::X) + at.X * shiftX;
  place.Y = read(CentralOutput::Y) + at.Y * read(CentralOutput::ShiftY);
  BoundOnScreen<Real>(job.Camera, cell, read(CentralOutput::HalfWidth),
    read(CentralOutput::HalfHeight), place, alive);
  Real share;
  const VisibleAreaOf<Real> visible = SeenFromCell<Real>(job,
    { read(CentralOutput::Area), read(CentralOutput::AreaX), read(CentralOutput::AreaY),
      read(CentralOutput::TwoSided) > 0.0 },
    at, share);
  const Real weight = share * read(CentralOutput::Weight);
  alive &= weight >= MinSplatWeight;
  const LensFootprintFields<Real> lens(
    job, visible, read(CentralOutput::Share), read(CentralOutput::PerPixel));
  const FloatOf<Real> x = Narrow<Real>(place.X), y = Narrow<Real>(place.Y);
  const FloatOf<Real> w = Narrow<Real>(weight);
  const IntOf<Real> sizes = ConvertLanes<IntOf<Real>>(kind);
  const RowParts<Real> boxes = place.Boxes();
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    const int size = LaneAt(sizes, l);
    output.Invalid += size < 0 && static_cast<std::size_t>(l) < count ? 1 : 0;
    PixelBox box;
    boxes.Store(l, &box);
    if (LaneAt(alive, l) && job.Drawn.Touch(ReachOf(box, size)))
    {
      const std::size_t n = output.Count;
      Splat& s = output.Splats[n] = central.Splats[first + l];
      s.X = LaneAt(x, l);
      s.Y = LaneAt(y, l);
      s.Weight = LaneAt(w, l);
      output.Boxes[n] = box;
      output.Nears[n] = *central.At(CentralOutput::Near, first + l);
      lens.Store(l, output.Footprints[n]);
      NoteGrid(s, size, output);
      output.Blurred += LaneAt(shiftX, l) != 0.0 ? 1 : 0;
      ++output.Count;
    }
  }
}
}

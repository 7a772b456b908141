// SPDX-License-Identifier: BSD-3-Clause
/**
 * The beginning and the end of a run of blurred Gaussians (GaussianRun.h): what its cells take over
 * from the pixels of a tile, and give back to them.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/BlocksOfSplats.h"
#include "Core/Raster/GaussianLayers.h"

namespace SurfelSplatting
{
namespace
{
/// Cells that let less through begin with this.
constexpr float LeastStart = 1.0f / 64.0f;

/// A cell whose own pixels let less through begins with the mean of all pixels that take something
/// over from it, since some of them may be open.
constexpr float DarkCell = 0.25f;

constexpr int MostCells = MostRunIntervals + 1;
static_assert(MostCells % BlockSize == 0, "a multiple");

/// Sums over pixels, weighted with T, since nothing is seen behind a closed pixel: of 1, T and its
/// moments.
constexpr int SumCount = 7;

struct CellSums
{
  alignas(64) float Of[SumCount][BlocksPerTile][PixelsPerBlock]; ///< in the blocks of the cells
};

/// How much of each pixel belongs to a cell, along an axis. A cell outside of the picture has its
/// last pixel.
struct CellPixels
{
  int Begin[MostCells], End[MostCells];
  float Share[MostCells][TileSize];

  /// @param reach about a centre, cells @param size of the picture, px
  SURFELSPLATTING_INLINE CellPixels(int intervals, float reach, int size)
  {
    const float cell = static_cast<float>(TileSize) / static_cast<float>(intervals);
    const float last = static_cast<float>(size - 1);
    for (int i = 0; i <= intervals; ++i)
    {
      const float from = (static_cast<float>(i) - reach) * cell, to = from + 2.0f * reach * cell;
      const float low = from < 0.0f ? 0.0f : from < last ? from : last;
      const float high = to < last + 1.0f ? to : last + 1.0f;
      this->Begin[i] = static_cast<int>(low);
      int& end = this->End[i];
      for (end = this->Begin[i]; static_cast<float>(end) < high; ++end)
      {
        const float x = static_cast<float>(end);
        const float right = x + 1.0f < high ? x + 1.0f : high;
        this->Share[i][end] = right - (x > low ? x : low);
      }
    }
  }
};

/// What is summed, row by row of the tile's pixels.
struct PixelRows
{
  alignas(64) float Of[SumCount][TileSize][TileSize];
  bool IsZero[SumCount]; ///< as the moments in front of a tile's first run are

  SURFELSPLATTING_INLINE explicit PixelRows(const PixelTile& tile)
  {
    Lanes largest[SumCount] = { 1.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f };
    for (int block = 0; block < BlocksPerTile; ++block)
    {
      const FinishedLayers& done = tile.Finished[block];
      const Lanes weight = Lanes::Load(done.Transmittance);
      const float* const moments[] = { done.Transmittance, done.ThroughX, done.ThroughY,
        done.ThroughRim, done.ThroughAcross, done.ThroughDiagonal };
      this->Set(0, block, weight);
      for (int k = 1; k < SumCount; ++k)
      {
        const Lanes moment = Lanes::Load(moments[k - 1]);
        largest[k] = Larger(largest[k], moment * moment);
        this->Set(k, block, weight * moment);
      }
    }
    for (int k = 0; k < SumCount; ++k)
    {
      this->IsZero[k] = !Any(largest[k] > 0.0f);
    }
  }

  SURFELSPLATTING_INLINE void Set(int k, int block, const Lanes& values)
  {
    alignas(64) float stored[PixelsPerBlock];
    values.Store(stored);
    const int x = block % BlocksPerRow * BlockSize, y = block / BlocksPerRow * BlockSize;
    for (int row = 0; row < BlockSize; ++row)
    {
      __builtin_memcpy(
        &this->Of[k][y + row][x], stored + row * BlockSize, BlockSize * sizeof(float));
    }
  }
};

/// The shares of columns of pixels in cells, cell by cell.
struct CellsOfColumns
{
  static constexpr int Parts = (MostCells + LaneCount - 1) / LaneCount;
  alignas(64) float Of[TileSize][Parts * LaneCount];

  SURFELSPLATTING_INLINE CellsOfColumns(const CellPixels& columns, int intervals)
  {
    __builtin_memset(this->Of, 0, sizeof(this->Of));
    for (int i = 0; i <= intervals; ++i)
    {
      for (int x = columns.Begin[i]; x < columns.End[i]; ++x)
      {
        this->Of[x][i] = columns.Share[i][x];
      }
    }
  }
};

/// Sums over the rows of pixels of a row of cells, of all columns.
SURFELSPLATTING_INLINE void SumRows(
  const float (&pixels)[TileSize][TileSize], const CellPixels& rows, int j, float* sums)
{
  for (int x = 0; x < TileSize; x += LaneCount)
  {
    Lanes sum = 0.0f;
    for (int y = rows.Begin[j]; y < rows.End[j]; ++y)
    {
      sum += rows.Share[j][y] * Lanes::Load(pixels[y] + x);
    }
    sum.Store(sums + x);
  }
}

/// Sums over the columns of pixels of four rows of cells; columns that are in none of some cells
/// are left out.
SURFELSPLATTING_INLINE void SumColumns(const float (&rows)[BlockSize][TileSize],
  const CellPixels& cells, const CellsOfColumns& columns, int intervals, int j,
  float (&sums)[BlocksPerTile][PixelsPerBlock])
{
  for (int first = 0; first <= intervals; first += LaneCount)
  {
    const int end = first + LaneCount < intervals + 1 ? first + LaneCount : intervals + 1;
    Lanes sum[BlockSize] = { 0.0f, 0.0f, 0.0f, 0.0f };
    for (int x = cells.Begin[first]; x < cells.End[end - 1]; ++x)
    {
      const Lanes shares = Lanes::Load(columns.Of[x] + first);
      for (int row = 0; row < BlockSize; ++row)
      {
        sum[row] += rows[row][x] * shares;
      }
    }
    for (int row = 0; row < BlockSize; ++row)
    {
      alignas(64) float stored[LaneCount];
      sum[row].Store(stored);
      for (int i = first; i < end; i += BlockSize)
      {
        __builtin_memcpy(&sums[BlockOfPixel(i, j)][row * BlockSize], stored + (i - first),
          BlockSize * sizeof(float));
      }
    }
  }
}

/// Sums over the pixels of all cells.
/// @param reach about their centres, cells
SURFELSPLATTING_INLINE void SumPixels(
  const PixelRows& pixels, const RunGrid& grid, float reach, CellSums& sums)
{
  const int n = grid.Intervals;
  const CellPixels cellRows(n, reach, grid.Height), cellColumns(n, reach, grid.Width);
  const CellsOfColumns columns(cellColumns, n);
  for (int k = 0; k < SumCount; ++k)
  {
    if (pixels.IsZero[k])
    {
      __builtin_memset(sums.Of[k], 0, sizeof(sums.Of[k]));
      continue;
    }
    for (int j = 0; j <= n; j += BlockSize)
    {
      alignas(64) float rows[BlockSize][TileSize];
      for (int row = 0; row < BlockSize; ++row)
      {
        SumRows(pixels.Of[k], cellRows, j + row, rows[row]);
      }
      SumColumns(rows, cellColumns, columns, n, j, sums.Of[k]);
    }
  }
}

/// Copies the doubt about a pixel, but not its drifts: a cell has those of the run.
SURFELSPLATTING_INLINE void CopyDoubt(
  const DoubtedLayers& from, int pixel, DoubtedLayers& to, int cell)
{
  to.Width[cell] = from.Width[pixel];
  to.Variation[cell] = from.Variation[pixel];
  to.Red[cell] = from.Red[pixel];
  to.Green[cell] = from.Green[pixel];
  to.Blue[cell] = from.Blue[pixel];
  to.RedDrift[cell] = to.GreenDrift[cell] = to.BlueDrift[cell] = 0.0f;
}

/// Doubts go on from those of the pixel in the middle of a cell.
SURFELSPLATTING_INLINE void CopyDoubts(const PixelTile& tile, const RunGrid& grid, PixelTile& run)
{
  const auto pixelOf = [&](int cell, int size) {
    const int pixel = cell * TileSize / grid.Intervals;
    return pixel < size ? pixel : size - 1;
  };
  for (int j = 0; j <= grid.Intervals; ++j)
  {
    for (int i = 0; i <= grid.Intervals; ++i)
    {
      const int x = pixelOf(i, grid.Width), y = pixelOf(j, grid.Height);
      CopyDoubt(tile.Doubted[BlockOfPixel(x, y)], LaneOfPixel(x, y),
        run.Doubted[BlockOfPixel(i, j)], LaneOfPixel(i, j));
    }
  }
}

/// Means of T of a block of cells, 0 of closed ones.
SURFELSPLATTING_INLINE Lanes MeanThrough(const CellSums& sums, int block)
{
  const Lanes weight = Lanes::Load(sums.Of[0][block]), through = Lanes::Load(sums.Of[1][block]);
  return Select(weight > 0.0f, through / Larger(weight, 1e-30f), 0.0f);
}

/// Begins a block of cells.
SURFELSPLATTING_INLINE void BeginBlock(
  PixelTile& run, int block, const CellSums& own, const CellSums& wide)
{
  const Lanes ofOwn = MeanThrough(own, block);
  const LaneMask dark = ofOwn < DarkCell;
  const auto sum = [&](int k) {
    return Select(dark, Lanes::Load(wide.Of[k][block]), Lanes::Load(own.Of[k][block]));
  };
  const Lanes mean = Select(dark, MeanThrough(wide, block), ofOwn),
              start = Larger(mean, LeastStart);
  const Lanes through = sum(1);
  const Lanes scale = Select(through > 0.0f, start / Larger(through, 1e-30f), 0.0f);
  FinishedLayers& done = run.Finished[block];
  start.Store(done.Transmittance);
  float* const moments[] = { done.ThroughX, done.ThroughY, done.ThroughRim, done.ThroughAcross,
    done.ThroughDiagonal };
  for (int k = 2; k < SumCount; ++k)
  {
    (scale * sum(k)).Store(moments[k - 2]);
  }
  for (float* rest : { done.Red, done.Green, done.Blue, done.Depth, done.Fragments })
  {
    Lanes(0.0f).Store(rest);
  }
  Lanes(1e30f).Store(done.OccluderDepth);
  const Lanes x = Lanes::Load(done.ThroughX), y = Lanes::Load(done.ThroughY);
  const std::uint64_t bit = std::uint64_t{ 1 } << block;
  run.Opaque &= Any(mean > MinTransmittance) ? ~bit : ~std::uint64_t{ 0 };
  run.Tilted |= Any(x * x + y * y > 0.0f) ? bit : 0;
}

/// Calls function(block, x, y) for the blocks of a run's cells and their first cells.
template <class Function>
SURFELSPLATTING_INLINE void ForCellBlocks(const RunGrid& grid, const Function& function)
{
  for (int y = 0; y <= grid.Intervals; y += BlockSize)
  {
    for (int x = 0; x <= grid.Intervals; x += BlockSize)
    {
      function(BlockOfPixel(x, y), x, y);
    }
  }
}

/// RasterTarget::BeginRun.
void BeginRun(const PixelTile& tile, const RunGrid& grid, PixelTile& run, RunStart& start)
{
  const PixelRows pixels(tile);
  CellSums own, wide;
  SumPixels(pixels, grid, 0.5f, own);
  bool isDark = false;
  ForCellBlocks(
    grid, [&](int block, int, int) { isDark = isDark || Any(MeanThrough(own, block) < DarkCell); });
  if (isDark)
  {
    SumPixels(pixels, grid, 1.0f, wide);
  }
  run.Opaque = ~std::uint64_t{ 0 };
  run.Dark = run.Tilted = 0;
  ForCellBlocks(grid, [&](int block, int, int) {
    BeginBlock(run, block, own, isDark ? wide : own);
    start.Before[block] = run.Finished[block];
  });
  if (grid.Doubts)
  {
    CopyDoubts(tile, grid, run);
  }
}

/// What a run does to its cells, row by row, and around them 0.
struct RunChange
{
  static constexpr int Fields = 9, Side = MostCells + 2;
  float Of[Fields][Side][Side];
  float Depth[Side][Side]; ///< of the median

  /// T_1 / T_0, C / T_0, m_1 / T_1 - m_0 / T_0 of a block of cells.
  SURFELSPLATTING_INLINE void Set(
    const FinishedLayers& after, const FinishedLayers& before, int x, int y)
  {
    const Lanes t0 = Lanes::Load(before.Transmittance), t1 = Lanes::Load(after.Transmittance);
    const Lanes per = 1.0f / t0, per1 = Select(t1 > 1e-6f, 1.0f / Larger(t1, 1e-6f), 0.0f);
    this->Put(this->Of[0], x, y, t1 * per);
    const float* const colors[] = { after.Red, after.Green, after.Blue };
    for (int c = 0; c < 3; ++c)
    {
      this->Put(this->Of[1 + c], x, y, Lanes::Load(colors[c]) * per);
    }
    const auto change = [&](const float* last, const float* first) {
      return Lanes::Load(last) * per1 - Lanes::Load(first) * per;
    };
    this->Put(this->Of[4], x, y, change(after.ThroughX, before.ThroughX));
    this->Put(this->Of[5], x, y, change(after.ThroughY, before.ThroughY));
    this->Put(this->Of[6], x, y, change(after.ThroughRim, before.ThroughRim));
    this->Put(this->Of[7], x, y, change(after.ThroughAcross, before.ThroughAcross));
    this->Put(this->Of[8], x, y, change(after.ThroughDiagonal, before.ThroughDiagonal));
    this->Put(this->Depth, x, y, Lanes::Load(after.Depth));
  }

  SURFELSPLATTING_INLINE void Put(float (&to)[Side][Side], int x, int y, const Lanes& values)
  {
    alignas(64) float stored[PixelsPerBlock];
    values.Store(stored);
    for (int row = 0; row < BlockSize; ++row)
    {
      __builtin_memcpy(&to[y + row][x], stored + row * BlockSize, BlockSize * sizeof(float));
    }
  }
};

/// N x N cells about the pixels of a block, and their shares in these.
template <int N>
struct CellCorners
{
  int I, J; ///< the first cell
  Lanes X[N], Y[N];

  SURFELSPLATTING_INLINE CellCorners(int block, int intervals)
  {
    const float perCell = static_cast<float>(intervals) / static_cast<float>(TileSize);
    const float x = FirstPixel[block % BlocksPerRow], y = FirstPixel[block / BlocksPerRow];
    this->I = static_cast<int>((x + 0.5f) * perCell);
    this->J = static_cast<int>((y + 0.5f) * perCell);
    const Lanes dx = (Lanes::Load(RampX) + (x + 0.5f)) * perCell - static_cast<float>(this->I);
    const Lanes dy = (Lanes::Load(RampY) + (y + 0.5f)) * perCell - static_cast<float>(this->J);
    for (int k = 0; k < N; ++k)
    {
      const Lanes ex = dx - static_cast<float>(k), ey = dy - static_cast<float>(k);
      this->X[k] = Larger(1.0f - Larger(ex, 0.0f - ex), 0.0f);
      this->Y[k] = Larger(1.0f - Larger(ey, 0.0f - ey), 0.0f);
    }
  }

  /// @param value of a cell
  template <class Value>
  SURFELSPLATTING_INLINE Lanes Interpolate(const Value& value) const
  {
    Lanes sum = 0.0f;
    for (int b = 0; b < N; ++b)
    {
      Lanes row = 0.0f;
      for (int a = 0; a < N; ++a)
      {
        row += this->X[a] * value(this->I + a, this->J + b);
      }
      sum += this->Y[b] * row;
    }
    return sum;
  }
};

/// Adds the doubts about a run to those about a block.
template <int N>
SURFELSPLATTING_INLINE void AddDoubtOfRun(
  PixelTile& tile, int block, const PixelTile& run, const CellCorners<N>& at, int intervals)
{
  DoubtedLayers& to = tile.Doubted[block];
  const auto interpolate = [&](float(DoubtedLayers::*field)[PixelsPerBlock]) {
    return at.Interpolate([&](int i, int j) {
      return i > intervals || j > intervals
        ? 0.0f
        : (run.Doubted[BlockOfPixel(i, j)].*field)[LaneOfPixel(i, j)];
    });
  };
  AddTo(to.RedDrift, interpolate(&DoubtedLayers::RedDrift));
  AddTo(to.GreenDrift, interpolate(&DoubtedLayers::GreenDrift));
  AddTo(to.BlueDrift, interpolate(&DoubtedLayers::BlueDrift));
  interpolate(&DoubtedLayers::Red).Store(to.Red);
  interpolate(&DoubtedLayers::Green).Store(to.Green);
  interpolate(&DoubtedLayers::Blue).Store(to.Blue);
  interpolate(&DoubtedLayers::Variation).Store(to.Variation);
  const Lanes through = Lanes::Load(tile.Finished[block].Transmittance);
  Smaller(interpolate(&DoubtedLayers::Width), through).Store(to.Width);
}

/// Composites a run behind the finished layers of a block.
template <int N>
SURFELSPLATTING_INLINE void AddRunToBlock(
  PixelTile& tile, int block, const RunChange& change, const CellCorners<N>& at)
{
  const auto interpolate = [&](int field) {
    return at.Interpolate([&](int i, int j) { return change.Of[field][j][i]; });
  };
  float depth = 0.0f; // the farthest of the cells'
  for (int k = 0; k < N * N; ++k)
  {
    const float ofCell = change.Depth[at.J + k / N][at.I + k % N];
    depth = ofCell > depth ? ofCell : depth;
  }
  FinishedLayers& done = tile.Finished[block];
  const Lanes before = Lanes::Load(done.Transmittance);
  const Lanes through = interpolate(0), after = before * through;
  AddTo(done.Red, before * interpolate(1));
  AddTo(done.Green, before * interpolate(2));
  AddTo(done.Blue, before * interpolate(3));
  const LensMoments<Lanes> t = MomentsOf(OneBlock{ done });
  const LensMoments<Lanes> behind{ t.X * through + after * interpolate(4),
    t.Y * through + after * interpolate(5), t.Rim * through + after * interpolate(6),
    t.Across * through + after * interpolate(7), t.Diagonal * through + after * interpolate(8) };
  if (AreLong(StoreMoments(OneBlock{ done }, behind, after)))
  {
    tile.Tilted |= std::uint64_t{ 1 } << block;
  }
  StoreThrough(tile, block, before, after, depth);
}

template <int N>
SURFELSPLATTING_INLINE void AddRunToBlocks(
  PixelTile& tile, const PixelTile& run, const RunChange& change, const RunGrid& grid)
{
  for (int block = 0; block < BlocksPerTile; ++block)
  {
    const CellCorners<N> at(block, grid.Intervals);
    AddRunToBlock<N>(tile, block, change, at);
    if (grid.Doubts)
    {
      AddDoubtOfRun<N>(tile, block, run, at, grid.Intervals);
    }
  }
}

/// How many cells along an axis the pixels of a block lie between, at most.
SURFELSPLATTING_INLINE int CornersOfBlocks(int intervals)
{
  int most = 0;
  for (int x = 0; x < TileSize; x += BlockSize)
  {
    const int first = (2 * x + 1) * intervals / (2 * TileSize);
    const int last = (2 * (x + BlockSize) - 1) * intervals / (2 * TileSize) + 1;
    most = last - first + 1 > most ? last - first + 1 : most;
  }
  return most;
}

/// RasterTarget::AddRun.
void AddRun(PixelTile& tile, const PixelTile& run, const RunStart& start, const RunGrid& grid)
{
  RunChange change;
  __builtin_memset(&change, 0, sizeof(change));
  ForCellBlocks(grid,
    [&](int block, int x, int y) { change.Set(run.Finished[block], start.Before[block], x, y); });
  switch (CornersOfBlocks(grid.Intervals))
  {
    case 2:
      AddRunToBlocks<2>(tile, run, change, grid);
      break;
    case 3:
      AddRunToBlocks<3>(tile, run, change, grid);
      break;
    default:
      AddRunToBlocks<4>(tile, run, change, grid);
  }
}
}
}

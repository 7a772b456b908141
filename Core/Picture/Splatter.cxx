// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Picture/Splatter.h"

#include "Core/Lens/GaussianFootprint.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>

namespace SurfelSplatting
{
namespace
{
class StopWatch
{
public:
  /// Milliseconds since the last call or the construction.
  double Lap()
  {
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double, std::milli>(now - this->Start).count();
    this->Start = now;
    return elapsed;
  }

private:
  std::chrono::steady_clock::time_point Start = std::chrono::steady_clock::now();
};

/// @throw std::invalid_argument if the frame is not one for this view
void CheckFrame(const Frame& frame, const View& view)
{
  if (frame.Width != view.Width || frame.Height != view.Height)
  {
    throw std::invalid_argument("the frame has " + std::to_string(frame.Width) + " x " +
      std::to_string(frame.Height) + " pixels, and the view " + std::to_string(view.Width) + " x " +
      std::to_string(view.Height) + "; make them equal");
  }
  if (frame.Color && !frame.Depth)
  {
    throw std::invalid_argument("the frame has colours, but no memory for depths; set both");
  }
}

/// Factor of the level of detail's error where cells are drawn only in doubtful tiles: the picture
/// through the whole lens has finer nodes, which gain 0.03 to 0.7 dB there for at most a third of
/// one picture's time.
constexpr double WholeError = 0.75;

/// Factor of the error of the cells themselves, if they are few.
constexpr double FewCellsError = 1.15;

/// CutSettings::BlurGain of K cells. A node is off by the cube of its size over the blur of a cell,
/// which is that of the lens over sqrt(K). Where all cells see it, their mean is off as the picture
/// through the whole lens is: K^(1/2). Where they see it behind different things, their errors are
/// independent: K^(1/6). Few cells take K^(1/3), which costs at most 0.07 dB against ray-traced
/// scenes, with FewCellsError; many are meant to come close to the limit.
double BlurGain(std::size_t cells, bool few)
{
  return std::pow(static_cast<double>(cells), few ? 1.0 / 3.0 : 1.0 / 6.0);
}

/// Does what a rank does by itself between exchanges: if it fails on one, all throw.
template <typename Work>
void DoOwn(const RenderTarget& target, const Work& work)
{
  if (target.Exchange)
  {
    target.Exchange->DoOwn(work);
    return;
  }
  work();
}
}

void FrameStatistics::Add(const FrameStatistics& other)
{
  this->Surfels = std::max(this->Surfels, other.Surfels);
  this->InvalidSurfels = std::max(this->InvalidSurfels, other.InvalidSurfels);
  this->Cut.Add(other.Cut);
  this->Splats += other.Splats;
  this->BlurredSplats += other.BlurredSplats;
  this->CoarseCells += other.CoarseCells;
  this->Pairs += other.Pairs;
  this->Fragments += other.Fragments;
  this->HiddenSurfels += other.HiddenSurfels;
  this->HiddenPairs += other.HiddenPairs;
  this->SelectionMilliseconds += other.SelectionMilliseconds;
  this->SetupMilliseconds += other.SetupMilliseconds;
  this->CoarseMilliseconds += other.CoarseMilliseconds;
  this->BinningMilliseconds += other.BinningMilliseconds;
  this->SortMilliseconds += other.SortMilliseconds;
  this->RasterMilliseconds += other.RasterMilliseconds;
}

/// Sets up the frame through one cell of the lens. Lights stay where they are in the world.
void Splatter::SetCell(const SplatContext& context, const SubAperture& cell)
{
  SplatContext& part = this->Cell;
  part = context;
  const bool layers = !context.DepthBuffered;
  part.CoarseGrids = context.CoarseGrids && layers;
  part.SkipHidden = context.SkipHidden && layers;
  part.Camera = cell.Camera;
  part.Optics = cell.Optics;
  part.Drawn = this->Doubtful.Tiles({ part.Camera.Width, part.Camera.Height });
  this->CellCenter = cell.Center;
  for (Light& light : part.Lights)
  {
    light.Position = light.Position - cell.Center;
  }
  this->CellInPicture = part;
  this->CellInPicture.CoarseGrids = false;
}

/// Selects the cut of a cloud into Ranges. Cells of the lens share one: its first cell makes it.
void Splatter::SelectRanges(const SurfelCloud& cloud, std::size_t index, const Executor& executor)
{
  this->Stats.Surfels += cloud.NumberOfSurfels;
  if (!cloud.Clusters)
  {
    AllSurfels(cloud, this->Ranges);
    return;
  }
  const SplatContext& cell = this->Cell;
  const TruncatedGaussian gaussian(cell.Settings.Cutoff);
  const double supportRadius = cloud.Kind == CloudKind::Capture ? std::sqrt(LargestGaussianReach)
    : cloud.Kind == CloudKind::Volume
    ? std::sqrt(LargestVolumeReach)
    : std::fmax(MaxKernelReach, std::sqrt(gaussian.Support() / gaussian.Tau));
  const double prefilter = cloud.IsInSpace() ? SpacePrefilter : cell.Settings.Prefilter;
  const double lensVariance = DefocusVariance(cell.Settings.Kernel, 1.0, gaussian);
  if (cell.Cut.Cells <= 1)
  {
    const CutCamera camera{ cell.Camera, cell.Optics, supportRadius, prefilter, lensVariance };
    this->Stats.Cut.Add(SelectCut(cloud, camera, cell.Cut, executor, this->Cut, this->Ranges));
    return;
  }
  this->SharedCuts.resize(std::max(this->SharedCuts.size(), index + 1));
  std::vector<CutRange>& shared = this->SharedCuts[index];
  const Lens& lens = this->Whole.Optics;
  if (this->IsFirstCell)
  {
    const CutCamera camera{ this->Whole.Camera, lens, supportRadius, prefilter, lensVariance,
      this->CellShare, this->CellReach };
    this->Stats.Cut.Add(SelectCut(cloud, camera, cell.Cut, executor, this->Cut, shared));
  }
  SeeFromCell(shared, this->Whole.Camera, lens, this->CellCenter, this->Ranges);
}

void Splatter::Append(const SplatContext& context, const SurfelCloud& cloud,
  const CutRanges& ranges, const Executor& executor)
{
  this->Maker.Set(context, cloud);
  AppendSplats(this->Maker, ranges, executor, this->List);
}

/// Wide nodes go to coarse grids, which have to be complete before anything else. All others stay
/// in the picture; if hidden splats are skipped, they wait until a tile needs them.
void Splatter::PlaceRanges(const SurfelCloud& cloud, bool mayWait, const Executor& executor)
{
  const bool grids = this->Cell.CoarseGrids;
  this->PictureRanges.clear();
  std::size_t wide = 0;
  for (const CutRange& range : this->Ranges)
  {
    if (!this->Cell.Drawn.Touch(range.Box))
    {
      continue;
    }
    if (range.Wide && grids && !cloud.IsInSpace())
    {
      this->Ranges[wide++] = range;
    }
    else
    {
      this->PictureRanges.push_back(range);
    }
  }
  const CutRange* narrow = this->PictureRanges.data();
  const CutRanges inPicture{ narrow, narrow + this->PictureRanges.size() };
  this->Append(this->Cell, cloud, { this->Ranges.data(), this->Ranges.data() + wide }, executor);
  if (mayWait && this->Cell.SkipHidden)
  {
    this->Lazy.Add(cloud, inPicture);
    return;
  }
  this->Append(this->CellInPicture, cloud, inPicture, executor);
}

bool Splatter::Render(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const RenderTarget& target, const CellFunction& afterCell)
{
  if (target.Exchange)
  {
    target.Exchange->BeginPicture();
  }
  CheckFrame(target.Picture, context.Camera);
  this->Doubtful.Clear();
  this->SumsDoubts = false;
  bool isWhole = true;
  if (IsWhole(context.Camera, context.Optics, context.Sampling))
  {
    this->SetCell(context, { context.Camera, context.Optics });
    this->RenderCell(clouds, executor, target);
  }
  else
  {
    isWhole = this->RenderCells(context, clouds, executor, target, afterCell);
  }
  if (target.Exchange)
  {
    target.Exchange->Collect(target.Picture);
  }
  return isWhole;
}

/// Renders through the whole lens, and finds the tiles that its cells may change by more than a
/// level of 255 if there are seven: the error of the mean falls with their number.
void Splatter::RenderWhole(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const RenderTarget& target)
{
  constexpr float doubtTimesCells = 7.0f / 255.0f;
  this->SetCell(context, { context.Camera, context.Optics });
  this->Cell.Cut.Error *= WholeError;
  this->SumsDoubts = true;
  this->RenderCell(clouds, executor, target);
  this->SumsDoubts = false;
  std::vector<float> doubts;
  for (const TileResult& tile : this->Tiles)
  {
    doubts.push_back(tile.Counts.Doubt);
  }
  if (target.Exchange)
  {
    target.Exchange->ShareLargest(doubts);
  }
  this->Doubtful.Set({ target.Picture.Width, target.Picture.Height }, doubts,
    doubtTimesCells / static_cast<float>(context.Sampling.Count));
}

/// Keeps what all cells of a lens have in common.
void Splatter::SetDivision(const SplatContext& context, const std::vector<SubAperture>& cells)
{
  const double radius = context.Optics.Radius;
  this->Whole = { context.Camera, context.Optics };
  this->CellShare = 1.0;
  this->CellReach = 0.0;
  for (const SubAperture& cell : cells)
  {
    const double share = cell.Optics.Radius / radius;
    this->CellShare = std::fmin(this->CellShare, share);
    this->CellReach = std::fmax(this->CellReach, share * std::sqrt(cell.Optics.Shape.Largest()));
  }
}

/// Memory for a mean of cells, where the picture keeps what the whole lens sees.
Frame Splatter::MeanBeside(const Frame& picture)
{
  const std::size_t pixels = static_cast<std::size_t>(picture.Width) * picture.Height;
  this->MeanColor.resize(4 * pixels);
  this->MeanDepth.resize(pixels);
  return { picture.Width, picture.Height, this->MeanColor.data(), this->MeanDepth.data() };
}

/// Renders through the cells of the lens, one after another, and takes their mean.
bool Splatter::RenderCells(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor, const RenderTarget& target, const CellFunction& afterCell)
{
  const std::vector<SubAperture> cells =
    DivideLens(context.Camera, context.Optics, context.Sampling);
  // Many cells are meant to come close to the limit, also where one picture is good.
  constexpr int fewCells = 9;
  const ApertureSampling& sampling = context.Sampling;
  const bool few = !sampling.Pinholes && sampling.Count <= fewCells;
  const bool everywhere =
    sampling.Everywhere || !few || context.DepthBuffered || target.Sink || !target.Picture.Color;
  FrameStatistics total;
  Frame mean = target.Picture;
  if (!everywhere)
  {
    this->RenderWhole(context, clouds, executor, target);
    total = this->Stats;
  }
  this->SetDivision(context, cells);
  DoOwn(target, [&] {
    mean = everywhere ? mean : this->MeanBeside(mean);
    this->Average.Start(mean, this->Doubtful, executor);
  });
  RenderTarget cellTarget = target;
  cellTarget.Picture = this->Average.Next();
  cellTarget.Mean = &this->Average;
  std::size_t done = 0;
  bool goOn = true;
  while (goOn && done < cells.size() && !this->Doubtful.IsEmpty())
  {
    this->IsFirstCell = done == 0;
    this->SetCell(context, cells[done]);
    this->Cell.Cut.Cells = cells.size();
    this->Cell.Cut.BlurGain = BlurGain(cells.size(), few);
    this->Cell.Cut.Error *= few ? FewCellsError : 1.0;
    this->RenderCell(clouds, executor, cellTarget);
    total.Add(this->Stats);
    this->Average.EndPicture();
    ++done;
    goOn = done == cells.size() || !afterCell ||
      afterCell(static_cast<double>(done) / static_cast<double>(cells.size()));
  }
  DoOwn(target, [&] {
    this->Average.Finish();
    if (!everywhere)
    {
      this->Doubtful.Mix(mean, target.Picture, executor);
    }
  });
  this->Stats = total;
  return goOn;
}

/// Makes the splats of all clouds into List; those that may wait go into Lazy.
void Splatter::MakeSplats(
  const std::vector<SurfelCloud>& clouds, bool mayWait, const Executor& executor)
{
  StopWatch watch;
  for (std::size_t i = 0; i < clouds.size(); ++i)
  {
    const SurfelCloud& cloud = clouds[i];
    this->SelectRanges(cloud, i, executor);
    this->Stats.SelectionMilliseconds += watch.Lap();
    if (cloud.Clusters)
    {
      this->PlaceRanges(cloud, mayWait, executor);
    }
    else
    {
      const CutRange* first = this->Ranges.data();
      this->Append(this->Cell, cloud, { first, first + this->Ranges.size() }, executor);
    }
    this->Stats.SetupMilliseconds += watch.Lap();
  }
  const SplatList::Part all = this->List.Sum();
  this->Stats.InvalidSurfels = all.Invalid;
  this->Stats.Splats = all.Count;
  this->Stats.BlurredSplats = all.Blurred;
}

/// Makes all splats at once, because it is unknown which of them lie behind those of other ranks.
void Splatter::ExchangeSplats(
  const std::vector<SurfelCloud>& clouds, const Executor& executor, SplatExchange& exchange)
{
  exchange.DoOwn([&] { this->MakeSplats(clouds, false, executor); });
  const View& view = this->Cell.Camera;
  exchange.Exchange(view.Width, view.Height, executor, this->List);
}

/// Composites the splats on coarse grids and adds their cells to List as tents of the picture.
RasterSettings Splatter::ResolveCoarseGrids(const Executor& executor)
{
  const SplatContext& context = this->Cell;
  const TruncatedGaussian gaussian(context.Settings.Cutoff);
  const SplatList::Part all = this->List.Sum();
  RasterSettings settings{ static_cast<float>(gaussian.Support()), all.LargestCoarseColor };
  settings.LargestDelay = all.LargestDelay;
  if (context.HasLens())
  {
    settings.LensRadius = static_cast<float>(context.Optics.Radius);
    settings.BlurPerDepth =
      static_cast<float>(context.Optics.Radius / context.Optics.FocalDistance);
    settings.SetShape(context.Optics.Shape);
  }
  settings.Pass = context.DepthBuffered ? RasterPass::Nearest : RasterPass::Layers;
  this->Stats.Fragments =
    ResolveCoarseLevels(this->List, context.Drawn, settings, executor, this->Rasters, this->Coarse);
  this->Stats.CoarseCells = this->List.Tents.Size();
  return settings;
}

void Splatter::RenderCell(
  const std::vector<SurfelCloud>& clouds, const Executor& executor, const RenderTarget& target)
{
  if (target.Sink)
  {
    target.Sink->BeginCell();
  }
  this->Stats = FrameStatistics();
  this->TileSeconds = 0.0;
  // The layers of a sink are those of pixels.
  this->Cell.GaussianRuns = this->CellInPicture.GaussianRuns =
    this->Cell.GaussianRuns && this->Cell.CoarseGrids && !target.Sink;
  this->List.Clear(this->Cell.HasLens());
  this->Lazy.Clear(this->Cell);
  if (target.Exchange)
  {
    this->ExchangeSplats(clouds, executor, *target.Exchange);
  }
  else
  {
    this->MakeSplats(clouds, !target.Sink, executor);
  }
  DoOwn(target, [&] { this->DrawSplats(executor, target); });
}

/// Draws List and Lazy.
void Splatter::DrawSplats(const Executor& executor, const RenderTarget& target)
{
  const PictureSize size{ this->Cell.Camera.Width, this->Cell.Camera.Height };
  StopWatch watch;
  RasterSettings settings = this->ResolveCoarseGrids(executor);
  settings.Doubts = this->SumsDoubts;
  this->Stats.CoarseMilliseconds = watch.Lap();

  BinSplats(this->List, 0, size, executor, this->Bins);
  this->Lazy.Bin(size);
  this->Stats.BinningMilliseconds = watch.Lap();
  if (!this->Cell.DepthBuffered)
  {
    SortBins(executor, this->Bins);
  }
  this->Stats.SortMilliseconds = watch.Lap();

  this->RasterTiles(settings, executor, target);
  this->ShareTime(watch.Lap());
}

void Splatter::RasterTiles(
  const RasterSettings& settings, const Executor& executor, const RenderTarget& target)
{
  const Frame& frame = target.Picture;
  LazySplats* lazy = this->Lazy.IsEmpty() ? nullptr : &this->Lazy;
  const RowRange rows = target.Exchange ? target.Exchange->Rows() : RowRange{ 0, frame.Height };
  this->Tiles.assign(this->Bins.NumberOfTiles(), {});
  const TileOrder order(this->Bins.TilesX, this->Bins.TilesY);
  executor.For(order.Size(), TileOrder::PieceSize, [&](std::size_t begin, std::size_t end) {
    const Pool<TileRaster>::Loan raster(this->Rasters);
    raster->Set(settings, target.OccluderDepth, target.Sink, this->Cell.SkipHidden);
    for (std::size_t place = begin; place < end; ++place)
    {
      const std::size_t tile = order[place];
      const int row = static_cast<int>(tile) / this->Bins.TilesX * TileSize;
      if (tile >= this->Tiles.size() || row < rows.Begin || row >= rows.End ||
        !this->Doubtful.Has(tile))
      {
        continue; // outside, belongs to another rank, or the whole lens is enough
      }
      StopWatch watch;
      this->Tiles[tile].Counts = raster->Render(this->List, this->Bins, tile, frame, lazy);
      this->Tiles[tile].Seconds = 1e-3 * watch.Lap();
      if (target.Mean)
      {
        target.Mean->Add(tile);
      }
    }
  });
  this->Stats.Pairs = this->Bins.Keys.size();
  for (const TileResult& tile : this->Tiles)
  {
    this->Stats.Fragments += tile.Counts.Fragments;
    this->Stats.HiddenPairs += tile.Counts.Hidden;
    this->Stats.Pairs += tile.Counts.LazyPairs;
    this->TileSeconds += tile.Seconds;
  }
}

/// Set-up and raster take turns within the tiles. Divides their wall-clock time in proportion to
/// the time that all threads spent on each.
void Splatter::ShareTime(double milliseconds)
{
  const LazySplats::Counts lazy = this->Lazy.Count();
  this->Stats.Splats += lazy.Splats;
  this->Stats.BlurredSplats += lazy.Blurred;
  this->Stats.InvalidSurfels += lazy.Invalid;
  this->Stats.HiddenSurfels = lazy.Hidden;
  const double share =
    this->TileSeconds > 0.0 ? std::fmin(1.0, lazy.Seconds / this->TileSeconds) : 0.0;
  this->Stats.SetupMilliseconds += share * milliseconds;
  this->Stats.RasterMilliseconds = (1.0 - share) * milliseconds;
}
}

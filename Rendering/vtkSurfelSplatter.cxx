// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelSplatter.h"

#include "Core/Base/MemoryGuard.h"
#include "Core/Picture/DeepImage.h"
#include "Core/Picture/Splatter.h"
#include "Parallel/ControllerRanks.h"
#include "Rendering/Scene/CameraAdapter.h"
#include "Rendering/Scene/CloudAdapter.h"
#include "Rendering/Scene/FrameKey.h"
#include "Rendering/Scene/HierarchyCache.h"
#include "Rendering/Scene/MiddleView.h"
#include "Rendering/Scene/PictureArrays.h"
#include "Rendering/Scene/PixelChannels.h"
#include "Rendering/Scene/PropOccluders.h"
#include "Rendering/Scene/SceneView.h"
#include "Rendering/Scene/ViewWarnings.h"
#include "SurfelData/SMPExecutor.h"
#include "vtkSurfelMapper.h"

#include <vtkActor.h>
#include <vtkAssemblyNode.h>
#include <vtkAssemblyPath.h>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkLightCollection.h>
#include <vtkMatrix4x4.h>
#include <vtkMultiProcessController.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkProperty.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>

namespace
{
constexpr const char* StageNames[] = { "scene", "selection", "setup", "coarse", "binning", "sort",
  "raster" };
constexpr int NumberOfStages = 7;

double MillisecondsSince(const std::chrono::steady_clock::time_point& start)
{
  const auto now = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::milli>(now - start).count();
}
}

/// The scene of a frame and the arrays of its picture.
struct vtkSurfelSplatter::SceneClouds
{
  std::vector<SurfelSplatting::SurfelCloudSource> Sources;
  std::vector<SurfelSplatting::SurfelCloud> Clouds;
  vtkSmartPointer<vtkFloatArray> Color, Depth;
  SurfelSplatting::DeepImage Deep;
  const float* OccluderDepth = nullptr; // distances of other props that stay sharp
};

struct vtkSurfelSplatter::Internals
{
  vtkSmartPointer<vtkMultiProcessController> Controller;
  std::unique_ptr<SurfelSplatting::Ranks> Ranks; // null: this process alone
  bool WarnedRanks = false;
  SurfelSplatting::Splatter Core;
  SurfelSplatting::Splatter ChannelCore; // another one: Core keeps the statistics of the colours
  vtkNew<vtkImageData> Output;
  SurfelSplatting::SplatContext Context;
  SurfelSplatting::FrameKey Key;            // of the picture in Output
  vtkSmartPointer<vtkSurfelSplatter> Small; // finds what is in the middle
  SurfelSplatting::PropOccluders Occluders;
  bool HasPicture = false;
  double SceneMilliseconds = 0.0;
  SurfelSplatting::ViewWarnings Warnings;
};

vtkStandardNewMacro(vtkSurfelSplatter);

vtkSurfelSplatter::vtkSurfelSplatter()
  : Internal(new Internals)
{
}

vtkSurfelSplatter::~vtkSurfelSplatter() = default;

void vtkSurfelSplatter::SetController(vtkMultiProcessController* controller)
{
  if (this->Internal->Controller != controller)
  {
    this->Internal->Controller = controller;
    this->Internal->Ranks.reset(controller && controller->GetNumberOfProcesses() > 1
        ? new SurfelSplatting::ControllerRanks(controller)
        : nullptr);
    this->Modified();
  }
}

vtkMultiProcessController* vtkSurfelSplatter::GetController()
{
  return this->Internal->Controller;
}

SurfelSplatting::Ranks* vtkSurfelSplatter::GetRanks()
{
  return this->Internal->Ranks.get();
}

void vtkSurfelSplatter::CollectItems(vtkProp* prop, SceneItems& items)
{
  if (!prop || !prop->GetVisibility())
  {
    return;
  }
  prop->InitPathTraversal();
  while (vtkAssemblyPath* path = prop->GetNextPath())
  {
    vtkAssemblyNode* node = path->GetLastNode();
    vtkActor* actor = vtkActor::SafeDownCast(node->GetViewProp());
    vtkSurfelMapper* mapper = actor ? vtkSurfelMapper::SafeDownCast(actor->GetMapper()) : nullptr;
    if (!mapper || !actor->GetVisibility())
    {
      continue;
    }
    SurfelSplatting::SceneItem item;
    item.Mapper = mapper;
    item.Property = actor->GetProperty();
    item.Matrix = vtkSmartPointer<vtkMatrix4x4>::New();
    item.Matrix->DeepCopy(node->GetMatrix());
    items.push_back(item);
  }
}

bool vtkSurfelSplatter::HasOneSize(const int size[2])
{
  SurfelSplatting::Ranks* ranks = this->GetRanks();
  if (!ranks)
  {
    return true;
  }
  const bool same = ranks->RootValue(size[0]) == size[0];
  if (ranks->All(ranks->RootValue(size[1]) == size[1] && same))
  {
    return true;
  }
  vtkErrorMacro("The processes' pictures differ in size; this one's is "
    << size[0] << " x " << size[1]
    << " pixels. Give all windows the same size, or unset the controller of this one.");
  return false;
}

bool vtkSurfelSplatter::Render(const SceneItems& items, const SceneView& view)
{
  if (!this->HasOneSize(view.Size))
  {
    return false;
  }
  try
  {
    this->RenderPicture(items, view);
    return true;
  }
  catch (const std::bad_alloc& problem)
  {
    if (this->GetRanks() && !dynamic_cast<const SurfelSplatting::RanksLackMemory*>(&problem))
    {
      throw; // the other processes wait for this one: ending is better than waiting forever
    }
    this->Internal->Output->Initialize();
    this->Internal->HasPicture = false;
    vtkErrorMacro("There is not enough memory for a picture of "
      << view.Size[0] << " x " << view.Size[1]
      << " pixels of these surfels. Make it smaller, or render it in tiles.");
    return false;
  }
  catch (const SurfelSplatting::DamagedMemory& problem)
  {
    this->Internal->Output->Initialize();
    this->Internal->HasPicture = false;
    vtkErrorMacro("A picture of these surfels cannot be made: " << problem.what() << ".");
    return false;
  }
}

void vtkSurfelSplatter::MakeContext(const SceneView& view)
{
  namespace Core = SurfelSplatting;
  Core::SplatContext context;
  context.Camera = view.Projection;
  context.Optics = view.Optics;
  context.Lights = Core::MakeLights(view.Lights, view.Camera, context.Camera);
  if (view.CellCount == 0)
  {
    // Channels are means over all cells; the picture that they belong to is as well.
    context.Sampling = { view.IsMoving ? 1 : this->LensCells,
      !view.IsMoving && this->LensPinholes != 0, this->Channels != 0 };
  }
  context.Settings.Kernel =
    this->Kernel == PEARSON_II ? Core::KernelType::PearsonII : Core::KernelType::Gaussian;
  context.Settings.Cutoff = this->Cutoff;
  context.Settings.Prefilter = this->Prefilter;
  context.Settings.KeepCaptureMass = this->KeepCaptureMass;
  context.Cut.Rule = this->LODMode == LOD_OFF ? Core::CutRule::Leaves
    : this->LODMode == LOD_PAPER              ? Core::CutRule::Paper
                                              : Core::CutRule::Moments;
  context.Cut.Error = this->LODError * view.Coarsening;
  context.CoarseGrids = this->CoarseGrids != 0;
  context.Colors = this->ColorByLevel ? Core::Paint::LevelColors : Core::Paint::Own;
  this->Internal->Context = context;
}

/// Updates the pipelines of the surfels. Call after MakeContext.
SurfelSplatting::FrameKey vtkSurfelSplatter::MakeKey(const SceneItems& items, const SceneView& view)
{
  for (const SurfelSplatting::SceneItem& item : items)
  {
    if (!item.Mapper->GetStatic() && item.Mapper->GetInputAlgorithm())
    {
      item.Mapper->GetInputAlgorithm()->Update();
    }
  }
  return this->FrameReuse
    ? SurfelSplatting::FrameKey(items, view, this->Internal->Context, this->GetMTime())
    : SurfelSplatting::FrameKey();
}

bool vtkSurfelSplatter::HasPicture(const SceneItems& items, const SceneView& view)
{
  if (!this->FrameReuse || !this->Internal->HasPicture || !view.PropStamp || this->GetRanks())
  {
    return false;
  }
  this->MakeContext(view);
  return this->MakeKey(items, view) == this->Internal->Key;
}

void vtkSurfelSplatter::RenderPicture(const SceneItems& items, const SceneView& view)
{
  const auto start = std::chrono::steady_clock::now();
  this->MakeContext(view);
  const auto warn = [this](const char* text) { vtkWarningMacro(<< text); };
  this->Internal->Warnings.Tell(
    view, std::isfinite(this->Cutoff + this->Prefilter + this->LODError), warn);
  this->Internal->Warnings.TellOfItems(items, view, warn);
  SurfelSplatting::FrameKey key = this->MakeKey(items, view);
  this->NumberOfPreparedSurfels = 0;
  SurfelSplatting::Ranks* ranks = this->GetRanks();
  const bool same = this->FrameReuse && this->Internal->HasPicture && key == this->Internal->Key;
  if (ranks ? ranks->All(same) : same)
  {
    ++this->NumberOfReusedFrames;
  }
  else
  {
    this->Internal->HasPicture = false;
    const bool isComplete = this->RenderScene(items, view, start);
    this->Internal->HasPicture = isComplete && this->FrameReuse != 0;
    this->Internal->Key = std::move(key);
  }
  this->FrameMilliseconds = MillisecondsSince(start);
}

/// The distance to the surface in the middle, by a small picture; 0 if no surfels are seen.
double vtkSurfelSplatter::FindMiddle(const SceneItems& items, const SceneView& view)
{
  vtkSmartPointer<vtkSurfelSplatter>& small = this->Internal->Small;
  small = small ? small : vtkSmartPointer<vtkSurfelSplatter>::New();
  small->SetLensModeToPinhole();
  small->SetLODError(2.0); // 0.4 of the time, for nearly the same distance
  small->SetController(this->GetController());
  SurfelSplatting::Ranks* ranks = this->GetRanks(); // which have no channels
  small->SetChannels(!ranks && SurfelSplatting::HaveVolume(items) ? CHANNEL_MEDIAN_DEPTH : 0);
  small->SetKeepCaptureMass(this->KeepCaptureMass);
  small->SetLODMode(this->LODMode); // both as here: a mapper keeps what it has computed for one
  small->SetLinearLight(this->LinearLight);
  SurfelSplatting::MiddleView middle(view);
  small->CompleteView(middle.View, items);
  const double front = small->Render(items, middle.View) ? FindFront(small->GetOutput()) : 0.0;
  return ranks ? ranks->RootValue(front) : front;
}

void vtkSurfelSplatter::CompleteView(SceneView& view, const SceneItems& items)
{
  view.Projection = SurfelSplatting::MakeView(view.Camera, view.Size, view.Aspect);
  view.Projection.Near = view.ClippingRange[0];
  view.Projection.Far = view.ClippingRange[1];
  SurfelSplatting::Lens& lens = view.Optics;
  lens = SurfelSplatting::MakeLens(view.Camera);
  if (view.CellCount > 0)
  {
    lens.Shape = view.CellShape;
    return;
  }
  double distance = 0.0;
  if (this->FocusMode == FOCUS_POINT)
  {
    const double* p = this->FocusPoint;
    distance = view.Projection.WorldToCamera.Apply({ p[0], p[1], p[2] })[2];
  }
  else if (this->FocusMode == FOCUS_MIDDLE && this->HasLens(view.Camera) &&
    view.Camera->GetFocalDistance() == 0.0)
  {
    distance = this->FindMiddle(items, view);
  }
  lens.FocalDistance = distance > 0.0 ? distance : lens.FocalDistance;
  if (this->LensMode == LENS_PINHOLE)
  {
    lens.Radius = 0.0;
  }
  else if (this->LensMode == LENS_CIRCLE_OF_CONFUSION)
  {
    lens.Radius =
      this->CircleOfConfusion * view.Oversampling * lens.FocalDistance / view.Projection.Fy;
  }
}

bool vtkSurfelSplatter::HasLens(vtkCamera* camera)
{
  if (camera->GetParallelProjection() || this->LensMode == LENS_PINHOLE)
  {
    return false;
  }
  return this->LensMode == LENS_CIRCLE_OF_CONFUSION ? this->CircleOfConfusion > 0.0
                                                    : camera->GetFocalDisk() > 0.0;
}

const SurfelSplatting::DepthImageSurfels& vtkSurfelSplatter::GetBlurredPixels()
{
  return this->Internal->Occluders.GetBlurredPixels();
}

/// Makes the clouds of this process.
void vtkSurfelSplatter::MakeClouds(
  const SceneItems& items, const SceneView& view, SceneClouds& scene)
{
  namespace Core = SurfelSplatting;
  scene.Sources.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i)
  {
    vtkSurfelMapper* mapper = vtkSurfelMapper::SafeDownCast(items[i].Mapper);
    Core::HierarchyCache& cache = mapper->GetHierarchyCache();
    const std::uint64_t before = cache.NumberOfPreparedSurfels();
    Core::CloudInput input;
    input.Surfels = mapper->GetInput();
    input.Colors = mapper->GetFrameColors(this->LinearLight != 0);
    input.Hierarchy = &cache;
    input.Matrix = items[i].Matrix;
    input.Property = items[i].Property;
    input.ShowsBacks = mapper->GetShowBacks() != 0;
    input.PaperCut = this->LODMode == LOD_PAPER;
    input.LinearLight = this->LinearLight != 0;
    const std::string problem = Core::MakeCloud(input, scene.Sources[i]);
    this->NumberOfPreparedSurfels +=
      static_cast<vtkIdType>(cache.NumberOfPreparedSurfels() - before);
    if (!problem.empty())
    {
      vtkErrorMacro(<< problem);
      continue;
    }
    if (const std::string warning = cache.TakeWarning(); !warning.empty())
    {
      vtkWarningMacro(<< warning);
    }
    scene.Clouds.push_back(scene.Sources[i].Cloud);
  }
  const vtkIdType pixels = static_cast<vtkIdType>(view.Size[0]) * view.Size[1];
  scene.Color = Core::NewPixelArray("Color", 4, pixels);
  scene.Depth = Core::NewPixelArray("Depth", 1, pixels);
  Internals& my = *this->Internal;
  scene.OccluderDepth = my.Occluders.SplatBlurredPixels(view, my.Context, scene.Clouds);
}

/// Makes the clouds and, with a controller, gets the occluder depth of process 0.
void vtkSurfelSplatter::MakeScene(
  const SceneItems& items, const SceneView& view, SceneClouds& scene)
{
  SurfelSplatting::Ranks* ranks = this->GetRanks();
  if (!ranks)
  {
    this->MakeClouds(items, view, scene);
    return;
  }
  ranks->DoOwn([&] { this->MakeClouds(items, view, scene); });
  if ((this->DeepSamples || this->Channels != 0) && !this->Internal->WarnedRanks)
  {
    this->Internal->WarnedRanks = true;
    vtkErrorMacro(
      "DeepSamples and Channels need a single process: the picture has only colours and depths. "
      "Unset the controller if you need them.");
  }
  scene.OccluderDepth = this->Internal->Occluders.ShareDepth(view, scene.OccluderDepth, *ranks);
}

bool vtkSurfelSplatter::RenderScene(const SceneItems& items, const SceneView& view,
  const std::chrono::steady_clock::time_point& start)
{
  namespace Core = SurfelSplatting;
  Internals& my = *this->Internal;
  SceneClouds scene;
  this->MakeScene(items, view, scene);
  my.SceneMilliseconds = MillisecondsSince(start);

  Core::RenderTarget target = Core::Frame{ view.Size[0], view.Size[1], scene.Color->GetPointer(0),
    scene.Depth->GetPointer(0) };
  target.OccluderDepth = scene.OccluderDepth;
  std::function<bool(double)> progress = view.Progress;
  std::unique_ptr<Core::SplatExchange> exchange;
  if (Core::Ranks* ranks = this->GetRanks())
  {
    exchange.reset(new Core::SplatExchange(*ranks));
    target.Exchange = exchange.get();
    progress = [&view, ranks](
                 double done) { return ranks->All(!view.Progress || view.Progress(done)); };
  }
  else if (this->DeepSamples)
  {
    scene.Deep.Begin(view.Size[0], view.Size[1], my.Context.Sampling.Count == 1);
    target.Sink = &scene.Deep;
  }
  const bool isComplete =
    my.Core.Render(my.Context, scene.Clouds, Core::SMPExecutor(), target, progress);
  this->StorePicture(view, scene);
  if (this->Channels != 0 && isComplete && !this->GetRanks())
  {
    this->AddChannels(scene);
  }
  return isComplete;
}

/// Moves the picture into the output.
void vtkSurfelSplatter::StorePicture(const SceneView& view, SceneClouds& scene)
{
  namespace Core = SurfelSplatting;
  Internals& my = *this->Internal;
  Core::Ranks* ranks = this->GetRanks();
  if (ranks && !ranks->IsRoot())
  {
    scene.Color->Fill(0.0); // process 0 has the picture
    scene.Depth->Fill(0.0);
  }
  vtkImageData* output = my.Output;
  output->Initialize();
  output->SetDimensions(view.Size[0], view.Size[1], 1);
  output->GetPointData()->SetScalars(scene.Color);
  output->GetPointData()->AddArray(scene.Depth);
  Core::AddCameraArrays(my.Context, output);
  if (this->DeepSamples && !ranks)
  {
    scene.Deep.Finish(Core::SMPExecutor());
    Core::AddDeepSamples(scene.Deep, output);
  }
}

void vtkSurfelSplatter::AddChannels(const SceneClouds& scene)
{
  SurfelSplatting::PixelChannels channels;
  channels.Normal = this->Channels & CHANNEL_NORMAL;
  channels.CircleOfConfusion = this->Channels & CHANNEL_CIRCLE_OF_CONFUSION;
  channels.Coverage = this->Channels & CHANNEL_COVERAGE;
  channels.Fragments = this->Channels & CHANNEL_FRAGMENTS;
  channels.Level = this->Channels & CHANNEL_LEVEL;
  channels.MedianDepth = this->Channels & CHANNEL_MEDIAN_DEPTH;
  Internals& my = *this->Internal;
  SurfelSplatting::AddChannels(
    channels, { my.Context, scene.Clouds, scene.OccluderDepth, my.ChannelCore }, my.Output);
}

double vtkSurfelSplatter::FindFront(vtkImageData* picture)
{
  return picture ? SurfelSplatting::FrontOf(picture) : 0.0;
}

vtkImageData* vtkSurfelSplatter::GetOutput()
{
  return this->Internal->Output;
}

#define SURFEL_STATISTIC(name, field)                                       \
  vtkIdType vtkSurfelSplatter::Get##name()                                  \
  {                                                                         \
    return static_cast<vtkIdType>(this->Internal->Core.Statistics().field); \
  }
SURFEL_STATISTIC(NumberOfSurfels, Surfels)
SURFEL_STATISTIC(NumberOfInvalidSurfels, InvalidSurfels)
SURFEL_STATISTIC(NumberOfSplats, Splats)
SURFEL_STATISTIC(NumberOfBlurredSplats, BlurredSplats)
SURFEL_STATISTIC(NumberOfFragments, Fragments)
SURFEL_STATISTIC(NumberOfChosenNodes, Cut.Nodes)
SURFEL_STATISTIC(NumberOfVisitedNodes, Cut.VisitedNodes)
SURFEL_STATISTIC(NumberOfSurfelsOutside, Cut.OutsideLeaves)
SURFEL_STATISTIC(NumberOfSurfelsFacingAway, Cut.BackLeaves)
SURFEL_STATISTIC(NumberOfHiddenSurfels, HiddenSurfels)
SURFEL_STATISTIC(NumberOfHiddenPairs, HiddenPairs)
SURFEL_STATISTIC(NumberOfCoarseCells, CoarseCells)
#undef SURFEL_STATISTIC

int vtkSurfelSplatter::GetNumberOfStages()
{
  return NumberOfStages;
}

const char* vtkSurfelSplatter::GetStageName(int stage)
{
  return stage >= 0 && stage < NumberOfStages ? StageNames[stage] : nullptr;
}

double vtkSurfelSplatter::GetStageMilliseconds(int stage)
{
  const SurfelSplatting::FrameStatistics& s = this->Internal->Core.Statistics();
  const double times[NumberOfStages] = { this->Internal->SceneMilliseconds, s.SelectionMilliseconds,
    s.SetupMilliseconds, s.CoarseMilliseconds, s.BinningMilliseconds, s.SortMilliseconds,
    s.RasterMilliseconds };
  return stage >= 0 && stage < NumberOfStages ? times[stage] : 0.0;
}

void vtkSurfelSplatter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Controller: " << this->Internal->Controller.Get() << "\n";
  os << indent << "LensMode: " << this->LensMode << "\n";
  os << indent << "FocusMode: " << this->FocusMode << "\n";
  os << indent << "FocusPoint: " << this->FocusPoint[0] << " " << this->FocusPoint[1] << " "
     << this->FocusPoint[2] << "\n";
  os << indent << "CircleOfConfusion: " << this->CircleOfConfusion << " px\n";
  os << indent << "LensCells: " << this->LensCells << "\n";
  os << indent << "LensPinholes: " << this->LensPinholes << "\n";
  os << indent << "Kernel: " << this->Kernel << "\n";
  os << indent << "Cutoff: " << this->Cutoff << "\n";
  os << indent << "Prefilter: " << this->Prefilter << " px^2\n";
  os << indent << "KeepCaptureMass: " << (this->KeepCaptureMass ? "on" : "off") << "\n";
  os << indent << "LODMode: " << this->LODMode << "\n";
  os << indent << "LODError: " << this->LODError << "\n";
  os << indent << "CoarseGrids: " << this->CoarseGrids << "\n";
  os << indent << "FrameReuse: " << this->FrameReuse << "\n";
  os << indent << "LinearLight: " << this->LinearLight << "\n";
  os << indent << "DeepSamples: " << this->DeepSamples << "\n";
  os << indent << "Channels: " << this->Channels << "\n";
  os << indent << "ColorByLevel: " << this->ColorByLevel << "\n";
  os << indent << "NumberOfSurfels: " << this->GetNumberOfSurfels() << "\n";
  os << indent << "NumberOfInvalidSurfels: " << this->GetNumberOfInvalidSurfels() << "\n";
  os << indent << "NumberOfSplats: " << this->GetNumberOfSplats() << "\n";
  os << indent << "NumberOfBlurredSplats: " << this->GetNumberOfBlurredSplats() << "\n";
  os << indent << "NumberOfFragments: " << this->GetNumberOfFragments() << "\n";
  os << indent << "NumberOfChosenNodes: " << this->GetNumberOfChosenNodes() << "\n";
  os << indent << "NumberOfVisitedNodes: " << this->GetNumberOfVisitedNodes() << "\n";
  os << indent << "NumberOfSurfelsOutside: " << this->GetNumberOfSurfelsOutside() << "\n";
  os << indent << "NumberOfSurfelsFacingAway: " << this->GetNumberOfSurfelsFacingAway() << "\n";
  os << indent << "NumberOfHiddenSurfels: " << this->GetNumberOfHiddenSurfels() << "\n";
  os << indent << "NumberOfHiddenPairs: " << this->GetNumberOfHiddenPairs() << "\n";
  os << indent << "NumberOfCoarseCells: " << this->GetNumberOfCoarseCells() << "\n";
  os << indent << "NumberOfPreparedSurfels: " << this->NumberOfPreparedSurfels << "\n";
  os << indent << "NumberOfReusedFrames: " << this->NumberOfReusedFrames << "\n";
  os << indent << "FrameMilliseconds: " << this->FrameMilliseconds << "\n";
  for (int i = 0; i < NumberOfStages; ++i)
  {
    os << indent << "  " << StageNames[i] << ": " << this->GetStageMilliseconds(i) << " ms\n";
  }
}

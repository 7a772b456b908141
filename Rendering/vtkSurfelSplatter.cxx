// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelSplatter.h"

#include "Core/Picture/DeepImage.h"
#include "Core/Picture/Splatter.h"
#include "Core/Splats/DepthImageSurfels.h"
#include "Parallel/ControllerRanks.h"
#include "Rendering/Scene/FrameKey.h"
#include "Rendering/Scene/HierarchyCache.h"
#include "Rendering/Scene/PictureArrays.h"
#include "Rendering/Scene/PixelChannels.h"
#include "Rendering/Scene/SceneAdapter.h"
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
#include <limits>
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

/// Blur, px, from which on others' pixels are taken: of the same pixels whether the lens is in
/// cells or not.
double LeastConfusion(const vtkSurfelSplatter::View& view)
{
  return SurfelSplatting::LeastPixelConfusion / std::sqrt(std::max(1, view.CellCount));
}
}

/// What a frame is made of.
struct vtkSurfelSplatter::SceneClouds
{
  std::vector<SurfelSplatting::SurfelCloudSource> Sources;
  std::vector<SurfelSplatting::SurfelCloud> Clouds;
  vtkSmartPointer<vtkFloatArray> Color, Depth;
  const float* Limit = nullptr; ///< depths of what others have drawn and stays
};

struct vtkSurfelSplatter::Internals
{
  vtkSmartPointer<vtkMultiProcessController> Controller;
  std::unique_ptr<SurfelSplatting::Ranks> Ranks; // null: this process alone
  bool WarnedRanks = false;
  SurfelSplatting::Splatter Core;
  SurfelSplatting::Splatter ChannelCore; // the frame's statistics are those of its colours
  vtkNew<vtkImageData> Output;
  SurfelSplatting::SplatContext Context;
  SurfelSplatting::FrameKey Key; // of the picture in Output
  SurfelSplatting::DepthImageSurfels Pixels;
  std::vector<float> SharpLimit; // depths of others without the pixels that are taken
  SurfelSplatting::Message RootLimit;
  bool HasPicture = false;
  double SceneMilliseconds = 0.0;
  bool WarnedParallel = false;
  bool WarnedOffAxis = false;
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

void vtkSurfelSplatter::CollectItems(vtkProp* prop, std::vector<Item>& items)
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
    Item item;
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
    << " pixels. Give all windows the same size, or this one no controller.");
  return false;
}

bool vtkSurfelSplatter::Render(const std::vector<Item>& items, const View& view)
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
      throw; // the others wait for this process: better ended than forever
    }
    this->Internal->Output->Initialize();
    this->Internal->HasPicture = false;
    vtkErrorMacro("Memory does not suffice for a picture of "
      << view.Size[0] << " x " << view.Size[1]
      << " pixels of these surfels. Make it smaller, or in tiles.");
    return false;
  }
}

void vtkSurfelSplatter::MakeContext(const View& view)
{
  namespace Core = SurfelSplatting;
  vtkCamera* camera = view.Camera;
  Core::SplatContext context;
  context.Camera = Core::MakeView(camera, view.Size, view.Aspect);
  context.Camera.Near = view.ClippingRange[0];
  context.Camera.Far = view.ClippingRange[1];
  context.Lights = Core::MakeLights(view.Lights, camera, context.Camera);
  context.Sectors = this->LensSectors != 0;
  context.Sampling = { this->LensCells, this->LensPinholes != 0 };
  context.Settings.Kernel =
    this->Kernel == PEARSON_II ? Core::KernelType::PearsonII : Core::KernelType::Gaussian;
  context.Settings.Cutoff = this->Cutoff;
  context.Settings.Prefilter = this->Prefilter;
  context.Cut.Rule = this->LODMode == LOD_OFF ? Core::CutRule::Leaves
    : this->LODMode == LOD_PAPER              ? Core::CutRule::Paper
                                              : Core::CutRule::Moments;
  context.Cut.Error = this->LODError * view.Coarsening;
  context.Cut.SkipOutside = this->FrustumCulling != 0;
  context.Cut.SkipBackFaces = this->BackfaceCulling != 0;
  context.CoarseGrids = this->CoarseGrids != 0;
  context.SkipHidden = this->OcclusionCulling != 0;
  context.Colors = this->ColorByLevel ? Core::Paint::LevelColors : Core::Paint::Own;

  context.Optics = this->GetLens(view);
  if (view.CellCount > 0)
  {
    context.Sampling = {};
  }
  if (context.Camera.Parallel && context.Optics.Radius > 0.0 && !this->Internal->WarnedParallel)
  {
    this->Internal->WarnedParallel = true;
    vtkWarningMacro(
      "Parallel projection has no lens: the picture is sharp. Use a perspective "
      "camera for depth of field, or SetLensModeToPinhole() to say that none is wanted.");
  }
  if (camera->GetUseOffAxisProjection() && !this->Internal->WarnedOffAxis)
  {
    this->Internal->WarnedOffAxis = true;
    vtkWarningMacro("Off-axis projection is not supported: surfels are not where meshes are. Give "
                    "the camera the same projection with SetExplicitProjectionTransformMatrix().");
  }
  this->Internal->Context = context;
}

void vtkSurfelSplatter::RenderPicture(const std::vector<Item>& items, const View& view)
{
  const auto start = std::chrono::steady_clock::now();
  this->MakeContext(view);
  for (const Item& item : items)
  {
    if (!item.Mapper->GetStatic() && item.Mapper->GetInputAlgorithm())
    {
      item.Mapper->GetInputAlgorithm()->Update();
    }
  }
  SurfelSplatting::FrameKey key;
  if (this->FrameReuse)
  {
    key = SurfelSplatting::FrameKey(items, view, this->Internal->Context, this->GetMTime());
  }
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
    const bool whole = this->RenderScene(items, view, start);
    this->Internal->HasPicture = whole && this->FrameReuse != 0;
    this->Internal->Key = std::move(key);
  }
  this->FrameMilliseconds = MillisecondsSince(start);
}

SurfelSplatting::Lens vtkSurfelSplatter::GetLens(const View& view)
{
  SurfelSplatting::Lens lens = SurfelSplatting::MakeLens(view.Camera);
  if (view.CellCount > 0)
  {
    return lens;
  }
  if (this->FocusMode == FOCUS_POINT)
  {
    const double* p = this->FocusPoint;
    const double distance = SurfelSplatting::MakeView(view.Camera, view.Size, view.Aspect)
                              .WorldToCamera.Apply({ p[0], p[1], p[2] })[2];
    lens.FocalDistance = distance > 0.0 ? distance : lens.FocalDistance;
  }
  if (this->LensMode == LENS_PINHOLE)
  {
    lens.Radius = 0.0;
  }
  else if (this->LensMode == LENS_CIRCLE_OF_CONFUSION)
  {
    const double f = SurfelSplatting::MakeView(view.Camera, view.Size, view.Aspect).Fy;
    lens.Radius = this->CircleOfConfusion * view.Oversampling * lens.FocalDistance / f;
  }
  return lens;
}

int vtkSurfelSplatter::GetMargin(const View& view, const double distances[2])
{
  return SurfelSplatting::MarginOf(SurfelSplatting::MakeView(view.Camera, view.Size, view.Aspect),
    this->GetLens(view), distances[0], distances[1], LeastConfusion(view));
}

/// Others' pixels that are blurred become a cloud of their own. Returns the depths of those that
/// stay.
const float* vtkSurfelSplatter::TakePixels(
  const View& view, std::vector<SurfelSplatting::SurfelCloud>& clouds)
{
  Internals& my = *this->Internal;
  if (!view.OccluderDepth || !view.Others)
  {
    my.Pixels = SurfelSplatting::DepthImageSurfels();
    return view.OccluderDepth;
  }
  const std::size_t pixels = static_cast<std::size_t>(view.Size[0]) * view.Size[1];
  my.SharpLimit.assign(view.OccluderDepth, view.OccluderDepth + pixels);
  SurfelSplatting::DepthImage others = *view.Others;
  others.LeastConfusion = LeastConfusion(view);
  my.Pixels.Take(my.Context.Camera, my.Context.Optics, others, my.SharpLimit.data(),
    SurfelSplatting::SMPExecutor());
  if (my.Pixels.Size() > 0)
  {
    clouds.push_back(my.Pixels.Get());
  }
  return my.SharpLimit.data();
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

const SurfelSplatting::DepthImageSurfels& vtkSurfelSplatter::GetTakenPixels()
{
  return this->Internal->Pixels;
}

void vtkSurfelSplatter::MakeScene(
  const std::vector<Item>& items, const View& view, SceneClouds& scene)
{
  namespace Core = SurfelSplatting;
  scene.Sources.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i)
  {
    const Core::HierarchyCache& cache = items[i].Mapper->GetHierarchyCache();
    const std::uint64_t before = cache.NumberOfPreparedSurfels();
    const std::string problem = Core::MakeCloud(items[i].Mapper, items[i].Matrix, items[i].Property,
      this->LODMode == LOD_PAPER, this->LinearLight != 0, scene.Sources[i]);
    this->NumberOfPreparedSurfels +=
      static_cast<vtkIdType>(cache.NumberOfPreparedSurfels() - before);
    if (!problem.empty())
    {
      vtkErrorMacro(<< problem);
      continue;
    }
    scene.Clouds.push_back(scene.Sources[i].Cloud);
  }
  const vtkIdType pixels = static_cast<vtkIdType>(view.Size[0]) * view.Size[1];
  scene.Color = Core::NewPixelArray("Color", 4, pixels);
  scene.Depth = Core::NewPixelArray("Depth", 1, pixels);
  scene.Limit = this->TakePixels(view, scene.Clouds);
}

/// Of all processes, each of which says whether its part could be made; the depths of others are
/// those that process 0 has.
void vtkSurfelSplatter::ShareScene(const View& view, bool good, SceneClouds& scene)
{
  SurfelSplatting::Ranks& ranks = *this->GetRanks();
  if (!ranks.All(good))
  {
    throw SurfelSplatting::RanksLackMemory();
  }
  if ((this->DeepSamples || this->Channels != 0) && !this->Internal->WarnedRanks)
  {
    this->Internal->WarnedRanks = true;
    vtkErrorMacro("DeepSamples and Channels are not made by several processes: the picture has its "
                  "colours and depths alone. Set no controller where they are wanted.");
  }
  const std::size_t pixels = static_cast<std::size_t>(view.Size[0]) * view.Size[1];
  SurfelSplatting::Message& limit = this->Internal->RootLimit;
  limit.clear();
  if (scene.Limit && std::any_of(scene.Limit, scene.Limit + pixels, [](float depth) {
        return depth < std::numeric_limits<float>::infinity();
      }))
  {
    SurfelSplatting::Put(scene.Limit, pixels, limit);
  }
  limit = ranks.FromRoot(limit);
  scene.Limit = limit.empty() ? nullptr : reinterpret_cast<const float*>(limit.data());
}

bool vtkSurfelSplatter::RenderScene(const std::vector<Item>& items, const View& view,
  const std::chrono::steady_clock::time_point& start)
{
  namespace Core = SurfelSplatting;
  Internals& my = *this->Internal;
  SceneClouds scene;
  std::function<bool(double)> progress = view.Progress;
  Core::Ranks* ranks = this->GetRanks();
  if (ranks)
  {
    bool good = true;
    try
    {
      this->MakeScene(items, view, scene);
    }
    catch (const std::bad_alloc&)
    {
      good = false;
    }
    this->ShareScene(view, good, scene);
    progress = [&](double done) { return ranks->All(!view.Progress || view.Progress(done)); };
  }
  else
  {
    this->MakeScene(items, view, scene);
  }
  const Core::Frame frame{ view.Size[0], view.Size[1], scene.Color->GetPointer(0),
    scene.Depth->GetPointer(0) };
  my.SceneMilliseconds = MillisecondsSince(start);
  Core::DeepImage deep;
  const bool isDeep = this->DeepSamples && !ranks;
  if (isDeep)
  {
    deep.Begin(view.Size[0], view.Size[1]);
  }
  std::unique_ptr<Core::SplatExchange> exchange(ranks ? new Core::SplatExchange(*ranks) : nullptr);
  const bool whole = my.Core.Render(my.Context, scene.Clouds, Core::SMPExecutor(), frame,
    scene.Limit, isDeep ? &deep : nullptr, progress, exchange.get());

  if (ranks && !ranks->IsRoot())
  {
    scene.Color->Fill(0.0); // all is in process 0's
    scene.Depth->Fill(0.0);
  }
  vtkImageData* output = my.Output;
  output->Initialize();
  output->SetDimensions(view.Size[0], view.Size[1], 1);
  output->GetPointData()->SetScalars(scene.Color);
  output->GetPointData()->AddArray(scene.Depth);
  Core::AddCamera(my.Context, output);
  if (isDeep)
  {
    deep.Finish(Core::SMPExecutor());
    Core::AddDeepSamples(deep, output);
  }
  if (this->Channels != 0 && whole && !ranks)
  {
    Core::AddChannels(
      this->Channels, my.Context, scene.Clouds, scene.Limit, my.ChannelCore, output);
  }
  return whole;
}

vtkImageData* vtkSurfelSplatter::GetOutput()
{
  return this->Internal->Output;
}

vtkIdType vtkSurfelSplatter::GetNumberOfSurfels()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().Surfels);
}

vtkIdType vtkSurfelSplatter::GetNumberOfInvalidSurfels()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().InvalidSurfels);
}

vtkIdType vtkSurfelSplatter::GetNumberOfSplats()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().Splats);
}

vtkIdType vtkSurfelSplatter::GetNumberOfBlurredSplats()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().BlurredSplats);
}

vtkIdType vtkSurfelSplatter::GetNumberOfFragments()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().Fragments);
}

vtkIdType vtkSurfelSplatter::GetNumberOfChosenNodes()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().Cut.Nodes);
}

vtkIdType vtkSurfelSplatter::GetNumberOfVisitedNodes()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().Cut.VisitedNodes);
}

vtkIdType vtkSurfelSplatter::GetNumberOfSurfelsOutside()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().Cut.OutsideLeaves);
}

vtkIdType vtkSurfelSplatter::GetNumberOfSurfelsFacingAway()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().Cut.BackLeaves);
}

vtkIdType vtkSurfelSplatter::GetNumberOfCoarseCells()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().CoarseCells);
}

vtkIdType vtkSurfelSplatter::GetNumberOfHiddenSurfels()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().HiddenSurfels);
}

vtkIdType vtkSurfelSplatter::GetNumberOfHiddenPairs()
{
  return static_cast<vtkIdType>(this->Internal->Core.Statistics().HiddenPairs);
}

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
  os << indent << "LensSectors: " << this->LensSectors << "\n";
  os << indent << "LensPinholes: " << this->LensPinholes << "\n";
  os << indent << "Kernel: " << this->Kernel << "\n";
  os << indent << "Cutoff: " << this->Cutoff << "\n";
  os << indent << "Prefilter: " << this->Prefilter << " px^2\n";
  os << indent << "LODMode: " << this->LODMode << "\n";
  os << indent << "LODError: " << this->LODError << "\n";
  os << indent << "FrustumCulling: " << this->FrustumCulling << "\n";
  os << indent << "BackfaceCulling: " << this->BackfaceCulling << "\n";
  os << indent << "OcclusionCulling: " << this->OcclusionCulling << "\n";
  os << indent << "CoarseGrids: " << this->CoarseGrids << "\n";
  os << indent << "FrameReuse: " << this->FrameReuse << "\n";
  os << indent << "LinearLight: " << this->LinearLight << "\n";
  os << indent << "DeepSamples: " << this->DeepSamples << "\n";
  os << indent << "Channels: " << this->Channels << "\n";
  os << indent << "ColorByLevel: " << this->ColorByLevel << "\n";
  os << indent << "NumberOfPreparedSurfels: " << this->NumberOfPreparedSurfels << "\n";
  os << indent << "NumberOfReusedFrames: " << this->NumberOfReusedFrames << "\n";
  os << indent << "FrameMilliseconds: " << this->FrameMilliseconds << "\n";
}

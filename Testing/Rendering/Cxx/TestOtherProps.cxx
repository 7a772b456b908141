// SPDX-License-Identifier: BSD-3-Clause
/**
 * Meshes through the lens in all the ways that VTK draws: stereo, layers, posters of tiles, passes
 * of one's own, viewports; in one picture and in cells of the lens. What they look like is tested
 * in Python/TestOtherProps.py.
 */
#include "RenderingTest.h"

#include "vtkLensAccumulationPass.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkMapper.h>
#include <vtkMatrix4x4.h>
#include <vtkOpaquePass.h>
#include <vtkPlane.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTransform.h>

#include <algorithm>
#include <cmath>
#include <functional>

using namespace RenderingTest;

TEST_SUITE_BEGIN("OtherProps");

namespace
{
constexpr int CellCounts[] = { 1, 5 };

vtkSmartPointer<vtkCamera> LensCamera(double distance, double focus)
{
  vtkSmartPointer<vtkCamera> camera = FrontCamera(distance);
  camera->SetFocalDisk(0.5);
  camera->SetFocalDistance(focus);
  return camera;
}

void AddMeshes(vtkRenderer* renderer)
{
  renderer->SetBackground(0.1, 0.1, 0.3);
  renderer->AddActor(QuadActor({ -1.2, -0.9, 1.5 }, { 1.0, 0, 0.5 }, { 0, 1.3, 0.3 }, { 1, 0, 0 }));
  renderer->AddActor(QuadActor({ -3, -2, -2 }, { 5, 0, 0 }, { 0, 3, 0 }, { 0.2, 0.8, 0.3 }));
}

/// A renderer with the pass in a layer above the scene's own, which is VTK's.
struct LayeredScene : Scene
{
  explicit LayeredScene(int cells, int samples = 0)
    : Scene(80, 80, samples)
  {
    this->Renderer->SetPass(nullptr);
    this->Top->SetLayer(1);
    this->Top->SetPass(this->Pass);
    this->Window->SetNumberOfLayers(2);
    this->Window->AddRenderer(this->Top);
    this->Pass->GetSplatter()->SetLensCells(cells);
  }

  /// Both layers through a lens that focuses there.
  void SeeBoth(double focus)
  {
    vtkSmartPointer<vtkCamera> camera = LensCamera(6.0, focus);
    this->See(camera);
    camera->SetClippingRange(3.0, 9.0);
    this->Top->SetActiveCamera(camera);
  }

  vtkNew<vtkRenderer> Top;
};
}

/// Each eye sees surfels and a mesh of the same place alike, blurred by as much.
TEST_CASE_FIXTURE(NoMessages, "Stereo")
{
  for (const int eye : { VTK_STEREO_LEFT, VTK_STEREO_RIGHT })
  {
    for (const int cells : CellCounts)
    {
      const EyePictures pictures(eye, LensCamera(4.0, 2.2), cells);
      CHECK(Compare(pictures.Mono, pictures.Polygons).Mean > 1.0); // the eyes do differ
      // The mesh's edges, 200 px of them, are up to half a pixel elsewhere; 10800 px in all.
      CHECK_NEAR(Compare(pictures.Splats, pictures.Polygons).Mean, 0.0, 2.4);
      CHECK_NEAR(Compare(pictures.Splats, pictures.Polygons).Max, 0.0, 40.0);
    }
  }
}

/// The mean of many views is that of the same eye.
TEST_CASE_FIXTURE(NoMessages, "Stereo views")
{
  vtkSmartPointer<vtkImageData> eyes[2];
  for (const bool left : { true, false })
  {
    Scene one(120, 90), many(120, 90, 0, false);
    vtkNew<vtkLensAccumulationPass> accumulation;
    accumulation->SetNumberOfLensPoints(40);
    many.Renderer->SetPass(accumulation);
    for (Scene* s : { &one, &many })
    {
      s->Window->SetStereoType(left ? VTK_STEREO_LEFT : VTK_STEREO_RIGHT);
      s->Window->StereoRenderOn();
      AddMeshes(s->Renderer);
      vtkSmartPointer<vtkCamera> camera = LensCamera(6.0, 5.0);
      camera->SetEyeAngle(6.0);
      s->See(camera);
    }
    eyes[left] = many.Render();
    CHECK_NEAR(Compare(one.Render(), eyes[left]).Mean, 0.0, 1.5);
  }
  CHECK(Compare(eyes[0], eyes[1]).Mean > 6.0);
}

/// A blurred mesh in a layer of its own lets the layer below through at its edge only.
TEST_CASE_FIXTURE(NoMessages, "Layer on top")
{
  for (const int cells : CellCounts)
  {
    LayeredScene scene(cells);
    scene.Renderer->SetBackground(0.0, 0.0, 1.0);
    scene.Top->AddActor(
      QuadActor({ -5, -5, 0 }, { 5, 0, 0 }, { 0, 10, 0 }, { 1, 0, 0 })); // left half
    scene.SeeBoth(3.0);
    vtkSmartPointer<vtkImageData> picture = scene.Render();
    CHECK_NEAR(At(picture, 5, 40, 0), 255.0, 1.0);
    CHECK_NEAR(At(picture, 5, 40, 2), 0.0, 1.0);
    CHECK_NEAR(At(picture, 75, 40, 0), 0.0, 1.0);
    CHECK_NEAR(At(picture, 75, 40, 2), 255.0, 1.0);
    CHECK_NEAR(0.5 * (At(picture, 39, 40, 0) + At(picture, 40, 40, 0)), 127.5, 10.0);
    for (int x = 0; x < 80; ++x)
    {
      CHECK_NEAR(At(picture, x, 40, 0) + At(picture, x, 40, 2), 255.0, 3.0);
    }
  }
}

/// The same of light: cells mix it with the layer below as one picture does.
TEST_CASE_FIXTURE(NoMessages, "Light of layers")
{
  vtkSmartPointer<vtkImageData> pictures[2];
  for (int i = 0; i < 2; ++i)
  {
    LayeredScene scene(i == 0 ? 1 : 19);
    scene.Renderer->SetBackground(0.0, 0.5, 1.0);
    scene.Top->AddActor(QuadActor({ -5, -5, 0 }, { 5, 0, 0 }, { 0, 10, 0 }, { 1, 0, 0 }));
    scene.Pass->GetSplatter()->LinearLightOn();
    scene.SeeBoth(3.0);
    pictures[i] = scene.Render();
    CHECK_NEAR(At(pictures[i], 75, 40, 1), 127.5, 1.0);
    // Half of each one's light.
    CHECK_NEAR(0.5 * (At(pictures[i], 39, 40, 2) + At(pictures[i], 40, 40, 2)), 187.5, 10.0);
  }
  // Codes are steep where there is little light, at the disc's rim.
  CHECK_NEAR(Compare(pictures[0], pictures[1]).Mean, 0.0, 1.0);
}

/// Tiles of a poster join, and are a window of its size.
TEST_CASE_FIXTURE(NoMessages, "Poster")
{
  for (const int cells : CellCounts)
  {
    Scene scene(80, 60), large(160, 120);
    for (Scene* s : { &scene, &large })
    {
      AddMeshes(s->Renderer);
      s->See(LensCamera(6.0, 5.0));
      s->Pass->GetSplatter()->SetLensCells(cells);
    }
    vtkSmartPointer<vtkImageData> poster = RenderPoster(scene.Window);
    vtkSmartPointer<vtkImageData> picture = large.Render();
    // A mesh's edge may cover a pixel more in one of the two.
    CHECK(CountDifferent(poster, picture, 1, 2.0) <= 20);
  }
}

/// A projection that is given as a matrix, with a user's transform on top, is that of cells and
/// margins, too: the same picture as by the camera's own parameters.
TEST_CASE_FIXTURE(NoMessages, "Projections")
{
  for (const int cells : CellCounts)
  {
    Scene reference(100, 80), given(100, 80);
    for (Scene* s : { &reference, &given })
    {
      AddMeshes(s->Renderer);
      s->Renderer->AddActor(
        QuadActor({ 1.55, -0.8, 1.5 }, { 0.4, 0, 0 }, { 0, 1.2, 0 }, { 1, 1, 0 })); // beyond
      vtkSmartPointer<vtkCamera> camera = LensCamera(6.0, 5.0);
      camera->SetWindowCenter(0.2, -0.1);
      s->See(camera);
      s->Pass->GetSplatter()->SetLensCells(cells);
    }
    vtkCamera* camera = given.Renderer->GetActiveCamera();
    vtkNew<vtkMatrix4x4> projection;
    projection->DeepCopy(camera->GetProjectionTransformMatrix(1.25, -1, 1));
    // Half of the scale is the user's.
    for (int c = 0; c < 4; ++c)
    {
      projection->SetElement(0, c, 0.5 * projection->GetElement(0, c));
      projection->SetElement(1, c, 0.5 * projection->GetElement(1, c));
    }
    vtkNew<vtkTransform> twice;
    twice->Scale(2.0, 2.0, 1.0);
    camera->SetUserTransform(twice);
    camera->SetExplicitProjectionTransformMatrix(projection);
    camera->UseExplicitProjectionTransformMatrixOn();
    camera->SetWindowCenter(0.0, 0.0);
    CHECK_NEAR(Compare(given.Render(), reference.Render()).Mean, 0.0, 0.05); // edges, rounding
  }
}

/// What layers below hide stays hidden where their depth is preserved, in every cell.
TEST_CASE_FIXTURE(NoMessages, "Preserved depth")
{
  for (const int cells : CellCounts)
  {
    for (const int samples : { 0, 4 })
    {
      LayeredScene scene(cells, samples);
      scene.Renderer->AddActor(
        QuadActor({ -0.5, -0.5, 1.0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 1, 0, 0 }));
      scene.Top->SetPreserveDepthBuffer(true);
      scene.Top->AddActor(QuadActor({ -3, -3, 0 }, { 6, 0, 0 }, { 0, 6, 0 }, { 0, 1, 0 }));
      scene.SeeBoth(5.0);
      vtkSmartPointer<vtkImageData> picture = scene.Render();
      CHECK_NEAR(At(picture, 40, 40, 0), 255.0, 1.0);
      CHECK_NEAR(At(picture, 40, 40, 1), 0.0, 1.0);
      CHECK_NEAR(At(picture, 8, 40, 1), 255.0, 1.0);
    }
  }
}

namespace
{
/// Meshes before a lens, counting the frames that are kept.
struct StillScene : Scene
{
  explicit StillScene(int samples = 0)
    : Scene(90, 70, samples)
  {
    AddMeshes(this->Renderer);
    this->Mesh = QuadActor({ -0.3, -0.4, 0.5 }, { 0.9, 0, 0.3 }, { 0, 0.7, 0 }, { 0.9, 0.9, 0.1 });
    this->Renderer->AddActor(this->Mesh);
    this->See(LensCamera(6.0, 5.0));
  }

  bool IsKept()
  {
    vtkSurfelSplatter* splatter = this->Pass->GetSplatter();
    const vtkIdType before = splatter->GetNumberOfReusedFrames();
    this->Window->Render();
    return splatter->GetNumberOfReusedFrames() > before;
  }

  /// Whether a change makes a new frame, which is right and kept from then on.
  bool IsSeen(const std::function<void()>& change)
  {
    change();
    const bool anew = !this->IsKept();
    vtkSmartPointer<vtkImageData> drawn = Grab(this->Window);
    const bool kept = this->IsKept() && Compare(Grab(this->Window), drawn).Max == 0.0;
    vtkNew<vtkSurfelSplattingPass> fresh;
    fresh->SetOtherPropsThroughLens(this->Pass->GetOtherPropsThroughLens());
    this->Renderer->SetPass(fresh);
    this->Window->Render();
    const bool isRight = Compare(Grab(this->Window), drawn).Max == 0.0;
    this->Renderer->SetPass(this->Pass);
    return anew && kept && isRight && !this->IsKept() && this->IsKept();
  }

  vtkSmartPointer<vtkActor> Mesh;
};
}

/// While nothing changes the frame is kept, and whatever changes is seen.
TEST_CASE_FIXTURE(NoMessages, "Still frames")
{
  for (const int samples : { 0, 4 })
  {
    StillScene s(samples);
    CHECK(!s.IsKept());
    CHECK(s.IsKept());
    vtkNew<vtkPlane> plane;
    plane->SetOrigin(0.2, 0, 0);
    vtkNew<vtkMatrix4x4> moved;
    s.Mesh->SetUserMatrix(moved);
    CHECK(!s.IsKept());
    const std::function<void()> changes[] = {
      [&] { s.Renderer->GetActiveCamera()->Azimuth(2.0); },
      [&] { s.Renderer->GetActiveCamera()->SetFocalDistance(4.5); },
      [&] { s.Renderer->SetBackground(0.3, 0.1, 0.1); },
      [&] { s.Mesh->GetProperty()->SetColor(0.2, 0.9, 0.9); },
      [&] { s.Mesh->SetPosition(0.1, 0.1, 0.2); },
      [&] { moved->SetElement(0, 3, -0.2); },
      [&] { s.Mesh->GetMapper()->AddClippingPlane(plane); },
      [&] { plane->SetOrigin(0.4, 0, 0); },
      [&] {
        vtkPoints* points = vtkPolyData::SafeDownCast(s.Mesh->GetMapper()->GetInput())->GetPoints();
        points->SetPoint(2, 0.8, 0.6, 0.9);
        points->Modified();
      },
      [&] {
        s.Mesh->GetProperty()->LightingOn();
        s.Mesh->GetProperty()->SetAmbient(0.3);
      },
      [&] {
        vtkLight::SafeDownCast(s.Renderer->GetLights()->GetItemAsObject(0))->SetIntensity(0.6);
      },
      [&] { s.Window->SetSize(80, 60); },
      [&] { s.Mesh->VisibilityOff(); },
    };
    for (const std::function<void()>& change : changes)
    {
      CHECK(s.IsSeen(change));
    }
  }
}

/// A frame whose meshes may draw anything is compared pixel by pixel.
TEST_CASE_FIXTURE(NoMessages, "Still frames of unknown props")
{
  StillScene s;
  vtkNew<vtkCallbackCommand> observer;
  int frames = 0;
  observer->SetClientData(&frames);
  observer->SetCallback(
    [](vtkObject*, unsigned long, void* count, void*) { ++*static_cast<int*>(count); });
  s.Mesh->GetMapper()->AddObserver(vtkCommand::StartEvent, observer);
  CHECK(!s.IsKept());
  const int drawn = frames;
  CHECK(drawn > 0);
  CHECK(s.IsKept());
  CHECK(frames == 2 * drawn); // it was drawn to be compared
}

/// Where no prop reaches the margin, none is drawn in it: the same picture.
TEST_CASE_FIXTURE(NoMessages, "Margin without props")
{
  for (const double width : { 1.0, 2.9, 3.2, 3.6 }) // the window is 3.3 wide there
  {
    vtkSmartPointer<vtkImageData> pictures[2];
    for (const bool drawn : { false, true })
    {
      Scene scene(90, 70);
      vtkSmartPointer<vtkActor> mesh =
        QuadActor({ -0.5 * width, -0.8, 1.2 }, { width, 0, 0 }, { 0, 1.6, 0 }, { 0.9, 0.9, 0.1 });
      scene.Renderer->AddActor(mesh);
      vtkNew<vtkCallbackCommand> observer; // makes it a prop that may draw anywhere
      observer->SetCallback([](vtkObject*, unsigned long, void*, void*) {});
      if (drawn)
      {
        mesh->GetMapper()->AddObserver(vtkCommand::StartEvent, observer);
      }
      scene.See(LensCamera(6.0, 3.0));
      pictures[drawn] = scene.Render();
    }
    INFO("width " << width);
    CHECK_NEAR(Compare(pictures[0], pictures[1]).Max, 0.0, 0.0);
  }
}

/// Surfels do not get coarser for a time that meshes take.
TEST_CASE_FIXTURE(NoMessages, "Update rate")
{
  Scene scene(300, 240);
  AddMeshes(scene.Renderer);
  scene.Renderer->AddActor(SurfelActor(UnitSphere()));
  scene.See(LensCamera(6.0, 3.0));
  // Times are noisy: one of several tries is enough.
  double least = 16.0;
  for (int attempt = 0; attempt < 5 && least > 4.0; ++attempt)
  {
    vtkNew<vtkSurfelSplattingPass> fresh;
    scene.Renderer->SetPass(fresh);
    scene.Window->SetDesiredUpdateRate(1000.0);
    for (int i = 0; i < 12; ++i)
    {
      scene.Renderer->GetActiveCamera()->Azimuth(0.5);
      scene.Render();
    }
    least = std::min(least, fresh->GetCoarsening());
  }
  CHECK(least <= 4.0);
}

/// In a viewport, multisampled or not, it is the picture of a window of that size. The last bits of
/// the meshes' depths may depend on the place of the viewport, so one value may round the other
/// way.
TEST_CASE_FIXTURE(NoMessages, "Viewport")
{
  for (const int cells : CellCounts)
  {
    for (const int samples : { 0, 4 })
    {
      Scene whole(90, 70, samples), part(180, 140, samples);
      part.Renderer->SetViewport(0.5, 0.5, 1.0, 1.0);
      for (Scene* s : { &whole, &part })
      {
        AddMeshes(s->Renderer);
        s->See(LensCamera(6.0, 5.0));
        s->Pass->GetSplatter()->SetLensCells(cells);
      }
      vtkSmartPointer<vtkImageData> picture = part.Render();
      const Difference d = Compare(Crop(picture, 90, 70, 90, 70), whole.Render());
      CHECK(d.Max <= 1.0);
      CHECK(d.Mean <= 1.0 / (90 * 70));
      CHECK_NEAR(CountBrighter(Crop(picture, 0, 0, 90, 140), 0), 0, 0.0);
    }
  }
}

/// As a step among the user's own: the same picture.
TEST_CASE_FIXTURE(NoMessages, "Delegate inside own steps")
{
  Scene alone(90, 70), inside(90, 70);
  vtkNew<vtkRenderStepsPass> steps;
  vtkNew<vtkOpaquePass> opaque;
  inside.Pass->SetDelegatePass(opaque);
  steps->SetOpaquePass(inside.Pass);
  inside.Renderer->SetPass(steps);
  for (Scene* s : { &alone, &inside })
  {
    AddMeshes(s->Renderer);
    s->See(LensCamera(6.0, 5.0));
  }
  CHECK_NEAR(Compare(alone.Render(), inside.Render()).Max, 0.0, 0.0);
}

/// What was released comes back, between one picture and cells as well.
TEST_CASE_FIXTURE(NoMessages, "Release and render again")
{
  for (const int cells : CellCounts)
  {
    Scene scene(90, 70, 4);
    AddMeshes(scene.Renderer);
    scene.See(LensCamera(6.0, 5.0));
    scene.Pass->GetSplatter()->SetLensCells(cells);
    vtkSmartPointer<vtkImageData> reference = scene.Render();
    scene.Pass->ReleaseGraphicsResources(scene.Window);
    CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
    scene.Window->SetSize(60, 60);
    scene.Render();
    scene.Window->SetSize(90, 70);
    CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
    scene.Pass->GetSplatter()->SetLensCells(6 - cells);
    scene.Render();
    scene.Pass->GetSplatter()->SetLensCells(cells);
    CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
  }
}

TEST_SUITE_END();

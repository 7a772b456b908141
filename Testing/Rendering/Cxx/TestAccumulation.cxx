// SPDX-License-Identifier: BSD-3-Clause
/**
 * vtkLensAccumulationPass: the thin lens by many views, for meshes and surfels.
 */
#include "RenderingTest.h"

#include "vtkLensAccumulationPass.h"
#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCameraPass.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkMath.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPropPicker.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkWindowToImageFilter.h>

#include <cmath>
#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Accumulation");

namespace
{
constexpr int Width = 120, Height = 90;

/// A scene whose renderer accumulates views.
struct LensScene : Scene
{
  explicit LensScene(int points, int width = Width, int height = Height)
    : Scene(width, height, 0, false)
  {
    this->Accumulation->SetNumberOfLensPoints(points);
    this->Renderer->SetPass(this->Accumulation);
  }
  vtkNew<vtkLensAccumulationPass> Accumulation;
};

vtkSmartPointer<vtkCamera> LensCamera(double disk, double focus)
{
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  camera->SetFocalDisk(disk);
  camera->SetFocalDistance(focus);
  return camera;
}

double FocalLength(int height)
{
  return 0.5 * height / std::tan(vtkMath::RadiansFromDegrees(15.0));
}

/// White, left of x = 0 at z = 0.
vtkSmartPointer<vtkActor> HalfPlane()
{
  return QuadActor({ -5, -5, 0 }, { 5, 0, 0 }, { 0, 10, 0 }, { 1, 1, 1 });
}

vtkSmartPointer<vtkActor> TwoSpheres()
{
  SurfelBuilder builder;
  builder.AddSphere({ 0.1, 0, 0 }, 0.9, 6000);
  builder.AddSphere({ -0.6, 0.2, 2.0 }, 0.3, 3000);
  builder.Color([](const Vector& p) -> std::array<int, 4> {
    return { p[0] > 0 ? 250 : 60, p[2] > 1 ? 220 : 90, 120, 255 };
  });
  return SurfelActor(builder.Data);
}
}

/// The edge of a disc, 1/2 + (u sqrt(1 - u^2) + asin u) / pi, by a mesh.
TEST_CASE_FIXTURE(NoMessages, "Mesh edge")
{
  constexpr int points = 400;
  LensScene scene(points);
  scene.Renderer->AddActor(HalfPlane());
  vtkSmartPointer<vtkCamera> camera = LensCamera(0.8, 3.0);
  scene.See(camera);
  const double confusion = FocalLength(Height) * 0.4 * (1.0 / 3.0 - 1.0 / 6.0);
  CHECK(confusion > 10.0);
  CHECK(confusion < 30.0);
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  for (int x = 0; x < Width; ++x)
  {
    const double u = std::fmin(1.0, std::fmax(-1.0, (Width / 2 - x - 0.5) / confusion));
    const double disc = 0.5 + (u * std::sqrt(1.0 - u * u) + std::asin(u)) / vtkMath::Pi();
    // Rings of points share columns; 8 bits.
    CHECK_NEAR(At(picture, x, 45, 0) / 255.0, disc, 0.03);
  }
}

/// What is in focus stays what it is, whatever the lens.
TEST_CASE_FIXTURE(NoMessages, "In focus")
{
  LensScene scene(23);
  Scene sharp(Width, Height, 0, false);
  vtkSmartPointer<vtkCamera> camera = LensCamera(0.8, 6.0);
  for (Scene* s : { static_cast<Scene*>(&scene), &sharp })
  {
    s->Renderer->SetBackground(0.1, 0.3, 0.6);
    s->Renderer->AddActor(HalfPlane());
    s->See(camera);
  }
  const Difference d = Compare(scene.Render(), sharp.Render());
  CHECK(d.Max <= 1.0);
}

/// Surfels through pinholes: the splatter's own. And through cells with other props in the scene,
/// which are drawn once per cell: the same without. Of more than nine cells all tiles are drawn
/// through all, as here; of fewer only those in doubt.
TEST_CASE_FIXTURE(NoMessages, "Surfels as the splatter does")
{
  for (bool cells : { false, true })
  {
    LensScene points(13);
    Scene amongProps(Width, Height), own(Width, Height);
    for (Scene* s : { static_cast<Scene*>(&points), &amongProps, &own })
    {
      s->Renderer->AddActor(TwoSpheres());
      s->See(LensCamera(1.0, 5.1));
    }
    for (Scene* s : { &amongProps, &own })
    {
      s->Pass->GetSplatter()->SetLensCells(13);
      s->Pass->GetSplatter()->SetLensPinholes(!cells);
    }
    // Beside the picture.
    amongProps.Renderer->AddActor(QuadActor({ 90, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 1, 1, 1 }));
    vtkSmartPointer<vtkImageData> views = cells ? amongProps.Render() : points.Render();
    const Difference d = Compare(views, own.Render());
    CHECK(d.Max <= 1.0); // the frame buffer's 8 bits
    own.Pass->GetSplatter()->SetLensCells(1);
    own.Pass->GetSplatter()->LensPinholesOff();
    // And not that of one cell, which is within two levels: more than rounding.
    CHECK(Compare(views, own.Render()).Max > 1.0);
  }
}

/// A pixel filter of 1 px on the edge of a mesh in focus: the Gaussian's integral.
TEST_CASE_FIXTURE(NoMessages, "Pixel filter")
{
  LensScene scene(500);
  scene.Accumulation->SetPixelFilter(1.0);
  scene.Renderer->AddActor(HalfPlane());
  scene.See(LensCamera(0.0, 6.0));
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  for (int x = 0; x < Width; ++x)
  {
    // Without antialiasing a view has the edge at a pixel: a box of 1 px more. 8 bits.
    const double variance = 1.0 + 1.0 / 12.0;
    const double share = 0.5 * std::erfc((x + 0.5 - Width / 2) / std::sqrt(2.0 * variance));
    CHECK_NEAR(At(picture, x, 45, 0) / 255.0, share, 0.03);
  }
}

/// The camera is the renderer's own again, and has not changed.
TEST_CASE_FIXTURE(NoMessages, "Camera is left alone")
{
  LensScene scene(5);
  scene.Renderer->AddActor(HalfPlane());
  vtkSmartPointer<vtkCamera> camera = LensCamera(0.5, 4.0);
  scene.See(camera);
  scene.Render();
  const vtkMTimeType time = camera->GetMTime();
  vtkSmartPointer<vtkImageData> first = scene.Render();
  CHECK(scene.Renderer->GetActiveCamera() == camera);
  CHECK(camera->GetMTime() == time);
  CHECK(Compare(first, scene.Render()).Max == 0.0);
}

/// One view where there is no lens: the delegate's picture. Picking sees sharp props.
TEST_CASE_FIXTURE(NoMessages, "No lens")
{
  Scene sharp(Width, Height, 0, false);
  sharp.Renderer->AddActor(HalfPlane());
  sharp.See(LensCamera(0.0, 6.0));
  vtkSmartPointer<vtkImageData> expected = sharp.Render();
  LensScene scene(64);
  vtkSmartPointer<vtkActor> half = HalfPlane();
  scene.Renderer->AddActor(half);
  scene.See(LensCamera(0.0, 6.0));
  CHECK(Compare(scene.Render(), expected).Max == 0.0);
  scene.Accumulation->SetNumberOfLensPoints(1);
  scene.See(LensCamera(0.8, 3.0)); // one point of a lens is a pinhole
  CHECK(Compare(scene.Render(), expected).Max <= 1.0);

  vtkNew<vtkPropPicker> picker;
  CHECK(picker->PickProp(30, 45, scene.Renderer) == 1);
  CHECK(picker->GetViewProp() == half);
  CHECK(picker->PickProp(90, 45, scene.Renderer) == 0);
}

/// Posters in tiles are the picture of a larger window.
TEST_CASE_FIXTURE(NoMessages, "Tiles")
{
  LensScene scene(12);
  scene.Renderer->AddActor(HalfPlane());
  scene.Renderer->AddActor(TwoSpheres());
  scene.See(LensCamera(0.5, 5.1));
  scene.Render();
  vtkNew<vtkWindowToImageFilter> poster;
  poster->SetInput(scene.Window);
  poster->SetScale(2);
  poster->ReadFrontBufferOff();
  poster->Update();
  LensScene large(12, 2 * Width, 2 * Height);
  large.Renderer->AddActor(HalfPlane());
  large.Renderer->AddActor(TwoSpheres());
  large.See(LensCamera(0.5, 5.1));
  const Difference d = Compare(poster->GetOutput(), large.Render());
  CHECK(d.Mean < 0.05);
}

/// The depth of the innermost view is left for others, and windows of other sizes are met.
TEST_CASE_FIXTURE(NoMessages, "Depth and size")
{
  LensScene scene(7);
  scene.Renderer->AddActor(HalfPlane());
  vtkSmartPointer<vtkCamera> camera = LensCamera(0.8, 3.0);
  scene.See(camera);
  for (int width : { Width, 64, 200 })
  {
    scene.Window->SetSize(width, Height);
    scene.Render();
    const float left = scene.Renderer->GetZ(width / 2 - 20, 45);
    const float right = scene.Renderer->GetZ(width / 2 + 20, 45);
    CHECK(left > 0.0f);
    CHECK(left < 1.0f);
    CHECK(right == 1.0f);
  }
  scene.Window->Finalize();
  scene.Window->SetSize(Width, Height);
  CHECK(CountBrighter(scene.Render(), 200) > 1000);
}

TEST_CASE_FIXTURE(NoMessages, "No delegate")
{
  LensScene scene(7);
  scene.Accumulation->SetDelegatePass(nullptr);
  scene.See(LensCamera(0.8, 3.0));
  scene.Render();
  CHECK(TakeMessages().find("SetDelegatePass") != std::string::npos);
}

TEST_SUITE_END();

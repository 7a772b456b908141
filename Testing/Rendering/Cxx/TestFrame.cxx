// SPDX-License-Identifier: BSD-3-Clause
/**
 * Backgrounds, viewports, layers, sizes, samples, tiles and projections.
 */
#include "RenderingTest.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Frame");

namespace
{
vtkSmartPointer<vtkPolyData> StripedSphere()
{
  SurfelBuilder builder;
  builder.AddSphere({ 0, 0, 0 }, 1.0, 4000);
  builder.Color([](const Vector& p) {
    const bool stripe = std::sin(15.0 * (p[0] + p[1])) > 0.0;
    return std::array<int, 4>{ 255, stripe ? 220 : 60, static_cast<int>(120 + 100 * p[2]), 255 };
  });
  return builder.Data;
}

vtkSmartPointer<vtkCamera> BlurredCamera()
{
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  camera->Azimuth(10);
  camera->SetFocalDisk(0.6);
  camera->SetFocalDistance(5.2);
  return camera;
}

/// A mesh that cuts the sphere, so that depth matters everywhere.
vtkSmartPointer<vtkActor> CuttingQuad()
{
  return QuadActor({ -1.4, -1.2, 0.2 }, { 2.8, 0.0, 0.0 }, { 0.0, 1.3, 0.3 }, { 0.1, 0.8, 0.3 });
}

void AddSphereAndQuad(vtkRenderer* renderer)
{
  renderer->AddActor(SurfelActor(StripedSphere()));
  renderer->AddActor(CuttingQuad());
}
}

TEST_CASE_FIXTURE(NoMessages, "Solid and gradient background")
{
  Scene scene(80, 60);
  vtkSmartPointer<vtkActor> sphere = SurfelActor(StripedSphere());
  sphere->VisibilityOff();
  scene.Renderer->AddActor(sphere);
  scene.See(BlurredCamera());
  for (bool gradient : { false, true })
  {
    scene.Renderer->SetBackground(0.2, 0.5, 0.9);
    scene.Renderer->SetBackground2(0.9, 0.1, 0.2);
    scene.Renderer->SetGradientBackground(gradient);
    sphere->VisibilityOff();
    vtkSmartPointer<vtkImageData> background = scene.Render();
    sphere->VisibilityOn();
    vtkSmartPointer<vtkImageData> picture = scene.Render();
    double worst = 0.0;
    int touched = 0;
    const std::vector<float> rgba = Values(scene.Float(), "Color");
    for (int i = 0; i < 80 * 60; ++i)
    {
      for (int c = 0; c < 3; ++c)
      {
        const double expected = std::min(1.0f, rgba[4 * i + c]) * 255.0 +
          (1.0 - rgba[4 * i + 3]) * At(background, i % 80, i / 80, c);
        worst = std::max(worst, std::abs(expected - At(picture, i % 80, i / 80, c)));
      }
      touched += rgba[4 * i + 3] > 0.0f && rgba[4 * i + 3] < 1.0f;
    }
    CHECK(touched > 300);
    // Blending in 8 bits: the surfels' colour, the background's share and its opacity are each
    // rounded.
    CHECK_NEAR(worst, 0.0, 2.0); // and the background itself
    CHECK(gradient ==
      (Compare(Crop(background, 0, 0, 80, 1), Crop(background, 0, 59, 80, 1)).Max > 50));
  }
}

TEST_CASE_FIXTURE(NoMessages, "Viewport is a window of its size")
{
  for (int samples : { 0, 4 })
  {
    Scene whole(90, 70, samples);
    AddSphereAndQuad(whole.Renderer);
    whole.Renderer->SetBackground(0.2, 0.2, 0.5);
    whole.See(BlurredCamera());
    vtkSmartPointer<vtkImageData> reference = whole.Render();

    Scene part(180, 140, samples);
    AddSphereAndQuad(part.Renderer);
    part.Renderer->SetBackground(0.2, 0.2, 0.5);
    part.Renderer->SetViewport(0.5, 0.5, 1.0, 1.0);
    part.See(BlurredCamera());
    vtkSmartPointer<vtkImageData> picture = part.Render();
    CHECK_NEAR(Compare(Crop(picture, 90, 70, 90, 70), reference).Max, 0.0, 0.0);
    CHECK_NEAR(CountBrighter(Crop(picture, 0, 0, 180, 70), 0), 0, 0.0);
    CHECK_NEAR(CountBrighter(Crop(picture, 0, 0, 90, 140), 0), 0, 0.0);
  }
}

TEST_CASE_FIXTURE(OnlyOfDots, "Renderers side by side")
{
  // The same actor left with the pass, right without: the pass's marks must not reach into the
  // other renderer. A third renderer shares the actor with a pass of its own.
  for (int samples : { 0, 4 })
  {
    Scene scene(240, 80, samples);
    vtkSmartPointer<vtkActor> sphere = SurfelActor(StripedSphere());
    vtkNew<vtkRenderer> plain, second;
    vtkNew<vtkSurfelSplattingPass> pass;
    second->SetPass(pass);
    vtkRenderer* renderers[3] = { scene.Renderer, plain, second };
    for (int i = 0; i < 3; ++i)
    {
      renderers[i]->SetViewport(i / 3.0, 0.0, (i + 1) / 3.0, 1.0);
      renderers[i]->AddActor(sphere);
      renderers[i]->AddActor(CuttingQuad());
      renderers[i]->SetActiveCamera(BlurredCamera());
      renderers[i]->ResetCameraClippingRange();
      if (i > 0)
      {
        scene.Window->AddRenderer(renderers[i]);
      }
    }
    vtkSmartPointer<vtkImageData> picture = scene.Render();
    // OpenGL rounds the quad's depths otherwise in another viewport, and they take part in its
    // blur.
    CHECK_NEAR(Compare(Crop(picture, 0, 0, 80, 80), Crop(picture, 160, 0, 80, 80)).Max, 0.0, 1.0);
    // Dots, not nothing and not splats.
    CHECK(CountBrighter(Crop(picture, 80, 40, 80, 40), 150) > 300);
    CHECK(Compare(Crop(picture, 0, 0, 80, 80), Crop(picture, 80, 0, 80, 80)).Mean > 2.0);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Layer on top")
{
  for (bool preserveDepth : { false, true })
  {
    Scene scene(80, 80);
    scene.Renderer->SetBackground(0.0, 0.4, 0.0);
    scene.Renderer->AddActor(
      QuadActor({ -2, -2, 1.5 }, { 2, 0, 0 }, { 0, 4, 0 }, { 1, 0, 0 })); // in front, left half
    vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
    scene.Renderer->SetPass(nullptr);
    vtkNew<vtkRenderer> top;
    top->SetLayer(1);
    top->SetPass(scene.Pass);
    top->SetPreserveDepthBuffer(preserveDepth);
    top->AddActor(SurfelActor(UnitSphere()));
    scene.Window->SetNumberOfLayers(2);
    scene.Window->AddRenderer(top);
    scene.See(camera);
    camera->SetClippingRange(3.0, 9.0);
    top->SetActiveCamera(camera);
    vtkSmartPointer<vtkImageData> picture = scene.Render();
    // The layer below shows where there are no surfels, and where they are behind its preserved
    // depth.
    CHECK_NEAR(At(picture, 2, 40, 0), 255.0, 0.0);
    CHECK_NEAR(At(picture, 78, 78, 1), std::round(0.4 * 255), 0.0);
    CHECK(At(picture, 45, 40, 2) > 200);
    CHECK((preserveDepth ? At(picture, 34, 40, 1) == 0.0 : At(picture, 34, 40, 1) > 200));
  }
}

TEST_CASE_FIXTURE(NoMessages, "Resize between frames")
{
  Scene scene(100, 80);
  AddSphereAndQuad(scene.Renderer);
  scene.See(BlurredCamera());
  vtkSmartPointer<vtkImageData> first = scene.Render();
  scene.Window->SetSize(61, 127);
  vtkSmartPointer<vtkImageData> other = scene.Render();
  CHECK(scene.Float()->GetDimensions()[0] == 61);
  CHECK(scene.Float()->GetDimensions()[1] == 127);
  Scene fresh(61, 127);
  AddSphereAndQuad(fresh.Renderer);
  fresh.See(BlurredCamera());
  CHECK_NEAR(Compare(fresh.Render(), other).Max, 0.0, 0.0);
  scene.Window->SetSize(100, 80);
  CHECK_NEAR(Compare(scene.Render(), first).Max, 0.0, 0.0);
}

TEST_CASE_FIXTURE(NoMessages, "Multi samples")
{
  // Surfels know no samples. Pictures may differ where the mesh's edges (270 px) and its line of
  // intersection with the sphere (50 px) have other samples.
  vtkSmartPointer<vtkImageData> reference;
  std::vector<float> referenceColor;
  for (int samples : { 0, 4, 8 })
  {
    Scene scene(100, 80, samples);
    AddSphereAndQuad(scene.Renderer);
    scene.See(BlurredCamera());
    vtkSmartPointer<vtkImageData> picture = scene.Render();
    scene.Pass->OtherPropsThroughLensOff(); // for the surfels alone
    scene.Render();
    const std::vector<float> color = Values(scene.Float(), "Color");
    if (samples == 0)
    {
      reference = picture;
      referenceColor = color;
      CHECK(At(picture, 50, 60, 0) > 200);
      CHECK(At(picture, 20, 15, 1) > 190);
      continue;
    }
    const int different = CountDifferent(picture, reference, 1, 30.0);
    int hiddenOtherwise = 0;
    for (int i = 0; i < 100 * 80; ++i)
    {
      hiddenOtherwise += std::abs(color[4 * i + 3] - referenceColor[4 * i + 3]) > 1e-3f;
    }
    CHECK_NEAR(different, 0, 320);
    CHECK_NEAR(hiddenOtherwise, 0, 160);
    CHECK(different > 10); // the window is multisampled indeed
  }
}

TEST_CASE_FIXTURE(NoMessages, "Poster of tiles has no seams")
{
  // SetScale(2) renders four tiles through a quarter of the lens's picture each; a window of twice
  // the size is the same picture. Tiles differ in rounding only: view angle and window centre
  // instead of the size.
  Scene scene(80, 60);
  AddSphereAndQuad(scene.Renderer);
  scene.Renderer->SetBackground(0.1, 0.1, 0.3);
  scene.See(BlurredCamera());
  vtkSmartPointer<vtkImageData> poster = RenderPoster(scene.Window);

  Scene large(160, 120);
  AddSphereAndQuad(large.Renderer);
  large.Renderer->SetBackground(0.1, 0.1, 0.3);
  large.See(BlurredCamera());
  vtkSmartPointer<vtkImageData> picture = large.Render();
  // One level for a value that rounds the other way. The mesh's edge may cover one pixel more in
  // one of the two.
  CHECK_NEAR(Compare(poster, picture).Mean, 0.0, 0.1);
  CHECK(CountDifferent(poster, picture, 1, 1.0) <= 20);
}

TEST_CASE_FIXTURE(NoMessages, "Poster keeps the blur in window pixels")
{
  // A lens given in pixels means the window's: a poster of twice the size looks the same, a window
  // of twice the size with twice the circle of confusion is that poster.
  Scene scene(60, 60);
  scene.Renderer->AddActor(SurfelActor(StripedSphere()));
  scene.See(BlurredCamera());
  scene.Pass->GetSplatter()->SetLensModeToCircleOfConfusion();
  scene.Pass->GetSplatter()->SetCircleOfConfusion(40.0);
  vtkSmartPointer<vtkImageData> poster = RenderPoster(scene.Window);
  Scene large(120, 120);
  large.Renderer->AddActor(SurfelActor(StripedSphere()));
  large.See(BlurredCamera());
  large.Pass->GetSplatter()->SetLensModeToCircleOfConfusion();
  large.Pass->GetSplatter()->SetCircleOfConfusion(80.0);
  CHECK_NEAR(Compare(poster, large.Render()).Max, 0.0, 1.0); // rounding
}

TEST_CASE_FIXTURE(NoMessages, "What is not finite is said")
{
  // VTK's macros keep NaN, and an empty picture does not tell why.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const char* what : { "camera is not finite", "lens is not finite", "Prefilter" })
  {
    Scene scene(60, 40);
    SurfelBuilder builder;
    builder.AddGrid({ -0.5, -0.25, 0.7 }, { 0.1, 0, 0 }, { 0, 0.1, 0 }, 10, 5);
    scene.Renderer->AddActor(SurfelActor(builder.Data));
    vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
    vtkSurfelSplatter* splatter = scene.Pass->GetSplatter();
    if (what[0] == 'c')
    {
      camera->SetViewAngle(nan);
    }
    else if (what[0] == 'l')
    {
      splatter->SetLensModeToCircleOfConfusion();
      splatter->SetCircleOfConfusion(nan);
    }
    else
    {
      splatter->SetPrefilter(nan);
    }
    scene.See(camera);
    scene.Render();
    const std::string warning = TakeMessages();
    INFO(what, ": ", warning);
    CHECK(warning.find(what) != std::string::npos);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Parallel projection")
{
  // Orthographic: a grid of surfels lands where height / (2 * parallel scale) px per world unit
  // puts it. The lens is said to have no effect, once.
  Scene scene(120, 80);
  SurfelBuilder builder;
  builder.AddGrid({ -0.5, -0.25, 0.7 }, { 0.01, 0, 0 }, { 0, 0.01, 0 }, 100, 50);
  scene.Renderer->AddActor(SurfelActor(builder.Data));
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  camera->ParallelProjectionOn();
  camera->SetParallelScale(1.0);
  camera->SetFocalDisk(0.5);
  scene.See(camera);
  scene.Render();
  const std::string warning = TakeMessages();
  CHECK(warning.find("Parallel projection has no lens") != std::string::npos);
  const std::vector<float> rgba = Values(scene.Float(), "Color");
  const std::vector<float> depth = Values(scene.Float(), "Depth");
  // 40 px per unit: x from 40 to 80, y from 30 to 50. The edges are one prefilter wide (s = 1 px,
  // kernel half a spacing of 0.4 px): 1/2 at the edge, within 0.01 of 0 and 1 three standard
  // deviations away; ripple at most 2 %.
  double area = 0.0;
  for (int y = 0; y < 80; ++y)
  {
    for (int x = 0; x < 120; ++x)
    {
      const double a = rgba[4 * (y * 120 + x) + 3];
      area += a;
      if (x >= 44 && x < 76 && y >= 34 && y < 46)
      {
        CHECK_NEAR(a, 1.0, 0.02);
        CHECK_NEAR(depth[y * 120 + x], 5.3, 1e-5);
      }
      else if (x < 36 || x >= 84 || y < 26 || y >= 54)
      {
        CHECK_NEAR(a, 0.0, 0.01);
      }
    }
  }
  CHECK_NEAR(area, 800.0, 0.02 * 800.0); // coverage is kept but for the ripple

  scene.Render();
  scene.Render();
  CHECK(TakeMessages().empty());
  scene.Pass->GetSplatter()->SetLensModeToPinhole();
  scene.Render();
  CHECK(Values(scene.Float(), "Color") == rgba);
}

TEST_CASE_FIXTURE(NoMessages, "Stereo eyes agree with meshes")
{
  // Left and right eye: surfels over a mesh of the same shape and place cover the same pixels.
  for (const int eye : { VTK_STEREO_LEFT, VTK_STEREO_RIGHT })
  {
    const EyePictures pictures(eye, FrontCamera(4.0));
    CHECK(Compare(pictures.Mono, pictures.Polygons).Mean > 1.0); // the eyes do differ
    // Centre of the white pixels of a row: half a pixel for the mesh's rasterisation, a tenth for
    // the surfels' edges.
    auto center = [](vtkImageData* picture) {
      double sum = 0.0, weight = 0.0;
      for (int x = 0; x < 120; ++x)
      {
        weight += At(picture, x, 45, 0);
        sum += x * At(picture, x, 45, 0);
      }
      return sum / weight;
    };
    CHECK_NEAR(center(pictures.Splats), center(pictures.Polygons), 0.6);
    CHECK(std::abs(center(pictures.Polygons) - center(pictures.Mono)) > 1.5);
  }
}

TEST_SUITE_END();

// SPDX-License-Identifier: BSD-3-Clause
/**
 * The camera's lens: conventions, modes and scale.
 */
#include "RenderingTest.h"

#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkMath.h>
#include <vtkPolyData.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <sys/resource.h>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Lens");

namespace
{
constexpr int Size = 128;

/// Mass, px^2, and variance along x and y, px^2, of the coverage.
struct Moments
{
  double Mass = 0, X = 0, Y = 0, VarianceX = 0, VarianceY = 0;

  explicit Moments(vtkImageData* picture)
  {
    const int* size = picture->GetDimensions();
    double xx = 0, yy = 0;
    for (int y = 0; y < size[1]; ++y)
    {
      for (int x = 0; x < size[0]; ++x)
      {
        const double a = At(picture, x, y, 3);
        this->Mass += a;
        this->X += a * (x + 0.5);
        this->Y += a * (y + 0.5);
        xx += a * (x + 0.5) * (x + 0.5);
        yy += a * (y + 0.5) * (y + 0.5);
      }
    }
    this->X /= this->Mass;
    this->Y /= this->Mass;
    this->VarianceX = xx / this->Mass - this->X * this->X;
    this->VarianceY = yy / this->Mass - this->Y * this->Y;
  }
};

/// One surfel at distance z from a camera at the origin of a picture of Size px; its kernel is a
/// point.
struct PointScene
{
  explicit PointScene(double z, double area = 1e-4)
  {
    SurfelBuilder builder;
    builder.Add({ 0, 0, 10.0 - z }, { 0, 0, 1 }, 1e-5, area);
    this->Camera = FrontCamera(10.0);
    this->Renderer->SetSize(Size, Size);
    this->Renderer->SetCamera(this->Camera);
    this->Renderer->AddActor(SurfelActor(builder.Data));
  }

  vtkImageData* Picture()
  {
    this->Renderer->Update();
    return this->Renderer->GetOutput();
  }

  double FocalLength() const { return 0.5 * Size / std::tan(vtkMath::RadiansFromDegrees(15.0)); }

  vtkSmartPointer<vtkCamera> Camera;
  vtkNew<vtkSurfelImageRenderer> Renderer;
};

/// The kernel ends at 2.5 on its exponent. Its variance is kept, but a picture samples it at
/// pixels: where it is one pixel wide, a ring of pixels with 8 % of the mass lies just inside or
/// outside of its end.
constexpr double Sampling = 0.15;

/// Variance of the blur with circle of confusion c. Pearson II: the disc's own. The paper's
/// Gaussian: that closest to the disc, c^2 / (2 ln 4), less what its truncation at the cut-off (on
/// the exponent) takes away.
double BlurVariance(int kernel, double c, double cutoff = 2.5)
{
  if (kernel == vtkSurfelSplatter::PEARSON_II)
  {
    return 0.25 * c * c;
  }
  const double tau = 1.0 - cutoff * std::exp(-cutoff) / (1.0 - std::exp(-cutoff));
  return tau * c * c / (2.0 * std::log(4.0));
}
}

TEST_CASE_FIXTURE(NoMessages, "Variance of a point")
{
  // C = f R |1/zf - 1/z|, R = FocalDisk / 2; variance of that blur + prefilter, on both sides of
  // the focus.
  const double disk = 0.8, focus = 5.0;
  for (double z : { 2.5, 3.5, 5.0, 8.0, 40.0 })
  {
    PointScene scene(z);
    scene.Camera->SetFocalDisk(disk);
    scene.Camera->SetFocalDistance(focus);
    for (int variant = 0; variant < 4; ++variant)
    {
      const double prefilter = variant % 2 ? 1.0 : 2.5;
      const int kernel = variant / 2;
      scene.Renderer->GetSplatter()->SetPrefilter(prefilter);
      scene.Renderer->GetSplatter()->SetKernel(kernel);
      scene.Renderer->GetSplatter()->CoarseGridsOff(); // an approximation: Core.CoarseGrid
      const Moments moments(scene.Picture());
      const double c = scene.FocalLength() * 0.5 * disk * std::abs(1.0 / focus - 1.0 / z);
      const double expected = BlurVariance(kernel, c) + prefilter;
      const double bound = std::max(Sampling, 0.02 * expected);
      CHECK_NEAR(moments.VarianceX, expected, bound);
      CHECK_NEAR(moments.VarianceY, expected, bound);
      CHECK_NEAR(moments.X, 0.5 * Size, 0.01);
      CHECK_NEAR(moments.Y, 0.5 * Size, 0.01);
      // f^2 A / z^2: a point below a pixel has no ripple to be compensated for.
      const double mass = scene.FocalLength() * scene.FocalLength() * 1e-4 / (z * z);
      CHECK_NEAR(moments.Mass / mass, 1.0, bound / expected);
    }
  }
}

TEST_CASE_FIXTURE(NoMessages, "Cutoff")
{
  PointScene scene(3.0);
  scene.Camera->SetFocalDisk(0.8);
  scene.Camera->SetFocalDistance(5.0);
  const double c = scene.FocalLength() * 0.4 * (1.0 / 3.0 - 1.0 / 5.0);
  scene.Renderer->GetSplatter()->SetKernelToGaussian();
  for (double cutoff : { 1.5, 4.0, 8.0 })
  {
    scene.Renderer->GetSplatter()->SetCutoff(cutoff);
    const double expected = BlurVariance(vtkSurfelSplatter::GAUSSIAN, c, cutoff) + 1.0;
    CHECK_NEAR(Moments(scene.Picture()).VarianceX, expected, 0.02 * expected); // sampled at pixels
  }
}

TEST_CASE_FIXTURE(NoMessages, "Focal distance zero is the focal point")
{
  PointScene scene(4.0);
  scene.Camera->SetFocalDisk(0.8);
  scene.Camera->SetFocalDistance(scene.Camera->GetDistance());
  const std::vector<float> named = Values(scene.Picture(), "Color");
  scene.Camera->SetFocalDistance(0.0);
  CHECK(Values(scene.Picture(), "Color") == named);
  scene.Camera->SetFocalPoint(0, 0, 6.0); // at the surfel: in focus
  scene.Picture();
  CHECK_NEAR(Moments(scene.Picture()).VarianceX, 1.0, Sampling);
}

TEST_CASE_FIXTURE(NoMessages, "Pinhole is a disk of zero")
{
  PointScene scene(3.0);
  scene.Camera->SetFocalDistance(9.0);
  scene.Camera->SetFocalDisk(0.0);
  const std::vector<float> disk = Values(scene.Picture(), "Color");
  scene.Camera->SetFocalDisk(1.0);
  CHECK(Values(scene.Picture(), "Color") != disk);
  scene.Renderer->GetSplatter()->SetLensModeToPinhole();
  CHECK(Values(scene.Picture(), "Color") == disk);
  scene.Renderer->GetSplatter()->SetLensModeToCamera();
  CHECK(Values(scene.Picture(), "Color") != disk);
}

TEST_CASE_FIXTURE(NoMessages, "Circle of confusion in pixels")
{
  // At infinity C; at z, C (1 - zf / z); whatever FocalDisk says.
  PointScene scene(20.0);
  scene.Camera->SetFocalDisk(123.0);
  scene.Camera->SetFocalDistance(5.0);
  scene.Renderer->GetSplatter()->SetLensModeToCircleOfConfusion();
  scene.Renderer->GetSplatter()->SetCircleOfConfusion(12.0);
  // A lonely disc on cells of 2 px is off by up to 6 % (Core.CoarseGrid).
  scene.Renderer->GetSplatter()->CoarseGridsOff();
  const double c = 12.0 * (1.0 - 5.0 / 20.0);
  const double expected = BlurVariance(vtkSurfelSplatter::PEARSON_II, c) + 1.0;
  CHECK_NEAR(Moments(scene.Picture()).VarianceX, expected, 0.01 * expected); // sampled at pixels
  scene.Renderer->GetSplatter()->SetCircleOfConfusion(0.0);
  const std::vector<float> none = Values(scene.Picture(), "Color");
  scene.Renderer->GetSplatter()->SetLensModeToPinhole();
  CHECK(Values(scene.Picture(), "Color") == none);
}

TEST_CASE_FIXTURE(NoMessages, "Setters keep their ranges")
{
  vtkNew<vtkSurfelSplatter> splatter;
  CHECK(splatter->GetLensMode() == vtkSurfelSplatter::LENS_CAMERA);
  CHECK(splatter->GetCutoff() == 2.5);
  CHECK(splatter->GetPrefilter() == 1.0);
  CHECK(splatter->GetCircleOfConfusion() == 8.0);
  splatter->SetLensMode(7);
  CHECK(splatter->GetLensMode() == vtkSurfelSplatter::LENS_CIRCLE_OF_CONFUSION);
  splatter->SetCircleOfConfusion(-1.0);
  CHECK(splatter->GetCircleOfConfusion() == 0.0);
  splatter->SetCutoff(0.0);
  CHECK(splatter->GetCutoff() == 1.0);
  splatter->SetPrefilter(0.0);
  CHECK(splatter->GetPrefilter() == 0.01);
}

TEST_CASE_FIXTURE(NoMessages, "Picture scales with size")
{
  // Twice the pixels: twice the circle of confusion, four times the lens's variance.
  PointScene scene(3.0);
  scene.Camera->SetFocalDisk(0.5);
  scene.Camera->SetFocalDistance(6.0);
  scene.Renderer->GetSplatter()->CoarseGridsOff(); // an approximation: Core.CoarseGrid
  const double single = Moments(scene.Picture()).VarianceX - 1.0;
  scene.Renderer->SetSize(2 * Size, 2 * Size);
  const double twice = Moments(scene.Picture()).VarianceX - 1.0;
  CHECK(single > 4.0);
  CHECK_NEAR(twice / single, 4.0, 0.04); // sampled at pixels
}

TEST_CASE_FIXTURE(NoMessages, "Wide and narrow pictures")
{
  // The view angle is the vertical one, or the horizontal one where the camera says so; pixels stay
  // square.
  PointScene scene(3.0);
  scene.Camera->SetFocalDisk(0.5);
  scene.Camera->SetFocalDistance(6.0);
  scene.Renderer->GetSplatter()->CoarseGridsOff(); // an approximation: Core.CoarseGrid
  const Moments square(scene.Picture());
  scene.Renderer->SetSize(2 * Size, Size);
  const Moments wide(scene.Picture());
  CHECK_NEAR(
    wide.VarianceX, square.VarianceX, 1e-3); // the same kernel on other pixel columns: rounding
  CHECK_NEAR(wide.VarianceY, square.VarianceY, 1e-3);
  CHECK_NEAR(wide.X, Size, 1e-3);
  scene.Camera->UseHorizontalViewAngleOn();
  const Moments horizontal(scene.Picture());
  CHECK_NEAR((horizontal.VarianceX - 1.0) / (wide.VarianceX - 1.0), 4.0, 0.05); // sampled at pixels
  CHECK_NEAR(horizontal.VarianceX, horizontal.VarianceY, 1e-3 * horizontal.VarianceX);
}

TEST_CASE_FIXTURE(NoMessages, "Focus on a point")
{
  // The plane through the point, wherever it lies on it; behind the camera the camera's focus.
  Scene scene(100, 100);
  scene.Renderer->AddActor(SurfelActor(UnitSphere()));
  scene.See(FrontCamera(6.0));
  vtkSurfelSplatter* splatter = scene.Pass->GetSplatter();
  splatter->SetLensModeToCircleOfConfusion();
  splatter->SetCircleOfConfusion(20.0);
  vtkCamera* camera = scene.Renderer->GetActiveCamera();
  camera->SetFocalDistance(4.5);
  const vtkSmartPointer<vtkImageData> byCamera = scene.Render();
  camera->SetFocalDistance(9.0);
  const vtkSmartPointer<vtkImageData> other = scene.Render();
  CHECK(Compare(byCamera, other).Max > 20.0);
  splatter->SetFocusModeToPoint();
  splatter->SetFocusPoint(0.7, -3.0, 1.5);
  CHECK_NEAR(Compare(scene.Render(), byCamera).Max, 0.0, 0.0);
  splatter->SetFocusPoint(0.0, 0.0, 6.5);
  CHECK_NEAR(Compare(scene.Render(), other).Max, 0.0, 0.0);
}

TEST_CASE_FIXTURE(NoMessages, "Focus on the surface in the middle")
{
  // Not on the focal point, the middle of the sphere: on its front, 5 to 5.02 before the camera.
  Scene scene(160, 120);
  scene.Renderer->AddActor(SurfelActor(UnitSphere()));
  scene.See(FrontCamera(6.0));
  vtkSurfelSplatter* splatter = scene.Pass->GetSplatter();
  splatter->SetLensModeToCircleOfConfusion();
  splatter->SetCircleOfConfusion(20.0);
  vtkCamera* camera = scene.Renderer->GetActiveCamera();
  const vtkSmartPointer<vtkImageData> onFocalPoint = scene.Render();
  camera->SetFocalDistance(5.01);
  const vtkSmartPointer<vtkImageData> onFront = scene.Render();
  CHECK(Compare(onFocalPoint, onFront).Max > 20.0);
  camera->SetFocalDistance(0.0);
  splatter->SetFocusModeToMiddle();
  const vtkSmartPointer<vtkImageData> found = scene.Render();
  CHECK(Compare(found, onFront).Max < 2.0);
  const vtkSmartPointer<vtkImageData> poster = RenderPoster(scene.Window);
  CHECK(poster->GetDimensions()[0] == 320);
  // Cells of the lens share the focus of the whole lens, also where meshes are drawn.
  splatter->SetLensCells(7);
  CHECK(Compare(scene.Render(), onFront).Max < 6.0);
  splatter->SetLensCells(1);
  // A frame of nothing new is kept, and a focal distance counts.
  const vtkIdType reused = splatter->GetNumberOfReusedFrames();
  scene.Render();
  scene.Render();
  CHECK(splatter->GetNumberOfReusedFrames() > reused);
  camera->SetFocalDistance(6.0);
  CHECK_NEAR(Compare(scene.Render(), onFocalPoint).Max, 0.0, 0.0);
  // Nothing in sight: the camera's focus, without a message.
  camera->SetFocalDistance(0.0);
  camera->SetFocalPoint(0.0, 0.0, 12.0);
  CHECK(Compare(scene.Render(), onFocalPoint).Max > 20.0);
}

TEST_CASE_FIXTURE(NoMessages, "Focus in the middle of a strip")
{
  // The picture that finds it has no more pixels than usual: 65536 x 1 took 22 GiB and 40 s.
  vtkNew<vtkSurfelImageRenderer> renderer;
  renderer->AddActor(SurfelActor(UnitSphere()));
  renderer->SetCamera(FrontCamera(6.0));
  renderer->SetSize(20000, 2);
  vtkSurfelSplatter* splatter = renderer->GetSplatter();
  splatter->SetLensModeToCircleOfConfusion();
  splatter->SetCircleOfConfusion(20.0);
  splatter->SetFocusModeToMiddle();
  rusage before, after;
  getrusage(RUSAGE_SELF, &before);
  renderer->Update();
  getrusage(RUSAGE_SELF, &after);
  const double focus =
    renderer->GetOutput()->GetFieldData()->GetArray("CameraLens")->GetComponent(0, 2);
  CHECK_NEAR(focus, 5.1, 0.2);
  CHECK(after.ru_maxrss - before.ru_maxrss < 1 << 20); // KiB
}

TEST_SUITE_END();

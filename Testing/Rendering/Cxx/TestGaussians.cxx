// SPDX-License-Identifier: BSD-3-Clause
/**
 * Gaussians in space in a window: their order among meshes and surfels, their colours, dots, bounds
 * and channels.
 */
#include "RenderingTest.h"

#include "vtkSurfelHierarchy.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkHardwareSelector.h>
#include <vtkIdTypeArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkSelection.h>
#include <vtkSelectionNode.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Gaussians");

namespace
{
vtkSmartPointer<vtkFloatArray> NewFloats(const char* name, int components)
{
  auto array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  return array;
}

/// Round Gaussians of a capture, with harmonics of degree 0.
struct GaussianBuilder
{
  GaussianBuilder()
  {
    this->Data->SetPoints(vtkSmartPointer<vtkPoints>::New());
    this->Data->GetPointData()->AddArray(this->Covariances);
    this->Data->GetPointData()->AddArray(this->Opacities);
    this->Data->GetPointData()->AddArray(this->Harmonics);
  }

  void Add(const Vector& p, double deviation, const Vector& color)
  {
    constexpr double c0 = 0.28209479177387814; // harmonic of degree 0
    const double s = deviation * deviation;
    this->Data->GetPoints()->InsertNextPoint(p.data());
    this->Covariances->InsertNextTuple6(s, s, s, 0, 0, 0);
    this->Opacities->InsertNextValue(0.95f);
    this->Harmonics->InsertNextTuple3(
      (color[0] - 0.5) / c0, (color[1] - 0.5) / c0, (color[2] - 0.5) / c0);
  }

  /// A red plane z = x for |x| < 1.5, |y| < 1.2.
  void AddTiltedPlane()
  {
    constexpr double step = 0.03;
    for (double x = -1.5; x < 1.5; x += step)
    {
      for (double y = -1.2; y < 1.2; y += step)
      {
        this->Add({ x, y, x }, step, { 1, 0, 0 });
      }
    }
  }

  vtkNew<vtkPolyData> Data;
  vtkSmartPointer<vtkFloatArray> Covariances = NewFloats("GaussianCovariance", 6);
  vtkSmartPointer<vtkFloatArray> Opacities = NewFloats("GaussianOpacity", 1);
  vtkSmartPointer<vtkFloatArray> Harmonics = NewFloats("GaussianHarmonics", 3);
};

/// A camera at z = 6 that is focused on z = 0.
vtkSmartPointer<vtkCamera> LensCamera(double diameter)
{
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  camera->SetFocalDisk(diameter);
  camera->SetFocalDistance(6.0);
  return camera;
}

/// The channel of a pixel that is brighter than 200 while the others are darker than 55; -1 if none
/// is.
int ChannelAt(vtkImageData* picture, int x, int y)
{
  int found = -1;
  for (int c = 0; c < 3; ++c)
  {
    const double value = At(picture, x, y, c);
    if (value > 200.0)
    {
      found = found < 0 ? c : 3;
    }
    else if (value >= 55.0)
    {
      return -1;
    }
  }
  return found < 3 ? found : -1;
}
}

TEST_CASE_FIXTURE(NoMessages, "Order among a mesh and surfels")
{
  // The capture z = x, a green mesh z = 0 and, above, blue surfels z = 0.6. What is at z = 1 has a
  // circle of confusion of 280 px * 0.3 * (1/5 - 1/6) = 2.8 px; edges are kept away from by 10 px.
  GaussianBuilder capture;
  capture.AddTiltedPlane();
  vtkNew<vtkSurfelHierarchy> hierarchy;
  hierarchy->SetInputData(capture.Data);
  hierarchy->Update();
  SurfelBuilder scan;
  scan.AddGrid({ -1.2, 0.3, 0.6 }, { 0.03, 0, 0 }, { 0, 0.03, 0 }, 80, 30);
  scan.Color([](const Vector&) { return std::array<int, 4>{ 0, 0, 255, 255 }; });
  for (vtkPolyData* gaussians : { capture.Data.Get(), hierarchy->GetOutput() })
  {
    Scene scene(150, 150);
    scene.Renderer->AddActor(SurfelActor(gaussians));
    scene.Renderer->AddActor(SurfelActor(scan.Data));
    scene.Renderer->AddActor(
      QuadActor({ -1.2, -1.0, 0 }, { 2.4, 0, 0 }, { 0, 2.0, 0 }, { 0, 1, 0 }));
    scene.See(LensCamera(0.6));
    vtkSmartPointer<vtkImageData> picture = scene.Render();
    // A point at x, y, z is seen at 75 + f x / (6 - z), f = 75 / tan(15 degrees) = 280 px.
    const auto at = [&](double x, double y, double z) {
      const double f = 75.0 / std::tan(15.0 * 3.14159265358979 / 180.0);
      return ChannelAt(picture, static_cast<int>(75.0 + f * x / (6.0 - z)),
        static_cast<int>(75.0 + f * y / (6.0 - z)));
    };
    for (double y : { -0.7, -0.4, 0.0 })
    {
      CHECK(at(-0.9, y, 0.0) == 1);
      CHECK(at(-0.3, y, 0.0) == 1);
      CHECK(at(0.3, y, 0.3) == 0);
      CHECK(at(0.9, y, 0.9) == 0);
    }
    for (double y : { 0.55, 0.75 })
    {
      CHECK(at(-0.9, y, 0.6) == 2);
      CHECK(at(0.0, y, 0.6) == 2);
      CHECK(at(0.3, y, 0.6) == 2);
      CHECK(at(0.9, y, 0.9) == 0);
    }
  }
}

TEST_CASE_FIXTURE(NoMessages, "Scalars win over harmonics")
{
  GaussianBuilder capture;
  capture.AddTiltedPlane();
  vtkNew<vtkUnsignedCharArray> green;
  green->SetNumberOfComponents(3);
  green->SetNumberOfTuples(capture.Data->GetNumberOfPoints());
  green->FillComponent(0, 0);
  green->FillComponent(1, 255);
  green->FillComponent(2, 0);
  Scene scene(60, 60);
  vtkSmartPointer<vtkActor> actor = SurfelActor(capture.Data);
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(6.0));
  CHECK(ChannelAt(scene.Render(), 30, 30) == 0);
  capture.Data->GetPointData()->SetScalars(green);
  CHECK(ChannelAt(scene.Render(), 30, 30) == 1);
  actor->GetMapper()->ScalarVisibilityOff();
  CHECK(ChannelAt(scene.Render(), 30, 30) == 0);
  capture.Harmonics->FillComponent(2, capture.Harmonics->GetComponent(0, 0));
  capture.Harmonics->FillComponent(0, capture.Harmonics->GetComponent(0, 1));
  capture.Harmonics->Modified();
  CHECK(ChannelAt(scene.Render(), 30, 30) == 2);
  vtkNew<vtkSurfelMapper> copy;
  copy->ShallowCopy(actor->GetMapper());
  actor->SetMapper(copy);
  CHECK(ChannelAt(scene.Render(), 30, 30) == 2);
}

TEST_CASE_FIXTURE(OnlyOfDots, "Dots, picking and bounds with a huge stray Gaussian")
{
  GaussianBuilder capture;
  capture.AddTiltedPlane();
  const vtkIdType count = capture.Data->GetNumberOfPoints();
  capture.Add({ 0, 0, -40 }, 10.0, { 1, 1, 1 });
  vtkSmartPointer<vtkActor> actor = SurfelActor(capture.Data);
  // Each Gaussian by its own deviation: of the plane 0.03, of the stray one 10.
  const double expected[6] = { -10, 10, -10, 10, -50, 1.53 };
  for (int i = 0; i < 6; ++i)
  {
    CHECK_NEAR(actor->GetBounds()[i], expected[i], 0.04);
  }
  Scene scene(150, 150, 0, false);
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(6.0));
  vtkSmartPointer<vtkImageData> dots = scene.Render();
  // Dots are 0.8 * 3^(1/4) of the plane's deviation: they close its gaps and end at its border,
  // which is at y = 1.2 and z = 0 for x = 0: 56 px from the middle.
  CHECK(At(dots, 75, 75, 0) > 250);
  CHECK(At(dots, 75, 75 + 52, 0) > 250);
  CHECK(At(dots, 75, 75 + 62, 0) < 5);
  vtkNew<vtkHardwareSelector> selector;
  selector->SetRenderer(scene.Renderer);
  selector->SetArea(70, 70, 80, 80);
  selector->SetFieldAssociation(vtkDataObject::FIELD_ASSOCIATION_POINTS);
  vtkSmartPointer<vtkSelection> selection;
  selection.TakeReference(selector->Select());
  REQUIRE(selection->GetNumberOfNodes() == 1);
  auto* ids = vtkIdTypeArray::SafeDownCast(selection->GetNode(0)->GetSelectionList());
  CHECK(ids->GetNumberOfTuples() > 10);
  for (vtkIdType i = 0; i < ids->GetNumberOfTuples(); ++i)
  {
    const vtkIdType id = ids->GetValue(i);
    REQUIRE(id < count);
    CHECK_NEAR(std::abs(capture.Data->GetPoint(id)[0]), 0.0, 0.2);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Channels")
{
  // Surfels above, Gaussians below: normals are those of the surfels, and exactly 0 below.
  GaussianBuilder capture;
  capture.AddTiltedPlane();
  SurfelBuilder scan;
  scan.AddGrid({ -1.2, 0.3, 1.5 }, { 0.03, 0, 0 }, { 0, 0.03, 0 }, 80, 30);
  Scene scene(60, 60);
  scene.Renderer->AddActor(SurfelActor(capture.Data));
  scene.Renderer->AddActor(SurfelActor(scan.Data));
  scene.Pass->GetSplatter()->SetChannels(vtkSurfelSplatter::ALL_CHANNELS);
  scene.See(LensCamera(0.2));
  scene.Render();
  const std::vector<float> normals = Values(scene.Float(), "Normal");
  const std::vector<float> coverage = Values(scene.Float(), "Coverage");
  const std::vector<float> levels = Values(scene.Float(), "Level");
  const auto pixel = [](int x, int y) { return static_cast<std::size_t>(60 * y + x); };
  for (int c = 0; c < 3; ++c)
  {
    CHECK_NEAR(normals[3 * pixel(30, 20) + c], 0.0, 0.0);
    CHECK_NEAR(normals[3 * pixel(30, 48) + c], c == 2 ? 1.0 : 0.0, 1e-4);
  }
  CHECK_NEAR(coverage[pixel(30, 20)], 1.0, 1e-3);
  CHECK_NEAR(levels[pixel(30, 20)], 0.0, 0.0);
  CHECK_NEAR(levels[pixel(2, 2)], -1.0, 0.0);
}

TEST_CASE_FIXTURE(NoMessages, "Normals are seen through Gaussians with translucent scalars")
{
  GaussianBuilder capture;
  capture.AddTiltedPlane();
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetNumberOfComponents(4);
  colors->SetNumberOfTuples(capture.Data->GetNumberOfPoints());
  colors->Fill(5); // the alpha, too: 2 %
  capture.Data->GetPointData()->SetScalars(colors);
  SurfelBuilder scan; // behind
  scan.AddGrid({ -1.2, -1.2, -2 }, { 0.03, 0, 0 }, { 0, 0.03, 0 }, 80, 80);
  Scene scene(60, 60);
  scene.Renderer->AddActor(SurfelActor(capture.Data));
  scene.Renderer->AddActor(SurfelActor(scan.Data));
  scene.Pass->GetSplatter()->SetChannels(vtkSurfelSplatter::CHANNEL_NORMAL);
  scene.See(LensCamera(0.2));
  scene.Render();
  const std::vector<float> normals = Values(scene.Float(), "Normal");
  CHECK_NEAR(normals[3 * (60 * 30 + 30) + 2], 1.0, 1e-3);
}

TEST_SUITE_END();

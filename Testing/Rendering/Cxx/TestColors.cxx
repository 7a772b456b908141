// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where colours come from, opacity, and lighting against VTK's own.
 */
#include "RenderingTest.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkLookupTable.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSphereSource.h>
#include <vtkUnsignedCharArray.h>

#include <cmath>
#include <functional>
#include <limits>

#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Colors");

namespace
{
/// A wall of surfels that fills the picture and leaves the colour as it is: opaque everywhere by
/// having each surfel stand for twice its area.
struct WallScene
{
  WallScene()
    : Window(40, 40)
  {
    this->Builder.AddGrid({ -1.5, -1.5, 0 }, { 0.05, 0, 0 }, { 0, 0.05, 0 }, 60, 60);
    vtkDataArray* area = this->Builder.Data->GetPointData()->GetArray("SurfelAreaVector");
    for (vtkIdType i = 0; i < area->GetNumberOfTuples(); ++i)
    {
      area->SetComponent(i, 2, 2.0 * area->GetComponent(i, 2));
    }
  }

  void Add()
  {
    this->Actor = SurfelActor(this->Builder.Data);
    this->Mapper = vtkSurfelMapper::SafeDownCast(this->Actor->GetMapper());
    this->Window.Renderer->AddActor(this->Actor);
    this->Window.See(FrontCamera(4.0));
  }

  /// Checks the picture's middle; float arithmetic of weighted means leaves 1e-6.
  void Expect(double r, double g, double b, double a, double bound = 1e-6)
  {
    this->Window.Window->Render();
    const double expected[4] = { r, g, b, a };
    for (int c = 0; c < 4; ++c)
    {
      CHECK_NEAR(At(this->Window.Float(), 20, 20, c), expected[c], bound);
    }
  }

  SurfelBuilder Builder;
  Scene Window;
  vtkSmartPointer<vtkActor> Actor;
  vtkSurfelMapper* Mapper = nullptr;
};

TEST_CASE_FIXTURE(NoMessages, "Scalars with more components than colours")
{
  WallScene scene;
  vtkNew<vtkUnsignedCharArray> six;
  six->SetName("six");
  six->SetNumberOfComponents(6);
  six->SetNumberOfTuples(scene.Builder.Data->GetNumberOfPoints());
  six->Fill(100);
  scene.Builder.Data->GetPointData()->SetScalars(six);
  scene.Add();
  scene.Actor->GetProperty()->SetColor(0.25, 0.5, 0.75);
  scene.Actor->GetProperty()->SetLighting(false);
  scene.Expect(0.25, 0.5, 0.75, 1.0);
  CHECK(TakeMessages().find("The scalars six have 6 components") != std::string::npos);
  scene.Window.Window->Render();
  CHECK(TakeMessages().empty()); // once
  // Another problem of scalars is told of as well.
  vtkNew<vtkFloatArray> nothing;
  nothing->SetName("nothing");
  nothing->SetNumberOfTuples(six->GetNumberOfTuples());
  nothing->FillValue(std::numeric_limits<float>::quiet_NaN());
  scene.Builder.Data->GetPointData()->SetScalars(nothing);
  scene.Window.Window->Render();
  CHECK(TakeMessages().find("The scalars nothing are NaN everywhere") != std::string::npos);
  scene.Window.Renderer->SetPass(nullptr);
  scene.Window.Window->Render(); // as dots
  CHECK(TakeMessages().find("drawn as dots") != std::string::npos);
}

vtkSmartPointer<vtkFloatArray> Constant(const char* name, vtkIdType count, float value)
{
  vtkSmartPointer<vtkFloatArray> array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name);
  array->SetNumberOfTuples(count);
  array->FillValue(value);
  return array;
}
}

TEST_CASE_FIXTURE(NoMessages, "Property color and opacity")
{
  WallScene scene;
  scene.Add();
  scene.Actor->GetProperty()->SetColor(0.25, 0.5, 0.75);
  scene.Expect(0.25, 0.5, 0.75, 1.0);
  scene.Actor->GetProperty()->SetOpacity(0.5);
  scene.Expect(0.125, 0.25, 0.375, 0.5);
  scene.Builder.Data->GetPointData()->AddArray(Constant("SurfelOpacity", 3600, 0.5f));
  scene.Expect(0.0625, 0.125, 0.1875, 0.25);
}

TEST_CASE_FIXTURE(NoMessages, "Direct RGB and RGBA")
{
  WallScene rgb;
  rgb.Builder.Color([](const Vector&) { return std::array<int, 4>{ 51, 102, 204, 0 }; }, 3);
  rgb.Add();
  rgb.Expect(0.2, 0.4, 0.8, 1.0);
  rgb.Mapper->ScalarVisibilityOff();
  rgb.Actor->GetProperty()->SetColor(1, 0, 0);
  rgb.Expect(1, 0, 0, 1);
  rgb.Mapper->ScalarVisibilityOn();
  rgb.Expect(0.2, 0.4, 0.8, 1.0);
  rgb.Builder.Data->GetPointData()->GetScalars()->Fill(255);
  rgb.Builder.Data->GetPointData()->GetScalars()->Modified();
  rgb.Builder.Data->Modified();
  rgb.Expect(1, 1, 1, 1);

  WallScene rgba;
  rgba.Builder.Color([](const Vector&) { return std::array<int, 4>{ 51, 102, 204, 102 }; }, 4);
  rgba.Add();
  rgba.Expect(0.2 * 0.4, 0.4 * 0.4, 0.8 * 0.4, 0.4);
  rgba.Actor->GetProperty()->SetOpacity(0.5);
  rgba.Expect(0.2 * 0.2, 0.4 * 0.2, 0.8 * 0.2, 0.2);
}

TEST_CASE_FIXTURE(NoMessages, "Lookup table")
{
  WallScene scene;
  scene.Builder.Data->GetPointData()->SetScalars(Constant("Height", 3600, 1.0f));
  scene.Builder.Data->GetPointData()->AddArray(Constant("Other", 3600, 2.0f));
  scene.Add();
  vtkNew<vtkLookupTable> table;
  table->SetNumberOfTableValues(3);
  table->SetRange(0, 2);
  table->SetTableValue(0, 1, 0, 0, 1);
  table->SetTableValue(1, 0, 1, 0, 1);
  table->SetTableValue(2, 0, 0, 1, 0.4);
  scene.Mapper->SetLookupTable(table);
  scene.Mapper->UseLookupTableScalarRangeOn();
  scene.Expect(0, 1, 0, 1);
  table->SetTableValue(1, 0.2, 0.4, 0.6, 1);
  table->Modified();
  scene.Expect(0.2, 0.4, 0.6, 1);
  scene.Mapper->SetScalarModeToUsePointFieldData();
  scene.Mapper->SelectColorArray("Other");
  scene.Expect(0, 0, 0.4, 0.4);
  // Interpolated scalars are for textures, which splats do not have: colours are per surfel.
  scene.Mapper->InterpolateScalarsBeforeMappingOn();
  scene.Expect(0, 0, 0.4, 0.4);
  scene.Mapper->UseLookupTableScalarRangeOff();
  scene.Mapper->SetScalarRange(2, 4);
  scene.Expect(1, 0, 0, 1);
}

namespace
{
/// Mean and largest difference of a lit sphere of surfels from VTK's mesh, away from the
/// silhouette.
Difference LitDifference(const std::function<void(vtkRenderer*, vtkProperty*)>& setUp)
{
  vtkSmartPointer<vtkImageData> pictures[2];
  for (int mesh = 0; mesh < 2; ++mesh)
  {
    Scene scene(160, 160);
    vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere(40000));
    if (mesh)
    {
      vtkNew<vtkSphereSource> source;
      source->SetRadius(1.0);
      source->SetThetaResolution(200);
      source->SetPhiResolution(200);
      vtkNew<vtkPolyDataMapper> mapper;
      mapper->SetInputConnection(source->GetOutputPort());
      actor->SetMapper(mapper);
    }
    actor->GetProperty()->LightingOn();
    actor->GetProperty()->SetColor(0.8, 0.6, 0.3);
    setUp(scene.Renderer, actor->GetProperty());
    scene.Renderer->AddActor(actor);
    vtkSmartPointer<vtkCamera> camera = FrontCamera(5.0);
    camera->Azimuth(20);
    scene.See(camera);
    pictures[mesh] = scene.Render();
  }
  Difference result;
  int count = 0;
  for (int y = 0; y < 160; ++y)
  {
    for (int x = 0; x < 160; ++x)
    {
      // The sphere's radius is 61 px.
      if (std::hypot(x - 79.5, y - 79.5) > 54)
      {
        continue;
      }
      for (int c = 0; c < 3; ++c)
      {
        const double d = std::abs(At(pictures[0], x, y, c) - At(pictures[1], x, y, c));
        result.Max = std::max(result.Max, d);
        result.Mean += d;
        ++count;
      }
    }
  }
  result.Mean /= count;
  return result;
}

/// Shading per surfel, blurred over 1 px, of a sphere of 40000: one level of rounding, and one
/// of 1.5 % ripple.
constexpr double LitMean = 2.0;
constexpr double LitMax = 6.0;
}

TEST_CASE_FIXTURE(NoMessages, "Lighting is VTK's")
{
  const std::pair<const char*, std::function<void(vtkRenderer*, vtkProperty*)>> cases[] = {
    { "headlight", [](vtkRenderer*, vtkProperty*) {} },
    { "headlight's highlight",
      [](vtkRenderer*, vtkProperty* property) {
        property->SetSpecular(0.4);
        property->SetSpecularPower(12.0);
      } },
    { "ambient and diffuse",
      [](vtkRenderer*, vtkProperty* property) {
        property->SetAmbient(0.3);
        property->SetAmbientColor(0.1, 0.2, 0.9);
        property->SetDiffuse(0.6);
      } },
    { "scene light",
      [](vtkRenderer* renderer, vtkProperty*) {
        vtkNew<vtkLight> light;
        light->SetLightTypeToSceneLight();
        light->SetPosition(3, 4, 2);
        light->SetColor(1.0, 0.9, 0.5);
        light->SetIntensity(0.8);
        renderer->AddLight(light);
      } },
    { "camera light",
      [](vtkRenderer* renderer, vtkProperty*) {
        vtkNew<vtkLight> light;
        light->SetLightTypeToCameraLight();
        light->SetPosition(0.7, 0.5, 1);
        renderer->AddLight(light);
      } },
    { "two lights, one off",
      [](vtkRenderer* renderer, vtkProperty*) {
        for (int i = 0; i < 3; ++i)
        {
          vtkNew<vtkLight> light;
          light->SetLightTypeToSceneLight();
          light->SetPosition(3 - 3 * i, 2, 4);
          light->SetIntensity(0.5);
          light->SetSwitch(i != 1);
          renderer->AddLight(light);
        }
      } },
    { "positional",
      [](vtkRenderer* renderer, vtkProperty*) {
        vtkNew<vtkLight> light;
        light->SetLightTypeToSceneLight();
        light->PositionalOn();
        light->SetPosition(1.0, 0.5, 2.0);
        light->SetConeAngle(90);
        light->SetAttenuationValues(0.5, 0.1, 0.2);
        renderer->AddLight(light);
      } },
    { "spot",
      [](vtkRenderer* renderer, vtkProperty*) {
        vtkNew<vtkLight> light;
        light->SetLightTypeToSceneLight();
        light->PositionalOn();
        light->SetPosition(1.0, 0.5, 3.0);
        light->SetFocalPoint(0, 0, 0);
        light->SetConeAngle(40);
        light->SetExponent(3);
        renderer->AddLight(light);
      } },
    { "specular, scene light",
      [](vtkRenderer* renderer, vtkProperty* property) {
        vtkNew<vtkLight> light;
        light->SetLightTypeToSceneLight();
        light->SetPosition(3, 4, 5);
        renderer->AddLight(light);
        property->SetSpecular(0.5);
        property->SetSpecularPower(20);
        property->SetSpecularColor(0.5, 1, 0.5);
      } },
  };
  for (const auto& entry : cases)
  {
    const Difference difference = LitDifference(entry.second);
    CHECK_MESSAGE(Near(difference.Mean, 0.0, LitMean), entry.first, ", mean");
    CHECK_MESSAGE(Near(difference.Max, 0.0, LitMax), entry.first, ", max");
  }
}

TEST_CASE_FIXTURE(NoMessages, "Two sided surfels are lit on the side seen")
{
  WallScene scene;
  vtkDataArray* area = scene.Builder.Data->GetPointData()->GetArray("SurfelAreaVector");
  for (vtkIdType i = 0; i < area->GetNumberOfTuples(); ++i)
  {
    area->SetComponent(i, 2, -area->GetComponent(i, 2));
  }
  scene.Add();
  scene.Expect(0, 0, 0, 0); // the back is not seen
  scene.Builder.Data->GetPointData()->AddArray(Constant("SurfelTwoSided", 3600, 1.0f));
  scene.Expect(1, 1, 1, 1);
  scene.Actor->GetProperty()->LightingOn();
  scene.Expect(1, 1, 1, 1, 1e-3); // a headlight, straight on: cosines within 2 px of the middle
}

TEST_SUITE_END();

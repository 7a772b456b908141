// SPDX-License-Identifier: BSD-3-Clause
/**
 * The renderer without a window, as an algorithm.
 */
#include "RenderingTest.h"

#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"

#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkLight.h>
#include <vtkLookupTable.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkSMPTools.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkTransform.h>
#include <vtkTransformPolyDataFilter.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("ImageRenderer");

namespace
{
vtkSmartPointer<vtkPolyData> ColoredSphere()
{
  SurfelBuilder builder;
  builder.AddSphere({ 0, 0, 0 }, 1.0, 3000);
  builder.Color([](const Vector& p) {
    return std::array<int, 4>{ static_cast<int>(128 + 127 * p[0]),
      std::sin(9 * p[1]) > 0 ? 220 : 30, 90, 255 };
  });
  return builder.Data;
}

/// How often an algorithm executes.
struct Executions
{
  explicit Executions(vtkAlgorithm* algorithm)
  {
    vtkNew<vtkCallbackCommand> command;
    command->SetClientData(&this->Count);
    command->SetCallback(
      [](vtkObject*, unsigned long, void* count, void*) { ++*static_cast<int*>(count); });
    algorithm->AddObserver(vtkCommand::StartEvent, command);
  }
  int Count = 0;
};
}

TEST_CASE_FIXTURE(NoMessages, "Runs without a display")
{
  CHECK(std::getenv("DISPLAY") == nullptr);
  vtkNew<vtkSurfelImageRenderer> renderer;
  vtkSmartPointer<vtkActor> actor = SurfelActor(ColoredSphere());
  actor->GetProperty()->LightingOn();
  renderer->AddActor(actor);
  renderer->SetCamera(FrontCamera(5.0));
  renderer->SetSize(120, 90);
  renderer->Update();
  vtkImageData* picture = renderer->GetOutput();
  const int* extent = picture->GetExtent();
  CHECK(extent[0] == 0);
  CHECK(extent[1] == 119);
  CHECK(extent[2] == 0);
  CHECK(extent[3] == 89);
  CHECK(extent[5] == 0);
  CHECK(picture->GetScalarType() == VTK_FLOAT);
  CHECK(picture->GetNumberOfScalarComponents() == 4);
  CHECK(std::string(picture->GetPointData()->GetScalars()->GetName()) == "Color");
  CHECK(picture->GetPointData()->GetArray("Depth") != nullptr);
  vtkInformation* information = renderer->GetOutputInformation(0);
  const int* whole = information->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT());
  CHECK(whole[1] == 119);
  CHECK(whole[3] == 89);
  CHECK(At(picture, 60, 45, 3) > 0.97);
  // Distance along the view direction to the sphere's front; a pixel from the axis it curves by
  // 1e-4.
  CHECK_NEAR(Values(picture, "Depth")[45 * 120 + 60], 4.0, 0.01);
  CHECK(At(picture, 2, 2, 3) == 0.0);
  CHECK(Values(picture, "Depth")[0] == 0.0f);
}

TEST_CASE_FIXTURE(NoMessages, "Executes when something changed")
{
  vtkSmartPointer<vtkPolyData> data = ColoredSphere();
  vtkNew<vtkFloatArray> height;
  height->SetName("Height");
  for (vtkIdType i = 0; i < 3000; ++i)
  {
    height->InsertNextValue(i / 3000.0f);
  }
  data->GetPointData()->AddArray(height);
  vtkSmartPointer<vtkActor> actor = SurfelActor(data);
  vtkSurfelMapper* mapper = vtkSurfelMapper::SafeDownCast(actor->GetMapper());
  vtkNew<vtkLookupTable> table;
  vtkNew<vtkMatrix4x4> matrix;
  actor->SetUserMatrix(matrix);
  actor->GetProperty()->LightingOn();
  vtkNew<vtkLight> light;
  light->SetLightTypeToSceneLight();
  light->SetPosition(2, 2, 5);
  vtkSmartPointer<vtkCamera> camera = FrontCamera(5.0);
  vtkNew<vtkSurfelImageRenderer> renderer;
  renderer->SetSize(60, 50);
  renderer->AddActor(actor);
  renderer->AddLight(light);
  renderer->SetCamera(camera);
  vtkNew<vtkActor> second;
  second->ShallowCopy(SurfelActor(ColoredSphere()));
  second->SetPosition(0.8, 0.5, 0.5);

  struct Change
  {
    const char* Name;
    std::function<void()> Do;
  };
  const Change changes[] = {
    { "camera", [&] { camera->Azimuth(10); } },
    { "lens", [&] { camera->SetFocalDisk(0.4); } },
    { "focus", [&] { camera->SetFocalDistance(3.0); } },
    { "property", [&] { actor->GetProperty()->SetAmbient(0.3); } },
    { "opacity", [&] { actor->GetProperty()->SetOpacity(0.6); } },
    { "position", [&] { actor->SetPosition(0.2, 0, 0); } },
    { "user matrix", [&] { matrix->SetElement(1, 3, 0.3); } },
    { "color array",
      [&] {
        mapper->SetScalarModeToUsePointFieldData();
        mapper->SelectColorArray("Height");
        mapper->SetLookupTable(table);
      } },
    { "lookup table", [&] { table->SetHueRange(0.1, 0.3); } },
    { "data",
      [&] {
        data->GetPointData()->GetArray("SurfelAreaVector")->SetComponent(5, 0, 3.0);
        data->GetPointData()->GetArray("SurfelAreaVector")->Modified();
        data->Modified();
      } },
    { "new data", [&] { mapper->SetInputData(ColoredSphere()); } },
    { "light", [&] { light->SetIntensity(0.5); } },
    { "lights", [&] { renderer->RemoveAllLights(); } },
    { "size", [&] { renderer->SetSize(70, 50); } },
    { "background",
      [&] {
        renderer->SetBackground(0.1, 0.2, 0.3);
        renderer->SetBackgroundAlpha(1);
      } },
    { "splatter", [&] { renderer->GetSplatter()->SetPrefilter(2.0); } },
    { "actor added", [&] { renderer->AddActor(second); } },
    { "invisible", [&] { second->VisibilityOff(); } },
    { "visible", [&] { second->VisibilityOn(); } },
    { "actor removed", [&] { renderer->RemoveActor(second); } },
  };
  Executions executions(renderer);
  renderer->Update();
  CHECK_NEAR(executions.Count, 1, 0);
  for (const Change& change : changes)
  {
    vtkNew<vtkImageData> before;
    before->DeepCopy(renderer->GetOutput());
    const int count = executions.Count;
    change.Do();
    renderer->Update();
    CHECK_MESSAGE(Near(executions.Count, count + 1, 0), change.Name);
    CHECK_MESSAGE(
      Compare(before, renderer->GetOutput()).Max > 1e-6, "another picture after: ", change.Name);
    renderer->Update();
    renderer->Update();
    CHECK_MESSAGE(Near(executions.Count, count + 1, 0), "nothing changed after: ", change.Name);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Background")
{
  vtkNew<vtkSurfelImageRenderer> renderer;
  vtkSmartPointer<vtkActor> actor = SurfelActor(ColoredSphere());
  actor->GetProperty()->SetOpacity(0.6);
  renderer->AddActor(actor);
  renderer->SetCamera(FrontCamera(5.0));
  renderer->SetSize(60, 60);
  renderer->Update();
  const std::vector<float> bare = Values(renderer->GetOutput(), "Color");
  renderer->SetBackground(0.2, 0.4, 2.0); // above 1 is allowed: linear light
  renderer->SetBackgroundAlpha(0.5);
  renderer->Update();
  const std::vector<float> blended = Values(renderer->GetOutput(), "Color");
  const double under[4] = { 0.1, 0.2, 1.0, 0.5 };
  double worst = 0.0;
  for (std::size_t i = 0; i < blended.size(); ++i)
  {
    const double expected = bare[i] + (1.0 - bare[i - i % 4 + 3]) * under[i % 4];
    worst = std::max(worst, std::abs(expected - blended[i]));
  }
  CHECK_NEAR(worst, 0.0, 1e-6); // float arithmetic
  CHECK(Values(renderer->GetSplatter()->GetOutput(), "Color") == bare);
}

TEST_CASE_FIXTURE(NoMessages, "Input port")
{
  // Surfels at the input are the same as an unlit actor; two inputs share an A-buffer.
  vtkNew<vtkTransform> transform;
  transform->Translate(0.7, 0, 0);
  vtkNew<vtkTransformPolyDataFilter> moved;
  moved->SetInputData(ColoredSphere());
  moved->SetTransform(transform);
  moved->Update();
  vtkNew<vtkSurfelImageRenderer> byActors, byInput;
  for (vtkSurfelImageRenderer* renderer : { byActors.Get(), byInput.Get() })
  {
    renderer->SetCamera(FrontCamera(5.0));
    renderer->SetSize(70, 60);
  }
  byActors->AddActor(SurfelActor(ColoredSphere()));
  byActors->AddActor(SurfelActor(moved->GetOutput()));
  byInput->AddInputData(ColoredSphere());
  byInput->AddInputConnection(moved->GetOutputPort());
  byActors->Update();
  byInput->Update();
  CHECK(CountBrighter(byInput->GetOutput(), 0.5) > 1000);
  CHECK(Values(byInput->GetOutput(), "Color") == Values(byActors->GetOutput(), "Color"));
  Executions executions(byInput);
  transform->Translate(0.1, 0, 0);
  byInput->Update();
  CHECK_NEAR(executions.Count, 1, 0);
}

TEST_CASE_FIXTURE(NoMessages, "Same at any number of threads")
{
  std::vector<float> color, depth;
  for (int threads : { 8, 2, 1 }) // TBB takes no more than it was given first
  {
    vtkSMPTools::Initialize(threads);
    CHECK_NEAR(vtkSMPTools::GetEstimatedNumberOfThreads(), threads, 0);
    vtkNew<vtkSurfelImageRenderer> renderer;
    SurfelBuilder builder;
    builder.AddSphere({ 0, 0, 0 }, 1.0, 20000);
    builder.AddSphere({ 0.5, 0.4, -2 }, 1.0, 20000);
    renderer->AddActor(SurfelActor(builder.Data));
    vtkSmartPointer<vtkCamera> camera = FrontCamera(5.0);
    camera->SetFocalDisk(0.3);
    camera->SetFocalDistance(4.0);
    renderer->SetCamera(camera);
    renderer->SetSize(200, 150);
    renderer->Update();
    if (threads < 8)
    {
      CHECK(Values(renderer->GetOutput(), "Color") == color);
      CHECK(Values(renderer->GetOutput(), "Depth") == depth);
    }
    color = Values(renderer->GetOutput(), "Color");
    depth = Values(renderer->GetOutput(), "Depth");
  }
  vtkSMPTools::Initialize(0);
}

TEST_CASE_FIXTURE(NoMessages, "File round trip")
{
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(ColoredSphere());
  writer->WriteToOutputStringOn();
  writer->SetFileName("unused.vtp");
  writer->Write();
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(writer->GetOutputString());
  std::vector<float> pictures[2];
  for (int i = 0; i < 2; ++i)
  {
    vtkNew<vtkSurfelImageRenderer> renderer;
    renderer->SetCamera(FrontCamera(5.0));
    renderer->SetSize(60, 60);
    if (i == 0)
    {
      renderer->SetInputData(ColoredSphere());
    }
    else
    {
      renderer->SetInputConnection(reader->GetOutputPort());
    }
    renderer->Update();
    pictures[i] = Values(renderer->GetOutput(), "Color");
  }
  CHECK(pictures[0].size() == 60 * 60 * 4);
  CHECK(pictures[0] == pictures[1]);
}

TEST_CASE_FIXTURE(NoMessages, "Clipping range")
{
  // Fitted: nothing in front of the lens is cut off, and the camera stays as it is. Not fitted: the
  // camera's.
  vtkNew<vtkSurfelImageRenderer> renderer;
  renderer->AddActor(SurfelActor(ColoredSphere()));
  vtkSmartPointer<vtkCamera> camera = FrontCamera(5.0);
  camera->SetClippingRange(4.5, 4.6);
  renderer->SetCamera(camera);
  renderer->SetSize(60, 60);
  renderer->Update();
  CHECK(At(renderer->GetOutput(), 30, 30, 3) > 0.97);
  CHECK(camera->GetClippingRange()[0] == 4.5);
  CHECK(camera->GetClippingRange()[1] == 4.6);
  renderer->AutomaticClippingRangeOff();
  renderer->Update();
  CHECK(At(renderer->GetOutput(), 30, 30, 3) < 0.01);
  CHECK(CountBrighter(renderer->GetOutput(), 0.1) > 20); // a ring at that distance
}

TEST_SUITE_END();

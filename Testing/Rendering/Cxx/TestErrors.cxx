// SPDX-License-Identifier: BSD-3-Clause
/**
 * Input that is not as it should be: said clearly, nothing crashes, the rest is drawn.
 */
#include "RenderingTest.h"

#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPlane.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSphereSource.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <sys/resource.h>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Errors");

namespace
{
void Contains(const std::string& text, const std::string& part)
{
  CHECK_MESSAGE(text.find(part) != std::string::npos, "no \"", part, "\" in \"", text, "\"");
}

/// Renders bad surfels beside a usable cloud and a mesh; gives the message. The others must be
/// drawn.
std::string MessageOf(vtkPolyData* bad)
{
  Scene scene(90, 60);
  vtkSmartPointer<vtkActor> usable = SurfelActor(UnitSphere());
  usable->SetPosition(-1.5, 0, 0);
  scene.Renderer->AddActor(SurfelActor(bad));
  scene.Renderer->AddActor(usable);
  scene.Renderer->AddActor(QuadActor({ 1, -1, 0 }, { 1, 0, 0 }, { 0, 2, 0 }, { 0, 0, 1 }));
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  scene.See(camera);
  camera->SetClippingRange(2, 10);
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  CHECK(At(picture, 17, 30, 0) > 240);
  CHECK(At(picture, 73, 30, 2) > 240);
  return TakeMessages();
}

vtkSmartPointer<vtkPolyData> Without(const char* array)
{
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  surfels->GetPointData()->RemoveArray(array);
  return surfels;
}

vtkSmartPointer<vtkPolyData> With(const char* name, int components, vtkIdType tuples)
{
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  vtkNew<vtkFloatArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(tuples);
  array->Fill(0.5);
  surfels->GetPointData()->AddArray(array);
  return surfels;
}
}

TEST_CASE_FIXTURE(NoMessages, "Arrays missing or wrong")
{
  vtkNew<vtkSphereSource> points;
  points->Update();
  Contains(MessageOf(points->GetOutput()), "no point array SurfelCovariance");
  Contains(MessageOf(Without("SurfelAreaVector")), "no point array SurfelAreaVector");
  Contains(MessageOf(With("SurfelCovariance", 9, 4000)), "9 components instead of 6");
  Contains(MessageOf(With("SurfelAreaVector", 1, 4000)), "1 components instead of 3");
  Contains(MessageOf(With("SurfelTwoSided", 2, 4000)), "2 components instead of 1");
  Contains(MessageOf(With("SurfelOpacity", 4, 4000)), "4 components instead of 1");
  // Shorter than the points: reading on would read what is not there.
  Contains(MessageOf(With("SurfelCovariance", 6, 10)), "10 tuples");
  Contains(MessageOf(With("SurfelOpacity", 1, 3999)), "3999 tuples");

  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  vtkNew<vtkDoubleArray> origin;
  origin->SetName("SurfelOrigin");
  origin->SetNumberOfComponents(2);
  origin->InsertNextTuple2(1, 2);
  surfels->GetFieldData()->AddArray(origin);
  Contains(MessageOf(surfels), "SurfelOrigin");
}

/// Reading on would read what is not there, with the pass and as dots.
TEST_CASE_FIXTURE(NoMessages, "Scalars of another length")
{
  for (const bool isByte : { false, true })
  {
    for (const bool withPass : { true, false })
    {
      const vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
      const vtkSmartPointer<vtkDataArray> few = vtkSmartPointer<vtkDataArray>::Take(
        vtkDataArray::CreateDataArray(isByte ? VTK_UNSIGNED_CHAR : VTK_FLOAT));
      few->SetName("Few");
      few->SetNumberOfComponents(3);
      few->SetNumberOfTuples(10);
      few->Fill(0.0);
      surfels->GetPointData()->SetScalars(few);
      const vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
      actor->GetMapper()->SetColorModeToDirectScalars();
      Scene scene(60, 60, 0, withPass);
      scene.Renderer->AddActor(actor);
      scene.See(FrontCamera(6.0));
      scene.Render();
      CHECK(At(scene.Render(), 30, 30, 0) > 240);
      const std::string said = TakeMessages();
      Contains(said, "Few have 10 values for 4000 surfels");
      const std::size_t again = said.find("Few", said.find("Few") + 1);
      CHECK(again == std::string::npos);
    }
  }
}

TEST_CASE_FIXTURE(NoMessages, "Empty input")
{
  vtkNew<vtkPolyData> empty;
  CHECK(MessageOf(empty).empty());
  vtkNew<vtkPolyData> noTuples;
  vtkNew<vtkPoints> points;
  noTuples->SetPoints(points);
  CHECK(MessageOf(noTuples).empty());
}

TEST_CASE_FIXTURE(NoMessages, "Invalid surfels are counted and not drawn")
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinite = std::numeric_limits<float>::infinity();
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  surfels->GetPoints()->SetPoint(10, nan, 0, 0);
  surfels->GetPoints()->SetPoint(20, 0, -infinite, 0);
  surfels->GetPointData()->GetArray("SurfelCovariance")->SetComponent(30, 4, nan);
  surfels->GetPointData()->GetArray("SurfelAreaVector")->SetComponent(40, 1, infinite);
  Scene scene(80, 80);
  scene.Renderer->AddActor(SurfelActor(surfels));
  scene.See(FrontCamera(6.0));
  scene.Render();
  vtkSurfelSplatter* splatter = scene.Pass->GetSplatter();
  CHECK_NEAR(splatter->GetNumberOfSurfels(), 4000, 0);
  CHECK_NEAR(splatter->GetNumberOfInvalidSurfels(), 4, 0);
  for (float value : Values(scene.Float(), "Color"))
  {
    if (!(value >= 0.0f && value <= 1.001f))
    {
      CHECK_NEAR(value, 0.5, 0.501); // limited coverage; float rounding
      break;
    }
  }
  CHECK(CountBrighter(scene.Float(), 0.9) > 1000);
}

TEST_CASE_FIXTURE(NoMessages, "Other types are converted")
{
  // Doubles for floats, floats for flags: the same picture.
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  Scene scene(80, 80);
  vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(6.0));
  scene.Render();
  const std::vector<float> reference = Values(scene.Float(), "Color");
  vtkSmartPointer<vtkPolyData> other = UnitSphere();
  for (const char* name : { "SurfelCovariance", "SurfelAreaVector" })
  {
    vtkNew<vtkDoubleArray> array;
    array->DeepCopy(other->GetPointData()->GetArray(name));
    other->GetPointData()->RemoveArray(name);
    other->GetPointData()->AddArray(array);
  }
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->DeepCopy(other->GetPoints());
  other->SetPoints(points);
  vtkNew<vtkDoubleArray> flags;
  flags->SetName("SurfelTwoSided");
  flags->SetNumberOfTuples(4000);
  flags->FillValue(0.0);
  other->GetPointData()->AddArray(flags);
  vtkSurfelMapper::SafeDownCast(actor->GetMapper())->SetInputData(other);
  scene.Render();
  CHECK(Values(scene.Float(), "Color") == reference);
}

TEST_CASE_FIXTURE(NoMessages, "Image renderer settings")
{
  vtkNew<vtkSurfelImageRenderer> renderer;
  renderer->Update();
  Contains(TakeMessages(), "no camera");
  renderer->SetCamera(FrontCamera(5.0));
  renderer->SetSize(0, 0);
  Contains(TakeMessages(), "0 x 0");
  renderer->SetSize(70000, 5);
  Contains(TakeMessages(), "70000 x 5");
  CHECK(renderer->GetSize()[0] == 512);
  CHECK(renderer->GetSize()[1] == 512);
  renderer->SetSize(1, 1);
  renderer->Update();
  CHECK(renderer->GetOutput()->GetNumberOfPoints() == 1);

  vtkNew<vtkActor> mesh;
  vtkNew<vtkPolyDataMapper> mapper;
  mesh->SetMapper(mapper);
  renderer->AddActor(mesh);
  Contains(TakeMessages(), "not a vtkSurfelMapper");
  renderer->AddActor(nullptr);
  renderer->AddLight(nullptr);
  renderer->RemoveActor(mesh);
  vtkNew<vtkPolyData> empty;
  renderer->AddActor(SurfelActor(empty));
  renderer->Update();
  CHECK(Values(renderer->GetOutput(), "Color") == std::vector<float>(4, 0.0f));
  vtkNew<vtkActor> without; // a mapper without input
  vtkNew<vtkSurfelMapper> noInput;
  without->SetMapper(noInput);
  renderer->AddActor(without);
  renderer->Update();
  CHECK(Values(renderer->GetOutput(), "Color") == std::vector<float>(4, 0.0f));
  // The actor's mapper is taken away after it was added.
  without->SetMapper(nullptr);
  renderer->Update();
}

TEST_CASE_FIXTURE(NoMessages, "Scalars that are NaN everywhere")
{
  for (const bool isEmpty : { true, false })
  {
    const vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
    vtkNew<vtkFloatArray> scalars;
    scalars->SetName("Nothing");
    scalars->SetNumberOfTuples(surfels->GetNumberOfPoints());
    scalars->Fill(std::nan(""));
    scalars->SetValue(7, isEmpty ? scalars->GetValue(8) : 0.5f);
    surfels->GetPointData()->SetScalars(scalars);
    Scene scene(60, 60);
    scene.Renderer->AddActor(SurfelActor(surfels));
    scene.See(FrontCamera(6.0));
    scene.Render();
    scalars->Modified();
    scene.Render();
    const std::string said = TakeMessages();
    CHECK((said.find("Nothing are NaN everywhere") != std::string::npos) == isEmpty);
    CHECK(said.find("Nothing", said.find("Nothing") + 1) == std::string::npos);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Surfels too far to be drawn")
{
  vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
  for (const double scale : { 1e15, 1e16 })
  {
    Scene scene(60, 60);
    actor->SetScale(scale);
    scene.Renderer->AddActor(actor);
    scene.See(FrontCamera(3.9 * scale));
    scene.Render();
    const bool isSeen = At(scene.Render(), 30, 30, 0) > 50;
    CHECK(isSeen == (scale == 1e15));
    const std::string said = TakeMessages();
    CHECK((said.find("a depth of more than 5e15") == std::string::npos) == isSeen);
    CHECK(said.find("depth of more", said.find("depth of more") + 1) == std::string::npos);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Clipping planes of a mapper")
{
  Scene scene(60, 60);
  vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(5.0));
  scene.Render();
  CHECK(TakeMessages().empty());
  vtkNew<vtkPlane> plane;
  actor->GetMapper()->AddClippingPlane(plane);
  scene.Render();
  Contains(TakeMessages(), "vtkClipPolyData");
  plane->SetOrigin(0.1, 0, 0);
  scene.Render();
  CHECK(TakeMessages().empty()); // once
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) // which need the address space
TEST_CASE_FIXTURE(NoMessages, "Out of memory")
{
  rlimit before;
  getrlimit(RLIMIT_AS, &before);
  rlimit limit = before;
  limit.rlim_cur = rlim_t(16) << 30;
  vtkNew<vtkSurfelImageRenderer> renderer;
  renderer->AddActor(SurfelActor(UnitSphere()));
  renderer->SetCamera(FrontCamera(5.0));
  renderer->SetSize(65536, 65536); // 68 GB
  setrlimit(RLIMIT_AS, &limit);
  renderer->Update();
  setrlimit(RLIMIT_AS, &before);
  Contains(TakeMessages(), "There is not enough memory");
  renderer->SetSize(20, 20);
  renderer->Update();
  CHECK(CountBrighter(renderer->GetOutput(), 0.5) > 20);
}
#endif

TEST_CASE_FIXTURE(NoMessages, "Degenerate cameras")
{
  // A disk below zero or far too large, a focus behind the camera, an angle next to nothing: finite
  // pictures, no crash.
  const std::function<void(vtkCamera*)> changes[] = {
    [](vtkCamera* camera) { camera->SetFocalDisk(-1.0); },
    [](vtkCamera* camera) { camera->SetFocalDisk(1e9); },
    [](vtkCamera* camera) {
      camera->SetFocalDisk(1.0);
      camera->SetFocalDistance(1e-12);
    },
    [](vtkCamera* camera) { camera->SetViewAngle(1e-5); },
    [](vtkCamera* camera) { camera->SetViewAngle(179.9); },
    [](vtkCamera* camera) { camera->SetPosition(0, 0, 0.99); },
  };
  for (const auto& change : changes)
  {
    vtkNew<vtkSurfelImageRenderer> renderer;
    renderer->SetSize(40, 40);
    renderer->AddActor(SurfelActor(UnitSphere()));
    vtkSmartPointer<vtkCamera> camera = FrontCamera(5.0);
    change(camera);
    renderer->SetCamera(camera);
    renderer->Update();
    for (float value : Values(renderer->GetOutput(), "Color"))
    {
      if (!(value >= 0.0f && value < 1.001f))
      {
        CHECK_NEAR(value, 0.5, 0.501); // limited coverage; float rounding
        break;
      }
    }
    TakeMessages(); // VTK itself may speak about the camera
  }
}

TEST_SUITE_END();

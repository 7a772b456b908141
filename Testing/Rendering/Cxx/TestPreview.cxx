// SPDX-License-Identifier: BSD-3-Clause
/**
 * The mapper in a renderer without the pass: dots, bounds, local origin.
 */
#include "RenderingTest.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkActorCollection.h>
#include <vtkCamera.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkHardwareSelector.h>
#include <vtkIdTypeArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationIntegerKey.h>
#include <vtkMath.h>
#include <vtkPlane.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSelection.h>
#include <vtkSelectionNode.h>
#include <vtkSphereSource.h>
#include <vtkWeakPointer.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Preview");

namespace
{
void SetOrigin(vtkPolyData* data, double x, double y, double z)
{
  vtkNew<vtkDoubleArray> origin;
  origin->SetName("SurfelOrigin");
  origin->SetNumberOfComponents(3);
  origin->InsertNextTuple3(x, y, z);
  data->GetFieldData()->AddArray(origin);
}

/// Points in double precision that are moved.
void Move(vtkPolyData* data, const double by[3])
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    const double* p = data->GetPoint(i);
    points->InsertNextPoint(p[0] + by[0], p[1] + by[1], p[2] + by[2]);
  }
  data->SetPoints(points);
}

vtkSmartPointer<vtkActor> MeshSphere()
{
  vtkNew<vtkSphereSource> source;
  source->SetRadius(1.0);
  source->SetThetaResolution(100);
  source->SetPhiResolution(100);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(source->GetOutputPort());
  vtkSmartPointer<vtkActor> actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->LightingOff();
  return actor;
}

/// Pixels of the mesh that the dots leave open, and pixels of dots outside of the mesh grown by
/// some pixels.
struct Silhouette
{
  int Open = 0, Outside = 0, Covered = 0;

  Silhouette(vtkImageData* dots, vtkImageData* mesh, int margin)
  {
    const int* size = dots->GetDimensions();
    for (int y = margin; y < size[1] - margin; ++y)
    {
      for (int x = margin; x < size[0] - margin; ++x)
      {
        bool near = false;
        for (int j = -margin; j <= margin; ++j)
        {
          for (int i = -margin; i <= margin; ++i)
          {
            near = near || At(mesh, x + i, y + j, 0) > 127;
          }
        }
        const bool dot = At(dots, x, y, 0) > 127;
        this->Covered += dot;
        this->Open += !dot && At(mesh, x, y, 0) > 127;
        this->Outside += dot && !near;
      }
    }
  }
};
}

TEST_CASE_FIXTURE(OnlyOfDots, "Dots cover the silhouette")
{
  // Also under an actor's matrix. Dots are 0.8 of the spacing (0.056): up to 2 px outside.
  const double scales[][3] = { { 1, 1, 1 }, { 3, 3, 3 }, { -1, 1, 1 }, { 1.3, 1.0, 0.8 } };
  for (const auto& scale : scales)
  {
    Scene scene(120, 120, 0, false);
    vtkSmartPointer<vtkActor> dots = SurfelActor(UnitSphere());
    vtkSmartPointer<vtkActor> mesh = MeshSphere();
    for (vtkActor* actor : { dots.Get(), mesh.Get() })
    {
      actor->SetScale(scale[0], scale[1], scale[2]);
      actor->SetPosition(0.1, 0, 0);
      scene.Renderer->AddActor(actor);
    }
    scene.See(FrontCamera(6.0 * std::abs(scale[0])));
    mesh->VisibilityOff();
    vtkSmartPointer<vtkImageData> ofDots = scene.Render();
    mesh->VisibilityOn();
    dots->VisibilityOff();
    vtkSmartPointer<vtkImageData> ofMesh = scene.Render();
    const Silhouette silhouette(ofDots, ofMesh, 4);
    CHECK(silhouette.Covered > 1000);
    CHECK_NEAR(silhouette.Open, 0, 0.0);
    CHECK_NEAR(silhouette.Outside, 0, 0.0);
  }
}

TEST_CASE_FIXTURE(OnlyOfDots, "Colors and changes")
{
  Scene scene(80, 80, 0, false);
  vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
  actor->GetProperty()->SetColor(1, 0, 0);
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(6.0));
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  CHECK(At(picture, 40, 40, 0) > 250);
  CHECK(At(picture, 40, 40, 1) < 5);
  actor->GetProperty()->SetColor(0, 1, 0);
  picture = scene.Render();
  CHECK(At(picture, 40, 40, 1) > 250);
  CHECK(At(picture, 40, 40, 0) < 5);

  SurfelBuilder builder;
  builder.AddSphere({ 0, 0, 0 }, 1.0, 4000);
  builder.Color([](const Vector& p) {
    return std::array<int, 4>{ 0, p[1] > 0 ? 0 : 255, 255, 255 };
  });
  vtkSurfelMapper* mapper = vtkSurfelMapper::SafeDownCast(actor->GetMapper());
  mapper->SetInputData(builder.Data);
  picture = scene.Render();
  CHECK(At(picture, 40, 50, 2) > 250);
  CHECK(At(picture, 40, 50, 1) < 5);
  CHECK(At(picture, 40, 30, 2) > 250);
  CHECK(At(picture, 40, 30, 1) > 250);
  mapper->ScalarVisibilityOff();
  picture = scene.Render();
  CHECK(At(picture, 40, 50, 1) > 250);
  CHECK(At(picture, 40, 50, 2) < 5);

  // Points that move in place, and a clipping plane.
  builder.Data->GetPoints()->GetData()->FillComponent(0, 1.2);
  builder.Data->GetPoints()->Modified();
  builder.Data->Modified();
  picture = scene.Render();
  CHECK(At(picture, 30, 40, 1) < 5);
  CHECK(At(picture, 70, 40, 1) > 250);
  vtkNew<vtkPlane> plane;
  plane->SetNormal(0, 1, 0);
  mapper->AddClippingPlane(plane);
  picture = scene.Render();
  CHECK(At(picture, 70, 50, 1) > 250);
  CHECK(At(picture, 70, 30, 1) < 5);
}

TEST_CASE_FIXTURE(NoMessages, "Selection names points by an array")
{
  // As where surfels were made of other points: selection gives those points' ids.
  Scene scene(120, 120);
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  const vtkIdType count = surfels->GetNumberOfPoints();
  constexpr vtkIdType first = vtkIdType{ 3 } << 24; // more than one pass of a selection holds
  vtkNew<vtkIdTypeArray> ids;
  ids->SetName("from");
  for (vtkIdType i = 0; i < count; ++i)
  {
    ids->InsertNextValue(first + count - i);
  }
  surfels->GetPointData()->AddArray(ids);
  vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(6.0));
  const auto select = [&](const char* name) {
    vtkSurfelMapper::SafeDownCast(actor->GetMapper())->SetPointIdArrayName(name);
    scene.Render();
    vtkNew<vtkHardwareSelector> selector;
    selector->SetRenderer(scene.Renderer);
    selector->SetArea(50, 55, 70, 65);
    selector->SetFieldAssociation(vtkDataObject::FIELD_ASSOCIATION_POINTS);
    vtkSmartPointer<vtkSelection> selection;
    selection.TakeReference(selector->Select());
    std::vector<vtkIdType> found;
    if (selection->GetNumberOfNodes() == 1)
    {
      auto* list = vtkIdTypeArray::SafeDownCast(selection->GetNode(0)->GetSelectionList());
      found.assign(list->GetPointer(0), list->GetPointer(0) + list->GetNumberOfTuples());
    }
    return found;
  };
  std::vector<vtkIdType> expected = select(nullptr);
  CHECK(expected.size() > 20);
  for (vtkIdType& id : expected)
  {
    id = (first + count - id) & 0xffffff; // a small cloud has but the pass of the low bits
  }
  std::sort(expected.begin(), expected.end());
  std::vector<vtkIdType> found = select("from");
  for (vtkIdType& id : found)
  {
    id &= 0xffffff;
  }
  std::sort(found.begin(), found.end());
  CHECK(found == expected);
}

TEST_CASE_FIXTURE(NoMessages, "Selection names the blocks of points by an array")
{
  Scene scene(120, 120);
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  vtkNew<vtkDoubleArray> heights, blocks;
  heights->SetName("height");
  blocks->SetName("block");
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    heights->InsertNextValue(surfels->GetPoint(i)[1]);
    blocks->InsertNextValue(surfels->GetPoint(i)[1] > 0.0 ? 7 : 300);
  }
  surfels->GetPointData()->SetScalars(heights);
  surfels->GetPointData()->AddArray(blocks);
  vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
  auto* mapper = vtkSurfelMapper::SafeDownCast(actor->GetMapper());
  mapper->SetCompositeIdArrayName("block");
  mapper->InterpolateScalarsBeforeMappingOn(); // as ParaView's; dots must not want a texture
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(6.0));
  scene.Render();
  vtkNew<vtkHardwareSelector> selector;
  selector->SetRenderer(scene.Renderer);
  selector->SetArea(50, 45, 70, 75);
  selector->SetFieldAssociation(vtkDataObject::FIELD_ASSOCIATION_POINTS);
  vtkSmartPointer<vtkSelection> selection;
  selection.TakeReference(selector->Select());
  REQUIRE(selection->GetNumberOfNodes() == 2);
  for (unsigned int n = 0; n < 2; ++n)
  {
    vtkSelectionNode* node = selection->GetNode(n);
    auto* ids = vtkIdTypeArray::SafeDownCast(node->GetSelectionList());
    CHECK(ids->GetNumberOfTuples() > 20);
    const int block = node->GetProperties()->Get(vtkSelectionNode::COMPOSITE_INDEX());
    for (vtkIdType i = 0; i < ids->GetNumberOfTuples(); ++i)
    {
      CHECK(block == static_cast<int>(blocks->GetValue(ids->GetValue(i))));
    }
  }
}

TEST_CASE_FIXTURE(OnlyOfDots, "Nothing keeps the points of dots that are gone")
{
  // The window, the actor in it, or the mapper goes first.
  for (const int first : { 0, 1, 2 })
  {
    vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
    vtkPolyData* surfels = vtkPolyData::SafeDownCast(actor->GetMapper()->GetInput());
    vtkWeakPointer<vtkDataArray> points = surfels->GetPoints()->GetData();
    {
      Scene scene(70, 70, 0, false);
      scene.Renderer->AddActor(actor);
      scene.See(FrontCamera(6.0));
      CHECK(CountBrighter(scene.Render(), 200) > 500);
      if (first == 1)
      {
        scene.Renderer->RemoveActor(actor);
      }
      CHECK(points);
      if (first == 2)
      {
        actor->SetMapper(nullptr);
        CHECK_FALSE(points);
      }
    }
    actor = nullptr;
    CHECK_FALSE(points);
  }
}

TEST_CASE_FIXTURE(OnlyOfDots, "Actor in several windows")
{
  // The dots' OpenGL objects belong to a window; the actor is in two, loses its mapper, outlives
  // one of them.
  vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
  Scene second(70, 70, 0, false);
  second.Renderer->AddActor(MeshSphere());
  second.See(FrontCamera(6.0));
  vtkSmartPointer<vtkImageData> meshOnly = second.Render();
  vtkSmartPointer<vtkImageData> reference;
  {
    Scene first(70, 70, 0, false);
    first.Renderer->AddActor(actor);
    first.See(FrontCamera(6.0));
    reference = first.Render();
    second.Renderer->AddActor(actor);
    second.Renderer->GetActors()->GetLastActor()->SetPosition(0, 0, 0);
    for (int i = 0; i < 2; ++i)
    {
      CHECK_NEAR(Compare(first.Render(), reference).Max, 0.0, 0.0);
      CHECK(CountBrighter(second.Render(), 200) > 500);
    }
    first.Render();
    vtkSmartPointer<vtkActor> other = SurfelActor(UnitSphere());
    actor->SetMapper(other->GetMapper()); // the old mapper goes while the second window is current
    second.Render();
  }
  CHECK(CountBrighter(second.Render(), 200) > 500);
  second.Renderer->RemoveActor(actor);
  actor = nullptr;
  CHECK_NEAR(Compare(second.Render(), meshOnly).Max, 0.0, 0.0);
}

TEST_CASE_FIXTURE(OnlyOfDots, "Dots of points at UTM")
{
  // Dots of points in double precision are where those of the same points near the origin are,
  // also when others take their place.
  const double utm[3] = { 431000.0, 5412000.0, 250.0 }, back[3] = { -431000.0, -5412000.0, -250.0 };
  Scene scene(100, 100, 0, false);
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  scene.Renderer->AddActor(SurfelActor(surfels));
  scene.See(camera);
  const vtkSmartPointer<vtkImageData> near = scene.Render();
  CHECK(CountBrighter(near, 200) > 1000);
  Move(surfels, utm);
  camera->SetPosition(utm[0], utm[1], utm[2] + 6.0);
  camera->SetFocalPoint(utm);
  CHECK_NEAR(Compare(near, scene.Render()).Mean, 0.0, 0.5);
  // A point without a place takes no other one away.
  surfels->GetPoints()->SetPoint(0, std::numeric_limits<double>::infinity(), utm[1], utm[2]);
  surfels->Modified();
  CHECK_NEAR(Compare(near, scene.Render()).Mean, 0.0, 0.5);
  surfels->GetPoints()->SetPoint(0, utm[0], utm[1], utm[2] + 1.0);
  Move(surfels, back);
  camera->SetPosition(0.0, 0.0, 6.0);
  camera->SetFocalPoint(0.0, 0.0, 0.0);
  CHECK_NEAR(Compare(near, scene.Render()).Mean, 0.0, 0.5);
}

TEST_CASE_FIXTURE(OnlyOfDots, "Local origin at UTM")
{
  // A sphere of 1 m at UTM coordinates is the sphere at the origin, seen from there: dots, splats
  // and bounds.
  const double utm[3] = { 431000.0, 5412000.0, 250.0 };
  for (bool withPass : { false, true })
  {
    vtkSmartPointer<vtkImageData> pictures[2];
    for (bool far : { false, true })
    {
      Scene scene(100, 100, 0, withPass);
      vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
      vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
      camera->Azimuth(30);
      camera->SetFocalDisk(0.2);
      camera->SetFocalDistance(5.0);
      if (far)
      {
        SetOrigin(surfels, utm[0], utm[1], utm[2]);
        double p[3];
        camera->GetPosition(p);
        camera->SetPosition(p[0] + utm[0], p[1] + utm[1], p[2] + utm[2]);
        camera->SetFocalPoint(utm);
      }
      vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
      scene.Renderer->AddActor(actor);
      scene.See(camera);
      pictures[far] = scene.Render();
      if (far)
      {
        const double* bounds = actor->GetBounds();
        for (int i = 0; i < 3; ++i)
        {
          // Widened by the kernel's deviation: half a spacing of sqrt(4 pi / 4000), times sqrt 2.
          CHECK_NEAR(bounds[2 * i], utm[i] - 1.0, 0.045);
          CHECK_NEAR(bounds[2 * i + 1], utm[i] + 1.0, 0.045);
        }
        scene.Renderer->ResetCamera();
        CHECK_NEAR(
          std::sqrt(vtkMath::Distance2BetweenPoints(camera->GetFocalPoint(), utm)), 0.0, 0.05);
        CHECK(CountBrighter(scene.Render(), 200) > 2000);
      }
    }
    // Camera positions in double keep 1e-9 m there; a splat's centre moves by 1e-7 px. Dots go
    // through a float matrix about the camera: a dot's edge may take another pixel.
    const Difference difference = Compare(pictures[0], pictures[1]);
    CHECK(CountBrighter(pictures[0], 200) > 1000);
    CHECK_NEAR(difference.Max, 0.0, withPass ? 1.0 : 255.0);
    CHECK_NEAR(difference.Mean, 0.0, withPass ? 0.01 : 0.5);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Bounds follow the input")
{
  vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
  vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
  CHECK_NEAR(actor->GetBounds()[1], 1.02, 0.03);
  SetOrigin(surfels, 100, 0, 0);
  surfels->Modified();
  CHECK_NEAR(actor->GetBounds()[1], 101.02, 0.03);
  surfels->GetPoints()->SetPoint(0, 0, 0, 50);
  surfels->GetPoints()->Modified();
  CHECK_NEAR(actor->GetBounds()[5], 50.02, 0.03);
  vtkNew<vtkPolyData> empty;
  vtkSurfelMapper::SafeDownCast(actor->GetMapper())->SetInputData(empty);
  CHECK((!actor->GetBounds() || !vtkMath::AreBoundsInitialized(actor->GetBounds())));
}

TEST_CASE_FIXTURE(NoMessages, "Bounds leave out invalid surfels")
{
  // One NaN or infinite point (organised scans have them) must not spoil ResetCamera.
  for (double bad :
    { std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity() })
  {
    vtkSmartPointer<vtkPolyData> surfels = UnitSphere();
    surfels->GetPoints()->SetPoint(7, bad, 0, 0);
    surfels->GetPoints()->SetPoint(8, 0, -bad, bad);
    surfels->GetPoints()->Modified();
    vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
    const double* bounds = actor->GetBounds();
    for (int i = 0; i < 3; ++i)
    {
      CHECK_NEAR(bounds[2 * i], -1.02, 0.05);
      CHECK_NEAR(bounds[2 * i + 1], 1.02, 0.05);
    }
  }
}

TEST_CASE_FIXTURE(NoMessages, "Copies of a mapper")
{
  vtkNew<vtkSurfelMapper> mapper, copy;
  mapper->SetInputData(UnitSphere());
  mapper->ShowBacksOn();
  mapper->SetPointIdArrayName("Id");
  mapper->SetCompositeIdArrayName("Block");
  copy->ShallowCopy(mapper);
  CHECK(copy->GetInput() == mapper->GetInput());
  CHECK(copy->GetShowBacks());
  CHECK(copy->GetPointIdArrayName() == std::string("Id"));
  CHECK(copy->GetCompositeIdArrayName() == std::string("Block"));
}

TEST_CASE_FIXTURE(NoMessages, "Nothing is drawn of nothing")
{
  Scene scene(40, 40, 0, false);
  vtkNew<vtkPolyData> empty;
  scene.Renderer->AddActor(SurfelActor(empty));
  scene.See(FrontCamera(6.0));
  CHECK_NEAR(CountBrighter(scene.Render(), 0), 0, 0.0);
  vtkNew<vtkActor> without;
  vtkNew<vtkSurfelMapper> mapper;
  without->SetMapper(mapper);
  scene.Renderer->AddActor(without);
  CHECK_NEAR(CountBrighter(scene.Render(), 0), 0, 0.0);
}

TEST_SUITE_END();

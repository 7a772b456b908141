// SPDX-License-Identifier: BSD-3-Clause
/**
 * The pass in other sequences of passes, in several windows, and what it leaves of OpenGL's state.
 */
#include "RenderingTest.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCameraPass.h>
#include <vtkGaussianBlurPass.h>
#include <vtkHardwareSelector.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkLightsPass.h>
#include <vtkOpaquePass.h>
#include <vtkOpenGLFXAAPass.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProp3D.h>
#include <vtkPropPicker.h>
#include <vtkProperty.h>
#include <vtkRenderPassCollection.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSSAAPass.h>
#include <vtkSelection.h>
#include <vtkSelectionNode.h>
#include <vtkSequencePass.h>
#include <vtkToneMappingPass.h>

#include <cmath>
#include <memory>
#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Compose");

namespace
{
vtkSmartPointer<vtkActor> BlueQuad()
{
  return QuadActor({ -1.4, -1.2, 0.2 }, { 2.8, 0, 0 }, { 0, 1.1, 0.3 }, { 0, 0, 1 });
}

vtkSmartPointer<vtkCamera> LensCamera()
{
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  camera->SetFocalDisk(0.4);
  camera->SetFocalDistance(5.2);
  return camera;
}

void Fill(Scene& scene)
{
  scene.Renderer->SetBackground(0.2, 0.4, 0.2);
  scene.Renderer->AddActor(SurfelActor(UnitSphere()));
  scene.Renderer->AddActor(BlueQuad());
  scene.See(LensCamera());
}

/// OpenGL objects belong to a context; a pass that moves between windows must not carry them along.
/// The second window has made other objects before, so that names do not agree by chance.
void CheckTwoWindows(int lensCells)
{
  vtkSmartPointer<vtkImageData> reference;
  {
    Scene scene(90, 70);
    Fill(scene);
    scene.Pass->GetSplatter()->SetLensCells(lensCells);
    reference = scene.Render();
  }
  auto first = std::make_unique<Scene>(90, 70);
  Scene second(90, 70, 0, false);
  Fill(*first);
  Fill(second);
  second.Renderer->GetActors()->GetLastActor()->GetProperty()->SetOpacity(0.5);
  second.Renderer->UseDepthPeelingOn();
  second.Render();
  second.Renderer->GetActors()->GetLastActor()->GetProperty()->SetOpacity(1.0);
  second.Renderer->UseDepthPeelingOff();
  second.Renderer->SetPass(first->Pass);
  first->Pass->GetSplatter()->SetLensCells(lensCells);
  for (int i = 0; i < 3; ++i)
  {
    CHECK_NEAR(Compare(first->Render(), reference).Max, 0.0, 0.0);
    CHECK_NEAR(Compare(second.Render(), reference).Max, 0.0, 0.0);
  }
  first = nullptr;
  CHECK_NEAR(Compare(second.Render(), reference).Max, 0.0, 0.0);
}
}

TEST_CASE_FIXTURE(NoMessages, "Delegate inside own steps")
{
  Scene alone(90, 70);
  Fill(alone);
  vtkSmartPointer<vtkImageData> reference = alone.Render();

  Scene scene(90, 70);
  Fill(scene);
  vtkNew<vtkRenderStepsPass> steps;
  vtkNew<vtkOpaquePass> opaque;
  scene.Pass->SetDelegatePass(opaque);
  steps->SetOpaquePass(scene.Pass);
  scene.Renderer->SetPass(steps);
  CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
  CHECK(scene.Pass->GetDelegatePass() == opaque);

  // A sequence of one's own: lights, then the surfels' step.
  vtkNew<vtkRenderPassCollection> passes;
  vtkNew<vtkLightsPass> lights;
  passes->AddItem(lights);
  passes->AddItem(scene.Pass);
  vtkNew<vtkSequencePass> sequence;
  sequence->SetPasses(passes);
  vtkNew<vtkCameraPass> camera;
  camera->SetDelegatePass(sequence);
  scene.Renderer->SetPass(camera);
  CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
}

TEST_CASE_FIXTURE(NoMessages, "Post processing")
{
  Scene scene(90, 70);
  Fill(scene);
  vtkSmartPointer<vtkImageData> reference = scene.Render();

  // FXAA changes edges only; the middle of the sphere and of the quad stay.
  vtkNew<vtkOpenGLFXAAPass> fxaa;
  fxaa->SetDelegatePass(scene.Pass);
  scene.Renderer->SetPass(fxaa);
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  CHECK_NEAR(Compare(Crop(picture, 42, 42, 6, 6), Crop(reference, 42, 42, 6, 6)).Max, 0.0, 1.0);
  CHECK_NEAR(Compare(Crop(picture, 42, 18, 6, 6), Crop(reference, 42, 18, 6, 6)).Max, 0.0, 1.0);
  CHECK(Compare(picture, reference).Mean < 1.5);

  // Supersampling: the pass sees a framebuffer of a multiple of the size; averaged, the same
  // picture but for the prefilter, which is as wide as a pixel of the larger frame, and the mesh's
  // smoother edges.
  vtkNew<vtkSSAAPass> ssaa;
  ssaa->SetDelegatePass(scene.Pass);
  scene.Renderer->SetPass(ssaa);
  picture = scene.Render();
  CHECK(scene.Float()->GetDimensions()[0] > 2 * 90);
  // In the larger frame, more pixels of the mesh are blurred enough to go through the lens.
  CHECK_NEAR(Compare(picture, reference).Mean, 0.0, 3.5);
  CHECK_NEAR(
    Compare(Crop(picture, 42, 42, 6, 6), Crop(reference, 42, 42, 6, 6)).Max, 0.0, 0.03 * 255);

  // The blur pass enlarges its framebuffer and the camera's angle: surfels must still lie on the
  // mesh of their place.
  vtkNew<vtkGaussianBlurPass> blur;
  blur->SetDelegatePass(scene.Pass);
  scene.Renderer->SetPass(blur);
  scene.Renderer->RemoveAllViewProps();
  scene.Renderer->SetBackground(0, 0, 0);
  SurfelBuilder builder;
  builder.AddGrid({ 0.6, -1.2, 0 }, { 0.02, 0, 0 }, { 0, 0.02, 0 }, 60, 60);
  vtkSmartPointer<vtkActor> surfels = SurfelActor(builder.Data);
  scene.Renderer->AddActor(surfels);
  scene.Renderer->GetActiveCamera()->SetFocalDisk(0.0);
  scene.See(scene.Renderer->GetActiveCamera());
  vtkSmartPointer<vtkImageData> splats = scene.Render();
  scene.Renderer->RemoveActor(surfels);
  scene.Renderer->AddActor(QuadActor({ 0.6, -1.2, 0 }, { 1.2, 0, 0 }, { 0, 1.2, 0 }, { 1, 1, 1 }));
  vtkSmartPointer<vtkImageData> polygons = scene.Render();
  // The prefilter (1 px) softens the edges a little more than the blur pass does the mesh's: up to
  // a fifth of white; a shift of one pixel would be more than a quarter on this edge, and one of
  // the border's two pixels twice that.
  CHECK_NEAR(Compare(splats, polygons).Max, 0.0, 0.2 * 255);
}

TEST_CASE_FIXTURE(NoMessages, "Release and render again")
{
  Scene scene(90, 70, 4);
  Fill(scene);
  vtkSmartPointer<vtkImageData> reference = scene.Render();
  scene.Pass->ReleaseGraphicsResources(scene.Window);
  CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
  scene.Renderer->ReleaseGraphicsResources(scene.Window);
  CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
  scene.Window->Finalize();
  CHECK_NEAR(Compare(scene.Render(), reference).Max, 0.0, 0.0);
}

TEST_CASE_FIXTURE(OnlyOfDots, "One pass in two windows")
{
  CheckTwoWindows(1);
}

TEST_CASE_FIXTURE(OnlyOfDots, "One pass in two windows, cells of the lens")
{
  CheckTwoWindows(7);
}

TEST_CASE_FIXTURE(OnlyOfDots, "Life times")
{
  // The pass outlives its renderer and window, and the other way round, in the middle of an event
  // too.
  vtkSmartPointer<vtkSurfelSplattingPass> pass;
  vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
  {
    Scene scene(60, 60);
    scene.Renderer->AddActor(actor);
    scene.See(FrontCamera(5.0));
    scene.Render();
    pass = scene.Pass;
    scene.Renderer->SetPass(nullptr); // nobody releases the pass's resources now
  }
  pass = nullptr;
  Scene scene(60, 60, 0, false);
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(5.0));
  CHECK(CountBrighter(scene.Render(), 200) > 500); // dots: no mark is left on the mapper
  CHECK(!vtkSurfelMapper::SafeDownCast(actor->GetMapper())->GetSplatted());
  scene.Renderer->SetPass(vtkSmartPointer<vtkSurfelSplattingPass>::New());
  CHECK(CountBrighter(scene.Render(), 200) > 500);
  CHECK(!vtkSurfelMapper::SafeDownCast(actor->GetMapper())->GetSplatted());
  scene.Renderer->SetPass(nullptr);
  CHECK(CountBrighter(scene.Render(), 200) > 500);
}

TEST_CASE_FIXTURE(NoMessages, "Second render is the same")
{
  Scene scene(90, 70, 8);
  Fill(scene);
  vtkSmartPointer<vtkImageData> first = scene.Render();
  for (int i = 0; i < 3; ++i)
  {
    CHECK_NEAR(Compare(scene.Render(), first).Max, 0.0, 0.0);
  }
  // Nor does the pass disturb a renderer that comes after it without surfels.
  CHECK(scene.Renderer->VisibleActorCount() == 2);
}

TEST_CASE_FIXTURE(NoMessages, "Number of rendered props")
{
  Scene scene(60, 60);
  Fill(scene);
  scene.Render();
  CHECK_NEAR(scene.Pass->GetNumberOfRenderedProps(), 2, 0.0);
}

TEST_CASE_FIXTURE(OnlyOfDots, "Hardware selection")
{
  for (bool withPass : { false, true, false })
  {
    Scene scene(100, 100, 0, withPass);
    vtkSmartPointer<vtkActor> sphere = SurfelActor(UnitSphere());
    vtkSmartPointer<vtkActor> quad =
      QuadActor({ -1.4, -1.4, 1.2 }, { 2.8, 0, 0 }, { 0, 1.2, 0 }, { 0, 0, 1 });
    scene.Renderer->AddActor(quad);
    scene.Renderer->AddActor(sphere);
    scene.See(LensCamera());
    vtkSmartPointer<vtkImageData> before = scene.Render();

    vtkNew<vtkPropPicker> picker;
    picker->Pick(50, 60, 0, scene.Renderer);
    CHECK(picker->GetActor() == sphere);
    picker->Pick(50, 25, 0, scene.Renderer);
    CHECK(picker->GetActor() == quad);
    picker->Pick(2, 97, 0, scene.Renderer);
    CHECK(picker->GetActor() == nullptr);

    vtkNew<vtkHardwareSelector> selector;
    selector->SetRenderer(scene.Renderer);
    selector->SetArea(48, 58, 52, 62);
    selector->SetFieldAssociation(vtkDataObject::FIELD_ASSOCIATION_POINTS);
    vtkSmartPointer<vtkSelection> selection;
    selection.TakeReference(selector->Select());
    REQUIRE(selection);
    CHECK(selection->GetNumberOfNodes() == 1);
    if (selection && selection->GetNumberOfNodes() == 1)
    {
      vtkSelectionNode* node = selection->GetNode(0);
      CHECK(node->GetProperties()->Get(vtkSelectionNode::PROP()) == sphere);
      vtkDataArray* ids = vtkDataArray::SafeDownCast(node->GetSelectionList());
      REQUIRE(ids);
      CHECK(ids->GetNumberOfTuples() > 0);
      vtkPolyData* surfels = vtkSurfelMapper::SafeDownCast(sphere->GetMapper())->GetInput();
      for (vtkIdType i = 0; ids && i < ids->GetNumberOfTuples(); ++i)
      {
        double p[3];
        surfels->GetPoint(static_cast<vtkIdType>(ids->GetTuple1(i)), p);
        // 31 px per unit at the sphere's front: the area is at (0, 0.28) on its near side; a dot is
        // 0.05 wide.
        CHECK_NEAR(std::hypot(p[0], p[1] - 0.27), 0.0, 0.2);
        CHECK(p[2] > 0.0);
      }
    }
    CHECK_NEAR(Compare(scene.Render(), before).Max, 0.0, 0.0);
  }
}

TEST_SUITE_END();

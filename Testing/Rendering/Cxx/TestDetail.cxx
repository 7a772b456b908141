// SPDX-License-Identifier: BSD-3-Clause
/**
 * Hierarchies through mapper, pass and windowless renderer: what is drawn, kept and counted.
 */
#include "RenderingTest.h"

#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkLookupTable.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSurfelHierarchy.h>
#include <vtkSurfelHierarchyReader.h>
#include <vtkSurfelHierarchyWriter.h>
#include <vtkUnsignedCharArray.h>

#include <cmath>
#include <cstdio>
#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Detail");

namespace
{
vtkSmartPointer<vtkPolyData> HierarchyOf(vtkPolyData* surfels)
{
  vtkNew<vtkSurfelHierarchy> hierarchy;
  hierarchy->SetInputData(surfels);
  hierarchy->Update();
  return hierarchy->GetOutput();
}

/// Fine stripes, red and green.
vtkSmartPointer<vtkPolyData> StripedSphere(int count = 40000)
{
  SurfelBuilder builder;
  builder.AddSphere({ 0, 0, 0 }, 1.0, count);
  builder.Color([](const Vector& p) {
    const bool red = std::sin(60.0 * p[1]) > 0.0;
    return std::array<int, 4>{ red ? 255 : 0, red ? 0 : 255, 0, 255 };
  });
  return builder.Data;
}

vtkSmartPointer<vtkCamera> LensCamera(double disk)
{
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  camera->SetFocalDisk(disk);
  camera->SetFocalDistance(3.0);
  return camera;
}

vtkSmartPointer<vtkImageData> Picture(
  vtkSurfelImageRenderer* renderer, vtkPolyData* data, vtkCamera* camera)
{
  renderer->SetInputData(data);
  renderer->SetSize(160, 160);
  renderer->SetCamera(camera);
  renderer->Modified();
  renderer->Update();
  vtkNew<vtkImageData> copy;
  copy->DeepCopy(renderer->GetOutput());
  return copy;
}
}

TEST_CASE_FIXTURE(NoMessages, "Fewer splats same picture")
{
  vtkSmartPointer<vtkPolyData> surfels = StripedSphere(), hierarchy = HierarchyOf(surfels);
  for (double disk : { 0.0, 0.6 })
  {
    vtkNew<vtkSurfelImageRenderer> renderer;
    vtkSurfelSplatter* splatter = renderer->GetSplatter();
    vtkSmartPointer<vtkCamera> camera = LensCamera(disk);
    vtkSmartPointer<vtkImageData> all = Picture(renderer, surfels, camera);
    const vtkIdType splats = splatter->GetNumberOfSplats();
    CHECK(splatter->GetNumberOfVisitedNodes() == 0);
    vtkSmartPointer<vtkImageData> some = Picture(renderer, hierarchy, camera);
    CHECK(splatter->GetNumberOfSurfels() == 40000);
    CHECK(splatter->GetNumberOfSurfelsFacingAway() > 10000);
    CHECK(splatter->GetNumberOfChosenNodes() < 30000);
    CHECK((disk == 0.0 || 3 * splatter->GetNumberOfSplats() < splats));
    CHECK(Compare(all, some).Mean < 2e-3); // a fraction of a grey level
    CHECK(Compare(all, some).Max < 0.06);  // at the border
    splatter->SetLODModeToOff();
    CHECK(Compare(all, Picture(renderer, hierarchy, camera)).Mean < 1e-4);
    splatter->SetLODModeToPaper();
    CHECK(Compare(all, Picture(renderer, hierarchy, camera)).Mean < 2e-2);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Table colors are averaged not scalars")
{
  // Scalars -1 and 1 by turns, white and black in the table, blue for their mean, 0.
  SurfelBuilder builder;
  builder.AddSphere({ 0, 0, 0 }, 1.0, 20000);
  vtkNew<vtkFloatArray> scalars;
  scalars->SetName("turn");
  for (int i = 0; i < 20000; ++i)
  {
    scalars->InsertNextValue(i % 2 ? 1.0f : -1.0f);
  }
  builder.Data->GetPointData()->SetScalars(scalars);
  vtkSmartPointer<vtkActor> actor = SurfelActor(HierarchyOf(builder.Data));
  vtkNew<vtkLookupTable> table;
  table->SetNumberOfTableValues(3);
  table->SetTableValue(0, 1, 1, 1);
  table->SetTableValue(1, 0, 0, 1);
  table->SetTableValue(2, 0, 0, 0);
  table->SetTableRange(-1, 1);
  actor->GetMapper()->SetLookupTable(table);
  actor->GetMapper()->SetScalarRange(-1, 1);
  vtkNew<vtkSurfelImageRenderer> renderer;
  renderer->AddActor(actor);
  renderer->SetSize(100, 100);
  renderer->SetCamera(LensCamera(1.0));
  renderer->Update();
  vtkSurfelSplatter* splatter = renderer->GetSplatter();
  CHECK(splatter->GetNumberOfSplats() < 3000);            // nodes
  CHECK(splatter->GetNumberOfPreparedSurfels() == 40000); // table and colours
  for (int c = 0; c < 3; ++c)
  {
    CHECK_NEAR(At(renderer->GetOutput(), 50, 50, c), 0.5, 0.1);
  }
  // Another table recomputes the colours, nothing else.
  table->SetTableValue(2, 1, 0, 0);
  renderer->Update();
  CHECK(splatter->GetNumberOfPreparedSurfels() == 20000);
  CHECK_NEAR(At(renderer->GetOutput(), 50, 50, 0), 1.0, 0.1);
  CHECK_NEAR(At(renderer->GetOutput(), 50, 50, 2), 0.5, 0.1);
}

/// As filters and users do behind vtkSurfelHierarchy, who know nothing of its nodes.
TEST_CASE_FIXTURE(NoMessages, "Values of surfels that change later")
{
  const vtkSmartPointer<vtkPolyData> whole = HierarchyOf(StripedSphere());
  vtkNew<vtkPolyData> changed;
  changed->ShallowCopy(whole);
  vtkNew<vtkFloatArray> opacities;
  opacities->SetName("SurfelOpacity");
  for (vtkIdType i = 0; i < whole->GetNumberOfPoints(); ++i)
  {
    opacities->InsertNextValue(whole->GetPoint(i)[0] > 0.0 ? 1.0f : 0.25f);
  }
  changed->GetPointData()->AddArray(opacities);
  vtkNew<vtkSurfelImageRenderer> renderer;
  vtkSmartPointer<vtkCamera> camera = LensCamera(0.4);
  const auto before = Picture(renderer, whole, camera);
  const vtkSmartPointer<vtkImageData> wanted = Picture(renderer, HierarchyOf(changed), camera);
  CHECK(Compare(before, wanted).Max > 0.5);
  CHECK(Compare(Picture(renderer, changed, camera), wanted).Max < 0.02);
  CHECK(renderer->GetSplatter()->GetNumberOfChosenNodes() < 20000);

  vtkNew<vtkSurfelHierarchyWriter> writer;
  vtkNew<vtkSurfelHierarchyReader> reader;
  const std::string path = "TestDetail.surfels";
  writer->SetFileName(path.c_str());
  writer->SetInputData(changed);
  CHECK(writer->Write() == 1);
  reader->SetFileName(path.c_str());
  reader->Update();
  CHECK(Compare(Picture(renderer, reader->GetOutput(), camera), wanted).Max < 0.02);
  CHECK(Compare(Picture(renderer, whole, camera), before).Max == 0.0);
  std::remove(path.c_str());

  const vtkSmartPointer<vtkPolyData> translucent = HierarchyOf(changed);
  vtkNew<vtkPolyData> opaque;
  opaque->ShallowCopy(translucent);
  opaque->GetPointData()->RemoveArray("SurfelOpacity");
  CHECK(Compare(Picture(renderer, opaque, camera), before).Max < 0.02);
  CHECK(Compare(Picture(renderer, translucent, camera), wanted).Max == 0.0);
  // As if the array were older than the hierarchy
  changed->GetFieldData()->GetAbstractArray("SurfelNodes")->Modified();
  CHECK(Compare(Picture(renderer, changed, camera), wanted).Max < 0.02);

  // Other sides need other trees.
  changed->GetPointData()->RemoveArray("SurfelOpacity");
  vtkNew<vtkUnsignedCharArray> sides;
  sides->SetName("SurfelTwoSided");
  sides->SetNumberOfTuples(whole->GetNumberOfPoints());
  sides->FillValue(1);
  changed->GetPointData()->AddArray(sides);
  const auto both = Picture(renderer, changed, camera);
  CHECK(TakeMessages().find("Put vtkSurfelHierarchy after") != std::string::npos);
  CHECK(Compare(both, Picture(renderer, HierarchyOf(changed), camera)).Mean < 0.01);
}

TEST_CASE_FIXTURE(NoMessages, "Orbit prepares nothing")
{
  vtkNew<vtkSurfelImageRenderer> renderer;
  vtkSmartPointer<vtkActor> actor = SurfelActor(HierarchyOf(StripedSphere()));
  renderer->AddActor(actor);
  renderer->SetSize(120, 120);
  vtkSmartPointer<vtkCamera> camera = LensCamera(0.4);
  renderer->SetCamera(camera);
  renderer->Update();
  vtkSurfelSplatter* splatter = renderer->GetSplatter();
  CHECK(splatter->GetNumberOfPreparedSurfels() == 80000);
  const vtkMTimeType data = actor->GetMapper()->GetInput()->GetMTime();
  for (int i = 0; i < 60; ++i)
  {
    camera->Azimuth(6.0);
    renderer->Update();
    CHECK(splatter->GetNumberOfPreparedSurfels() == 0);
    CHECK(splatter->GetNumberOfVisitedNodes() < 40000 / 16);
    CHECK(splatter->GetNumberOfChosenNodes() < 40000 / 2);
  }
  CHECK(actor->GetMapper()->GetInput()->GetMTime() == data);
  // Only the lens: the same.
  camera->SetFocalDisk(1.0);
  renderer->Update();
  CHECK(splatter->GetNumberOfPreparedSurfels() == 0);
  CHECK(splatter->GetNumberOfReusedFrames() == 0);
}

TEST_CASE_FIXTURE(NoMessages, "Unchanged frames are kept")
{
  Scene scene(80, 80);
  vtkSmartPointer<vtkActor> actor = SurfelActor(StripedSphere(5000));
  scene.Renderer->AddActor(actor);
  scene.See(LensCamera(0.2));
  vtkSurfelSplatter* splatter = scene.Pass->GetSplatter();
  vtkSmartPointer<vtkImageData> first = scene.Render();
  CHECK(splatter->GetNumberOfReusedFrames() == 0);
  CHECK_NEAR(Compare(first, scene.Render()).Max, 0.0, 0.0);
  CHECK(splatter->GetNumberOfReusedFrames() == 1);
  // Everything that changes the picture renders it again.
  vtkIdType kept = 1;
  const auto changed = [&]() {
    scene.Render();
    const bool anew = splatter->GetNumberOfReusedFrames() == kept;
    scene.Render();
    ++kept;
    return anew && splatter->GetNumberOfReusedFrames() == kept;
  };
  scene.Renderer->GetActiveCamera()->Azimuth(1.0);
  CHECK(changed());
  scene.Renderer->GetActiveCamera()->SetFocalDisk(0.3);
  CHECK(changed());
  actor->SetPosition(0.1, 0, 0);
  CHECK(changed());
  actor->GetProperty()->SetOpacity(0.7);
  CHECK(changed());
  splatter->SetKernelToGaussian();
  CHECK(changed());
  vtkPolyData* data = vtkPolyData::SafeDownCast(actor->GetMapper()->GetInput());
  data->GetPoints()->Modified();
  data->Modified();
  CHECK(changed());
  vtkSmartPointer<vtkActor> quad =
    QuadActor({ -0.5, -0.5, 1.5 }, { 0.5, 0, 0 }, { 0, 0.5, 0 }, { 0, 0, 1 });
  scene.Renderer->AddActor(quad);
  scene.Render();
  CHECK(splatter->GetNumberOfReusedFrames() == kept);
  // VTK's step for translucent props, as the surfels are now, changes a new actor after that.
  scene.Render();
  kept = splatter->GetNumberOfReusedFrames();
  scene.Render();
  CHECK(splatter->GetNumberOfReusedFrames() == ++kept);
  quad->SetPosition(0.05, 0, 0); // seen in the depth that it leaves
  CHECK(changed());
  splatter->FrameReuseOff();
  scene.Render();
  scene.Render();
  CHECK(splatter->GetNumberOfReusedFrames() == kept);
}

TEST_CASE_FIXTURE(OnlyOfDots, "Dots are leaves only")
{
  vtkSmartPointer<vtkPolyData> surfels = StripedSphere(4000);
  Scene scene(90, 90, 0, false);
  vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(6.0));
  vtkSmartPointer<vtkImageData> expected = scene.Render();
  actor->GetMapper()->SetInputDataObject(HierarchyOf(surfels));
  // Same dots; which of two at one pixel is in front depends on their order.
  CHECK(Compare(expected, scene.Render()).Mean < 1.0);
  double bounds[6];
  actor->GetBounds(bounds);
  CHECK(bounds[1] < 1.2); // not the root's kernel
}

TEST_CASE_FIXTURE(NoMessages, "Color by level")
{
  vtkNew<vtkSurfelImageRenderer> renderer;
  vtkSmartPointer<vtkPolyData> hierarchy = HierarchyOf(StripedSphere());
  renderer->GetSplatter()->ColorByLevelOn();
  vtkSmartPointer<vtkImageData> sharp = Picture(renderer, hierarchy, FrontCamera(1.4));
  vtkSmartPointer<vtkImageData> blurred = Picture(renderer, hierarchy, LensCamera(3.0));
  // Near and sharp: surfels, light grey. Blurred: coarser levels' colours.
  CHECK_NEAR(At(sharp, 80, 80, 0), At(sharp, 80, 80, 2), 0.02);
  CHECK(At(sharp, 80, 80, 0) > 0.8);
  CHECK(std::abs(At(blurred, 80, 80, 0) - At(blurred, 80, 80, 2)) > 0.1);
}

TEST_CASE_FIXTURE(NoMessages, "Update rate is held")
{
  Scene scene(300, 300);
  scene.Renderer->AddActor(SurfelActor(HierarchyOf(StripedSphere(200000))));
  scene.See(LensCamera(0.2));
  scene.Render();
  CHECK_NEAR(scene.Pass->GetCoarsening(), 1.0, 0.0);
  vtkSmartPointer<vtkImageData> still = scene.Render();
  const vtkIdType splats = scene.Pass->GetSplatter()->GetNumberOfSplats();
  vtkIdType fewest = splats;
  // Other work on the machine can make a coarser frame look slower: then the next motion, after a
  // still frame, tries again.
  for (int motion = 0; motion < 8 && scene.Pass->GetCoarsening() < 2.0; ++motion)
  {
    scene.Window->SetDesiredUpdateRate(0.0001);
    scene.Render();
    scene.Window->SetDesiredUpdateRate(2000.0); // more than any machine holds
    for (int i = 0; i < 12; ++i)
    {
      scene.Renderer->GetActiveCamera()->Azimuth(0.01);
      scene.Render();
      fewest = std::min(fewest, scene.Pass->GetSplatter()->GetNumberOfSplats());
    }
  }
  CHECK(scene.Pass->GetCoarsening() >= 2.0); // more only as long as it saves time
  CHECK(3 * fewest < splats); // a coarsening of 2 leaves about a fourth of them
  // Coarser, but of the same look.
  CHECK(Compare(still, scene.Render()).Mean < 12.0);
  scene.Window->SetDesiredUpdateRate(2.0); // what any machine holds
  for (int i = 0; i < 30; ++i)
  {
    scene.Renderer->GetActiveCamera()->Azimuth(0.01);
    scene.Render();
  }
  CHECK(scene.Pass->GetCoarsening() < 1.5);
  scene.Window->SetDesiredUpdateRate(0.0001);
  scene.Render();
  CHECK_NEAR(scene.Pass->GetCoarsening(), 1.0, 0.0);
  scene.Pass->HoldUpdateRateOff();
  scene.Window->SetDesiredUpdateRate(2000.0);
  scene.Render();
  CHECK_NEAR(scene.Pass->GetCoarsening(), 1.0, 0.0);
}

/// Cells of the lens are for still pictures, with other props and without.
TEST_CASE_FIXTURE(NoMessages, "One picture while moving")
{
  for (const bool hasProps : { false, true })
  {
    Scene scene(200, 150);
    scene.Renderer->AddActor(SurfelActor(HierarchyOf(StripedSphere(20000))));
    if (hasProps)
    {
      scene.Renderer->AddActor(
        QuadActor({ -1.2, -0.9, 1.5 }, { 1, 0, 0 }, { 0, 1, 0 }, { 1, 0, 0 }));
    }
    scene.See(LensCamera(2.0));
    vtkSurfelSplatter* splatter = scene.Pass->GetSplatter();
    vtkSmartPointer<vtkImageData> one = scene.Render();
    splatter->SetLensCells(7);
    vtkSmartPointer<vtkImageData> seven = scene.Render();
    CHECK(Compare(one, seven).Mean > 0.0);
    scene.Window->SetDesiredUpdateRate(2.0); // what any machine holds
    CHECK(Compare(one, scene.Render()).Max == 0.0);
    splatter->LensPinholesOn();
    CHECK(Compare(one, scene.Render()).Max == 0.0);
    splatter->LensPinholesOff();
    scene.Window->SetDesiredUpdateRate(0.0001);
    CHECK(Compare(seven, scene.Render()).Max == 0.0);
    scene.Window->SetDesiredUpdateRate(2.0);
    scene.Pass->HoldUpdateRateOff();
    CHECK(Compare(seven, scene.Render()).Max == 0.0);
  }
}

/// Bytes that are no nodes, as a damaged file may hold: whatever is drawn, no NaN comes out.
TEST_CASE_FIXTURE(NoMessages, "Nodes of nonsense")
{
  vtkSmartPointer<vtkPolyData> hierarchy = HierarchyOf(UnitSphere());
  for (int fill : { 0, 0x7f, 0xff, -1 })
  {
    vtkNew<vtkPolyData> broken;
    broken->DeepCopy(hierarchy);
    auto* nodes =
      vtkUnsignedCharArray::SafeDownCast(broken->GetFieldData()->GetArray("SurfelNodes"));
    for (vtkIdType i = 0; i < nodes->GetNumberOfValues(); ++i)
    {
      nodes->SetValue(i, static_cast<unsigned char>(fill < 0 ? 73 * i * i + 11 * i : fill));
    }
    vtkNew<vtkSurfelImageRenderer> renderer;
    for (const vtkSmartPointer<vtkCamera>& camera : { FrontCamera(6.0), LensCamera(2.0) })
    {
      vtkSmartPointer<vtkImageData> picture = Picture(renderer, broken, camera);
      vtkDataArray* colors = picture->GetPointData()->GetScalars();
      double sum = 0.0;
      for (vtkIdType i = 0; i < colors->GetNumberOfTuples(); ++i)
      {
        sum += colors->GetComponent(i, 0) + colors->GetComponent(i, 3);
      }
      CHECK(std::isfinite(sum));
    }
    TakeMessages();
  }
}

TEST_CASE_FIXTURE(NoMessages, "Broken hierarchies")
{
  vtkSmartPointer<vtkPolyData> hierarchy = HierarchyOf(UnitSphere());
  vtkNew<vtkSurfelImageRenderer> renderer;
  vtkNew<vtkUnsignedCharArray> narrow;
  narrow->DeepCopy(hierarchy->GetFieldData()->GetArray("SurfelNodes"));
  narrow->SetName("SurfelNodes");
  narrow->SetNumberOfComponents(24);
  for (vtkUnsignedCharArray* nodes : { static_cast<vtkUnsignedCharArray*>(nullptr), narrow.Get() })
  {
    vtkNew<vtkPolyData> broken;
    broken->DeepCopy(hierarchy);
    broken->GetFieldData()->RemoveArray("SurfelNodes");
    if (nodes)
    {
      broken->GetFieldData()->AddArray(nodes);
    }
    Picture(renderer, broken, FrontCamera(6.0));
    CHECK(TakeMessages().find("vtkSurfelHierarchy") != std::string::npos);
  }
  vtkNew<vtkPolyData> fewer;
  fewer->DeepCopy(hierarchy);
  fewer->GetPoints()->SetNumberOfPoints(100);
  for (int i = 0; i < fewer->GetPointData()->GetNumberOfArrays(); ++i)
  {
    fewer->GetPointData()->GetArray(i)->SetNumberOfTuples(100);
  }
  Picture(renderer, fewer, FrontCamera(6.0));
  CHECK(TakeMessages().find("100 points") != std::string::npos);
}

TEST_SUITE_END();

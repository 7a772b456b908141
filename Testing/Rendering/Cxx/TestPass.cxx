// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels in a window among other props.
 */
#include "RenderingTest.h"

#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkActor2D.h>
#include <vtkAppendPolyData.h>
#include <vtkAssembly.h>
#include <vtkAxesActor.h>
#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkFloatArray.h>
#include <vtkGPUVolumeRayCastMapper.h>
#include <vtkImageActor.h>
#include <vtkImageData.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTransform.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

#include <algorithm>
#include <cmath>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Pass");

namespace
{
// A picture in 8 bits: the surfels' colour and the background's share are rounded one by one.
constexpr double OneLevel = 1.0;

/// A plane of surfels that faces the camera, wider than the picture.
vtkSmartPointer<vtkPolyData> Wall(double z, double halfSize = 1.2, int count = 120)
{
  const double step = 2.0 * halfSize / count;
  SurfelBuilder builder;
  builder.AddGrid({ -halfSize, -halfSize, z }, { step, 0, 0 }, { 0, step, 0 }, count, count);
  return builder.Data;
}

/// The same surfels where a matrix puts them, by the rule of the data contract.
vtkSmartPointer<vtkPolyData> Transformed(vtkPolyData* surfels, vtkMatrix4x4* matrix)
{
  double l[3][3], inverse[3][3];
  for (int i = 0; i < 3; ++i)
  {
    for (int j = 0; j < 3; ++j)
    {
      l[i][j] = matrix->GetElement(i, j);
    }
  }
  const double determinant = std::abs(vtkMath::Determinant3x3(l));
  vtkMath::Invert3x3(l, inverse);
  vtkSmartPointer<vtkPolyData> result = vtkSmartPointer<vtkPolyData>::New();
  result->DeepCopy(surfels);
  vtkDataArray* covariance = result->GetPointData()->GetArray("SurfelCovariance");
  vtkDataArray* area = result->GetPointData()->GetArray("SurfelAreaVector");
  for (vtkIdType n = 0; n < result->GetNumberOfPoints(); ++n)
  {
    double p[4] = { 0, 0, 0, 1 }, s[6], a[3], transformedArea[3];
    result->GetPoint(n, p);
    matrix->MultiplyPoint(p, p);
    result->GetPoints()->SetPoint(n, p);
    covariance->GetTuple(n, s);
    const double full[3][3] = { { s[0], s[3], s[5] }, { s[3], s[1], s[4] }, { s[5], s[4], s[2] } };
    double left[3][3], transposed[3][3], both[3][3];
    vtkMath::Multiply3x3(l, full, left);
    vtkMath::Transpose3x3(l, transposed);
    vtkMath::Multiply3x3(left, transposed, both);
    covariance->SetTuple6(
      n, both[0][0], both[1][1], both[2][2], both[0][1], both[1][2], both[0][2]);
    area->GetTuple(n, a);
    for (int i = 0; i < 3; ++i)
    {
      transformedArea[i] =
        determinant * (inverse[0][i] * a[0] + inverse[1][i] * a[1] + inverse[2][i] * a[2]);
    }
    area->SetTuple(n, transformedArea);
  }
  return result;
}

vtkSmartPointer<vtkPolyData> ColoredSphere()
{
  SurfelBuilder builder;
  builder.AddSphere({ 0, 0, 0 }, 1.0, 3000);
  builder.Color([](const Vector& p) {
    return std::array<int, 4>{ static_cast<int>(128 + 127 * p[0]),
      static_cast<int>(128 + 127 * p[1]), std::sin(20 * p[2]) > 0 ? 255 : 40, 255 };
  });
  return builder.Data;
}
}

TEST_CASE_FIXTURE(NoMessages, "Equals image renderer")
{
  Scene scene(160, 120);
  vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
  camera->Azimuth(20);
  camera->SetFocalDisk(0.5);
  camera->SetFocalDistance(5.0);
  vtkSmartPointer<vtkActor> sphere = SurfelActor(ColoredSphere());
  sphere->GetProperty()->LightingOn();
  vtkSmartPointer<vtkActor> wall = SurfelActor(Wall(-1.5));
  wall->GetProperty()->SetColor(0.9, 0.5, 0.2);
  wall->GetProperty()->SetOpacity(0.7);
  vtkNew<vtkSurfelImageRenderer> renderer;
  for (vtkActor* actor : { sphere.Get(), wall.Get() })
  {
    scene.Renderer->AddActor(actor);
    renderer->AddActor(actor);
  }
  scene.Renderer->SetBackground(0.1, 0.3, 0.6);
  scene.See(camera);
  vtkSmartPointer<vtkImageData> window = scene.Render();

  renderer->SetCamera(camera);
  renderer->SetSize(160, 120);
  renderer->AutomaticClippingRangeOff();
  renderer->Update();
  CHECK(renderer->GetSplatter()->GetNumberOfSplats() > 5000);
  CHECK(Values(scene.Float(), "Color") == Values(renderer->GetOutput(), "Color"));
  CHECK(Values(scene.Float(), "Depth") == Values(renderer->GetOutput(), "Depth"));

  renderer->SetBackground(0.1, 0.3, 0.6);
  renderer->SetBackgroundAlpha(1.0);
  renderer->Update();
  double worst = 0.0;
  for (int y = 0; y < 120; ++y)
  {
    for (int x = 0; x < 160; ++x)
    {
      for (int c = 0; c < 3; ++c)
      {
        const double value = std::min(1.0, At(renderer->GetOutput(), x, y, c));
        worst = std::max(worst, std::abs(At(window, x, y, c) - 255.0 * value));
      }
    }
  }
  // Blending in 8 bits rounds the surfels' colour, their alpha, the background and the product of
  // the last two, half a level each.
  CHECK_NEAR(worst, 0.0, 2.0);
}

TEST_CASE_FIXTURE(NoMessages, "Mesh in front and behind")
{
  // Sharp surfels at z = 0; a green mesh left in front of them, a red one right behind.
  Scene scene(100, 100);
  scene.Renderer->AddActor(SurfelActor(Wall(0.0)));
  scene.Renderer->AddActor(QuadActor({ -1, -1, 0.5 }, { 1, 0, 0 }, { 0, 2, 0 }, { 0, 1, 0 }));
  scene.Renderer->AddActor(QuadActor({ 0, -1, -0.5 }, { 1, 0, 0 }, { 0, 2, 0 }, { 1, 0, 0 }));
  scene.See(FrontCamera(4.0));
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  const double left[3] = { 0, 255, 0 }, right[3] = { 255, 255, 255 };
  for (int y = 5; y < 95; y += 5)
  {
    for (int c = 0; c < 3; ++c)
    {
      CHECK_NEAR(At(picture, 30, y, c), left[c], 0.0);
      // The weights of a grid ripple about 1 and are limited to 1 from above: a dark ripple of 2 %
      // is left.
      CHECK_NEAR(At(picture, 70, y, c), right[c], 0.02 * 255);
    }
  }
}

TEST_CASE_FIXTURE(NoMessages, "Mesh intersects where depths cross")
{
  // The mesh leans out of the wall of surfels along x = 0: z = x. Its visible part is x > 0, up to
  // half a pixel of the mesh's own rasterisation and half a pixel of the prefilter, since a layer
  // is hidden at its mean depth.
  Scene scene(200, 100);
  scene.Renderer->AddActor(SurfelActor(Wall(0.0)));
  scene.Renderer->AddActor(
    QuadActor({ -0.8, -1, -0.8 }, { 1.6, 0, 1.6 }, { 0, 2, 0 }, { 1, 0, 0 }));
  scene.See(FrontCamera(4.0));
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  for (int y = 10; y < 90; y += 3)
  {
    int boundary = 60; // the wall begins at 52
    while (boundary < 200 && At(picture, boundary, y, 1) > 127)
    {
      ++boundary;
    }
    CHECK_NEAR(boundary, 100, 1.0);
    CHECK(At(picture, 60, y, 1) > 250);
    CHECK(At(picture, 130, y, 1) < 1);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Mesh in front of blurred surfels has a hard edge")
{
  // Half of a mesh in front of strongly blurred surfels: nothing of them leaks over it.
  Scene scene(100, 100);
  vtkSmartPointer<vtkCamera> camera = FrontCamera(4.0);
  camera->SetFocalDisk(1.0);
  camera->SetFocalDistance(3.5);
  scene.Renderer->AddActor(SurfelActor(Wall(-2.0, 3.0)));
  scene.Renderer->AddActor(QuadActor({ -2, -2, 0.5 }, { 2, 0, 0 }, { 0, 4, 0 }, { 0, 0, 0.2 }));
  scene.See(camera);
  vtkSmartPointer<vtkImageData> picture = scene.Render();
  for (int y = 5; y < 95; y += 9)
  {
    CHECK_NEAR(At(picture, 49, y, 0), 0.0, 0.0);
    CHECK_NEAR(At(picture, 50, y, 0), 255.0, 0.02 * 255); // ripple, as above
  }
}

TEST_CASE_FIXTURE(NoMessages, "Translucent mesh")
{
  for (int samples : { 0, 4 })
  {
    Scene scene(100, 100, samples);
    scene.Renderer->SetBackground(0, 0, 0.4);
    scene.Renderer->AddActor(SurfelActor(Wall(0.0)));
    vtkSmartPointer<vtkActor> front =
      QuadActor({ -1, -1, 0.5 }, { 1, 0, 0 }, { 0, 2, 0 }, { 0, 1, 0 });
    vtkSmartPointer<vtkActor> behind =
      QuadActor({ 0, -1, -0.5 }, { 1, 0, 0 }, { 0, 2, 0 }, { 1, 0, 0 });
    front->GetProperty()->SetOpacity(0.25);
    behind->GetProperty()->SetOpacity(0.25);
    scene.See(FrontCamera(4.0));
    scene.Renderer->GetActiveCamera()->SetClippingRange(3.0, 5.0);
    vtkSmartPointer<vtkImageData> alone = scene.Render();
    scene.Renderer->AddActor(front);
    scene.Renderer->AddActor(behind);
    for (bool peeling : { false, true })
    {
      if (peeling && samples > 0)
      {
        continue; // VTK's depth peeling has no multisampling
      }
      scene.Renderer->SetUseDepthPeeling(peeling);
      vtkSmartPointer<vtkImageData> picture = scene.Render();
      for (int y = 5; y < 95; y += 5)
      {
        const double green[3] = { 0, 255, 0 };
        for (int c = 0; c < 3; ++c)
        {
          // Three roundings to 8 bits: the surfels, the mesh's share, the sum.
          CHECK_NEAR(
            At(picture, 30, y, c), 0.75 * At(alone, 30, y, c) + 0.25 * green[c], 1.5 * OneLevel);
          CHECK_NEAR(At(picture, 70, y, c), At(alone, 70, y, c), OneLevel);
        }
      }
    }
  }
}

TEST_CASE_FIXTURE(NoMessages, "Translucent step is the renderers own")
{
  // Two translucent layers over surfels are what VTK without the pass makes of them over a mesh,
  // with depth peeling and without (order independent).
  for (bool peeling : { false, true })
  {
    vtkSmartPointer<vtkImageData> pictures[2];
    for (bool withPass : { false, true })
    {
      Scene scene(60, 60, 0, withPass);
      scene.Renderer->AddActor(withPass
          ? SurfelActor(Wall(0.0))
          : QuadActor({ -2, -2, 0 }, { 4, 0, 0 }, { 0, 4, 0 }, { 1, 1, 1 }));
      vtkSmartPointer<vtkActor> actors[2] = { QuadActor({ -2, -2, 0.6 }, { 4, 0, 0 }, { 0, 4, 0 },
                                                { 1, 0, 0 }),
        QuadActor({ -2, -2, 0.3 }, { 4, 0, 0 }, { 0, 4, 0 }, { 0, 1, 0 }) };
      for (vtkActor* actor : actors)
      {
        actor->GetProperty()->SetOpacity(0.5);
        scene.Renderer->AddActor(actor);
      }
      scene.Renderer->SetUseDepthPeeling(peeling);
      scene.Renderer->SetMaximumNumberOfPeels(8);
      scene.Renderer->SetOcclusionRatio(0.0);
      scene.See(FrontCamera(4.0));
      pictures[withPass] = scene.Render();
      CHECK((scene.Renderer->GetLastRenderingUsedDepthPeeling() != 0) == peeling);
    }
    // A quarter of the wall is seen, with its ripple of 2 %, and rounded once more.
    CHECK_NEAR(Compare(pictures[0], pictures[1]).Max, 0.0, 0.25 * 0.02 * 255 + OneLevel);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Text and overlay on top")
{
  Scene scene(120, 80);
  vtkSmartPointer<vtkActor> wall = SurfelActor(Wall(0.0));
  wall->GetProperty()->SetColor(0, 0, 1);
  scene.Renderer->AddActor(wall);
  vtkNew<vtkTextActor> text;
  text->SetInput("HHHH");
  text->SetPosition(10, 10);
  text->GetTextProperty()->SetFontSize(40);
  text->GetTextProperty()->SetColor(1, 1, 0);
  scene.See(FrontCamera(4.0));
  vtkSmartPointer<vtkImageData> before = scene.Render();
  scene.Renderer->AddActor2D(text);
  vtkSmartPointer<vtkImageData> after = scene.Render();
  int yellow = 0, changed = 0;
  for (int y = 0; y < 80; ++y)
  {
    for (int x = 0; x < 120; ++x)
    {
      yellow += At(after, x, y, 0) > 250 && At(after, x, y, 1) > 250 && At(after, x, y, 2) < 5;
      changed += At(after, x, y, 0) != At(before, x, y, 0);
    }
  }
  CHECK(yellow > 300); // the strokes of four letters 30 px high
  CHECK(changed > yellow / 2);
  CHECK(changed < 120 * 40); // the text's rows only
}

TEST_CASE_FIXTURE(NoMessages, "Axes and image and volume")
{
  Scene scene(120, 120);
  scene.Renderer->AddActor(SurfelActor(Wall(0.0)));
  scene.See(FrontCamera(5.0));
  vtkSmartPointer<vtkImageData> alone = scene.Render();

  vtkNew<vtkAxesActor> axes; // its z axis comes out of the wall, x and y lie in it
  axes->AxisLabelsOff();
  scene.Renderer->AddActor(axes);
  CHECK(Compare(scene.Render(), alone).Max > 100);
  scene.Renderer->RemoveActor(axes);
  CHECK(Compare(scene.Render(), alone).Max == 0.0);

  vtkNew<vtkImageData> gray;
  gray->SetDimensions(11, 11, 1);
  gray->SetSpacing(0.1, 0.1, 1);
  gray->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  gray->GetPointData()->GetScalars()->Fill(77);
  vtkNew<vtkImageActor> image; // in front of the right upper quarter
  image->SetInputData(gray);
  image->SetPosition(0, 0, 0.2);
  image->InterpolateOff();
  scene.Renderer->AddActor(image);
  vtkSmartPointer<vtkImageData> withImage = scene.Render();
  CHECK_NEAR(At(withImage, 75, 75, 0), 77, OneLevel);
  CHECK_NEAR(At(withImage, 45, 45, 0), At(alone, 45, 45, 0), 0.0);
  scene.Renderer->RemoveActor(image);

  vtkNew<vtkImageData> block;
  block->SetDimensions(9, 9, 9);
  block->SetSpacing(0.1, 0.1, 0.1);
  block->SetOrigin(-0.4, -0.4, -0.9); // behind the wall: hidden
  block->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  block->GetPointData()->GetScalars()->Fill(200);
  vtkNew<vtkGPUVolumeRayCastMapper> mapper;
  mapper->SetInputData(block);
  vtkNew<vtkPiecewiseFunction> opacity;
  opacity->AddPoint(0, 1.0);
  opacity->AddPoint(255, 1.0);
  vtkNew<vtkColorTransferFunction> color;
  color->AddRGBPoint(0, 1, 0, 0);
  color->AddRGBPoint(255, 1, 0, 0);
  vtkNew<vtkVolume> volume;
  volume->SetMapper(mapper);
  volume->GetProperty()->SetScalarOpacity(opacity);
  volume->GetProperty()->SetColor(color);
  scene.Renderer->AddVolume(volume);
  CHECK(Compare(scene.Render(), alone).Max <= OneLevel);
  block->SetOrigin(-0.4, -0.4, 0.1); // in front: red
  vtkSmartPointer<vtkImageData> withVolume = scene.Render();
  CHECK(At(withVolume, 60, 60, 0) > 250);
  CHECK(At(withVolume, 60, 60, 1) < 5);
}

TEST_CASE_FIXTURE(NoMessages, "Assembly and user matrix")
{
  Scene scene(120, 90);
  vtkSmartPointer<vtkActor> actor = SurfelActor(ColoredSphere());
  actor->SetPosition(0.3, 0, 0);
  actor->RotateZ(30);
  vtkNew<vtkAssembly> inner, outer;
  inner->AddPart(actor);
  inner->SetScale(0.5);
  inner->RotateY(40);
  outer->AddPart(inner);
  outer->SetPosition(-0.2, 0.1, 0.3);
  scene.Renderer->AddActor(outer);
  scene.See(FrontCamera(4.0));
  scene.Render();
  const std::vector<float> assembled = Values(scene.Float(), "Color");

  vtkNew<vtkMatrix4x4> matrix;
  vtkMatrix4x4::Multiply4x4(inner->GetMatrix(), actor->GetMatrix(), matrix);
  vtkMatrix4x4::Multiply4x4(outer->GetMatrix(), matrix, matrix);
  vtkSmartPointer<vtkActor> placed = SurfelActor(ColoredSphere());
  placed->SetUserMatrix(matrix);
  scene.Renderer->RemoveActor(outer);
  scene.Renderer->AddActor(placed);
  scene.Render();
  CHECK(CountBrighter(scene.Float(), 0.5) > 500);
  CHECK(Values(scene.Float(), "Color") == assembled);

  // A part that moves inside the assembly is seen at once.
  scene.Renderer->RemoveActor(placed);
  scene.Renderer->AddActor(outer);
  actor->SetPosition(0.6, 0, 0);
  scene.Render();
  CHECK(Values(scene.Float(), "Color") != assembled);
  outer->SetVisibility(false);
  scene.Render();
  CHECK_NEAR(CountBrighter(Grab(scene.Window), 0), 0, 0.0);
}

TEST_CASE_FIXTURE(NoMessages, "Mirrored and stretched")
{
  Scene scene(120, 90);
  vtkSmartPointer<vtkActor> actor = SurfelActor(ColoredSphere());
  scene.Renderer->AddActor(actor);
  vtkSmartPointer<vtkActor> reference = SurfelActor(ColoredSphere());
  scene.Renderer->AddActor(reference);
  vtkSmartPointer<vtkPolyData> data = ColoredSphere();
  const double scales[][3] = { { -1, 1, 1 }, { 1.5, 0.5, 1 }, { -0.5, 1, -2 } };
  for (const auto& scale : scales)
  {
    actor->SetOrientation(20, 0, 35);
    actor->SetScale(scale[0], scale[1], scale[2]);
    vtkSurfelMapper::SafeDownCast(reference->GetMapper())
      ->SetInputData(Transformed(data, actor->GetMatrix()));
    scene.See(FrontCamera(7.0));
    actor->VisibilityOn();
    reference->VisibilityOff();
    scene.Render();
    vtkNew<vtkImageData> transformedByActor;
    transformedByActor->DeepCopy(scene.Float());
    CHECK(CountBrighter(transformedByActor, 0.5) > 500);
    actor->VisibilityOff();
    reference->VisibilityOn();
    scene.Render();
    const Difference difference = Compare(transformedByActor, scene.Float());
    // The reference's arrays are rounded to float once more: positions to 1e-7 of an edge that is
    // one pixel wide, and a layer that closes a splat earlier or later at a silhouette.
    CHECK_NEAR(difference.Mean, 0.0, 1e-5);
    CHECK_NEAR(difference.Max, 0.0, 0.02);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Invisible actor is not drawn")
{
  Scene scene(60, 60);
  vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
  scene.Renderer->AddActor(actor);
  scene.See(FrontCamera(5.0));
  CHECK(CountBrighter(scene.Render(), 200) > 500);
  actor->VisibilityOff();
  CHECK_NEAR(CountBrighter(scene.Render(), 0), 0, 0.0);
  actor->VisibilityOn();
  CHECK(CountBrighter(scene.Render(), 200) > 500);
}

TEST_CASE_FIXTURE(NoMessages, "Actors share one A-buffer")
{
  // Two crossing sheets as two actors are the same picture as one cloud of both: one A-buffer, same
  // order of surfels.
  SurfelBuilder first, second;
  first.AddGrid({ -1, -1, -0.5 }, { 0.04, 0, 0.02 }, { 0, 0.04, 0 }, 50, 50);
  second.AddGrid({ -1, -1, 0.5 }, { 0.04, 0, -0.02 }, { 0, 0.04, 0 }, 50, 50);
  first.Color([](const Vector&) { return std::array<int, 4>{ 255, 60, 0, 255 }; });
  second.Color([](const Vector&) { return std::array<int, 4>{ 0, 60, 255, 255 }; });
  vtkNew<vtkAppendPolyData> append;
  append->AddInputData(first.Data);
  append->AddInputData(second.Data);
  append->Update();

  Scene scene(120, 120);
  vtkSmartPointer<vtkCamera> camera = FrontCamera(5.0);
  camera->SetFocalDisk(0.3);
  camera->SetFocalDistance(4.8);
  vtkSmartPointer<vtkActor> parts[2] = { SurfelActor(first.Data), SurfelActor(second.Data) };
  scene.Renderer->AddActor(parts[0]);
  scene.Renderer->AddActor(parts[1]);
  scene.See(camera);
  scene.Render();
  const std::vector<float> separate = Values(scene.Float(), "Color");
  scene.Renderer->RemoveActor(parts[0]);
  scene.Renderer->RemoveActor(parts[1]);
  scene.Renderer->AddActor(SurfelActor(append->GetOutput()));
  scene.Render();
  CHECK(CountBrighter(scene.Float(), 0.5) > 2000);
  CHECK(Values(scene.Float(), "Color") == separate);
}

TEST_CASE_FIXTURE(NoMessages, "Blur reaches into the picture from outside")
{
  // A sphere left of the picture, far out of focus: its blur is seen though culling would drop the
  // actor.
  Scene scene(80, 80);
  vtkSmartPointer<vtkCamera> camera = FrontCamera(4.0);
  camera->SetFocalDisk(1.0);
  camera->SetFocalDistance(1.0);
  vtkSmartPointer<vtkActor> actor = SurfelActor(UnitSphere());
  actor->SetScale(0.3);
  actor->SetPosition(-1.6, 0, 0);
  scene.Renderer->AddActor(actor);
  scene.Renderer->AddActor(QuadActor({ 0.2, 0, -1 }, { 0.1, 0, 0 }, { 0, 0.1, 0 }, { 0, 0, 1 }));
  scene.See(camera);
  CHECK(At(scene.Render(), 1, 40, 0) > 10);
  // Also when nothing else is in sight.
  scene.Renderer->RemoveActor(scene.Renderer->GetActors()->GetLastActor());
  scene.See(camera);
  CHECK(At(scene.Render(), 1, 40, 0) > 10);
}

TEST_CASE_FIXTURE(NoMessages, "Depth is left for later props")
{
  // The window's depth after the surfels is the depth of a mesh in their place, to the depth
  // buffer's 24 bits and float arithmetic at z / near = 10.
  Scene scene(60, 60);
  vtkSmartPointer<vtkActor> wall = SurfelActor(Wall(0.0));
  vtkSmartPointer<vtkActor> mesh = QuadActor({ -2, -2, 0 }, { 4, 0, 0 }, { 0, 4, 0 }, { 1, 1, 1 });
  scene.Renderer->AddActor(wall);
  scene.See(FrontCamera(4.0));
  scene.Renderer->GetActiveCamera()->SetClippingRange(0.4, 40.0);
  for (bool parallel : { false, true })
  {
    scene.Renderer->GetActiveCamera()->SetParallelProjection(parallel);
    vtkNew<vtkFloatArray> surfels, reference;
    scene.Render();
    scene.Window->GetZbufferData(0, 0, 59, 59, surfels);
    wall->VisibilityOff();
    scene.Renderer->AddActor(mesh);
    scene.Render();
    scene.Window->GetZbufferData(0, 0, 59, 59, reference);
    scene.Renderer->RemoveActor(mesh);
    wall->VisibilityOn();
    double worst = 0.0;
    for (vtkIdType i = 0; i < reference->GetNumberOfTuples(); ++i)
    {
      worst = std::max(worst, std::abs(double(surfels->GetValue(i)) - reference->GetValue(i)));
    }
    CHECK(reference->GetNumberOfTuples() == 3600);
    CHECK_NEAR(worst, 0.0, 1e-6);
  }
}

TEST_SUITE_END();

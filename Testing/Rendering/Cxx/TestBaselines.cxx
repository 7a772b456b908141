// SPDX-License-Identifier: BSD-3-Clause
/**
 * Compares with pictures that someone has looked at, pixel by pixel: VTK's own comparison lets a
 * shift, noise of +-40 and a colour that is off by 60 of 255 pass.
 *
 * To write new ones, look at them and commit them: SURFELSPLATTING_WRITE_BASELINES=1 ctest -R
 * Baseline
 */
#include "RenderingTest.h"

#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkConeSource.h>
#include <vtkImageData.h>
#include <vtkImageExtractComponents.h>
#include <vtkImageShiftScale.h>
#include <vtkLight.h>
#include <vtkPNGReader.h>
#include <vtkPNGWriter.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>

#include <cmath>
#include <fstream>
#include <string>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Baselines");

namespace
{
/// Largest and mean difference in levels of 255. The splats are the same on every machine but for
/// the last bits of float arithmetic (instruction sets): one level. Meshes and text are the
/// graphics driver's: edges may move.
void CheckBaseline(vtkImageData* picture, const std::string& name, double max, double mean)
{
  const std::string path = BaselineFolder() + "/" + name + ".png";
  if (WriteBaselines())
  {
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputData(picture);
    writer->SetFileName(path.c_str());
    writer->Write();
    return;
  }
  const bool exists = std::ifstream(path).good();
  CHECK_MESSAGE(exists, "there is no picture ", path);
  if (!exists)
  {
    return;
  }
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  const Difference difference = Compare(picture, reader->GetOutput());
  CHECK_MESSAGE(Near(difference.Max, 0.0, max), name, ", largest difference");
  CHECK_MESSAGE(Near(difference.Mean, 0.0, mean), name, ", mean difference");
  if (difference.Max > max || difference.Mean > mean)
  {
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputData(picture);
    writer->SetFileName((name + ".failed.png").c_str());
    writer->Write();
  }
}

/// RGB in 8 bits of a float picture.
vtkSmartPointer<vtkImageData> EightBits(vtkImageData* picture)
{
  vtkNew<vtkImageExtractComponents> rgb;
  rgb->SetInputData(picture);
  rgb->SetComponents(0, 1, 2);
  vtkNew<vtkImageShiftScale> scaled;
  scaled->SetInputConnection(rgb->GetOutputPort());
  scaled->SetShift(0.5 / 255.0); // to the nearest level
  scaled->SetScale(255.0);
  scaled->ClampOverflowOn();
  scaled->SetOutputScalarTypeToUnsignedChar();
  scaled->Update();
  return scaled->GetOutput();
}

/// A floor of checks at y = -1 that recedes from z = 4 to z = -16.
vtkSmartPointer<vtkActor> Checkers()
{
  SurfelBuilder builder;
  builder.AddGrid({ -5, -1, 4 }, { 0.04, 0, 0 }, { 0, 0, -0.04 }, 250, 500);
  builder.Color([](const Vector& p) {
    const bool dark = (static_cast<int>(std::floor(p[0])) + static_cast<int>(std::floor(p[2]))) % 2;
    return dark ? std::array<int, 4>{ 40, 60, 90, 255 } : std::array<int, 4>{ 235, 230, 210, 255 };
  });
  return SurfelActor(builder.Data);
}

vtkSmartPointer<vtkActor> RedSphere()
{
  vtkSmartPointer<vtkActor> sphere = SurfelActor(UnitSphere(12000));
  sphere->GetProperty()->LightingOn();
  sphere->GetProperty()->SetColor(0.85, 0.25, 0.2);
  sphere->GetProperty()->SetAmbient(0.1);
  return sphere;
}

vtkSmartPointer<vtkCamera> LowCamera()
{
  vtkSmartPointer<vtkCamera> camera = vtkSmartPointer<vtkCamera>::New();
  camera->SetPosition(0.6, 0.6, 6.0);
  camera->SetFocalPoint(0.0, -0.2, 0.0);
  camera->SetViewAngle(35);
  camera->SetFocalDisk(0.5);
  camera->SetFocalDistance(5.2);
  return camera;
}
}

TEST_CASE_FIXTURE(NoMessages, "Sphere on receding checkers")
{
  vtkNew<vtkSurfelImageRenderer> renderer;
  renderer->AddActor(Checkers());
  renderer->AddActor(RedSphere());
  renderer->SetCamera(LowCamera());
  renderer->SetSize(160, 120);
  renderer->SetBackground(0.55, 0.7, 0.85);
  renderer->SetBackgroundAlpha(1.0);
  vtkNew<vtkLight> light;
  light->SetLightTypeToSceneLight();
  light->SetPosition(3, 5, 4);
  renderer->AddLight(light);
  renderer->Update();
  // One level for a value that rounds the other way, at one pixel in twenty at most.
  CheckBaseline(EightBits(renderer->GetOutput()), "SphereOnCheckers", 1.0, 0.05);
}

TEST_CASE_FIXTURE(NoMessages, "Pass with mesh and text")
{
  Scene scene(160, 120);
  scene.Renderer->GradientBackgroundOn();
  scene.Renderer->SetBackground(0.2, 0.25, 0.3);
  scene.Renderer->SetBackground2(0.6, 0.7, 0.8);
  scene.Renderer->AddActor(Checkers());
  scene.Renderer->AddActor(RedSphere());
  vtkNew<vtkConeSource> cone; // through the sphere, tip to the viewer's right
  cone->SetHeight(3.2);
  cone->SetRadius(0.6);
  cone->SetResolution(40);
  cone->SetDirection(1, 0.2, 0.3);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(cone->GetOutputPort());
  vtkNew<vtkActor> mesh;
  mesh->SetMapper(mapper);
  mesh->GetProperty()->SetColor(0.3, 0.7, 0.3);
  scene.Renderer->AddActor(mesh);
  scene.Renderer->AddActor([] {
    vtkSmartPointer<vtkActor> glass =
      QuadActor({ -1.9, -0.9, 1.4 }, { 1.5, 0, 0 }, { 0, 1.6, 0 }, { 0.3, 0.5, 1.0 });
    glass->GetProperty()->SetOpacity(0.4);
    return glass;
  }());
  vtkNew<vtkTextActor> text;
  text->SetInput("surfels");
  text->SetPosition(6, 6);
  text->GetTextProperty()->SetFontSize(18);
  text->GetTextProperty()->SetColor(1, 1, 0.4);
  scene.Renderer->AddActor2D(text);
  scene.See(LowCamera());
  // Edges of meshes and letters of another graphics driver or font library: 300 of 19200 px may be
  // another colour.
  CheckBaseline(scene.Render(), "PassWithMeshAndText", 255.0, 1.0);
}

TEST_SUITE_END();

// SPDX-License-Identifier: BSD-3-Clause
#include "RenderingTest.h"
#include "Testing/Shared/SampledSurfaces.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkDataArray.h>
#include <vtkExtractVOI.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkMath.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPlaneSource.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <mutex>

namespace RenderingTest
{
namespace
{
std::string Messages;
bool DotsAreMeant = false;

/// Keeps messages instead of printing them.
class MessageWindow : public vtkOutputWindow
{
public:
  static MessageWindow* New();
  vtkTypeMacro(MessageWindow, vtkOutputWindow);
  void DisplayText(const char* text) override
  {
    const bool isOfDots = std::string(text).find("drawn as dots") != std::string::npos;
    const std::lock_guard<std::mutex> lock(this->Mutex); // ranks are threads
    Messages += isOfDots && DotsAreMeant ? "" : text;
  }

private:
  std::mutex Mutex;
};
vtkStandardNewMacro(MessageWindow);
}

NoMessages::NoMessages()
{
  vtkNew<MessageWindow> window;
  vtkOutputWindow::SetInstance(window);
}

NoMessages::~NoMessages()
{
  const std::string rest = TakeMessages();
  CHECK_MESSAGE(rest.empty(), "unexpected message: ", rest);
  vtkOutputWindow::SetInstance(nullptr);
}

OnlyOfDots::OnlyOfDots()
{
  DotsAreMeant = true;
}

OnlyOfDots::~OnlyOfDots()
{
  DotsAreMeant = false;
}

std::string TakeMessages()
{
  std::string taken;
  taken.swap(Messages);
  return taken;
}

SurfelBuilder::SurfelBuilder()
  : Data(vtkSmartPointer<vtkPolyData>::New())
{
  vtkNew<vtkPoints> points;
  this->Data->SetPoints(points);
  const std::pair<const char*, int> arrays[] = { { "SurfelCovariance", 6 },
    { "SurfelAreaVector", 3 } };
  for (const auto& entry : arrays)
  {
    vtkNew<vtkFloatArray> array;
    array->SetName(entry.first);
    array->SetNumberOfComponents(entry.second);
    this->Data->GetPointData()->AddArray(array);
  }
}

SurfelBuilder::~SurfelBuilder() = default;

void SurfelBuilder::Add(const Vector& position, const Vector& n, double s, double area)
{
  this->Data->GetPoints()->InsertNextPoint(position.data());
  const double v = s * s;
  const double covariance[6] = { v * (1 - n[0] * n[0]), v * (1 - n[1] * n[1]),
    v * (1 - n[2] * n[2]), -v * n[0] * n[1], -v * n[1] * n[2], -v * n[0] * n[2] };
  const double areaVector[3] = { area * n[0], area * n[1], area * n[2] };
  this->Data->GetPointData()->GetArray("SurfelCovariance")->InsertNextTuple(covariance);
  this->Data->GetPointData()->GetArray("SurfelAreaVector")->InsertNextTuple(areaVector);
}

void SurfelBuilder::AddSphere(const Vector& center, double radius, int count)
{
  const double area = 4.0 * vtkMath::Pi() * radius * radius / count;
  const SurfelTesting::Sampled sphere = SurfelTesting::FibonacciSphere(center, radius, count);
  for (int i = 0; i < count; ++i)
  {
    this->Add(sphere.Points[i], sphere.Normals[i], 0.5 * std::sqrt(area), area);
  }
}

void SurfelBuilder::AddGrid(
  const Vector& corner, const Vector& u, const Vector& v, int countU, int countV)
{
  Vector n;
  vtkMath::Cross(u.data(), v.data(), n.data());
  const double area = vtkMath::Normalize(n.data());
  for (int j = 0; j < countV; ++j)
  {
    for (int i = 0; i < countU; ++i)
    {
      Vector p;
      for (int c = 0; c < 3; ++c)
      {
        p[c] = corner[c] + (i + 0.5) * u[c] + (j + 0.5) * v[c];
      }
      this->Add(p, n, 0.5 * std::sqrt(area), area);
    }
  }
}

void SurfelBuilder::Color(
  const std::function<std::array<int, 4>(const Vector&)>& function, int components)
{
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("Color");
  colors->SetNumberOfComponents(components);
  for (vtkIdType i = 0; i < this->Data->GetNumberOfPoints(); ++i)
  {
    Vector p;
    this->Data->GetPoint(i, p.data());
    const std::array<int, 4> color = function(p);
    for (int c = 0; c < components; ++c)
    {
      colors->InsertNextValue(static_cast<unsigned char>(color[c]));
    }
  }
  this->Data->GetPointData()->SetScalars(colors);
}

vtkSmartPointer<vtkPolyData> UnitSphere(int count)
{
  SurfelBuilder builder;
  builder.AddSphere({ 0, 0, 0 }, 1.0, count);
  return builder.Data;
}

vtkSmartPointer<vtkActor> SurfelActor(vtkPolyData* surfels)
{
  vtkNew<vtkSurfelMapper> mapper;
  mapper->SetInputData(surfels);
  vtkSmartPointer<vtkActor> actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->LightingOff();
  return actor;
}

vtkSmartPointer<vtkActor> QuadActor(
  const Vector& corner, const Vector& u, const Vector& v, const Vector& color)
{
  vtkNew<vtkPlaneSource> source;
  source->SetOrigin(corner[0], corner[1], corner[2]);
  source->SetPoint1(corner[0] + u[0], corner[1] + u[1], corner[2] + u[2]);
  source->SetPoint2(corner[0] + v[0], corner[1] + v[1], corner[2] + v[2]);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(source->GetOutputPort());
  vtkSmartPointer<vtkActor> actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(color[0], color[1], color[2]);
  actor->GetProperty()->LightingOff();
  return actor;
}

vtkSmartPointer<vtkCamera> FrontCamera(double distance, double viewAngle)
{
  vtkSmartPointer<vtkCamera> camera = vtkSmartPointer<vtkCamera>::New();
  camera->SetPosition(0, 0, distance);
  camera->SetFocalPoint(0, 0, 0);
  camera->SetViewUp(0, 1, 0);
  camera->SetViewAngle(viewAngle);
  camera->SetFocalDisk(0.0);
  return camera;
}

Scene::Scene(int width, int height, int multiSamples, bool withPass)
  : Window(vtkSmartPointer<vtkRenderWindow>::New())
  , Renderer(vtkSmartPointer<vtkRenderer>::New())
{
  this->Window->SetOffScreenRendering(1);
  this->Window->SetMultiSamples(multiSamples);
  this->Window->SetSize(width, height);
  this->Window->AddRenderer(this->Renderer);
  if (withPass)
  {
    this->Pass = vtkSmartPointer<vtkSurfelSplattingPass>::New();
    this->Renderer->SetPass(this->Pass);
  }
}

void Scene::See(vtkCamera* camera)
{
  this->Renderer->SetActiveCamera(camera);
  this->Renderer->ResetCameraClippingRange();
}

vtkSmartPointer<vtkImageData> Scene::Render()
{
  this->Window->Render();
  return Grab(this->Window);
}

vtkImageData* Scene::Float()
{
  return this->Pass->GetSplatter()->GetOutput();
}

vtkSmartPointer<vtkImageData> Grab(vtkRenderWindow* window)
{
  const int* size = window->GetSize();
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetPixelData(0, 0, size[0] - 1, size[1] - 1, window->GetDoubleBuffer() ? 0 : 1, pixels);
  vtkSmartPointer<vtkImageData> picture = vtkSmartPointer<vtkImageData>::New();
  picture->SetDimensions(size[0], size[1], 1);
  picture->GetPointData()->SetScalars(pixels);
  return picture;
}

vtkSmartPointer<vtkImageData> RenderPoster(vtkRenderWindow* window)
{
  window->Render();
  vtkNew<vtkWindowToImageFilter> poster;
  poster->SetInput(window);
  poster->SetScale(2);
  poster->ReadFrontBufferOff();
  poster->FixBoundaryOff();
  poster->Update();
  return poster->GetOutput();
}

EyePictures::EyePictures(int eye, vtkCamera* camera, int cells)
{
  Scene scene(120, 90);
  scene.Window->SetStereoType(eye);
  scene.Window->StereoRenderOn();
  scene.Pass->GetSplatter()->SetLensCells(cells);
  SurfelBuilder builder;
  builder.AddGrid({ -0.615, -0.41, 0.8 }, { 0.02, 0, 0 }, { 0, 0.02, 0 }, 60, 40);
  vtkSmartPointer<vtkActor> surfels = SurfelActor(builder.Data);
  vtkSmartPointer<vtkActor> mesh =
    QuadActor({ -0.615, -0.41, 0.8 }, { 1.2, 0, 0 }, { 0, 0.8, 0 }, { 1, 1, 1 });
  scene.Renderer->AddActor(surfels);
  scene.Renderer->AddActor(mesh);
  camera->SetEyeAngle(6.0);
  scene.See(camera);
  mesh->VisibilityOff();
  this->Splats = scene.Render();
  mesh->VisibilityOn();
  surfels->VisibilityOff();
  this->Polygons = scene.Render();
  camera->SetEyeAngle(0.0);
  this->Mono = scene.Render();
}

double At(vtkImageData* picture, int x, int y, int c)
{
  return picture->GetScalarComponentAsDouble(x, y, 0, c);
}

std::vector<float> Values(vtkImageData* picture, const char* name)
{
  vtkFloatArray* array = vtkFloatArray::SafeDownCast(picture->GetPointData()->GetArray(name));
  if (!array)
  {
    return {};
  }
  return std::vector<float>(
    array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfValues());
}

Difference Compare(vtkImageData* a, vtkImageData* b)
{
  Difference difference;
  vtkDataArray* first = a->GetPointData()->GetScalars();
  vtkDataArray* second = b->GetPointData()->GetScalars();
  if (!first || !second ||
    !std::equal(a->GetDimensions(), a->GetDimensions() + 3, b->GetDimensions()) ||
    first->GetNumberOfComponents() != second->GetNumberOfComponents())
  {
    difference.Max = difference.Mean = std::numeric_limits<double>::infinity();
    return difference;
  }
  const int components = first->GetNumberOfComponents();
  for (vtkIdType i = 0; i < first->GetNumberOfTuples(); ++i)
  {
    for (int c = 0; c < components; ++c)
    {
      const double d = std::abs(first->GetComponent(i, c) - second->GetComponent(i, c));
      difference.Max = d <= difference.Max ? difference.Max : d; // a NaN counts
      difference.Mean += d;
    }
  }
  difference.Mean /= static_cast<double>(first->GetNumberOfTuples()) * components;
  return difference;
}

int CountDifferent(vtkImageData* a, vtkImageData* b, int c, double tolerance)
{
  const int* size = a->GetDimensions();
  if (!std::equal(size, size + 3, b->GetDimensions()))
  {
    return std::numeric_limits<int>::max();
  }
  int count = 0;
  for (int i = 0; i < size[0] * size[1]; ++i)
  {
    const int x = i % size[0], y = i / size[0];
    count += std::abs(At(a, x, y, c) - At(b, x, y, c)) > tolerance;
  }
  return count;
}

vtkSmartPointer<vtkImageData> Crop(vtkImageData* picture, int x, int y, int width, int height)
{
  vtkNew<vtkExtractVOI> extract;
  extract->SetInputData(picture);
  extract->SetVOI(x, x + width - 1, y, y + height - 1, 0, 0);
  extract->Update();
  vtkSmartPointer<vtkImageData> part = extract->GetOutput();
  part->SetExtent(0, width - 1, 0, height - 1, 0, 0);
  return part;
}

int CountBrighter(vtkImageData* picture, double value)
{
  vtkDataArray* scalars = picture->GetPointData()->GetScalars();
  int count = 0;
  for (vtkIdType i = 0; i < scalars->GetNumberOfTuples(); ++i)
  {
    bool brighter = false;
    for (int c = 0; c < scalars->GetNumberOfComponents(); ++c)
    {
      brighter = brighter || scalars->GetComponent(i, c) > value;
    }
    count += brighter ? 1 : 0;
  }
  return count;
}

std::string BaselineFolder()
{
  return SURFELSPLATTING_BASELINE_FOLDER;
}

bool WriteBaselines()
{
  const char* value = std::getenv("SURFELSPLATTING_WRITE_BASELINES");
  return value && *value && std::string(value) != "0";
}
}

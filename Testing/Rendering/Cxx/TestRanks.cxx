// SPDX-License-Identifier: BSD-3-Clause
/**
 * Several processes' surfels in one picture, by the renderer without a window: process 0 has the
 * picture of all, whether anything has changed is agreed upon, and what cannot be made is said.
 */
#include "Core/Files/ArrayFile.h"
#include "RenderingTest.h"
#include "ThreadController.h"

#include "vtkSurfelHierarchyReader.h"
#include "vtkSurfelHierarchyWriter.h"
#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkDoubleArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>

#include <atomic>
#include <cstdio>
#include <fstream>
#include <functional>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Ranks");
using SurfelTesting::ThreadController;

namespace
{
vtkSmartPointer<vtkActor> Sphere(const Vector& center, double opacity)
{
  SurfelBuilder builder;
  builder.AddSphere(center, 0.7, 3000);
  vtkSmartPointer<vtkActor> actor = SurfelActor(builder.Data);
  actor->GetProperty()->SetOpacity(opacity);
  actor->GetProperty()->SetColor(0.5 + 0.5 * center[0], 0.5, 1.0);
  return actor;
}

/// Three spheres that cover one another.
std::vector<vtkSmartPointer<vtkActor>> Spheres()
{
  return { Sphere({ 0, 0, 0 }, 1.0), Sphere({ 0.5, 0.2, 1.5 }, 0.4), Sphere({ -0.4, 0, -2 }, 1.0) };
}

struct Camera
{
  explicit Camera(vtkSurfelImageRenderer* renderer)
  {
    vtkSmartPointer<vtkCamera> camera = FrontCamera(6.0);
    camera->SetFocalDistance(4.5);
    renderer->SetCamera(camera);
    renderer->SetSize(120, 90);
    renderer->GetSplatter()->SetLensModeToCircleOfConfusion();
    renderer->GetSplatter()->SetCircleOfConfusion(9.0);
  }
};

/// A file of surfels, too large to be checked when it is opened, whose positions are damaged.
class DamagedFile
{
public:
  static constexpr const char* Path = "ranks.surfels";

  DamagedFile()
  {
    constexpr int count = 3000;
    const vtkSmartPointer<vtkPolyData> surfels = UnitSphere(count);
    vtkNew<vtkDoubleArray> wide; // 36 MB
    wide->SetName("Wide");
    wide->SetNumberOfComponents(1500);
    wide->SetNumberOfTuples(count);
    wide->Fill(1.0);
    surfels->GetPointData()->AddArray(wide);
    vtkNew<vtkSurfelHierarchyWriter> writer;
    writer->SetInputData(surfels);
    writer->SetFileName(Path);
    REQUIRE(writer->Write() == 1);
    std::fstream file(Path, std::ios::in | std::ios::out | std::ios::binary);
    SurfelSplatting::FileHeader header;
    file.read(reinterpret_cast<char*>(&header), sizeof(header));
    file.seekp(static_cast<std::streamoff>(header.ArraysBegin));
    const std::vector<char> wrong(12 * count, 7);
    file.write(wrong.data(), static_cast<std::streamsize>(wrong.size()));
  }
  ~DamagedFile() { std::remove(Path); }
};

vtkSmartPointer<vtkImageData> Copy(vtkImageData* picture)
{
  auto copy = vtkSmartPointer<vtkImageData>::New();
  copy->DeepCopy(picture);
  return copy;
}

vtkSmartPointer<vtkImageData> ByOne(int cells)
{
  vtkNew<vtkSurfelImageRenderer> renderer;
  const Camera camera(renderer);
  renderer->GetSplatter()->SetLensCells(cells);
  for (const auto& actor : Spheres())
  {
    renderer->AddActor(actor);
  }
  renderer->Update();
  return Copy(renderer->GetOutput());
}
}

TEST_CASE_FIXTURE(NoMessages, "The picture is that of one process")
{
  for (const int cells : { 1, 7 })
  {
    const vtkSmartPointer<vtkImageData> expected = ByOne(cells);
    vtkSmartPointer<vtkImageData> found;
    ThreadController::Run(3, [&](vtkMultiProcessController* controller) {
      const int rank = controller->GetLocalProcessId();
      vtkNew<vtkSurfelImageRenderer> renderer;
      const Camera camera(renderer);
      renderer->GetSplatter()->SetLensCells(cells);
      renderer->GetSplatter()->SetController(controller);
      const auto actors = Spheres();
      for (int i = 0; i < 3; ++i)
      {
        if (rank == (i == 2 ? 2 : 0)) // process 1 has nothing
        {
          renderer->AddActor(actors[static_cast<std::size_t>(i)]);
        }
      }
      renderer->Update();
      if (rank == 0)
      {
        found = Copy(renderer->GetOutput());
      }
    });
    CHECK_NEAR(Compare(found, expected).Max, 0.0, 0.0);
  }
}

/// All focus on what only one of them has in the middle.
TEST_CASE_FIXTURE(NoMessages, "One focus on the surface in the middle")
{
  const auto draw = [](vtkMultiProcessController* controller, bool hasNear, bool hasFar) {
    vtkNew<vtkSurfelImageRenderer> renderer;
    const Camera camera(renderer);
    renderer->GetCamera()->SetFocalDistance(0.0);
    renderer->GetSplatter()->SetFocusModeToMiddle();
    renderer->GetSplatter()->SetController(controller);
    if (hasNear)
    {
      renderer->AddActor(Sphere({ 0, 0, 2 }, 1.0));
    }
    if (hasFar)
    {
      renderer->AddActor(Sphere({ 0.8, 0, -2 }, 1.0));
    }
    renderer->Update();
    return Copy(renderer->GetOutput());
  };
  const vtkSmartPointer<vtkImageData> expected = draw(nullptr, true, true);
  vtkSmartPointer<vtkImageData> found;
  ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    const vtkSmartPointer<vtkImageData> own = draw(controller, rank == 1, rank == 0);
    if (rank == 0)
    {
      found = own;
    }
  });
  CHECK_NEAR(Compare(found, expected).Max, 0.0, 0.0);
}

TEST_CASE_FIXTURE(NoMessages, "A change anywhere is a new picture")
{
  vtkSmartPointer<vtkImageData> first, second;
  vtkIdType reused[2] = { -1, -1 };
  ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    vtkNew<vtkSurfelImageRenderer> renderer;
    const Camera camera(renderer);
    renderer->GetSplatter()->SetController(controller);
    const vtkSmartPointer<vtkActor> actor = Spheres()[static_cast<std::size_t>(rank)];
    renderer->AddActor(actor);
    renderer->Update();
    if (rank == 0)
    {
      first = Copy(renderer->GetOutput());
    }
    renderer->Modified();
    renderer->Update(); // nothing has changed
    reused[rank] = renderer->GetSplatter()->GetNumberOfReusedFrames();
    if (rank == 1)
    {
      actor->GetProperty()->SetColor(0, 1, 0);
    }
    renderer->Modified();
    renderer->Update();
    if (rank == 0)
    {
      second = Copy(renderer->GetOutput());
    }
    reused[rank] -= renderer->GetSplatter()->GetNumberOfReusedFrames();
  });
  CHECK(Compare(first, second).Max > 0.1);
  CHECK(reused[0] == 0);
  CHECK(reused[1] == 0);
}

TEST_CASE_FIXTURE(NoMessages, "What is not made is said")
{
  vtkSmartPointer<vtkImageData> found;
  ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
    vtkNew<vtkSurfelImageRenderer> renderer;
    const Camera camera(renderer);
    renderer->GetSplatter()->SetController(controller);
    renderer->GetSplatter()->DeepSamplesOn();
    renderer->AddActor(Spheres()[0]);
    renderer->Update();
    if (controller->GetLocalProcessId() == 0)
    {
      found = Copy(renderer->GetOutput());
    }
  });
  CHECK(TakeMessages().find("DeepSamples") != std::string::npos);
  CHECK(At(found, 60, 45, 3) > 0.9);
}

TEST_CASE_FIXTURE(NoMessages, "Pictures of different size are refused")
{
  std::atomic<int> made{ 0 };
  ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
    vtkNew<vtkSurfelImageRenderer> renderer;
    const Camera camera(renderer);
    renderer->SetSize(100, 80 + controller->GetLocalProcessId());
    renderer->GetSplatter()->SetController(controller);
    renderer->AddActor(Spheres()[0]);
    renderer->Update();
    made += renderer->GetOutput()->GetNumberOfPoints() > 0 ? 1 : 0;
  });
  CHECK(TakeMessages().find("differ in size") != std::string::npos);
  CHECK(made == 0);
}

/// No process waits for the one that finds the damage, in its clouds (paper) or its splats.
TEST_CASE_FIXTURE(NoMessages, "A damaged file is said")
{
  const DamagedFile file;
  for (const int mode : { vtkSurfelSplatter::LOD_PAPER, vtkSurfelSplatter::LOD_OFF })
  {
    std::atomic<int> made{ 0 };
    ThreadController::Run(2, [&](vtkMultiProcessController* controller) {
      vtkNew<vtkSurfelHierarchyReader> reader;
      reader->SetFileName(DamagedFile::Path);
      reader->Update();
      vtkNew<vtkSurfelImageRenderer> renderer;
      const Camera camera(renderer);
      renderer->GetSplatter()->SetController(controller);
      renderer->GetSplatter()->SetLODMode(mode);
      const bool hasFile = controller->GetLocalProcessId() == 1;
      renderer->AddActor(hasFile ? SurfelActor(reader->GetOutput()) : Spheres()[0]);
      renderer->Update();
      made += renderer->GetOutput()->GetNumberOfPoints() > 0 ? 1 : 0;
    });
    const std::string messages = TakeMessages();
    CHECK(messages.find("array Points is not what was written") != std::string::npos);
    CHECK(messages.find("another process") != std::string::npos);
    CHECK(messages.find("memory") == std::string::npos);
    CHECK(made == 0);
  }
}

TEST_SUITE_END();

// SPDX-License-Identifier: BSD-3-Clause
// Points of a sphere -> surfels -> picture with depth of field, without a window.
#include "vtkActor.h"
#include "vtkCamera.h"
#include "vtkNew.h"
#include "vtkPNGWriter.h"
#include "vtkPoints.h"
#include "vtkPointsToSurfels.h"
#include "vtkPolyData.h"
#include "vtkProperty.h"
#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"

#include <cmath>

int main(int argc, char** argv)
{
  constexpr int count = 20000;
  vtkNew<vtkPoints> points;
  for (int i = 0; i < count; ++i) // a spiral that covers a sphere evenly
  {
    const double z = 0.5 - (i + 0.5) / count, r = std::sqrt(0.25 - z * z), angle = 2.399963 * i;
    points->InsertNextPoint(r * std::cos(angle), r * std::sin(angle), z);
  }
  vtkNew<vtkPolyData> cloud; // any vtkPointSet will do
  cloud->SetPoints(points);

  vtkNew<vtkPointsToSurfels> surfels;
  surfels->SetInputData(cloud);
  vtkNew<vtkSurfelMapper> mapper;
  mapper->SetInputConnection(surfels->GetOutputPort());
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(0.9, 0.6, 0.3);

  vtkNew<vtkCamera> camera;
  camera->SetPosition(0, 0, 3);
  camera->SetFocalDisk(0.3);      // diameter of the lens, world units
  camera->SetFocalDistance(2.55); // in focus: just behind the sphere's front

  vtkNew<vtkSurfelImageRenderer> picture;
  picture->AddActor(actor);
  picture->SetCamera(camera);
  picture->SetSize(512, 512);

  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(picture->GetOutputPort(1)); // 8 bits; port 0 has floats
  writer->SetFileName(argc > 1 ? argv[1] : "example.png");
  writer->Write();
  return writer->GetErrorCode() == 0 ? 0 : 1;
}

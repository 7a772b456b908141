// SPDX-License-Identifier: BSD-3-Clause
// Points of a sphere -> surfels -> picture with depth of field, without a window.
#include "vtkActor.h"
#include "vtkCamera.h"
#include "vtkImageShiftScale.h"
#include "vtkNew.h"
#include "vtkPNGWriter.h"
#include "vtkPointSource.h"
#include "vtkProperty.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelHierarchy.h"
#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelNormalization.h"

int main(int argc, char** argv)
{
  vtkNew<vtkPointSource> points; // any vtkPointSet will do
  points->SetDistributionToShell();
  points->SetNumberOfPoints(20000);

  vtkNew<vtkSurfelEstimation> surfels;
  surfels->SetInputConnection(points->GetOutputPort());
  vtkNew<vtkSurfelNormalization> normalized;
  normalized->SetInputConnection(surfels->GetOutputPort());

  vtkNew<vtkSurfelHierarchy> detailed;
  detailed->SetInputConnection(normalized->GetOutputPort());
  vtkNew<vtkSurfelMapper> mapper;
  mapper->SetInputConnection(detailed->GetOutputPort());
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

  vtkNew<vtkImageShiftScale> bytes; // the picture is float, 0 to 1
  bytes->SetInputConnection(picture->GetOutputPort());
  bytes->SetScale(255);
  bytes->SetOutputScalarTypeToUnsignedChar();
  bytes->ClampOverflowOn();
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(bytes->GetOutputPort());
  writer->SetFileName(argc > 1 ? argv[1] : "example.png");
  writer->Write();
  return writer->GetErrorCode() == 0 ? 0 : 1;
}

// SPDX-License-Identifier: BSD-3-Clause
// Points on the faces of meshes; what they look like is tested by CommandLine.MeshFaces.
#include "vtkPointsOnFaces.h"

#include "SurfelTesting.h"
#include "Testing/Shared/Check.h"

#include "vtkCellArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSurfelEstimation.h"

#include <cmath>

namespace
{
/// Appends a cube of side 1.
void AddCube(vtkPolyData* mesh, double x)
{
  constexpr vtkIdType sides[6][4] = { { 0, 1, 3, 2 }, { 4, 6, 7, 5 }, { 0, 4, 5, 1 },
    { 2, 3, 7, 6 }, { 0, 2, 6, 4 }, { 1, 5, 7, 3 } };
  const vtkIdType first = mesh->GetNumberOfPoints();
  for (int i = 0; i < 8; ++i)
  {
    mesh->GetPoints()->InsertNextPoint(x + i / 4, i / 2 % 2, i % 2);
  }
  for (const auto& side : sides)
  {
    vtkIdType ids[4];
    for (int c = 0; c < 4; ++c)
    {
      ids[c] = first + side[c];
    }
    mesh->GetPolys()->InsertNextCell(4, ids);
  }
}

/// @param x of the second one; 1: it touches the first
vtkNew<vtkPolyData> TwoCubes(double x = 3.0)
{
  vtkNew<vtkPolyData> mesh;
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> faces;
  mesh->SetPoints(points);
  mesh->SetPolys(faces);
  AddCube(mesh, 0.0);
  AddCube(mesh, x);
  return mesh;
}
}

TEST_CASE("Points are on the faces, with their normals and parts")
{
  const vtkNew<vtkPolyData> mesh = TwoCubes();
  vtkNew<vtkPointsOnFaces> faces;
  faces->SetInputData(mesh);
  faces->SetNumberOfPoints(6000);
  faces->Update();
  CHECK(faces->GetLack() == vtkPointsOnFaces::TOO_FEW_VERTICES);
  CHECK(faces->GetIsModel());
  vtkPolyData* output = faces->GetOutput();
  const vtkIdType count = output->GetNumberOfPoints();
  CHECK_NEAR(static_cast<double>(count), 6000.0, 20.0);
  CHECK(output->GetNumberOfCells() == 0);
  REQUIRE(output->GetPointData()->GetNormals());
  REQUIRE(faces->GetParts());
  REQUIRE(faces->GetParts()->GetNumberOfValues() == count);
  int wrong = 0;
  for (vtkIdType i = 0; i < count; ++i)
  {
    double p[3], n[3];
    output->GetPoint(i, p);
    output->GetPointData()->GetNormals()->GetTuple(i, n);
    const bool isSecond = p[0] > 2.0;
    const double along =
      (p[0] - (isSecond ? 3.5 : 0.5)) * n[0] + (p[1] - 0.5) * n[1] + (p[2] - 0.5) * n[2];
    wrong += std::abs(along - 0.5) > 1e-6 || faces->GetParts()->GetValue(i) != (isSecond ? 1 : 0);
  }
  CHECK(wrong == 0);
}

/// They point to both sides of the plane between, which would be wrong of other points.
TEST_CASE("Normals of faces that touch are kept")
{
  vtkNew<vtkPointsOnFaces> faces;
  faces->SetInputData(TwoCubes(1.0));
  faces->SetNumberOfPoints(20000);
  faces->Update();
  vtkNew<vtkPolyData> points;
  points->ShallowCopy(faces->GetOutput());
  vtkNew<vtkSurfelEstimation> estimation;
  const SurfelTesting::Messages messages(estimation);
  estimation->SetInputData(points);
  estimation->Update();
  CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_KEPT);
  points->GetFieldData()->Initialize();
  points->Modified();
  estimation->Update();
  CHECK(estimation->GetNormalsUse() == vtkSurfelEstimation::NORMALS_WITHOUT_SIDES);
}

TEST_CASE("Normals are made only if they are wanted")
{
  const vtkNew<vtkPolyData> mesh = TwoCubes();
  vtkNew<vtkPointsOnFaces> faces;
  faces->SetInputData(mesh);
  faces->MakeNormalsOff();
  faces->Update();
  CHECK(faces->GetLack() == vtkPointsOnFaces::TOO_FEW_VERTICES);
  CHECK(!faces->GetOutput()->GetPointData()->GetNormals());
  CHECK(!faces->GetParts());
  vtkNew<vtkFloatArray> normals;
  normals->SetNumberOfComponents(3);
  normals->SetNumberOfTuples(mesh->GetNumberOfPoints());
  normals->Fill(1.0);
  mesh->GetPointData()->SetNormals(normals);
  mesh->Modified();
  faces->Update();
  CHECK(faces->GetOutput()->GetPointData()->GetNormals());
  CHECK(faces->GetParts());
}

/// Made normals repeat vertices at creases, which the mesh has not.
TEST_CASE("Few points are made of few vertices, with normals or without")
{
  const vtkNew<vtkPolyData> mesh = TwoCubes();
  vtkNew<vtkPointsOnFaces> faces;
  faces->SetInputData(mesh);
  faces->SetNumberOfPoints(20);
  for (const bool normals : { false, true })
  {
    faces->SetMakeNormals(normals);
    faces->Update();
    CHECK_NEAR(static_cast<double>(faces->GetOutput()->GetNumberOfPoints()), 20.0, 4.0);
  }
}

/// Reading on would read what is not there.
TEST_CASE("Arrays with too few values are left out, and that is said")
{
  vtkNew<vtkPointsOnFaces> faces;
  SurfelTesting::Messages messages(faces);
  for (const char* name : { "Normals", "Colors" })
  {
    const vtkNew<vtkPolyData> mesh = TwoCubes();
    vtkNew<vtkFloatArray> few;
    few->SetName(name);
    few->SetNumberOfComponents(3);
    few->SetNumberOfTuples(2);
    few->Fill(0.5);
    mesh->GetPointData()->AddArray(few);
    messages.Warnings.clear();
    faces->SetInputData(mesh);
    faces->Update();
    vtkPointData* data = faces->GetOutput()->GetPointData();
    CHECK(!data->HasArray("Colors"));
    REQUIRE(data->GetNormals()); // made of the faces
    CHECK(std::abs(data->GetNormals()->GetMaxNorm() - 1.0) < 1e-6);
    REQUIRE(messages.Warnings.size() == 1);
    CHECK(messages.Warnings[0].find(name) != std::string::npos);
  }
}

TEST_CASE("What tells its surface is passed, and forgets the mesh before")
{
  const vtkNew<vtkPolyData> mesh = TwoCubes();
  vtkNew<vtkPointsOnFaces> faces;
  faces->SetInputData(mesh);
  faces->Update();
  vtkNew<vtkPolyData> cloud;
  cloud->SetPoints(mesh->GetPoints());
  faces->SetInputData(cloud);
  faces->Update();
  CHECK(faces->GetLack() == vtkPointsOnFaces::NO_LACK);
  CHECK(!faces->GetIsModel());
  CHECK(!faces->GetParts());
  CHECK(faces->GetOutput()->GetPoints() == mesh->GetPoints());
  vtkNew<vtkPolyData> nothing;
  faces->SetInputData(nothing);
  faces->Update();
  CHECK(faces->GetOutput()->GetNumberOfPoints() == 0);
}

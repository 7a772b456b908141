// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels and hierarchies that were moved or selected: by filters behind them, and by actors.
 */
#include "RenderingTest.h"

#include "vtkSurfelHierarchyReader.h"
#include "vtkSurfelHierarchyWriter.h"
#include "vtkSurfelImageRenderer.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkMaskPoints.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkSurfelHierarchy.h>
#include <vtkTransform.h>
#include <vtkTransformFilter.h>

#include <cmath>
#include <cstdio>

using namespace RenderingTest;

TEST_SUITE_BEGIN("Moved");

namespace
{
/// A ball, a ground and a wall, in stripes: open, with corners, and one-sided.
vtkSmartPointer<vtkPolyData> Room(int count = 30000)
{
  SurfelBuilder builder;
  builder.AddSphere({ 0.2, 0.1, 0.3 }, 0.6, count);
  const int side = static_cast<int>(std::sqrt(count / 2.0));
  builder.AddGrid({ -1, -0.6, 1 }, { 2.0 / side, 0, 0 }, { 0, 0, -2.0 / side }, side, side);
  builder.AddGrid({ -1, -0.6, -0.6 }, { 2.0 / side, 0, 0 }, { 0, 1.5 / side, 0 }, side, side);
  const auto stripes = [](const Vector& p) {
    const bool red = std::sin(20.0 * (p[0] + p[1] + p[2])) > 0.0;
    return std::array<int, 4>{ red ? 230 : 40, red ? 60 : 200, 90, 255 };
  };
  builder.Color(stripes, 4); // vtkTransformFilter takes three for a vector
  return builder.Data;
}

vtkSmartPointer<vtkPolyData> WithNodes(vtkPolyData* surfels)
{
  vtkNew<vtkSurfelHierarchy> hierarchy;
  hierarchy->SetInputData(surfels);
  hierarchy->Update();
  return hierarchy->GetOutput();
}

/// Through a lens, so that nodes are drawn; of surfels with a matrix of their actor.
struct LensPicture
{
  LensPicture()
  {
    this->Camera = FrontCamera(6.0);
    this->Camera->SetFocalDisk(0.2);
    this->Camera->SetFocalDistance(5.0);
  }

  vtkSmartPointer<vtkImageData> Of(vtkPolyData* surfels, vtkTransform* transform = nullptr)
  {
    vtkSmartPointer<vtkActor> actor = SurfelActor(surfels);
    actor->SetUserTransform(transform);
    this->Renderer = vtkSmartPointer<vtkSurfelImageRenderer>::New();
    this->Renderer->AddActor(actor);
    this->Renderer->SetSize(200, 160);
    this->Renderer->SetCamera(this->Camera);
    this->Renderer->Update();
    return this->Renderer->GetOutput();
  }

  vtkIdType ChosenNodes() { return this->Renderer->GetSplatter()->GetNumberOfChosenNodes(); }

  vtkSmartPointer<vtkCamera> Camera;
  vtkSmartPointer<vtkSurfelImageRenderer> Renderer;
};

std::vector<vtkSmartPointer<vtkTransform>> Transforms()
{
  std::vector<vtkSmartPointer<vtkTransform>> transforms;
  for (int kind = 0; kind < 5; ++kind)
  {
    transforms.push_back(vtkSmartPointer<vtkTransform>::New());
  }
  transforms[0]->Translate(0.3, -0.2, 0.4);
  transforms[1]->RotateWXYZ(40.0, 1.0, 2.0, 0.5);
  transforms[2]->Scale(0.6, 0.6, 0.6);
  transforms[3]->RotateY(-25.0);
  transforms[3]->Scale(0.5, 1.2, 0.9);
  transforms[4]->Scale(-1.0, 1.0, 1.0);
  return transforms;
}

vtkSmartPointer<vtkPolyData> Transformed(vtkPolyData* input, vtkTransform* transform, bool vectors)
{
  vtkNew<vtkTransformFilter> filter;
  filter->SetInputData(input);
  filter->SetTransform(transform);
  filter->SetTransformAllInputVectors(vectors);
  filter->Update();
  return vtkPolyData::SafeDownCast(filter->GetOutput());
}

/// Surfels as a transformed scan would give them: kernels and area vectors as well.
vtkSmartPointer<vtkPolyData> TransformedSurfels(vtkPolyData* surfels, vtkTransform* transform)
{
  vtkSmartPointer<vtkPolyData> moved = Transformed(surfels, transform, false);
  double l[3][3];
  for (int i = 0; i < 9; ++i)
  {
    l[i / 3][i % 3] = transform->GetMatrix()->GetElement(i / 3, i % 3);
  }
  const double determinant = std::abs(vtkMath::Determinant3x3(l));
  double inverse[3][3];
  vtkMath::Invert3x3(l, inverse);
  auto* areas = moved->GetPointData()->GetArray("SurfelAreaVector");
  auto* covariances = moved->GetPointData()->GetArray("SurfelCovariance");
  for (vtkIdType i = 0; i < moved->GetNumberOfPoints(); ++i)
  {
    double a[3], s[6], to[3];
    areas->GetTuple(i, a);
    covariances->GetTuple(i, s);
    for (int r = 0; r < 3; ++r)
    {
      to[r] = determinant * (inverse[0][r] * a[0] + inverse[1][r] * a[1] + inverse[2][r] * a[2]);
    }
    areas->SetTuple(i, to);
    const double full[3][3] = { { s[0], s[3], s[5] }, { s[3], s[1], s[4] }, { s[5], s[4], s[2] } };
    double left[3][3], transposed[3][3], result[3][3];
    vtkMath::Multiply3x3(l, full, left);
    vtkMath::Transpose3x3(l, transposed);
    vtkMath::Multiply3x3(left, transposed, result);
    const double packed[6] = { result[0][0], result[1][1], result[2][2], result[0][1], result[1][2],
      result[0][2] };
    covariances->SetTuple(i, packed);
  }
  return moved;
}
}

/// The same as surfels whose values were transformed.
TEST_CASE_FIXTURE(NoMessages, "Matrices of actors")
{
  vtkSmartPointer<vtkPolyData> room = Room(), hierarchy = WithNodes(room);
  for (vtkTransform* transform : Transforms())
  {
    LensPicture truth, plain, withNodes;
    vtkSmartPointer<vtkPolyData> moved;
    moved = vtkSmartPointer<vtkPolyData>::New();
    moved->DeepCopy(room);
    moved = TransformedSurfels(moved, transform);
    vtkSmartPointer<vtkImageData> expected = truth.Of(moved);
    CHECK(Compare(expected, plain.Of(room, transform)).Mean < 1e-5);
    CHECK(Compare(expected, withNodes.Of(hierarchy, transform)).Mean < 2e-3);
  }
}

/// Behind the filter a transform moves points only, or vectors as well; an actor's matrix shows
/// what is meant.
TEST_CASE_FIXTURE(NoMessages, "Transforms behind the filter")
{
  vtkSmartPointer<vtkPolyData> hierarchy = WithNodes(Room());
  for (vtkTransform* transform : Transforms())
  {
    LensPicture matrix, filter;
    vtkSmartPointer<vtkImageData> expected = matrix.Of(hierarchy, transform);
    for (const bool vectors : { false, true })
    {
      CHECK(Compare(expected, filter.Of(Transformed(hierarchy, transform, vectors))).Mean < 1e-4);
      CHECK(filter.ChosenNodes() == matrix.ChosenNodes());
    }
  }
}

/// Points in double that are far from the origin, and their mapper's bounds.
TEST_CASE_FIXTURE(NoMessages, "Coordinates of a country")
{
  vtkSmartPointer<vtkPolyData> hierarchy = WithNodes(Room());
  LensPicture near, far;
  vtkSmartPointer<vtkImageData> expected = near.Of(hierarchy);
  vtkNew<vtkPolyData> moved;
  moved->ShallowCopy(hierarchy);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->DeepCopy(hierarchy->GetPoints());
  const double offset[3] = { 691608.3, 5334780.7, 512.1 };
  for (vtkIdType i = 0; i < points->GetNumberOfPoints(); ++i)
  {
    double p[3];
    points->GetPoint(i, p);
    points->SetPoint(i, p[0] + offset[0], p[1] + offset[1], p[2] + offset[2]);
  }
  moved->SetPoints(points);
  far.Camera->SetPosition(offset[0], offset[1], offset[2] + 6.0);
  far.Camera->SetFocalPoint(offset);
  CHECK(Compare(expected, far.Of(moved)).Mean < 1e-4);
  moved->GetFieldData()->RemoveArray("SurfelLeaves"); // without nodes
  CHECK(Compare(expected, far.Of(moved)).Mean < 2e-3);
}

/// Neighbours in the picture of all points are there, without level of detail, and a warning says
/// so once. A second hierarchy has no warning.
TEST_CASE_FIXTURE(NoMessages, "Selected points")
{
  vtkSmartPointer<vtkPolyData> hierarchy = WithNodes(Room());
  vtkNew<vtkMaskPoints> mask;
  mask->SetInputData(hierarchy);
  mask->SetMaximumNumberOfPoints(hierarchy->GetNumberOfPoints());
  mask->SetOnRatio(1);
  mask->SetOffset(7000);
  mask->GenerateVerticesOn();
  mask->SingleVertexPerCellOn();
  mask->Update();
  REQUIRE(mask->GetOutput()->GetNumberOfPoints() == hierarchy->GetNumberOfPoints() - 7000);
  vtkNew<vtkPolyData> plain;
  plain->ShallowCopy(mask->GetOutput());
  plain->GetFieldData()->Initialize();
  LensPicture truth, some, again;
  vtkSmartPointer<vtkImageData> expected = truth.Of(plain);
  CHECK(Compare(expected, some.Of(mask->GetOutput())).Max < 1e-6);
  CHECK(TakeMessages().find("Put vtkSurfelHierarchy after filters") != std::string::npos);
  some.Renderer->Modified();
  some.Renderer->Update();
  CHECK(TakeMessages().empty());
  CHECK(Compare(expected, again.Of(WithNodes(mask->GetOutput()))).Mean < 2e-3);
  CHECK(again.ChosenNodes() < plain->GetNumberOfPoints() / 2);
}

TEST_CASE_FIXTURE(NoMessages, "Warped points")
{
  vtkSmartPointer<vtkPolyData> hierarchy = WithNodes(Room());
  vtkNew<vtkPolyData> warped;
  warped->DeepCopy(hierarchy);
  for (vtkIdType i = 0; i < warped->GetNumberOfPoints(); ++i)
  {
    double p[3];
    warped->GetPoint(i, p);
    warped->GetPoints()->SetPoint(i, p[0], p[1] + 0.2 * std::sin(3.0 * p[0]), p[2]);
  }
  vtkNew<vtkPolyData> plain;
  plain->ShallowCopy(warped);
  plain->GetFieldData()->Initialize();
  LensPicture truth, picture;
  CHECK(Compare(truth.Of(plain), picture.Of(warped)).Max < 1e-6);
  CHECK(TakeMessages().find("Put vtkPointsToSurfels after filters") != std::string::npos);
  WithNodes(warped);
  CHECK(TakeMessages().find("turned, scaled or warped") != std::string::npos);
}

/// Files get the place of the points, and refuse points whose kernels were not turned.
TEST_CASE_FIXTURE(NoMessages, "Files of moved points")
{
  vtkSmartPointer<vtkPolyData> hierarchy = WithNodes(Room());
  vtkNew<vtkTransform> shift, turn;
  shift->Translate(0.3, 0.2, -0.5);
  turn->RotateX(30.0);
  const std::string path = "TestMoved.surfels";
  vtkNew<vtkSurfelHierarchyWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(Transformed(hierarchy, shift, false));
  CHECK(writer->Write() == 1);
  vtkNew<vtkSurfelHierarchyReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  LensPicture matrix, file;
  CHECK(Compare(matrix.Of(hierarchy, shift), file.Of(reader->GetOutput())).Mean < 1e-4);
  writer->SetInputData(Transformed(hierarchy, turn, false));
  CHECK(writer->Write() == 0);
  CHECK(TakeMessages().find("turned, scaled or warped") != std::string::npos);
  std::remove(path.c_str());
}

TEST_SUITE_END();

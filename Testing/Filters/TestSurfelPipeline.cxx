// SPDX-License-Identifier: BSD-3-Clause
// The filters in VTK's pipeline: arrays passed, coordinates far out, threads, files, abort.
#include "ProgressWatch.h"
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkFloatArray.h"
#include "vtkIntArray.h"
#include "vtkPointSet.h"
#include "vtkStringArray.h"
#include "vtkStructuredGrid.h"
#include "vtkUnsignedCharArray.h"
#include "vtkXMLPolyDataReader.h"
#include "vtkXMLPolyDataWriter.h"

#include <cstring>

using namespace SurfelTesting;

namespace
{
Sampled MakeScene()
{
  return MakeBallAndWall(12000, -1.1, 0.04);
}

vtkSmartPointer<vtkPolyData> Process(
  vtkPolyData* data, int kernelMode = vtkSurfelEstimation::CELL, bool interpolatesColors = true)
{
  vtkNew<vtkSurfelEstimation> estimation;
  vtkNew<vtkSurfelNormalization> normalization;
  Messages quiet(estimation);
  estimation->SetInputData(data);
  estimation->SetKernelMode(kernelMode);
  estimation->SetInterpolateColors(interpolatesColors);
  normalization->SetInputConnection(estimation->GetOutputPort());
  normalization->Update();
  return normalization->GetOutput();
}

bool SameBytes(vtkDataArray* a, vtkDataArray* b)
{
  return a && b && a->GetDataType() == b->GetDataType() &&
    a->GetNumberOfComponents() == b->GetNumberOfComponents() &&
    a->GetNumberOfTuples() == b->GetNumberOfTuples() &&
    std::memcmp(a->GetVoidPointer(0), b->GetVoidPointer(0),
      static_cast<size_t>(a->GetNumberOfValues()) * a->GetDataTypeSize()) == 0;
}

bool SameSurfels(vtkPolyData* a, vtkPolyData* b)
{
  bool same = SameBytes(a->GetPoints()->GetData(), b->GetPoints()->GetData());
  for (const char* name :
    { "SurfelCovariance", "SurfelAreaVector", "SurfelTwoSided", "SurfelOverlap" })
  {
    same = same && SameBytes(a->GetPointData()->GetArray(name), b->GetPointData()->GetArray(name));
  }
  return same &&
    SameBytes(
      a->GetFieldData()->GetArray("SurfelOrigin"), b->GetFieldData()->GetArray("SurfelOrigin"));
}

TEST_CASE("Threads")
{
  Sampled scene = MakeScene();
  Random random(9);
  Sampled rough = MakeRectangle({ 0, 0, 5 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.02, 1.0, random);
  for (Vec& p : rough.Points)
  {
    p[2] += random.Uniform(0.0, 0.06); // sheets that overlap
  }
  scene.Append(rough);
  const auto data = ToPolyData(scene.Points);
  const auto results = WithThreads({ 1, 2, 8 }, [&] { return Process(data); });
  CHECK(results[0]->GetPointData()->GetArray("SurfelOverlap")->GetRange()[1] > 50.0);
  CHECK(SameSurfels(results[0], results[1]));
  CHECK(SameSurfels(results[0], results[2]));
}

/// Every array of the surviving points passes, with its type, name and role.
TEST_CASE("Passing")
{
  const Sampled scene = MakeScene();
  auto data = ToPolyData(scene.Points);
  const vtkIdType count = data->GetNumberOfPoints();
  data->GetPoints()->SetPoint(5, std::nan(""), 0, 0);
  data->GetPoints()->SetPoint(9, data->GetPoint(3));
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("RGBA");
  colors->SetNumberOfComponents(4);
  vtkNew<vtkIntArray> ids;
  ids->SetName("Id");
  vtkNew<vtkStringArray> names;
  names->SetName("Name");
  vtkNew<vtkDoubleArray> field;
  field->SetName("Note");
  field->InsertNextValue(42.0);
  for (vtkIdType i = 0; i < count; ++i)
  {
    colors->InsertNextTuple4(i % 256, i / 256 % 256, 7, 255);
    ids->InsertNextValue(static_cast<int>(i));
    names->InsertNextValue(std::to_string(i));
  }
  data->GetPointData()->SetScalars(colors);
  data->GetPointData()->AddArray(ids);
  data->GetPointData()->AddArray(names);
  data->GetFieldData()->AddArray(field);
  // Leaves points in place, and colours as they are.
  const auto result = Process(data, vtkSurfelEstimation::CIRCULAR, false);
  vtkPointData* arrays = result->GetPointData();
  CHECK(result->GetNumberOfPoints() == count - 2);
  REQUIRE(arrays->GetScalars());
  CHECK(arrays->GetScalars()->GetDataType() == VTK_UNSIGNED_CHAR);
  CHECK(result->GetFieldData()->GetArray("Note") != nullptr);
  CHECK(result->GetNumberOfVerts() == 1);
  auto* resultNames = vtkStringArray::SafeDownCast(arrays->GetAbstractArray("Name"));
  vtkIdType wrong = 0;
  for (vtkIdType i = 0, from = 0; i < result->GetNumberOfPoints(); ++i, ++from)
  {
    from += from == 5 ? 1 : 0;
    from += from == 9 ? 1 : 0;
    double p[3], q[3];
    result->GetPoint(i, p);
    data->GetPoint(from, q);
    wrong += arrays->GetArray("Id")->GetComponent(i, 0) != from || p[0] != q[0] || p[2] != q[2] ||
        arrays->GetScalars()->GetComponent(i, 0) != from % 256 ||
        resultNames->GetValue(i) != std::to_string(from)
      ? 1
      : 0;
  }
  CHECK(wrong == 0);
}

/// Any vtkPointSet is an input.
TEST_CASE("Structured input")
{
  vtkNew<vtkStructuredGrid> grid;
  grid->SetDimensions(40, 30, 1);
  vtkNew<vtkPoints> points;
  for (int j = 0; j < 30; ++j)
  {
    for (int i = 0; i < 40; ++i)
    {
      points->InsertNextPoint(i, j, 0.1 * i);
    }
  }
  grid->SetPoints(points);
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(grid);
  estimation->Update();
  CHECK(estimation->GetOutput()->GetNumberOfPoints() == 1200);
}

/// The same cloud at UTM coordinates: the same surfels up to the rounding of positions.
TEST_CASE("Far coordinates")
{
  Sampled scene = MakeScene();
  for (Vec& p : scene.Points) // so that the sum below is exact
  {
    for (double& c : p)
    {
      c = std::round(c * 65536.0) / 65536.0;
    }
  }
  const auto near = Process(ToPolyData(scene.Points, VTK_DOUBLE));
  CHECK(near->GetFieldData()->GetArray("SurfelOrigin")->GetComponent(0, 0) == 0.0);
  const Vec shift{ 500000.0, 4649776.0, 312.0 };
  scene.Shift(shift);
  const auto far = Process(ToPolyData(scene.Points, VTK_DOUBLE));
  const Surfels a(near), b(far);
  CHECK(a.Count() == b.Count());
  double origin[3];
  far->GetFieldData()->GetArray("SurfelOrigin")->GetTuple(0, origin);
  for (const double c : origin)
  {
    CHECK(static_cast<double>(static_cast<float>(c)) == c);
  }
  double worstPosition = 0.0, worstArea = 0.0, worstCovariance = 0.0;
  vtkIdType sides = 0;
  for (vtkIdType i = 0; i < a.Count(); ++i)
  {
    const Vec p = a.Position(i);
    const Vec q = b.Position(i);
    for (int c = 0; c < 3; ++c)
    {
      worstPosition = std::max(worstPosition, std::abs(q[c] + origin[c] - p[c] - shift[c]));
    }
    const Vec d = Minus(a.AreaVector(i), b.AreaVector(i));
    const Vec s{ a.AreaVector(i)[0] + b.AreaVector(i)[0], a.AreaVector(i)[1] + b.AreaVector(i)[1],
      a.AreaVector(i)[2] + b.AreaVector(i)[2] };
    sides += a.IsTwoSided(i) != b.IsTwoSided(i) ? 1 : 0;
    // The sign of a two-sided surfel means nothing.
    const double difference = a.IsTwoSided(i) ? std::min(Length(d), Length(s)) : Length(d);
    worstArea = std::max(worstArea, difference / a.Area(i));
    worstCovariance =
      std::max(worstCovariance, std::abs(a.Covariance(i)[0] - b.Covariance(i)[0]) / a.Area(i));
  }
  CHECK(worstPosition <= 1e-6);
  CHECK(worstArea <= 0.02);
  CHECK(worstCovariance <= 0.02);
  CHECK(sides == 0);

  // Surfels as an input: their origin counts.
  vtkNew<vtkSurfelEstimation> again;
  again->SetInputData(far);
  again->Update();
  double secondOrigin[3];
  again->GetOutput()->GetFieldData()->GetArray("SurfelOrigin")->GetTuple(0, secondOrigin);
  CHECK_NEAR(secondOrigin[1], origin[1], 1e-9);
}

TEST_CASE("Files")
{
  const auto surfels = Process(ToPolyData(MakeScene().Points));
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(surfels);
  writer->SetDataModeToAppended();
  writer->WriteToOutputStringOn();
  writer->Write();
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(writer->GetOutputString());
  reader->Update();
  CHECK(SameSurfels(surfels, reader->GetOutput()));
}

/// Given normals are turned to the points; those that are estimated, one in ten here, become sharp
/// at edges.
TEST_CASE("Progress")
{
  Sampled scene = MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.02, 0.3, Random(1));
  scene.Append(MakeRectangle({ 0, 0, 0 }, { 0, 1, 0 }, 1, { 0, 0, 1 }, 1, 0.02, 0.3, Random(2)));
  for (std::size_t i = 0; i < scene.Normals.size(); i += 10)
  {
    scene.Normals[i] = {};
  }
  const auto data = ToPolyData(scene.Points);
  AddNormals(data, scene.Normals);
  vtkNew<vtkSurfelEstimation> estimation;
  Messages quiet(estimation);
  estimation->SetInputData(data);
  const ProgressWatch watch(estimation);
  estimation->Update();
  CHECK(estimation->GetNumberOfInvalidNormals() == 500);
  CHECK(!watch.Backwards);
  CHECK(watch.Last == 1.0);
}

TEST_CASE("Abort")
{
  const auto data = ToPolyData(MakeScene().Points);
  const auto surfels = Process(data);
  for (const double progress : { 0.01, 0.3, 0.65 })
  {
    vtkNew<vtkSurfelEstimation> estimation;
    const ProgressWatch watch(estimation, progress);
    estimation->SetInputData(data);
    estimation->Update();
    CHECK(estimation->GetOutput()->GetNumberOfPoints() == 0);

    vtkNew<vtkSurfelNormalization> normalization;
    const ProgressWatch second(normalization, progress);
    normalization->SetInputData(surfels);
    normalization->Update();
    CHECK(normalization->GetOutput()->GetNumberOfPoints() == 0);
  }
}

TEST_CASE("Printing")
{
  vtkNew<vtkSurfelEstimation> estimation;
  vtkNew<vtkSurfelNormalization> normalization;
  std::ostringstream text;
  estimation->Print(text);
  normalization->Print(text);
  for (const char* word : { "KernelScale: 0.5", "NumberOfNeighbors: 16", "SamplesPerPoint: 16" })
  {
    CHECK(text.str().find(word) != std::string::npos);
  }
}
}

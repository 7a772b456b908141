// SPDX-License-Identifier: BSD-3-Clause
/**
 * vtkSurfelHierarchy in the pipeline: arrays, attributes, origin, errors, abort, round trip. (What
 * its nodes hold: Core.Hierarchy.)
 */
#include "ProgressWatch.h"
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"
#include "vtkSurfelHierarchy.h"
#include "vtkSurfelNormalization.h"

#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkStringArray.h"
#include "vtkUnsignedCharArray.h"
#include "vtkXMLPolyDataReader.h"
#include "vtkXMLPolyDataWriter.h"

#include <string>

using namespace SurfelTesting;

namespace
{
vtkSmartPointer<vtkPolyData> SphereSurfels(int count, double offset = 0.0)
{
  Sampled sphere = MakeSphere(1.0, count, Random(1));
  for (Vec& p : sphere.Points)
  {
    p[0] += offset;
  }
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(sphere.Points));
  estimation->Update();
  vtkSmartPointer<vtkPolyData> surfels = estimation->GetOutput();
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("RGB");
  colors->SetNumberOfComponents(3);
  vtkNew<vtkFloatArray> height;
  height->SetName("height");
  vtkNew<vtkIdTypeArray> ids;
  ids->SetName("ids");
  vtkNew<vtkStringArray> names;
  names->SetName("names");
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    double p[3];
    surfels->GetPoint(i, p);
    const unsigned char c = static_cast<unsigned char>(127.5 + 127.0 * p[1]);
    const unsigned char rgb[3] = { c, 10, 250 };
    colors->InsertNextTypedTuple(rgb);
    height->InsertNextValue(static_cast<float>(p[1]));
    ids->InsertNextValue(i);
    names->InsertNextValue("surfel " + std::to_string(i));
  }
  surfels->GetPointData()->SetScalars(colors);
  surfels->GetPointData()->AddArray(height);
  surfels->GetPointData()->SetPedigreeIds(ids);
  surfels->GetPointData()->AddArray(names);
  return surfels;
}

TEST_CASE("Arrays")
{
  vtkSmartPointer<vtkPolyData> surfels = SphereSurfels(3000);
  vtkNew<vtkSurfelHierarchy> filter;
  filter->SetInputData(surfels);
  filter->Update();
  vtkPolyData* nodes = filter->GetOutput();
  const vtkIdType leaves = filter->GetNumberOfLeaves();
  CHECK(leaves == 3000);
  CHECK(nodes->GetNumberOfPoints() == leaves);
  CHECK(filter->GetNumberOfNodes() > 2 * leaves - 2);
  CHECK(filter->GetNumberOfNodes() < 2 * leaves + 40);
  CHECK(filter->GetNumberOfLevels() == 13);
  CHECK(Surfels(nodes).HasArrays());
  CHECK(Surfels(nodes).IsFinite());
  for (int i = 0; i < nodes->GetPointData()->GetNumberOfArrays(); ++i)
  {
    CHECK(nodes->GetPointData()->GetAbstractArray(i)->GetNumberOfTuples() == leaves);
  }
  vtkDataArray* packed = nodes->GetFieldData()->GetArray("SurfelNodes");
  REQUIRE(packed);
  CHECK(packed->GetNumberOfComponents() == 48);
  CHECK(packed->GetNumberOfTuples() == filter->GetNumberOfNodes() - leaves);
  CHECK(nodes->GetPoints()->GetDataType() == VTK_FLOAT);
  // VTK's own filters see the surfels.
  CHECK(nodes->GetNumberOfVerts() == 1);
  CHECK(nodes->GetVerts()->GetNumberOfConnectivityIds() == leaves);
  // Surfels keep what they had, in another order.
  vtkDataArray* ids = nodes->GetPointData()->GetArray("ids");
  vtkDataArray* height = nodes->GetPointData()->GetArray("height");
  vtkDataArray* colors = nodes->GetPointData()->GetScalars();
  REQUIRE(colors);
  CHECK(std::string(colors->GetName()) == "RGB");
  CHECK(nodes->GetPointData()->GetPedigreeIds() == ids);
  for (vtkIdType i = 0; i < leaves; ++i)
  {
    const auto id = static_cast<vtkIdType>(ids->GetTuple1(i));
    double p[3], q[3];
    surfels->GetPoint(id, p);
    nodes->GetPoint(i, q);
    CHECK_NEAR(p[0], q[0], 0.0);
    CHECK_NEAR(
      height->GetTuple1(i), surfels->GetPointData()->GetArray("height")->GetTuple1(id), 0.0);
  }
  auto* names = vtkStringArray::SafeDownCast(nodes->GetPointData()->GetAbstractArray("names"));
  REQUIRE(names);
  CHECK(names->GetValue(0) == "surfel " + std::to_string(static_cast<int>(ids->GetTuple1(0))));
}

TEST_CASE("Origin and doubles")
{
  vtkSmartPointer<vtkPolyData> far = SphereSurfels(500, 5e5); // with an origin of its own
  vtkNew<vtkSurfelHierarchy> filter;
  filter->SetInputData(far);
  filter->Update();
  double origin[3], before[3];
  filter->GetOutput()->GetFieldData()->GetArray("SurfelOrigin")->GetTuple(0, origin);
  far->GetFieldData()->GetArray("SurfelOrigin")->GetTuple(0, before);
  CHECK_NEAR(origin[0], before[0], 0.0);

  // Doubles far from the origin, as another program may write them.
  vtkNew<vtkPolyData> doubles;
  doubles->DeepCopy(far);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (vtkIdType i = 0; i < far->GetNumberOfPoints(); ++i)
  {
    double p[3];
    far->GetPoint(i, p);
    points->InsertNextPoint(p[0] + before[0], p[1] + before[1], p[2] + before[2]);
  }
  doubles->SetPoints(points);
  doubles->GetFieldData()->RemoveArray("SurfelOrigin");
  filter->SetInputData(doubles);
  filter->Update();
  vtkPolyData* nodes = filter->GetOutput();
  nodes->GetFieldData()->GetArray("SurfelOrigin")->GetTuple(0, origin);
  for (vtkIdType i = 0; i < filter->GetNumberOfLeaves(); ++i)
  {
    double p[3], q[3];
    nodes->GetPoint(i, p);
    points->GetPoint(
      static_cast<vtkIdType>(nodes->GetPointData()->GetArray("ids")->GetTuple1(i)), q);
    CHECK_NEAR(p[0] + origin[0], q[0], 1e-6);
  }
}

TEST_CASE("Troubles")
{
  vtkNew<vtkSurfelHierarchy> filter;
  Messages messages(filter);
  filter->SetInputData(ToPolyData(MakeSphere(1.0, 100, Random(2)).Points));
  filter->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("vtkPointsToSurfels") != std::string::npos);

  messages.Errors.clear();
  vtkNew<vtkSurfelHierarchy> first;
  first->SetInputData(SphereSurfels(100));
  vtkNew<vtkPolyData> warped;
  first->Update();
  warped->DeepCopy(first->GetOutput());
  for (vtkIdType i = 0; i < 100; i += 2)
  {
    warped->GetPoints()->SetPoint(i, 0.0, 0.01 * i, 3.0);
  }
  filter->SetInputData(warped);
  filter->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("turned, scaled or warped") != std::string::npos);

  messages.Errors.clear();
  vtkSmartPointer<vtkPolyData> faulty = SphereSurfels(100);
  faulty->GetPointData()->GetArray("SurfelCovariance")->SetComponent(3, 2, std::nan(""));
  filter->SetInputData(faulty);
  filter->Update();
  CHECK(messages.Errors.empty());
  CHECK(messages.Warnings.size() == 1);
  CHECK(filter->GetNumberOfInvalidSurfels() == 1);
  CHECK(filter->GetNumberOfLeaves() == 99);

  vtkSmartPointer<vtkPolyData> none = SphereSurfels(100);
  vtkNew<vtkPolyData> empty;
  empty->CopyStructure(none);
  empty->GetPointData()->CopyAllocate(none->GetPointData(), 0);
  empty->SetPoints(vtkNew<vtkPoints>());
  for (const char* name : { "SurfelCovariance", "SurfelAreaVector" })
  {
    vtkNew<vtkFloatArray> array;
    array->SetName(name);
    array->SetNumberOfComponents(std::string(name) == "SurfelCovariance" ? 6 : 3);
    empty->GetPointData()->AddArray(array);
  }
  filter->SetInputData(empty);
  filter->Update();
  CHECK(messages.Errors.empty());
  CHECK(filter->GetNumberOfNodes() == 0);
  CHECK(filter->GetOutput()->GetNumberOfPoints() == 0);
}

/// Of the surfels of a hierarchy, all or some of them.
TEST_CASE("A hierarchy of another one")
{
  vtkNew<vtkSurfelHierarchy> first, second;
  first->SetInputData(SphereSurfels(1000));
  second->SetInputConnection(first->GetOutputPort());
  second->Update();
  CHECK(second->GetNumberOfLeaves() == 1000);
  CHECK(second->GetNumberOfNodes() == first->GetNumberOfNodes());
  vtkNew<vtkPolyData> some;
  some->DeepCopy(first->GetOutput());
  some->GetPoints()->SetNumberOfPoints(300);
  for (int i = 0; i < some->GetPointData()->GetNumberOfArrays(); ++i)
  {
    some->GetPointData()->GetAbstractArray(i)->SetNumberOfTuples(300);
  }
  second->SetInputData(some);
  second->Update();
  CHECK(second->GetNumberOfLeaves() == 300);
  vtkFieldData* field = second->GetOutput()->GetFieldData();
  CHECK(field->GetArray("SurfelLeaves")->GetComponent(0, 0) == 300);
  CHECK(field->GetArray("SurfelNodes")->GetNumberOfTuples() == second->GetNumberOfNodes() - 300);
}

TEST_CASE("Progress and abort")
{
  vtkNew<vtkSurfelHierarchy> filter;
  filter->SetInputData(SphereSurfels(60000));
  ProgressWatch watch(filter);
  filter->Update();
  CHECK(watch.Events > 20);
  CHECK(!watch.Backwards);
  CHECK(watch.Last == 1.0);
  for (double at : { 0.01, 0.3, 0.6 })
  {
    watch.Restart(at);
    filter->Modified();
    filter->Update();
    CHECK(filter->GetOutput()->GetNumberOfPoints() == 0);
  }
}

/// Written and read back: the same arrays, bit by bit.
TEST_CASE("Round trip")
{
  vtkNew<vtkSurfelHierarchy> filter;
  filter->SetInputData(SphereSurfels(700));
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputConnection(filter->GetOutputPort());
  writer->SetFileName("TestSurfelHierarchy.vtp");
  writer->Write();
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName("TestSurfelHierarchy.vtp");
  reader->Update();
  vtkPolyData* a = filter->GetOutput();
  vtkPolyData* b = reader->GetOutput();
  CHECK(a->GetNumberOfPoints() == b->GetNumberOfPoints());
  CHECK(b->GetFieldData()->GetArray("SurfelLeaves")->GetComponent(0, 0) +
      b->GetFieldData()->GetArray("SurfelLeaves")->GetComponent(0, 1) ==
    700);
  for (const char* name : { "SurfelCovariance", "SurfelAreaVector", "RGB", "SurfelNodes" })
  {
    const bool ofNodes = std::string(name) == "SurfelNodes";
    vtkDataArray* x = (ofNodes ? a->GetAttributesAsFieldData(vtkDataObject::FIELD)
                               : a->GetAttributesAsFieldData(vtkDataObject::POINT))
                        ->GetArray(name);
    vtkDataArray* y = (ofNodes ? b->GetAttributesAsFieldData(vtkDataObject::FIELD)
                               : b->GetAttributesAsFieldData(vtkDataObject::POINT))
                        ->GetArray(name);
    REQUIRE(x);
    REQUIRE(y);
    CHECK(x->GetNumberOfComponents() == y->GetNumberOfComponents());
    CHECK(x->GetNumberOfValues() == y->GetNumberOfValues());
    for (vtkIdType i = 0; x && y && i < x->GetNumberOfTuples(); ++i)
    {
      for (int c = 0; c < x->GetNumberOfComponents(); ++c)
      {
        CHECK_NEAR(x->GetComponent(i, c), y->GetComponent(i, c), 0.0);
      }
    }
  }
}
}

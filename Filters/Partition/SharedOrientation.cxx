// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Partition/SharedOrientation.h"

#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Partition/PartitionedCloud.h"

#include "vtkFloatArray.h"
#include "vtkNew.h"
#include "vtkPoints.h"

#include <algorithm>
#include <utility>

using SurfelSplatting::Message;
using SurfelSplatting::MessageReader;
using SurfelSplatting::Put;

namespace SurfelGeometry
{
namespace
{
constexpr vtkIdType NoPoint = -1;

/// A point of a rank's region as it is sent to rank 0. Ids are numbered as in one process with all
/// points.
struct FittedPoint
{
  vtkIdType Id;
  float Position[3]; // relative to the distributed cloud's origin
  PlaneFit Fit;
  float Facing;                     // to its scanner, if the settings say so
  vtkIdType Neighbors[GraphDegree]; // nearest first, NoPoint at the end
};

/// Answer of rank 0 for a point.
struct OrientedPoint
{
  Float3 Normal; // outward
  unsigned char TwoSided, Known;
};

/// The points of all ranks as one cloud.
struct WholeCloud
{
  LocalCloud Cloud;
  NeighborGraph Graph;
  PlaneFits Fits;
  std::vector<float> Facings;
  std::vector<int> Indices; // [id] in the cloud, or NoPoint
};

int IndexOf(const WholeCloud& whole, vtkIdType id)
{
  return id >= 0 && id < static_cast<vtkIdType>(whole.Indices.size())
    ? whole.Indices[static_cast<size_t>(id)]
    : static_cast<int>(NoPoint);
}

void Assemble(const std::vector<FittedPoint>& fitted, const double origin[3], WholeCloud& whole)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(static_cast<vtkIdType>(fitted.size()));
  vtkIdType ids = 0;
  for (size_t i = 0; i < fitted.size(); ++i)
  {
    points->SetPoint(static_cast<vtkIdType>(i), fitted[i].Position);
    ids = std::max(ids, fitted[i].Id + 1);
  }
  GatherCloud(points, origin, whole.Cloud);
  const auto count = static_cast<size_t>(whole.Cloud.Size());
  whole.Indices.assign(static_cast<size_t>(ids), static_cast<int>(NoPoint));
  whole.Fits.resize(count);
  whole.Facings.resize(count);
  for (size_t i = 0; i < count; ++i)
  {
    const FittedPoint& point = fitted[static_cast<size_t>(whole.Cloud.InputIds[i])];
    whole.Indices[static_cast<size_t>(point.Id)] = static_cast<int>(i);
    whole.Fits[i] = point.Fit;
    whole.Facings[i] = point.Facing;
  }
  whole.Graph.Ids.assign(KeptNeighbors * count, static_cast<int>(NoPoint));
  for (size_t i = 0; i < count; ++i)
  {
    const FittedPoint& point = fitted[static_cast<size_t>(whole.Cloud.InputIds[i])];
    int* row = whole.Graph.Row(i);
    for (const vtkIdType neighbor : point.Neighbors)
    {
      const int index = IndexOf(whole, neighbor);
      if (index >= 0)
      {
        *row++ = index;
      }
    }
  }
}
}

/// The points of this rank's region, and the ids of all fetched points, whose signs it asks for.
Message SharedOrientation::PackRegion(const LocalCloud& cloud, const NeighborGraph& graph,
  const PlaneFits& fits, const std::vector<float>& facings) const
{
  const std::vector<vtkIdType> globalIds = this->Partition.GlobalIds();
  const auto count = static_cast<size_t>(cloud.Size());
  const auto idOf = [&](int i) { return globalIds[static_cast<size_t>(cloud.InputIds[i])]; };
  std::vector<FittedPoint> own;
  std::vector<vtkIdType> ids(count);
  for (size_t i = 0; i < count; ++i)
  {
    const vtkIdType fetched = cloud.InputIds[i];
    ids[i] = globalIds[static_cast<size_t>(fetched)];
    if (!this->Partition.IsInRegion(fetched))
    {
      continue;
    }
    FittedPoint point;
    point.Id = ids[i];
    std::copy_n(this->Partition.Position(fetched), 3, point.Position);
    point.Fit = fits[i];
    point.Facing = facings.empty() ? 0.0f : facings[i];
    const int* row = graph.Row(i);
    for (int k = 0; k < GraphDegree; ++k)
    {
      point.Neighbors[k] = row[k] >= 0 ? idOf(row[k]) : NoPoint;
    }
    own.push_back(point);
  }
  Message message;
  Put(own.size(), message);
  Put(own.data(), own.size(), message);
  Put(ids.data(), ids.size(), message);
  return message;
}

/// Rank 0: orients the points of all ranks. The answers are empty if stopped.
std::vector<Message> SharedOrientation::OrientAll(std::vector<Message> messages,
  const OutsideSettings& settings, const StageProgress& progress) const
{
  std::vector<FittedPoint> fitted;
  std::vector<std::vector<vtkIdType>> asked;
  for (Message& message : messages)
  {
    MessageReader reader(message);
    const size_t first = fitted.size();
    fitted.resize(first + reader.Get<size_t>());
    reader.Get(fitted.data() + first, fitted.size() - first);
    asked.emplace_back(reader.Size() / sizeof(vtkIdType));
    reader.Get(asked.back().data(), asked.back().size());
    Message().swap(message);
  }
  WholeCloud whole;
  Assemble(fitted, this->Partition.Origin(), whole);
  std::vector<FittedPoint>().swap(fitted);
  OutsideSettings own = settings;
  own.Facings = std::move(whole.Facings);
  const double* from = this->Partition.Origin();
  const double* to = whole.Cloud.Origin;
  own.Viewpoint = settings.Viewpoint + Vector3{ from[0] - to[0], from[1] - to[1], from[2] - to[2] };
  OrientationResult result;
  std::vector<Message> answers(messages.size());
  if (!OrientConsistently(whole.Cloud, whole.Graph, own, progress, whole.Fits, result))
  {
    return answers;
  }
  for (size_t rank = 0; rank < answers.size(); ++rank)
  {
    Put(result.NumberOfComponents, answers[rank]);
    Put(result.NumberOfClosedComponents, answers[rank]);
    std::vector<OrientedPoint> known;
    known.reserve(asked[rank].size());
    for (const vtkIdType id : asked[rank])
    {
      const int index = IndexOf(whole, id);
      known.push_back(index < 0 ? OrientedPoint{ Float3(), 1, 0 }
                                : OrientedPoint{ whole.Fits[static_cast<size_t>(index)].Normal,
                                    result.TwoSided[static_cast<size_t>(index)], 1 });
    }
    Put(known.data(), known.size(), answers[rank]);
  }
  return answers;
}

const double* SharedOrientation::Origin() const
{
  return this->Partition.Origin();
}

bool SharedOrientation::All(const std::function<bool()>& work)
{
  bool succeeded = false;
  this->Group.DoOwn([&] { succeeded = work(); });
  return this->Group.All(succeeded);
}

bool SharedOrientation::Orient(const LocalCloud& cloud, const NeighborGraph& graph,
  const OutsideSettings& settings, const StageProgress& progress, PlaneFits& fits,
  OrientationResult& result)
{
  std::vector<Message> messages =
    this->Group.ToRoot([&] { return this->PackRegion(cloud, graph, fits, settings.Facings); });
  std::vector<Message> answers;
  this->Group.DoOwn([&] {
    answers = this->Group.IsRoot() ? this->OrientAll(std::move(messages), settings, progress)
                                   : std::vector<Message>(static_cast<size_t>(this->Group.Size()));
    result.TwoSided.resize(static_cast<size_t>(cloud.Size()));
  });
  const Message answer = this->Group.Exchange(std::move(answers))[0];
  if (answer.empty())
  {
    return false; // stopped on rank 0
  }
  MessageReader reader(answer);
  result.NumberOfComponents = reader.Get<int>();
  result.NumberOfClosedComponents = reader.Get<int>();
  for (size_t i = 0; i < result.TwoSided.size(); ++i)
  {
    const auto point = reader.Get<OrientedPoint>();
    result.TwoSided[i] = point.TwoSided;
    if (point.Known && Dot(point.Normal, fits[i].Normal) < 0.0)
    {
      fits[i].Normal = -1.0 * fits[i].Normal;
    }
  }
  return true;
}
}

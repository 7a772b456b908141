// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Partition/SharedOrientation.h"

#include "Filters/Common/LocalCloud.h"
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

/// A point of a rank's region, as rank 0 sees it. Ids are those of one process with all points.
struct FittedPoint
{
  vtkIdType Id;
  float Position[3]; // about the dealt cloud's origin
  PlaneFit Fit;
  vtkIdType Neighbors[GraphDegree]; // nearest first, NoPoint at the end
};

/// What rank 0 says of it.
struct Side
{
  Float3 Normal; // outward
  unsigned char TwoSided, Known;
};

/// All ranks' points as one cloud.
struct WholeCloud
{
  LocalCloud Cloud;
  NeighborGraph Graph;
  std::vector<PlaneFit> Fits;
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
  for (size_t i = 0; i < count; ++i)
  {
    const FittedPoint& point = fitted[static_cast<size_t>(whole.Cloud.InputIds[i])];
    whole.Indices[static_cast<size_t>(point.Id)] = static_cast<int>(i);
    whole.Fits[i] = point.Fit;
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

std::vector<Message> SharedOrientation::OrientAll(std::vector<Message> messages,
  const OrientationSettings& settings, const StageProgress& monitor) const
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
  Assemble(fitted, this->Dealt.Origin(), whole);
  std::vector<FittedPoint>().swap(fitted);
  OrientationSettings own = settings;
  const double* from = this->Dealt.Origin();
  const double* to = whole.Cloud.Origin;
  own.Viewpoint = settings.Viewpoint + Vector3{ from[0] - to[0], from[1] - to[1], from[2] - to[2] };
  Sidedness sides;
  std::vector<Message> answers(messages.size());
  if (!OrientConsistently(whole.Cloud, whole.Graph, own, monitor, whole.Fits, sides))
  {
    return answers;
  }
  for (size_t rank = 0; rank < answers.size(); ++rank)
  {
    Put(sides.NumberOfComponents, answers[rank]);
    Put(sides.NumberOfClosedComponents, answers[rank]);
    std::vector<Side> known;
    known.reserve(asked[rank].size());
    for (const vtkIdType id : asked[rank])
    {
      const int index = IndexOf(whole, id);
      known.push_back(index < 0 ? Side{ Float3(), 1, 0 }
                                : Side{ whole.Fits[static_cast<size_t>(index)].Normal,
                                    sides.TwoSided[static_cast<size_t>(index)], 1 });
    }
    Put(known.data(), known.size(), answers[rank]);
  }
  return answers;
}

const double* SharedOrientation::Origin() const
{
  return this->Dealt.Origin();
}

bool SharedOrientation::Orient(const LocalCloud& cloud, const NeighborGraph& graph,
  const OrientationSettings& settings, const StageProgress& monitor, std::vector<PlaneFit>& fits,
  Sidedness& sides)
{
  const std::vector<vtkIdType> globalIds = this->Dealt.GlobalIds();
  const auto count = static_cast<size_t>(cloud.Size());
  const auto idOf = [&](int i) { return globalIds[static_cast<size_t>(cloud.InputIds[i])]; };
  std::vector<FittedPoint> mine;
  std::vector<vtkIdType> ids(count);
  for (size_t i = 0; i < count; ++i)
  {
    const vtkIdType dealt = cloud.InputIds[i];
    ids[i] = globalIds[static_cast<size_t>(dealt)];
    if (!this->Dealt.IsMine(dealt))
    {
      continue;
    }
    FittedPoint point;
    point.Id = ids[i];
    std::copy_n(this->Dealt.Position(dealt), 3, point.Position);
    point.Fit = fits[i];
    const int* row = graph.Row(i);
    for (int k = 0; k < GraphDegree; ++k)
    {
      point.Neighbors[k] = row[k] >= 0 ? idOf(row[k]) : NoPoint;
    }
    mine.push_back(point);
  }
  Message message;
  Put(mine.size(), message);
  Put(mine.data(), mine.size(), message);
  Put(ids.data(), ids.size(), message);
  std::vector<Message> messages = this->Group.ToRoot(std::move(message));
  std::vector<Message> answers(static_cast<size_t>(this->Group.Size()));
  if (this->Group.IsRoot())
  {
    answers = this->OrientAll(std::move(messages), settings, monitor);
  }
  const Message answer = this->Group.Exchange(std::move(answers))[0];
  if (answer.empty())
  {
    return false; // stopped on rank 0
  }
  MessageReader reader(answer);
  sides.NumberOfComponents = reader.Get<int>();
  sides.NumberOfClosedComponents = reader.Get<int>();
  sides.TwoSided.resize(count);
  for (size_t i = 0; i < count; ++i)
  {
    const Side side = reader.Get<Side>();
    sides.TwoSided[i] = side.TwoSided;
    if (side.Known && Dot(side.Normal, fits[i].Normal) < 0.0)
    {
      fits[i].Normal = -1.0 * fits[i].Normal;
    }
  }
  return true;
}
}

// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Partition/PartitionedCloud.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Neighbors/LocalCloud.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

using SurfelSplatting::Message;
using SurfelSplatting::MessageOf;
using SurfelSplatting::MessageReader;
using SurfelSplatting::Put;

namespace SurfelGeometry
{
namespace
{
/// Number of points, from all ranks together, that determine the regions.
constexpr vtkIdType SampleSize = 200000;

/// Summary of its points that each rank sends.
struct CloudSummary
{
  vtkIdType Count;
  double Lower[3], Upper[3], Origin[3];
};

/// Spacing of a surface through a region, from every step-th point.
double SpacingIn(const std::vector<float>& sample, const CloudRegion& region, std::size_t step)
{
  const std::vector<vtkIdType> inside = FindInside(sample, region);
  float lower[3] = {}, upper[3] = {};
  for (std::size_t i = 0; i < inside.size(); ++i)
  {
    for (int c = 0; c < 3; ++c)
    {
      const float x = sample[static_cast<std::size_t>(3 * inside[i] + c)];
      lower[c] = i == 0 ? x : std::min(lower[c], x);
      upper[c] = i == 0 ? x : std::max(upper[c], x);
    }
  }
  const double diagonal = std::hypot(upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]);
  return diagonal / std::sqrt(std::max(1.0, static_cast<double>(inside.size() * step)));
}

/// The regions of all ranks and their spacings, from every step-th point of each rank.
Message PackRegions(const std::vector<Message>& samples, std::size_t step)
{
  std::vector<float> sample;
  for (const Message& other : samples)
  {
    const std::size_t at = sample.size(), more = other.size() / sizeof(float);
    sample.resize(at + more);
    MessageReader(other).Get(sample.data() + at, more);
  }
  const std::vector<CloudRegion> regions = CutEvenly(sample, static_cast<int>(samples.size()));
  Message message;
  Put(regions.data(), regions.size(), message);
  for (const CloudRegion& region : regions)
  {
    Put(SpacingIn(sample, region, step), message);
  }
  return message;
}
}

PartitionedCloud::PartitionedCloud(SurfelSplatting::Ranks& ranks, vtkPointSet* input)
  : Group(ranks)
{
  ranks.DoTogether([&] {
    this->ShareOrigin(input);
    this->Cut();
  });
}

/// Finds the origin that one process would choose, and places this rank's points relative to it.
void PartitionedCloud::ShareOrigin(vtkPointSet* input)
{
  CloudSummary own{};
  vtkPoints* points = input ? input->GetPoints() : nullptr;
  if (points)
  {
    ReadOrigin(input, own.Origin);
    own.Count = FindBounds(points, own.Lower, own.Upper);
    this->NonFinite = points->GetNumberOfPoints() - own.Count;
  }
  CloudSummary all{};
  for (const Message& other : this->Group.Share([&] { return MessageOf(own); }))
  {
    const auto part = MessageReader(other).Get<CloudSummary>();
    if (part.Count == 0)
    {
      continue;
    }
    if (all.Count == 0)
    {
      all = part;
      continue;
    }
    for (int c = 0; c < 3; ++c)
    {
      const double shift = part.Origin[c] - all.Origin[c];
      all.Lower[c] = std::min(all.Lower[c], part.Lower[c] + shift);
      all.Upper[c] = std::max(all.Upper[c], part.Upper[c] + shift);
    }
    all.Count += part.Count;
  }
  ChooseOrigin(all.Lower, all.Upper, all.Origin, this->CommonOrigin);
  if (points)
  {
    PlaceAbout(points, own.Origin, this->CommonOrigin, this->Positions);
  }
}

void PartitionedCloud::Cut()
{
  const std::size_t count = this->Positions.size() / 3;
  for (const Message& other :
    this->Group.Share([&] { return MessageOf(static_cast<vtkIdType>(count)); }))
  {
    this->FirstIds.push_back(this->Total);
    this->Total += MessageReader(other).Get<vtkIdType>();
  }
  const auto step = static_cast<std::size_t>(std::max<vtkIdType>(1, this->Total / SampleSize));
  const std::vector<Message> samples = this->Group.ToRoot([&] {
    Message message;
    for (std::size_t i = 0; i < count; i += step)
    {
      Put(this->Positions.data() + 3 * i, 3, message);
    }
    return message;
  });
  const Message message = this->Group.FromRoot([&] { return PackRegions(samples, step); });
  MessageReader reader(message);
  this->Regions.resize(static_cast<std::size_t>(this->Group.Size()));
  this->Spacings.resize(this->Regions.size());
  reader.Get(this->Regions.data(), this->Regions.size());
  reader.Get(this->Spacings.data(), this->Spacings.size());
}

std::vector<vtkIdType> PartitionedCloud::GlobalIds() const
{
  std::vector<vtkIdType> ids;
  ids.reserve(this->Fetched.size());
  for (const PointKey& key : this->Fetched)
  {
    ids.push_back(this->FirstIds[static_cast<std::size_t>(key.Rank)] + key.Id);
  }
  return ids;
}

/// Packs this rank's points in a region: number, ids, positions, arrays.
Message PartitionedCloud::PackInside(
  const CloudRegion& region, const std::vector<Array>& arrays) const
{
  const std::vector<vtkIdType> ids = FindInside(this->Positions, region);
  Message message;
  Put(ids.size(), message);
  Put(ids.data(), ids.size(), message);
  std::vector<float> values;
  values.reserve(3 * ids.size());
  for (const vtkIdType id : ids)
  {
    values.insert(
      values.end(), this->Positions.begin() + 3 * id, this->Positions.begin() + 3 * id + 3);
  }
  Put(values.data(), values.size(), message);
  for (const Array& array : arrays)
  {
    values.assign(static_cast<std::size_t>(array.Components) * ids.size(), 0.0f);
    for (std::size_t i = 0; array.Values && i < ids.size(); ++i)
    {
      for (int c = 0; c < array.Components; ++c)
      {
        values[i * array.Components + c] =
          static_cast<float>(array.Values->GetComponent(ids[i], c));
      }
    }
    Put(values.data(), values.size(), message);
  }
  return message;
}

/// Unpacks what PackInside has packed, rank after rank.
vtkSmartPointer<vtkPolyData> PartitionedCloud::Unpack(
  const std::vector<Message>& messages, const std::vector<Array>& arrays)
{
  this->Fetched.clear();
  std::vector<MessageReader> readers;
  std::vector<std::size_t> sizes;
  for (std::size_t rank = 0; rank < messages.size(); ++rank)
  {
    readers.emplace_back(messages[rank]);
    sizes.push_back(readers[rank].Get<std::size_t>());
    std::vector<vtkIdType> ids(sizes[rank]);
    readers[rank].Get(ids.data(), ids.size());
    for (const vtkIdType id : ids)
    {
      this->Fetched.push_back({ static_cast<std::int32_t>(rank), id });
    }
  }
  const auto read = [&](float* to, int components) {
    for (std::size_t rank = 0; rank < readers.size(); ++rank)
    {
      const std::size_t count = sizes[rank] * static_cast<std::size_t>(components);
      readers[rank].Get(to, count);
      to += count;
    }
  };
  const auto count = static_cast<vtkIdType>(this->Fetched.size());
  this->FetchedPositions.resize(3 * this->Fetched.size());
  read(this->FetchedPositions.data(), 3);
  auto positions = MakeArray<vtkFloatArray>("Points", 3, count);
  std::copy(this->FetchedPositions.begin(), this->FetchedPositions.end(), positions->GetPointer(0));
  vtkNew<vtkPoints> points;
  points->SetData(positions);
  auto region = vtkSmartPointer<vtkPolyData>::New();
  region->SetPoints(points);
  for (const Array& array : arrays)
  {
    auto values = MakeArray<vtkFloatArray>(array.Name, array.Components, count);
    read(values->GetPointer(0), array.Components);
    region->GetPointData()->AddArray(values);
  }
  auto ids = MakeArray<vtkIdTypeArray>(IdArray, 1, count);
  std::iota(ids->GetPointer(0), ids->GetPointer(0) + count, vtkIdType{ 0 });
  region->GetPointData()->AddArray(ids);
  auto origin = MakeArray<vtkDoubleArray>(SurfelSplatting::Arrays::Origin, 3, 1);
  origin->SetTuple(0, this->CommonOrigin);
  region->GetFieldData()->AddArray(origin);
  return region;
}

vtkSmartPointer<vtkPolyData> PartitionedCloud::Fetch(
  double haloWidth, const std::vector<Array>& arrays)
{
  const std::vector<Message> regions =
    this->Group.Share([&] { return MessageOf(this->Region().Grown(haloWidth)); });
  std::vector<Message> messages;
  this->Group.DoOwn([&] {
    for (const Message& other : regions)
    {
      messages.push_back(this->PackInside(MessageReader(other).Get<CloudRegion>(), arrays));
    }
  });
  messages = this->Group.Exchange(std::move(messages));
  vtkSmartPointer<vtkPolyData> region;
  this->Group.DoOwn([&] { region = this->Unpack(messages, arrays); });
  return region;
}

std::vector<PartitionedCloud::Array> PartitionedCloud::OfAny(
  SurfelSplatting::Ranks& ranks, const std::vector<Array>& arrays)
{
  std::vector<Array> shared;
  for (const Array& array : arrays)
  {
    if (ranks.Any(array.Values != nullptr))
    {
      shared.push_back(array);
    }
  }
  return shared;
}

PartitionedCloud::Returned PartitionedCloud::Return(const Results& results)
{
  const auto components = static_cast<std::size_t>(results.Components);
  std::vector<Message> messages(static_cast<std::size_t>(this->Group.Size()));
  Returned returned;
  this->Group.DoOwn([&] {
    for (std::size_t i = 0; i < results.Points.size(); ++i)
    {
      const PointKey& key = this->Fetched[static_cast<std::size_t>(results.Points[i])];
      Message& message = messages[static_cast<std::size_t>(key.Rank)];
      Put(key.Id, message);
      Put(results.Values.data() + i * components, components, message);
    }
    const std::size_t count = this->Positions.size() / 3;
    returned.Has.assign(count, 0);
    returned.Values.assign(count * components, 0.0f);
  });
  for (const Message& message : this->Group.Exchange(std::move(messages)))
  {
    for (MessageReader reader(message); reader.Size() > 0;)
    {
      const auto id = static_cast<std::size_t>(reader.Get<vtkIdType>());
      returned.Has[id] = 1;
      reader.Get(returned.Values.data() + id * components, components);
    }
  }
  return returned;
}
}

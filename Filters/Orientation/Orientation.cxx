// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/Orientation.h"

#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/ParityUnionFind.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Orientation/ConsistentSets.h"
#include "Filters/Orientation/OrientationGraph.h"
#include "Filters/Orientation/Rooms.h"
#include "Filters/Orientation/ScannerSides.h"
#include "Filters/Orientation/SignPropagation.h"

#include <algorithm>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// Smaller patches are decided with others; points.
constexpr int MinPatch = 30;

/// What is known of the patch of a point.
enum class PatchKind : unsigned char
{
  Decided,
  Open, // its outside is unknown
  Small,
};

/// One execution.
class Orienter
{
public:
  Orienter(const LocalCloud& cloud, const NeighborGraph& graph, const OutsideSettings& settings,
    PlaneFits& fits)
    : Cloud(cloud)
    , Graph(graph)
    , Settings(settings)
    , Fits(fits)
    , Seen(settings.UseScanners ? FindSurelySeen(fits, settings.Facings)
                                : std::vector<unsigned char>())
    , Evidence(Seen.begin(), Seen.end())
    , Edges(CollectVotes(cloud, fits, graph, Seen))
    , Signs(cloud.Size())
    , Sides(fits.size(), 0)
    , Kinds(fits.size(), PatchKind::Decided)
  {
  }

  /// Returns false if stopped.
  bool Run(const StageProgress& progress, OrientationResult& result)
  {
    JoinSureEdges(this->Edges, this->Signs, this->Evidence);
    ReturnFreeMemory();
    const double decided = this->Settings.UseScanners ? 1.0 : 0.9;
    const bool finished = progress.Step(0.3) &&
      this->DecideSets(progress.Part(0.3, 0.5),
        [this](
          const OutsideInput& input, const Component& patch) { this->TakePatch(input, patch); }) &&
      this->OpenBesideOpen() &&
      JoinPatches({ this->Graph, this->Edges, this->Fits }, progress.Part(0.5, 0.7), this->Signs,
        this->Sides) &&
      this->DecideSets(progress.Part(0.7, decided),
        [this, &result](const OutsideInput& input, const Component& component) {
          this->TakeComponent(input, component, result);
        }) &&
      (this->Settings.UseScanners || this->TurnRooms(progress.Part(decided, 1.0), result));
    result.NumberOfComponents = this->NumberOfSets;
    return finished;
  }

private:
  /// Calls function(set) for the number of each set. Returns false if stopped.
  template <typename Function>
  bool ForSets(const ConsistentSets& sets, const StageProgress& progress, Function&& function)
  {
    for (int c = 0; c < sets.Count(); ++c)
    {
      function(c);
      // There may be as many sets as points: no report for each.
      const bool report = c % 1024 == 0 || sets.Size(c) > 1024;
      if (report && !progress.Step(static_cast<double>(sets.Starts[c + 1]) / this->Cloud.Size()))
      {
        return false;
      }
    }
    return true;
  }

  /// Calls decide(input, set) for the sets that are joined so far. Returns false if stopped.
  template <typename Decide>
  bool DecideSets(const StageProgress& progress, Decide&& decide)
  {
    const ConsistentSets sets = CollectSets(this->Cloud.Size(), this->Signs);
    const OutsideInput input{ { this->Cloud, this->Fits, this->Signs.FlatFlips() },
      [this](const Component& set) {
        return ConflictOf(this->Graph, this->Edges, this->Signs, set.Ids, set.Count);
      } };
    this->NumberOfSets = sets.Count();
    return this->ForSets(sets, progress, [&](int c) {
      decide(input, Component{ sets.Begin(c), sets.Size(c) });
    });
  }

  /// The side of a set, at its root.
  signed char& SideOf(const Component& set)
  {
    return this->Sides[this->Signs.Find(set.Ids[0]).first];
  }

  /// What its points have seen for the sign of a set's root.
  int EvidenceOf(const Component& set)
  {
    return this->Evidence.empty() ? 0 : this->Evidence[this->Signs.Find(set.Ids[0]).first];
  }

  /// Whether a normal with its final sign is turned away from its scanner.
  bool IsTurnedAway(const OutsideInput& input, int i, int side) const
  {
    if (!this->Settings.UseScanners)
    {
      return false;
    }
    const bool isFlipped = (input.Oriented.Flips[i] != 0) != (side < 0);
    return (isFlipped ? -1.0 : 1.0) * this->Settings.Facings[i] < -MostTurnedAway;
  }

  void TakePatch(const OutsideInput& input, const Component& patch)
  {
    const int seen = this->EvidenceOf(patch);
    signed char& side = this->SideOf(patch);
    if (patch.Count < MinPatch)
    {
      side = static_cast<signed char>(seen >= EnoughSeen ? 1 : seen <= -EnoughSeen ? -1 : 0);
    }
    else
    {
      side = static_cast<signed char>(DecidePatch(input, this->Settings, patch).Sign);
    }
    for (int m = 0; side == 0 && m < patch.Count; ++m)
    {
      this->Kinds[patch.Ids[m]] = patch.Count < MinPatch ? PatchKind::Small : PatchKind::Open;
    }
  }

  /// Small patches between decided ones have their outside, those at the edges of open ones have
  /// none: signs cross such edges by chance. Returns true.
  bool OpenBesideOpen()
  {
    std::vector<PatchKind> kinds(this->Kinds.size());
    ParallelFor(0, this->Cloud.Size(), [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        const bool isOpen = this->Kinds[i] == PatchKind::Open ||
          (this->Kinds[i] == PatchKind::Small && this->IsBesideOpen(i));
        kinds[i] = isOpen ? PatchKind::Open : PatchKind::Decided;
      }
    });
    this->Kinds = std::move(kinds);
    return true;
  }

  /// Whether more neighbours are in open patches than in decided ones.
  bool IsBesideOpen(vtkIdType i) const
  {
    const int* row = this->Graph.Row(static_cast<std::size_t>(i));
    int more = 0;
    for (int k = 0; k < GraphDegree && row[k] >= 0; ++k)
    {
      const PatchKind kind = this->Kinds[static_cast<std::size_t>(row[k])];
      more += kind == PatchKind::Open ? 1 : kind == PatchKind::Decided ? -1 : 0;
    }
    return more > 0;
  }

  /// Turns the normals of a component outward, and marks the points that have an outside: all, or
  /// those of its decided patches and the small patches between them.
  void TakeComponent(
    const OutsideInput& input, const Component& component, OrientationResult& result)
  {
    const signed char patches = this->SideOf(component);
    const bool isDecided = patches != 0 &&
      std::none_of(component.Ids, component.Ids + component.Count,
        [this](int i) { return this->Kinds[i] == PatchKind::Open; });
    const OutsideSign outside =
      isDecided ? OutsideSign{ patches, true } : DecideComponent(input, this->Settings, component);
    const int side = patches != 0 ? patches : outside.Sign;
    const bool isWhole = outside.Sign != 0 && side == outside.Sign;
    result.NumberOfClosedComponents += outside.IsClosed ? 1 : 0;
    ForPieces(component.Count, [&](vtkIdType, vtkIdType first, vtkIdType last) {
      for (vtkIdType m = first; m < last; ++m)
      {
        const int i = component.Ids[m];
        PlaneFit& fit = this->Fits[i];
        const bool isKnown = isWhole || (side != 0 && this->Kinds[i] != PatchKind::Open);
        const bool hasOutside =
          fit.SideGiven || (isKnown && fit.HasPlane() && !this->IsTurnedAway(input, i, side));
        result.TwoSided[i] = hasOutside ? 0 : 1;
        if (!fit.SideGiven)
        {
          const Vector3 normal = input.Oriented.Normal(i);
          fit.Normal = side < 0 ? -1.0 * normal : normal;
        }
      }
    });
  }

  /// Turns the normals of rooms inward. All are outward before. Returns false if stopped.
  bool TurnRooms(const StageProgress& progress, const OrientationResult& result)
  {
    const ConsistentSets sets = CollectSets(this->Cloud.Size(), this->Signs);
    return this->ForSets(sets, progress, [&](int c) {
      const Component component{ sets.Begin(c), sets.Size(c) };
      if (IsRoom(this->Cloud, this->Graph, this->Fits, result.TwoSided, sets, c))
      {
        for (int m = 0; m < component.Count; ++m)
        {
          Float3& normal = this->Fits[component.Ids[m]].Normal;
          normal = -1.0 * Vector3(normal);
        }
      }
    });
  }

  const LocalCloud& Cloud;
  const NeighborGraph& Graph;
  const OutsideSettings& Settings;
  PlaneFits& Fits;
  std::vector<unsigned char> Seen; // [n] with UseScanners
  std::vector<int> Evidence;       // [n] as in JoinSeen, with UseScanners
  EdgeVotes Edges;
  ParityUnionFind Signs;
  std::vector<signed char> Sides; // [n] as in JoinPatches
  std::vector<PatchKind> Kinds;   // [n]
  int NumberOfSets = 0;
};
}

void FaceViewpoint(const LocalCloud& cloud, const Vector3& viewpoint, PlaneFits& fits)
{
  ParallelFor(0, cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      if (Dot(fits[i].Normal, viewpoint - Load(cloud.Position(static_cast<int>(i)))) < 0.0)
      {
        fits[i].Normal = -1.0 * fits[i].Normal;
      }
    }
  });
}

bool OrientConsistently(const LocalCloud& cloud, const NeighborGraph& graph,
  const OutsideSettings& settings, const StageProgress& progress, PlaneFits& fits,
  OrientationResult& result)
{
  result.TwoSided.assign(fits.size(), 1);
  return Orienter(cloud, graph, settings, fits).Run(progress, result);
}
}

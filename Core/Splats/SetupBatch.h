// SPDX-License-Identifier: BSD-3-Clause
/**
 * First stage of the set-up: reads as many surfels as Real has lanes, transforms them to camera
 * space, and culls those that cannot be seen.
 */
#pragma once

#include "Core/Lens/Lens.h"
#include "Core/Simd/Rows.h"
#include "Core/Splats/SetupConstants.h"
#include "Core/Splats/SetupTarget.h"

namespace SurfelSplatting
{
/// Indices of the surfels in the lanes. If the last batch is not full, it repeats a surfel.
template <class Real>
struct BatchIndices
{
  std::size_t I[LaneTypes<Real>::Count], Parents[LaneTypes<Real>::Count];
  std::uint64_t FirstLeaf; ///< of surfel I[0], as in CutRange
  int Count;               ///< of surfels, in the first lanes
  int Level;               ///< level in the hierarchy, the same for all lanes; 0: surfels
  double Merging;          ///< with the parents, the same for all lanes (CutRange.h)

  SURFELSPLATTING_INLINE std::size_t operator[](int lane) const { return this->I[lane]; }
  SURFELSPLATTING_INLINE MaskOf<Real> ArePresent() const { return LanesBefore<Real>(this->Count); }
  SURFELSPLATTING_INLINE bool HasNodes() const { return this->Level > 0 || this->Merging > 0.0; }

  /// The first leaf of a surfel.
  SURFELSPLATTING_INLINE std::uint64_t LeafOf(int lane) const
  {
    return this->FirstLeaf +
      (static_cast<std::uint64_t>(this->I[lane] - this->I[0]) << this->Level);
  }

  SURFELSPLATTING_INLINE BatchIndices AtParents() const
  {
    BatchIndices parents = *this;
    for (int l = 0; l < LaneTypes<Real>::Count; ++l)
    {
      parents.I[l] = this->Parents[l];
    }
    ++parents.Level;
    parents.Merging = 0.0;
    return parents;
  }
};

/// Calls function(lane) for each lane and widens the results.
template <class Real, class Function>
SURFELSPLATTING_INLINE Real GatherFloats(Function&& function)
{
  return Widen<Real>(FillLanes<FloatOf<Real>>(LaneTypes<Real>::Count, function));
}

template <class Real, class Function>
SURFELSPLATTING_INLINE Real GatherInts(Function&& function)
{
  return WidenInt<Real>(FillLanes<IntOf<Real>>(LaneTypes<Real>::Count, function));
}

template <class Real, class Function>
SURFELSPLATTING_INLINE MaskOf<Real> GatherMask(Function&& function)
{
  return FillLanes<MaskOf<Real>>(
    LaneTypes<Real>::Count, [&](int l) { return function(l) ? -1 : 0; });
}

/// Reads a field of an array with the given stride.
template <class Real>
SURFELSPLATTING_INLINE Real Gather(const float* field, const BatchIndices<Real>& index, int stride)
{
  return GatherFloats<Real>([&](int l) { return field[stride * index[l]]; });
}

/// Reads vectors from an array [n][3].
template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> GatherVectors(
  const float* vectors, const BatchIndices<Real>& index)
{
  const auto c = LoadColumns<Real, 12>(0, [&](int l) { return vectors + 3 * index[l]; });
  return { c.Float(0), c.Float(1), c.Float(2) };
}

/// Reads matrices of six floats. @param row function(lane): the lane's matrix
template <class Real, class Function>
SURFELSPLATTING_INLINE Symmetric3Of<Real> GatherCovariances(Function&& row)
{
  const auto a = LoadColumns<Real>(0, row);
  const auto b = LoadColumns<Real, 8>(16, row);
  return { a.Float(0), a.Float(1), a.Float(2), a.Float(3), b.Float(0), b.Float(1) };
}

/// Surfels or nodes as they are stored.
template <class Real>
struct StoredSurfels
{
  Vector3Of<Real> Position, Area;
  Symmetric3Of<Real> Covariance;
  MaskOf<Real> TwoSided;
  Real Size;    ///< sum of the leaves' areas, world units squared; of nodes
  Real Patch;   ///< area that MinNodeBlur applies to, over the own area; 0 for surfels
  Real Overlap; ///< SurfelCloud::OverlapOf
};

template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> GatherPosition(
  const SurfelCloud& cloud, const BatchIndices<Real>& index)
{
  if (cloud.PositionsFloat)
  {
    return GatherVectors(cloud.PositionsFloat, index);
  }
  const double* p = cloud.PositionsDouble;
  constexpr int count = LaneTypes<Real>::Count;
  return { FillLanes<Real>(count, [&](int l) { return p[3 * index[l]]; }),
    FillLanes<Real>(count, [&](int l) { return p[3 * index[l] + 1]; }),
    FillLanes<Real>(count, [&](int l) { return p[3 * index[l] + 2]; }) };
}

template <class Real>
SURFELSPLATTING_INLINE void GatherSurfels(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, StoredSurfels<Real>& s)
{
  s.Position = GatherPosition(cloud, index);
  s.Area = GatherVectors(cloud.AreaVectors, index);
  s.Covariance = GatherCovariances<Real>([&](int l) { return cloud.Covariances + 6 * index[l]; });
  const unsigned char* twoSided = cloud.TwoSided;
  s.TwoSided =
    twoSided ? GatherMask<Real>([&](int l) { return twoSided[index[l]]; }) : MaskOf<Real>{};
  s.Size = s.Patch = Real{};
  const unsigned char* overlaps = cloud.Overlaps;
  s.Overlap =
    overlaps ? (1.0 / 255.0) * GatherInts<Real>([&](int l) { return overlaps[index[l]]; }) : Real{};
}

/// HierarchyNode::Normal of rows, of which b and c are the parts from bytes 16 and 32 on; unit
/// 1 / PackedOne.
template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> PackedNormals(const Columns<Real>& b, const Columns<Real>& c)
{
  static_assert(offsetof(HierarchyNode, Normal) == 28, "from the end of one part into the other");
  return { b.LowShort(3), b.HighShort(3), c.LowShort(0) };
}

/// Unpacks nodes (NodePacking.h).
template <class Real>
SURFELSPLATTING_INLINE void GatherNodes(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, StoredSurfels<Real>& s)
{
  static_assert(offsetof(HierarchyNode, Factor) == 16 && offsetof(HierarchyNode, Area) == 36 &&
      offsetof(HierarchyNode, Sides) == 46,
    "three parts of a row");
  const auto row = [&](int l) { return cloud.Nodes + (index[l] - cloud.NumberOfSurfels); };
  const auto a = LoadColumns<Real>(0, row), b = LoadColumns<Real>(16, row),
             c = LoadColumns<Real>(32, row);
  s.Position = { a.Float(0), a.Float(1), a.Float(2) };
  s.Size = c.Float(1);
  s.Patch = Uniform<Real>(1.0);
  const Real areaUnit = s.Size * (1.0 / PackedOne);
  const Vector3Of<Real> n = PackedNormals(b, c);
  s.Area = { areaUnit * n.X, areaUnit * n.Y, areaUnit * n.Z };
  const Real sides = 0.5 * c.HighShort(3);
  const Real overlap = WidenInt<Real>(ConvertLanes<IntOf<Real>>(sides));
  s.TwoSided = sides != overlap;
  s.Overlap = (1.0 / PackedOverlap) * overlap;
  const Real unit = a.Float(3) * (1.0 / PackedOne);
  // The rows of L in S = L L'.
  const Real x[6] = { unit * b.LowShort(0), unit * b.HighShort(0), unit * b.LowShort(1),
    unit * b.HighShort(1), unit * b.LowShort(2), unit * b.HighShort(2) };
  s.Covariance.XX = x[0] * x[0];
  s.Covariance.YY = x[1] * x[1] + x[2] * x[2];
  s.Covariance.ZZ = x[3] * x[3] + x[4] * x[4] + x[5] * x[5];
  s.Covariance.XY = x[0] * x[1];
  s.Covariance.YZ = x[1] * x[3] + x[2] * x[4];
  s.Covariance.XZ = x[0] * x[3];
}

/// Parent and child, mixed by the child's share.
template <class Real>
SURFELSPLATTING_INLINE Real Mixed(const Real& parent, const Real& child, const Real& share)
{
  return parent + share * (child - parent);
}

template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> Mixed(
  const Vector3Of<Real>& parent, const Vector3Of<Real>& child, const Real& share)
{
  return { Mixed(parent.X, child.X, share), Mixed(parent.Y, child.Y, share),
    Mixed(parent.Z, child.Z, share) };
}

template <class Real>
SURFELSPLATTING_INLINE Symmetric3Of<Real> Mixed(
  const Symmetric3Of<Real>& parent, const Symmetric3Of<Real>& child, const Real& share)
{
  return { Mixed(parent.XX, child.XX, share), Mixed(parent.YY, child.YY, share),
    Mixed(parent.ZZ, child.ZZ, share), Mixed(parent.XY, child.XY, share),
    Mixed(parent.YZ, child.YZ, share), Mixed(parent.XZ, child.XZ, share) };
}

/// t of CutRange.h.
template <class Real>
SURFELSPLATTING_INLINE double ShareOfChildren(const BatchIndices<Real>& index)
{
  return __builtin_sqrt(1.0 - index.Merging);
}

/// Moves surfels or nodes towards their parents (CutRange.h).
template <class Real>
SURFELSPLATTING_INLINE void MergePairs(
  const SurfelCloud& cloud, const BatchIndices<Real>& index, StoredSurfels<Real>& s)
{
  StoredSurfels<Real> parent;
  GatherNodes(cloud, index.AtParents(), parent);
  const Real one = Uniform<Real>(1.0), rest = Uniform<Real>(1.0 - index.Merging);
  const Real t = Uniform<Real>(ShareOfChildren(index));
  const Real size = index.Level > 0 ? s.Size : Norm(s.Area);
  const Real share = parent.Size > 0.0 ? size / parent.Size : one;
  // The two sides of a two-sided surfel are alike; the parent may have the other in front.
  const MaskOf<Real> turned = s.TwoSided & (Dot(s.Area, parent.Area) < 0.0);
  const Real own = turned ? -t : t, given = (1.0 - t) * share;
  s.Area = { own * s.Area.X + given * parent.Area.X, own * s.Area.Y + given * parent.Area.Y,
    own * s.Area.Z + given * parent.Area.Z };
  s.Size = size;
  s.Patch = rest * s.Patch + (share > 0.0 ? (1.0 - rest) / share : one);
  s.Overlap = Mixed(parent.Overlap, s.Overlap, rest);
  s.Position = Mixed(parent.Position, s.Position, t);
  s.Covariance = Mixed(parent.Covariance, s.Covariance, rest);
}

/// Whether all values of a surfel are finite.
template <class Real>
SURFELSPLATTING_INLINE MaskOf<Real> AreFinite(const StoredSurfels<Real>& stored)
{
  const Vector3Of<Real>&p = stored.Position, &a = stored.Area;
  const Symmetric3Of<Real>& s = stored.Covariance;
  // Short chains of additions, since all else waits for them.
  const Real sum =
    ((p.X + p.Y) + (p.Z + a.X)) + ((a.Y + a.Z) + (s.XX + s.YY)) + ((s.ZZ + s.XY) + (s.YZ + s.XZ));
  return 0.0 * sum == 0.0;
}

/// L S L'.
template <class Real>
SURFELSPLATTING_INLINE Symmetric3Of<Real> ToCamera(
  const double (&linear)[3][3], const Symmetric3Of<Real>& s)
{
  Vector3Of<Real> rows[3]; // S times each row of L
  for (int i = 0; i < 3; ++i)
  {
    const double* l = linear[i];
    rows[i] = { s.XX * l[0] + s.XY * l[1] + s.XZ * l[2], s.XY * l[0] + s.YY * l[1] + s.YZ * l[2],
      s.XZ * l[0] + s.YZ * l[1] + s.ZZ * l[2] };
  }
  return { Dot(linear[0], rows[0]), Dot(linear[1], rows[1]), Dot(linear[2], rows[2]),
    Dot(linear[0], rows[1]), Dot(linear[1], rows[2]), Dot(linear[0], rows[2]) };
}

template <class Real>
SURFELSPLATTING_INLINE Vector3Of<Real> Multiply(
  const double (&matrix)[3][3], const Vector3Of<Real>& x)
{
  return { Dot(matrix[0], x), Dot(matrix[1], x), Dot(matrix[2], x) };
}

/// Surfels in camera space, and the area that they deposit on the screen.
template <class Real>
struct PlacedSurfels
{
  MaskOf<Real> Alive;    ///< may be seen
  MaskOf<Real> Invalid;  ///< not finite, not drawn
  MaskOf<Real> BackSide; ///< seen from behind
  Vector3Of<Real> P, Area;
  Symmetric3Of<Real> Covariance;
  Real InverseZ;               ///< 1 with a parallel projection
  Real Facing;                 ///< change of Deposit per change of the area seen, [0, 1]
  Real Deposit;                ///< px^2, as seen from the point of the lens that sees most of it
  VisibleAreaOf<Real> Visible; ///< from the other points, as a share
  Real Patch;                  ///< area that MinNodeBlur applies to, over the own area; of
                               ///< Gaussians, the leaves' kernel area over the own one
  Real Overlap;                ///< SurfelCloud::OverlapOf
};

/// A slope over an ellipse becomes that over the unit disc of which `root` makes the ellipse.
template <class Real>
SURFELSPLATTING_INLINE void ToUnitDisc(const LensShape& root, Real& x, Real& y)
{
  const Real along = root.XX * x + root.XY * y;
  y = root.XY * x + root.YY * y;
  x = along;
}

/// Replaces what the lens's centre sees by what each of its points sees.
template <class Real>
SURFELSPLATTING_INLINE void SeeFromLens(const SetupJob& job, PlacedSurfels<Real>& s)
{
  const View& view = job.Camera;
  const Real scale = (s.BackSide ? Uniform<Real>(-1.0) : Uniform<Real>(1.0)) *
    (job.LensRadius * view.Fx * view.Fy) * s.Facing * s.InverseZ * s.InverseZ * s.InverseZ;
  Real x = scale * s.Area.X, y = scale * s.Area.Y;
  ToUnitDisc(job.ShapeRoot, x, y);
  const Real largest = s.Deposit + SquareRoot(x * x + y * y);
  const Real inverse = largest > 0.0 ? 1.0 / largest : Real{};
  s.Visible.Base = s.Deposit * inverse;
  s.Visible.X = x * inverse;
  s.Visible.Y = y * inverse;
  s.Deposit = largest;
}

/// Replaces what is seen of a node's area vector, the sum of its leaves', by the mean over their
/// normals: near silhouettes those that turn away do not hide the others. Their variance about the
/// mean normal is 1 - |A|^2 / size^2. The slope over the lens is subtracted: a lens that sees more
/// of a change than the normals make decides alone (MeanOverLens).
template <class Real>
SURFELSPLATTING_INLINE void SeeFacingLeaves(
  const SetupJob& job, const StoredSurfels<Real>& stored, PlacedSurfels<Real>& s)
{
  const View& view = job.Camera;
  const Real sum = Dot(stored.Area, stored.Area), rest = stored.Size * stored.Size - sum;
  const Real distance = view.Parallel ? Uniform<Real>(1.0) : Dot(s.P, s.P);
  const double radius = job.WeighsLens ? job.LensRadius : 0.0;
  Real x = s.Area.X, y = s.Area.Y;
  ToUnitDisc(job.ShapeRoot, x, y);
  const Real lens = radius * radius * (x * x + y * y);
  const Real scale = view.Fx * view.Fy * s.InverseZ * s.InverseZ * s.InverseZ;
  // The squared spread times `sum`.
  const Real squared =
    scale * scale * (NormalSpread * distance * Dot(s.Area, s.Area) * rest - lens * sum);
  if (!AnyLane<Real>(s.Deposit * s.Deposit * sum < squared))
  {
    return; // no silhouette near, as for most nodes
  }
  const Real spread = SquareRoot(Larger(squared, Real{}) / Larger(sum, Uniform<Real>(1e-200)));
  const FacingArea<Real> facing = MeanFacingArea(s.Deposit, spread, stored.TwoSided);
  s.Deposit = facing.Area;
  s.Facing = facing.Slope;
}

/// Bounds on the screen of an ellipsoid's image along x or y, px.
template <class Real>
struct ImageBounds
{
  Real Low, High;
};

/// Along x or y: of the centre, and k^2 S_xx and k^2 S_xz.
template <class Real>
struct EllipsoidAlong
{
  Real X, XX, XZ;
};

/**
 * Bounds of the image of the ellipsoid d' S^-1 d <= k^2 in front of the lens: a plane x = t z
 * through the lens's centre touches it where (x - t z)^2 = k^2 (S_xx - 2 t S_xz + t^2 S_zz).
 * @param z of its centre @param a z^2 - k^2 S_zz, > 0 @param focal,center px
 */
template <class Real>
SURFELSPLATTING_INLINE ImageBounds<Real> BoundImage(
  const EllipsoidAlong<Real>& e, const Real& z, const Real& a, double focal, double center)
{
  const Real b = e.X * z - e.XZ;
  const Real root = SquareRoot(Larger(b * b - a * (e.X * e.X - e.XX), Real{}));
  const Real scale = focal / a;
  const Real first = center + scale * (b - root), last = center + scale * (b + root);
  return { Smaller(first, last), Larger(first, last) };
}

/// The images of kernels' supports, and which supports nearly reach the lens plane.
template <class Real>
struct NearImages
{
  ImageBounds<Real> X, Y;
  MaskOf<Real> AreNear;
};

/// The part of an affine footprint's half width that its image has towards the picture, if its
/// centre is beside that; otherwise 1.
/// @param variance along x or y, px^2
template <class Real>
SURFELSPLATTING_INLINE Real ShareTowardsPicture(
  const ImageBounds<Real>& image, const Real& center, double size, const Real& variance)
{
  const Real way = center < 0.0 ? image.High - center : center - image.Low;
  const Real share = way / SquareRoot(Larger(variance, Uniform<Real>(1e-300)));
  const MaskOf<Real> beside = (center < 0.0) | (center > size);
  return beside ? Larger(Smaller(share, Uniform<Real>(1.0)), Real{}) : Uniform<Real>(1.0);
}

/**
 * Shortens near kernels whose centre is beside the picture so that their affine footprint reaches
 * as far towards it as their image. Blur brings such kernels into the picture, and without this
 * they would be a fog over it. S becomes A S A', where A scales across the line of sight: M A =
 * diag(along x, along y) M.
 */
template <class Real>
SURFELSPLATTING_INLINE void ShortenNear(
  const SetupJob& job, const NearImages<Real>& images, double reach, PlacedSurfels<Real>& s)
{
  const View& view = job.Camera;
  Symmetric3Of<Real>& c = s.Covariance;
  const Symmetric2Of<Real> w = ProjectionJacobian<Real>(view, s.P, s.InverseZ).Project(c);
  const Real x = s.P.X * s.InverseZ, y = s.P.Y * s.InverseZ, one = Uniform<Real>(1.0);
  const Real alongX = ShareTowardsPicture<Real>(
    images.X, view.Fx * x + view.Cx, static_cast<double>(view.Width), reach * w.XX);
  const Real alongY = ShareTowardsPicture<Real>(
    images.Y, view.Fy * y + view.Cy, static_cast<double>(view.Height), reach * w.YY);
  const Real fx = images.AreNear ? alongX : one, fy = images.AreNear ? alongY : one;
  const Real tx = (1.0 - fx) * x, ty = (1.0 - fy) * y; // A = (fx 0 tx; 0 fy ty; 0 0 1)
  c.XX = fx * fx * c.XX + tx * (2.0 * fx * c.XZ + tx * c.ZZ);
  c.YY = fy * fy * c.YY + ty * (2.0 * fy * c.YZ + ty * c.ZZ);
  c.XY = fx * (fy * c.XY + ty * c.XZ) + tx * (fy * c.YZ + ty * c.ZZ);
  c.XZ = fx * c.XZ + tx * c.ZZ;
  c.YZ = fy * c.YZ + ty * c.ZZ;
  s.Deposit *= fx * fy;
}

/**
 * Whether kernels may be seen. If one's support reaches the lens plane, the affine footprint does
 * not approximate its image: a surfel beside the lens would cover the whole screen. If it nearly
 * does, the footprint reaches farther towards the middle than the image; what has an image beside
 * the picture is left out.
 * @param reach k^2, of the support
 * @param images of what may be seen; set if AnyLane(images.AreNear)
 */
template <class Real>
SURFELSPLATTING_INLINE MaskOf<Real> MayBeSeen(
  const SetupJob& job, const PlacedSurfels<Real>& s, double reach, NearImages<Real>& images)
{
  constexpr double near = 16.0; // supports of a quarter of their depth
  const Symmetric3Of<Real>& c = s.Covariance;
  const Real a = s.P.Z * s.P.Z - reach * c.ZZ;
  const MaskOf<Real> inFront = a >= 0.0, isNear = near * reach * c.ZZ > s.P.Z * s.P.Z;
  images.AreNear = s.Alive & inFront & isNear;
  if (!AnyLane<Real>(images.AreNear))
  {
    return inFront;
  }
  const View& view = job.Camera;
  const Real positive = Larger(a, Uniform<Real>(1e-300));
  images.X =
    BoundImage<Real>({ s.P.X, reach * c.XX, reach * c.XZ }, s.P.Z, positive, view.Fx, view.Cx);
  images.Y =
    BoundImage<Real>({ s.P.Y, reach * c.YY, reach * c.YZ }, s.P.Z, positive, view.Fy, view.Cy);
  // The lens's disc, whose kernel ends at 1.42 radii (MaxKernelReach / 2), and the pixel filter
  // spread it.
  const Real blur =
    Larger(job.InverseFocalDistance - s.InverseZ, s.InverseZ - job.InverseFocalDistance);
  const double perBlur = 1.5 * job.LensRadius * __builtin_sqrt(job.LargestShape);
  const Real marginX = 4.0 + (perBlur * __builtin_fabs(view.Fx)) * blur;
  const Real marginY = 4.0 + (perBlur * __builtin_fabs(view.Fy)) * blur;
  const MaskOf<Real> isInside = (images.X.Low < view.Width + marginX) &
    (images.X.High > Real{} - marginX) & (images.Y.Low < view.Height + marginY) &
    (images.Y.High > Real{} - marginY);
  return inFront & (isInside | Not(isNear));
}

/// Surfels in camera space. What they deposit is still to be set.
template <class Real>
SURFELSPLATTING_INLINE PlacedSurfels<Real> MoveToCamera(const SetupJob& job,
  const BatchIndices<Real>& index, const StoredSurfels<Real>& stored, const MaskOf<Real>& finite)
{
  const View& view = job.Camera;
  PlacedSurfels<Real> s;
  const Vector3Of<Real> p = Multiply(job.Linear, stored.Position);
  s.P = { p.X + job.Translation[0], p.Y + job.Translation[1], p.Z + job.Translation[2] };
  s.InverseZ = view.Parallel ? Uniform<Real>(1.0) : 1.0 / s.P.Z;
  s.Covariance = ToCamera(job.Linear, stored.Covariance);
  s.Overlap = stored.Overlap;
  const MaskOf<Real> present = index.ArePresent();
  s.Invalid = present & Not(finite);
  s.Alive = present & finite & (s.P.Z >= view.Near) & (s.P.Z <= view.Far);
  return s;
}

/// Lets surfels have two sides. What was behind a sheet (SurfelCloud::OverlapOf) is before it when
/// seen from its back.
template <class Real>
SURFELSPLATTING_INLINE void ShowBacks(StoredSurfels<Real>& stored, PlacedSurfels<Real>& s)
{
  s.Overlap = (s.Deposit < 0.0) & Not(stored.TwoSided) ? Real{} : s.Overlap;
  stored.TwoSided = Real{} <= Real{};
}

template <class Real>
SURFELSPLATTING_INLINE PlacedSurfels<Real> Place(
  const SetupJob& job, const BatchIndices<Real>& index)
{
  const View& view = job.Camera;
  StoredSurfels<Real> stored;
  index.Level > 0 ? GatherNodes(job.Cloud, index, stored) : GatherSurfels(job.Cloud, index, stored);
  if (index.Merging > 0.0)
  {
    MergePairs(job.Cloud, index, stored);
  }
  PlacedSurfels<Real> s = MoveToCamera(job, index, stored, AreFinite(stored));
  s.Area = Multiply(job.AreaToCamera, stored.Area);
  s.Deposit = ProjectedArea(view, s.Area, s.P, s.InverseZ);
  if (job.Cloud.ShowsBacks)
  {
    ShowBacks(stored, s);
  }
  s.BackSide = (s.Deposit < 0.0) & stored.TwoSided;
  s.Deposit = s.BackSide ? -s.Deposit : s.Deposit;
  s.Visible = { Uniform<Real>(1.0), Real{}, Real{}, stored.TwoSided };
  s.Facing = Uniform<Real>(1.0);
  if (index.HasNodes())
  {
    SeeFacingLeaves(job, stored, s);
  }
  if (job.WeighsLens)
  {
    SeeFromLens(job, s);
  }
  s.Alive &= s.Deposit > 0.0;
  s.Patch = stored.Patch;
  if (!view.Parallel)
  {
    const double reach = job.Kernel == KernelType::Gaussian
      ? job.Gaussian.Support() / job.Gaussian.Tau
      : MaxKernelReach * MaxKernelReach;
    NearImages<Real> images{};
    s.Alive &= MayBeSeen(job, s, reach, images);
    if (AnyLane<Real>(images.AreNear & s.Alive))
    {
      ShortenNear(job, images, reach, s);
    }
  }
  return s;
}
}

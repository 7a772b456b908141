// SPDX-License-Identifier: BSD-3-Clause
/**
 * Arrays of structures for vector code: a row of bytes for each lane becomes columns of 32 bits,
 * with one row per lane, and back. Sixteen bytes of all rows are transposed at a time. Reading
 * field by field would take a load and an insertion for each.
 */
#pragma once

#include "Core/Simd/RealLanes.h"

#include <cstddef>

namespace SurfelSplatting
{
/// Four columns of 32 bits, integers or the bits of floats.
template <class Real>
struct Columns
{
  IntOf<Real> C[4];

  /// A column of floats, widened.
  SURFELSPLATTING_INLINE Real Float(int i) const
  {
    FloatOf<Real> x;
    __builtin_memcpy(&x, &this->C[i], sizeof(x));
    return Widen<Real>(x);
  }

  /// The lower and the upper half of a column of 16-bit integers.
  SURFELSPLATTING_INLINE Real LowShort(int i) const
  {
    if constexpr (LaneTypes<Real>::Count == 1)
    {
      return static_cast<std::int16_t>(this->C[i]);
    }
    else
    {
      return WidenInt<Real>((this->C[i] << 16) >> 16);
    }
  }
  SURFELSPLATTING_INLINE Real HighShort(int i) const { return WidenInt<Real>(this->C[i] >> 16); }
  SURFELSPLATTING_INLINE Real HighUnsigned(int i) const
  {
    return WidenInt<Real>((this->C[i] >> 16) & 0xffff);
  }

  /// Byte k of a column.
  SURFELSPLATTING_INLINE Real Byte(int i, int k) const
  {
    return WidenInt<Real>((this->C[i] >> (8 * k)) & 0xff);
  }
  SURFELSPLATTING_INLINE Real SignedByte(int i, int k) const
  {
    if constexpr (LaneTypes<Real>::Count == 1)
    {
      return static_cast<std::int8_t>(this->C[i] >> (8 * k));
    }
    else
    {
      return WidenInt<Real>((this->C[i] << (24 - 8 * k)) >> 24);
    }
  }
};

/// Sixteen bytes of a row.
typedef std::int32_t RowPart __attribute__((vector_size(16)));

/// Turns columns of as many lanes as Real has into rows and back, as arrays of vectors.
template <int Lanes>
struct RowTranspose;

template <>
struct RowTranspose<1>
{
  SURFELSPLATTING_INLINE static void ToColumns(const RowPart (&r)[1], std::int32_t (&c)[4])
  {
    for (int i = 0; i < 4; ++i)
    {
      c[i] = r[0][i];
    }
  }
  SURFELSPLATTING_INLINE static void ToRows(const std::int32_t (&c)[4], RowPart (&r)[1])
  {
    r[0] = RowPart{ c[0], c[1], c[2], c[3] };
  }
};

template <>
struct RowTranspose<2>
{
  typedef std::int32_t Column __attribute__((vector_size(8)));

  SURFELSPLATTING_INLINE static void ToColumns(const RowPart (&r)[2], Column (&c)[4])
  {
    c[0] = __builtin_shufflevector(r[0], r[1], 0, 4);
    c[1] = __builtin_shufflevector(r[0], r[1], 1, 5);
    c[2] = __builtin_shufflevector(r[0], r[1], 2, 6);
    c[3] = __builtin_shufflevector(r[0], r[1], 3, 7);
  }
  SURFELSPLATTING_INLINE static void ToRows(const Column (&c)[4], RowPart (&r)[2])
  {
    for (int l = 0; l < 2; ++l)
    {
      r[l] = RowPart{ c[0][l], c[1][l], c[2][l], c[3][l] };
    }
  }
};

template <>
struct RowTranspose<4>
{
  /// A transpose of 4 x 4, its own inverse.
  SURFELSPLATTING_INLINE static void Transpose(const RowPart (&a)[4], RowPart (&b)[4])
  {
    const RowPart low = __builtin_shufflevector(a[0], a[1], 0, 4, 1, 5);
    const RowPart high = __builtin_shufflevector(a[0], a[1], 2, 6, 3, 7);
    const RowPart low2 = __builtin_shufflevector(a[2], a[3], 0, 4, 1, 5);
    const RowPart high2 = __builtin_shufflevector(a[2], a[3], 2, 6, 3, 7);
    b[0] = __builtin_shufflevector(low, low2, 0, 1, 4, 5);
    b[1] = __builtin_shufflevector(low, low2, 2, 3, 6, 7);
    b[2] = __builtin_shufflevector(high, high2, 0, 1, 4, 5);
    b[3] = __builtin_shufflevector(high, high2, 2, 3, 6, 7);
  }
  SURFELSPLATTING_INLINE static void ToColumns(const RowPart (&r)[4], RowPart (&c)[4])
  {
    Transpose(r, c);
  }
  SURFELSPLATTING_INLINE static void ToRows(const RowPart (&c)[4], RowPart (&r)[4])
  {
    Transpose(c, r);
  }
};

template <>
struct RowTranspose<8>
{
  typedef std::int32_t Column __attribute__((vector_size(32)));

  /// Two transposes of 4 x 4 at a time, in the lower and upper halves.
  SURFELSPLATTING_INLINE static void Transpose(const Column (&a)[4], Column (&b)[4])
  {
    const Column low = __builtin_shufflevector(a[0], a[1], 0, 8, 1, 9, 4, 12, 5, 13);
    const Column high = __builtin_shufflevector(a[0], a[1], 2, 10, 3, 11, 6, 14, 7, 15);
    const Column low2 = __builtin_shufflevector(a[2], a[3], 0, 8, 1, 9, 4, 12, 5, 13);
    const Column high2 = __builtin_shufflevector(a[2], a[3], 2, 10, 3, 11, 6, 14, 7, 15);
    b[0] = __builtin_shufflevector(low, low2, 0, 1, 8, 9, 4, 5, 12, 13);
    b[1] = __builtin_shufflevector(low, low2, 2, 3, 10, 11, 6, 7, 14, 15);
    b[2] = __builtin_shufflevector(high, high2, 0, 1, 8, 9, 4, 5, 12, 13);
    b[3] = __builtin_shufflevector(high, high2, 2, 3, 10, 11, 6, 7, 14, 15);
  }
  SURFELSPLATTING_INLINE static void ToColumns(const RowPart (&r)[8], Column (&c)[4])
  {
    Column joined[4];
    for (int i = 0; i < 4; ++i)
    {
      joined[i] = __builtin_shufflevector(r[i], r[i + 4], 0, 1, 2, 3, 4, 5, 6, 7);
    }
    Transpose(joined, c);
  }
  SURFELSPLATTING_INLINE static void ToRows(const Column (&c)[4], RowPart (&r)[8])
  {
    Column joined[4];
    Transpose(c, joined);
    for (int i = 0; i < 4; ++i)
    {
      r[i] = __builtin_shufflevector(joined[i], joined[i], 0, 1, 2, 3);
      r[i + 4] = __builtin_shufflevector(joined[i], joined[i], 4, 5, 6, 7);
    }
  }
};

/// The first bytes of a part; the rest is 0. Compilers would copy 12 bytes through memory.
template <std::size_t Bytes>
SURFELSPLATTING_INLINE RowPart LoadPart(const char* from)
{
  static_assert(Bytes == 4 || Bytes == 8 || Bytes == 12 || Bytes == 16, "whole columns");
  RowPart part;
  if constexpr (Bytes == 16)
  {
    __builtin_memcpy(&part, from, sizeof(part));
    return part;
  }
  typedef std::int64_t Halves __attribute__((vector_size(16)));
  Halves halves{};
  if constexpr (Bytes >= 8)
  {
    std::int64_t first;
    __builtin_memcpy(&first, from, 8);
    halves[0] = first;
  }
  part = (RowPart)halves;
  if constexpr (Bytes % 8 != 0)
  {
    std::int32_t last;
    __builtin_memcpy(&last, from + (Bytes - 4), 4);
    part[Bytes / 8 * 2] = last;
  }
  return part;
}

/**
 * Reads columns of the lanes' rows.
 * @param rows function(lane): the lane's row
 * @param offset of the first column, bytes
 * @tparam Bytes that a row has from there on, at most 16; the rest is 0
 */
template <class Real, std::size_t Bytes = sizeof(RowPart), class Function>
SURFELSPLATTING_INLINE Columns<Real> LoadColumns(std::size_t offset, Function&& rows)
{
  constexpr int lanes = LaneTypes<Real>::Count;
  RowPart parts[lanes];
  for (int l = 0; l < lanes; ++l)
  {
    parts[l] = LoadPart<Bytes>(reinterpret_cast<const char*>(rows(l)) + offset);
  }
  Columns<Real> columns;
  RowTranspose<lanes>::ToColumns(parts, columns.C);
  return columns;
}

/// Sixteen bytes of the rows of all lanes.
template <class Real>
struct RowParts
{
  RowPart Parts[LaneTypes<Real>::Count];

  SURFELSPLATTING_INLINE RowParts() = default;

  /// @param a,b,c,d columns of integers or of floats
  template <class A, class B, class C, class D>
  SURFELSPLATTING_INLINE RowParts(const A& a, const B& b, const C& c, const D& d)
  {
    const IntOf<Real> columns[4] = { BitsOf(a), BitsOf(b), BitsOf(c), BitsOf(d) };
    RowTranspose<LaneTypes<Real>::Count>::ToRows(columns, this->Parts);
  }

  SURFELSPLATTING_INLINE void Store(int lane, void* to) const
  {
    __builtin_memcpy(to, &this->Parts[lane], sizeof(RowPart));
  }

private:
  template <class Column>
  SURFELSPLATTING_INLINE static IntOf<Real> BitsOf(const Column& column)
  {
    static_assert(sizeof(Column) == sizeof(IntOf<Real>), "32 bits for each lane");
    IntOf<Real> bits;
    __builtin_memcpy(&bits, &column, sizeof(bits));
    return bits;
  }
};

/// Writes the parts of a lane's row, one behind the other.
template <class Real, std::size_t Count>
SURFELSPLATTING_INLINE void StoreRow(const RowParts<Real> (&parts)[Count], int lane, void* to)
{
  for (std::size_t i = 0; i < Count; ++i)
  {
    parts[i].Store(lane, static_cast<char*>(to) + i * sizeof(RowPart));
  }
}
}

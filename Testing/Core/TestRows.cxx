// SPDX-License-Identifier: BSD-3-Clause
// Rows to columns and back, with one, two, four and eight lanes.
#include "Core/Simd/Rows.h"
#include "Testing/Shared/Check.h"

#include <array>
#include <cstring>

using namespace SurfelSplatting;

namespace
{
typedef double Real2 __attribute__((vector_size(16)));
typedef double Real4 __attribute__((vector_size(32)));
typedef double Real8 __attribute__((vector_size(64)));

constexpr std::size_t Offset = 4; // bytes before the first column

/// Different in each lane and column.
std::int32_t Number(int lane, int column)
{
  return 1000003 * (lane + 1) + 70001 * column;
}

/// Rows of five numbers; the columns begin at the second.
template <class Real>
struct RowsUnderTest
{
  std::array<std::int32_t, 5> Rows[LaneTypes<Real>::Count];

  RowsUnderTest()
  {
    for (int l = 0; l < LaneTypes<Real>::Count; ++l)
    {
      for (int i = 0; i < 5; ++i)
      {
        this->Rows[l][i] = Number(l, i - 1);
      }
    }
  }

  template <std::size_t Bytes = sizeof(RowPart)>
  Columns<Real> Load() const
  {
    return LoadColumns<Real, Bytes>(Offset, [this](int lane) { return this->Rows[lane].data(); });
  }
};

/// The columns of as many bytes hold the rows' numbers, and the others 0.
template <class Real, std::size_t Bytes>
void CheckLoad()
{
  CAPTURE(Bytes);
  const Columns<Real> columns = RowsUnderTest<Real>().template Load<Bytes>();
  for (int i = 0; i < 4; ++i)
  {
    for (int l = 0; l < LaneTypes<Real>::Count; ++l)
    {
      CHECK(LaneAt(columns.C[i], l) == (4u * i < Bytes ? Number(l, i) : 0));
    }
  }
}

/// Columns of integers and of floats become the rows that they were.
template <class Real>
void CheckStore()
{
  const RowsUnderTest<Real> rows;
  const Columns<Real> columns = rows.Load();
  FloatOf<Real> bits;
  std::memcpy(&bits, &columns.C[1], sizeof bits);
  const RowParts<Real> parts(columns.C[0], bits, columns.C[2], columns.C[3]);
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    std::array<std::int32_t, 4> row;
    parts.Store(l, row.data());
    CHECK(std::memcmp(row.data(), rows.Rows[l].data() + 1, sizeof row) == 0);
  }
}
}

TEST_CASE_TEMPLATE("Transpose", Real, double, Real2, Real4, Real8)
{
  CheckLoad<Real, 4>();
  CheckLoad<Real, 8>();
  CheckLoad<Real, 12>();
  CheckLoad<Real, 16>();
  CheckStore<Real>();
}

/// Signs and unsigned parts of packed columns.
TEST_CASE_TEMPLATE("Parts", Real, double, Real2, Real4, Real8)
{
  const std::uint32_t packed = 0x9c85f37eu;
  const float number = -0.375f;
  const auto columns = LoadColumns<Real, 8>(
    0, [row = std::array<std::uint32_t, 2>{ packed, 0u }, number](int) mutable {
      std::memcpy(&row[1], &number, sizeof number);
      return row.data();
    });
  for (int l = 0; l < LaneTypes<Real>::Count; ++l)
  {
    CHECK(LaneAt(columns.LowShort(0), l) == static_cast<std::int16_t>(0xf37e));
    CHECK(LaneAt(columns.HighShort(0), l) == static_cast<std::int16_t>(0x9c85));
    CHECK(LaneAt(columns.HighUnsigned(0), l) == 0x9c85);
    CHECK(LaneAt(columns.Byte(0, 0), l) == 0x7e);
    CHECK(LaneAt(columns.Byte(0, 3), l) == 0x9c);
    CHECK(LaneAt(columns.SignedByte(0, 1), l) == static_cast<std::int8_t>(0xf3));
    CHECK(LaneAt(columns.SignedByte(0, 3), l) == static_cast<std::int8_t>(0x9c));
    CHECK(LaneAt(columns.Float(1), l) == -0.375);
  }
}

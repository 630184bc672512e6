// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/tile_resolve.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <numeric>

#include "mapping/kernels/highway_targets.h"
#include "mapping/kernels/tile_scatter.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/kernels/tile_resolve.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace efm::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Unsigned = hn::RebindToUnsigned<Floats>;
using Signed = hn::RebindToSigned<Floats>;
using Cells = hn::ScalableTag<std::uint64_t>;
using FloatV = hn::Vec<Floats>;
using UnsignedV = hn::Vec<Unsigned>;

constexpr int kUp = kProductBits - kFractionBits;
constexpr std::uint32_t kSumMask = (1U << kSumBits) - 1;
constexpr std::uint32_t kProductMask = (1U << kCountShift) - (1U << kProductShift);

// ---------------------------------------------------------------- a row of cells

/// A cell per lane of a vector, by halves. Sums are read from them in units of 1/32,768, and
/// differences of sums are modulo 2^32.
struct CellHalves {
  UnsignedV lower, upper;
};

HWY_INLINE CellHalves halvesOf(const std::uint64_t* cells) {
  const Unsigned d;
#if HWY_TARGET == HWY_SCALAR
  return {hn::Set(d, static_cast<std::uint32_t>(*cells)),
          hn::Set(d, static_cast<std::uint32_t>(*cells >> 32))};
#else
  const Cells d64;
  const UnsignedV first = hn::BitCast(d, hn::LoadU(d64, cells));
  const UnsignedV second = hn::BitCast(d, hn::LoadU(d64, cells + hn::Lanes(d64)));
  return {hn::ConcatEven(d, second, first), hn::ConcatOdd(d, second, first)};
#endif
}

HWY_INLINE UnsignedV votesOf(const CellHalves& cells) {
  return hn::And(hn::ShiftRight<kCountShift - kProductBits>(cells.upper),
                 hn::Set(Unsigned(), (2 * kVotesPerCell - 1) << kProductBits));
}

/// The sums of a of some cells minus those of others.
HWY_INLINE UnsignedV differenceOfA(const CellHalves& cells, const CellHalves& others) {
  const UnsignedV mask = hn::Set(Unsigned(), kSumMask);
  return hn::ShiftLeft<kUp>(hn::Sub(hn::And(cells.lower, mask), hn::And(others.lower, mask)));
}

/// The same of ab.
HWY_INLINE UnsignedV differenceOfAB(const CellHalves& cells, const CellHalves& others) {
  const UnsignedV mask = hn::Set(Unsigned(), kProductMask);
  const UnsignedV difference = hn::Sub(hn::And(cells.upper, mask), hn::And(others.upper, mask));
  return hn::BitCast(Unsigned(), hn::ShiftRight<kProductShift>(hn::BitCast(Signed(), difference)));
}

/// The sums of b, which lie in both halves.
HWY_INLINE UnsignedV sumsOfB(const CellHalves& cells) {
  return hn::And(hn::Or(hn::ShiftRight<kSumBits - kUp>(cells.lower),
                        hn::ShiftLeft<32 - kSumBits + kUp>(cells.upper)),
                 hn::Set(Unsigned(), kSumMask << kUp));
}

/// Cells to the left and right of each pixel on their upper and lower sides.
struct RowOfCells {
  CellHalves west, east;

  /// @param cells the first pixel's left one.
  explicit HWY_INLINE RowOfCells(const std::uint64_t* cells)
      : west(halvesOf(cells)), east(halvesOf(cells + 1)) {}

  /// Their votes for the pixels below them.
  HWY_INLINE UnsignedV toBelow() const {
    return hn::Sub(sumsOfB(east), differenceOfAB(east, west));
  }
  /// Their votes for the pixels above them.
  HWY_INLINE UnsignedV toAbove() const {
    return hn::Sub(hn::Add(votesOf(east), differenceOfA(west, east)), toBelow());
  }
};

HWY_INLINE FloatV densityOf(UnsignedV from_above, UnsignedV from_below) {
  const Floats d;
  const Signed di;
  // Rounded products can leave a negative sum.
  const auto sum = hn::Max(hn::BitCast(di, hn::Add(from_above, from_below)), hn::Zero(di));
  return hn::Mul(hn::ConvertTo(d, sum), hn::Set(d, 1.0F / (1 << kProductBits)));
}

/// Stores a whole vector, or its lanes before the end.
HWY_INLINE void storeBefore(const float* end, FloatV value, float* values) {
  const Floats d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  if (values + lanes <= end) {
    hn::StoreU(value, d, values);
    return;
  }
  HWY_ALIGN float whole[hn::MaxLanes(Floats())];
  hn::Store(value, d, whole);
  std::copy_n(whole, std::max<std::ptrdiff_t>(end - values, 0), values);
}

HWY_INLINE void clearRow(std::uint64_t* cells) {
  const Cells d;
  for (int x = 0; x < kTileCells; x += static_cast<int>(hn::Lanes(d))) {
    hn::Store(hn::Zero(d), d, cells + x);
  }
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE std::uint64_t sumOfLanes(D d, V values) {
  HWY_ALIGN hn::TFromD<D> lanes[hn::MaxLanes(D())];
  hn::Store(values, d, lanes);
  return std::accumulate(lanes, lanes + hn::Lanes(d), std::uint64_t{0});
}

// ---------------------------------------------------------------- all pixels

std::uint64_t resolveAll(const CellBuffer& buffer, int width, int height, float* values) {
  std::uint64_t* cells = buffer.cells;
  const Unsigned du;
  const int lanes = static_cast<int>(hn::Lanes(du));
  // The votes of the row of cells above a pixel row.
  HWY_ALIGN std::uint32_t from_above[kTileCells];
  const float* end = values + static_cast<std::ptrdiff_t>(width) * height;
  for (int x = 0; x < width; x += lanes) {
    hn::Store(RowOfCells(cells + x).toBelow(), du, from_above + x);
  }
  clearRow(cells);
  UnsignedV votes = hn::Zero(du);
  for (int row = 0; row < height; ++row) {
    std::uint64_t* left = cells + static_cast<std::ptrdiff_t>(row + 1) * kTileCells;
    float* pixels = values + static_cast<std::ptrdiff_t>(row) * width;
    for (int x = 0; x < width; x += lanes) {
      const RowOfCells below(left + x);
      const auto within = hn::FirstN(du, static_cast<std::size_t>(width - x));
      votes =
          hn::Add(votes, hn::IfThenElseZero(within, hn::ShiftRight<kCountShift>(below.east.upper)));
      // The next row overwrites values beyond this row.
      storeBefore(end, densityOf(hn::Load(du, from_above + x), below.toAbove()), pixels + x);
      hn::Store(below.toBelow(), du, from_above + x);
    }
    clearRow(left);
  }
  std::fill_n(buffer.dirty, kDirtyFlags, std::uint8_t{0});
  return sumOfLanes(du, votes);
}

// ---------------------------------------------------------------- some pixels

/// Lists the positions of numbers that are not zero. Reads and writes up to a vector past the last.
/// @return their number.
template <typename Number>
HWY_INLINE std::size_t listNonZero(const Number* numbers, std::size_t count,
                                   std::uint32_t* positions) {
  const Unsigned d;
  const hn::Rebind<Number, Unsigned> d_narrow;
  // A load is faster than Highway's Iota, which writes lanes one by one.
  HWY_ALIGN static constexpr std::uint32_t kLanes[] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                       8, 9, 10, 11, 12, 13, 14, 15};
  static_assert(std::size(kLanes) >= hn::MaxLanes(Unsigned()));
  UnsignedV position = hn::Load(d, kLanes);
  const UnsignedV lanes = hn::Set(d, static_cast<std::uint32_t>(hn::Lanes(d)));
  std::size_t size = 0;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const UnsignedV number = hn::PromoteTo(d, hn::LoadU(d_narrow, numbers + i));
    const auto there = hn::And(hn::Ne(number, hn::Zero(d)), hn::FirstN(d, count - i));
    hn::StoreU(hn::Compress(position, there), d, positions + size);
    size += hn::CountTrue(d, there);
    position = hn::Add(position, lanes);
  }
  return size;
}

std::uint64_t findOccupied(const CellBuffer& buffer, TilePixels& pixels, DirtyLines& lines) {
  constexpr std::size_t kLinesInRow = kTileCells / kLineCells;
  const auto rows_of_cells = static_cast<std::size_t>(pixels.height) + 1;
  lines.size = listNonZero(buffer.dirty, kDirtyFlags, lines.lines);

  const Cells d;
  std::uint8_t occupied_in_line[kDirtyFlags] = {};  // bit x for a line's cell x
  auto votes = hn::Zero(d);
  auto votes_of_first_row = votes;
  for (std::size_t i = 0; i < lines.size; ++i) {
    const std::size_t line = lines.lines[i];
    std::uint32_t occupied = 0;
    for (std::size_t x = 0; x < kLineCells; x += hn::Lanes(d)) {
      const auto cells = hn::Load(d, buffer.cells + kLineCells * line + x);
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, hn::Ne(cells, hn::Zero(d)), bits);
      occupied |= std::uint32_t{bits[0]} << x;
      votes = hn::Add(votes, hn::ShiftRight<32 + kCountShift>(cells));
    }
    occupied_in_line[line] = static_cast<std::uint8_t>(occupied);
    if (line < kLinesInRow) votes_of_first_row = votes;
  }
  // Lowest bits first, on all processors that there are kernels for.
  std::uint64_t occupied[kTileCells + 2];
  static_assert(sizeof(occupied) == sizeof(occupied_in_line));
  std::memcpy(occupied, occupied_in_line, sizeof(occupied));

  std::uint64_t votes_of_first_column = 0;
  for (std::size_t y = 1; y < rows_of_cells; ++y) {
    votes_of_first_column += buffer.cells[kTileCells * y] >> (32 + kCountShift);
  }
  const std::uint64_t in_tile = (std::uint64_t{1} << pixels.width) - 1;
  for (int y = 0; y < pixels.height; ++y) {
    const std::uint64_t cells = occupied[y] | occupied[y + 1];
    pixels.rows[y] = (cells | cells >> 1) & in_tile;
  }
  return sumOfLanes(d, hn::Sub(votes, votes_of_first_row)) - votes_of_first_column;
}

void listBlocks(const TilePixels& pixels, PixelBlocks& blocks) {
  blocks.width = pixels.width;
  blocks.height = pixels.height;
  std::uint16_t pixels_of_block[kTileCells * kBlocksInRow];
  static_assert(sizeof(pixels_of_block) == sizeof(pixels.rows));
  std::memcpy(pixels_of_block, pixels.rows, sizeof(pixels.rows));
  blocks.size = listNonZero(pixels_of_block, static_cast<std::size_t>(kBlocksInRow * pixels.height),
                            blocks.blocks);
}

void resolveBlocks(const std::uint64_t* cells, const PixelBlocks& blocks, float* values) {
  const float* end = values + static_cast<std::ptrdiff_t>(blocks.width) * blocks.height;
  for (std::size_t i = 0; i < blocks.size; ++i) {
    const auto row = static_cast<std::ptrdiff_t>(blocks.blocks[i] / kBlocksInRow);
    const auto first = static_cast<std::ptrdiff_t>(blocks.blocks[i] % kBlocksInRow * kBlockPixels);
    const std::uint64_t* above = cells + row * kTileCells + first;
    float* block = values + row * blocks.width + first;
    for (std::size_t x = 0; x < kBlockPixels; x += hn::Lanes(Unsigned())) {
      // Values beyond the row belong to later blocks or to none.
      storeBefore(
          end,
          densityOf(RowOfCells(above + x).toBelow(), RowOfCells(above + kTileCells + x).toAbove()),
          block + x);
    }
  }
}

void clear(const CellBuffer& buffer, const DirtyLines& lines) {
  const Cells d;
  for (std::size_t i = 0; i < lines.size; ++i) {
    std::uint64_t* line = buffer.cells + std::size_t{kLineCells} * lines.lines[i];
    for (std::size_t x = 0; x < kLineCells; x += hn::Lanes(d)) hn::Store(hn::Zero(d), d, line + x);
  }
  std::fill_n(buffer.dirty, kDirtyFlags, std::uint8_t{0});
}

constexpr ResolveFunctions kResolve = {resolveAll, findOccupied, listBlocks, resolveBlocks, clear};

}  // namespace efm::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace efm::kernels {

const ResolveFunctions& resolveFunctions(VotingKernel kernel) {
  static constexpr KernelTable<ResolveFunctions> kTable = {nullptr, EFM_VECTOR_KERNELS(kResolve)};
  return kernelIn(kTable, kernel);
}

}  // namespace efm::kernels
#endif

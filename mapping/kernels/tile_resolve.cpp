// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/tile_resolve.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
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
  /// @param to_below as `toBelow` returns it.
  HWY_INLINE UnsignedV toAbove(UnsignedV to_below) const {
    return hn::Sub(hn::Add(votesOf(east), differenceOfA(west, east)), to_below);
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
  if (HWY_LIKELY(values + lanes <= end)) {
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

// ---------------------------------------------------------------- rows of pixels

/// Resolves a tile's rows of pixels downwards, a vector at a time, and clears its cells.
class RowResolver {
 public:
  HWY_INLINE RowResolver(std::uint64_t* cells, int width) : cells_(cells) {
    for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(Unsigned()))) {
      hn::Store(RowOfCells(cells + x).toBelow(), Unsigned(), from_above_ + x);
    }
    clearRow(cells);
  }

  /// The densities of pixels from x on. @param within the lanes inside the tile.
  template <class Mask>
  HWY_INLINE FloatV densities(int row, int x, Mask within) {
    const Unsigned d;
    const RowOfCells below(cells_ + static_cast<std::ptrdiff_t>(row + 1) * kTileCells + x);
    votes_ =
        hn::Add(votes_, hn::IfThenElseZero(within, hn::ShiftRight<kCountShift>(below.east.upper)));
    const UnsignedV to_below = below.toBelow();
    const FloatV density = densityOf(hn::Load(d, from_above_ + x), below.toAbove(to_below));
    hn::Store(to_below, d, from_above_ + x);
    return density;
  }
  HWY_INLINE void endRow(int row) {
    clearRow(cells_ + static_cast<std::ptrdiff_t>(row + 1) * kTileCells);
  }
  std::uint64_t votes() const { return sumOfLanes(Unsigned(), votes_); }

 private:
  std::uint64_t* cells_;
  UnsignedV votes_ = hn::Zero(Unsigned());
  // The votes of the row of cells above a pixel row.
  HWY_ALIGN std::uint32_t from_above_[kTileCells];
};

std::uint64_t resolveAll(std::uint64_t* cells, int width, int height, float* values) {
  const Unsigned du;
  const float* end = values + static_cast<std::ptrdiff_t>(width) * height;
  RowResolver rows(cells, width);
  for (int row = 0; row < height; ++row, values += width) {
    for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(du))) {
      const auto within = hn::FirstN(du, static_cast<std::size_t>(width - x));
      // The next row overwrites values beyond this row.
      storeBefore(end, rows.densities(row, x, within), values + x);
    }
    rows.endRow(row);
  }
  return rows.votes();
}

// ---------------------------------------------------------------- pairs

// The means of two of `fusion.cpp`, with the same bits.

struct Min {
  static HWY_INLINE FloatV mean(FloatV a, FloatV b) { return hn::Min(a, b); }
};

struct Harmonic {
  static HWY_INLINE FloatV mean(FloatV a, FloatV b) {
    const Floats d;
    const FloatV low = hn::Min(a, b);
    const FloatV high = hn::Max(a, b);
    const FloatV sum = hn::Max(hn::Add(low, high), hn::Set(d, std::numeric_limits<float>::min()));
    return hn::Mul(hn::Add(low, low), hn::Div(high, sum));
  }
};

struct Geometric {
  static HWY_INLINE FloatV mean(FloatV a, FloatV b) { return hn::Mul(hn::Sqrt(a), hn::Sqrt(b)); }
};

/// All pixels, by rows.
template <class Rule>
void addAll(std::uint64_t* first, std::uint64_t* second, int width, int height, float* sum,
            std::uint64_t votes[2]) {
  const Floats d;
  const Unsigned du;
  const float* end = sum + static_cast<std::ptrdiff_t>(width) * height;
  RowResolver first_rows(first, width);
  RowResolver second_rows(second, width);
  for (int row = 0; row < height; ++row, sum += width) {
    for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d))) {
      const auto within = hn::FirstN(du, static_cast<std::size_t>(width - x));
      const FloatV mean =
          Rule::mean(first_rows.densities(row, x, within), second_rows.densities(row, x, within));
      const FloatV added = hn::IfThenElseZero(hn::RebindMask(d, within), mean);
      storeBefore(end, hn::Add(hn::LoadU(d, sum + x), added), sum + x);
    }
    first_rows.endRow(row);
    second_rows.endRow(row);
  }
  votes[0] += first_rows.votes();
  votes[1] += second_rows.votes();
}

/// For each line of a row of pixels a byte, not zero where one of their cells may have votes: cells
/// of the rows above and below, of the line and of the next one.
HWY_INLINE std::uint64_t linesWithVotes(const std::uint8_t* dirty, int row) {
  constexpr int kLinesInRow = kTileCells / kLineCells;
  std::uint64_t rows[2];
  static_assert(kLinesInRow == sizeof(rows[0]));
  std::memcpy(rows, dirty + static_cast<std::ptrdiff_t>(row) * kLinesInRow, sizeof(rows));
  const std::uint64_t lines = rows[0] | rows[1];
  return lines | lines >> 8;  // lowest bits first, on all processors that there are kernels for
}

/// Clears the marked lines and their marks. @return the votes of the cells whose upper left pixel
/// lies in the tile.
std::uint64_t clearMarked(const CellBuffer& buffer, int height) {
  constexpr int kLinesInRow = kTileCells / kLineCells;
  const Cells d;
  auto votes = hn::Zero(d);
  std::uint64_t of_border = 0;  // the first row and the first column of cells
  for (int row = 0; row <= height; ++row) {
    std::uint8_t* dirty = buffer.dirty + static_cast<std::ptrdiff_t>(row) * kLinesInRow;
    std::uint64_t* cells = buffer.cells + static_cast<std::ptrdiff_t>(row) * kTileCells;
    std::uint64_t marks = 0;
    std::memcpy(&marks, dirty, sizeof(marks));
    if (marks == 0) continue;
    for (int x = 0; x < (row == 0 ? kTileCells : 1); ++x)
      of_border += cells[x] >> (32 + kCountShift);
    for (int line = 0; line < kLinesInRow; ++line) {
      if (dirty[line] == 0) continue;
      for (int x = kLineCells * line; x < kLineCells * (line + 1);
           x += static_cast<int>(hn::Lanes(d))) {
        votes = hn::Add(votes, hn::ShiftRight<32 + kCountShift>(hn::Load(d, cells + x)));
        hn::Store(hn::Zero(d), d, cells + x);
      }
    }
  }
  std::fill_n(buffer.dirty, kLines, std::uint8_t{0});
  return sumOfLanes(d, votes) - of_border;
}

/// The densities of pixels from x on, from the cells of both rows.
HWY_INLINE FloatV densitiesAt(const std::uint64_t* cells, int row, int x) {
  const std::uint64_t* above = cells + static_cast<std::ptrdiff_t>(row) * kTileCells + x;
  const RowOfCells below(above + kTileCells);
  return densityOf(RowOfCells(above).toBelow(), below.toAbove(below.toBelow()));
}

/// Pixels in lines where both have votes.
template <class Rule>
int addMarked(const CellBuffer& first, const CellBuffer& second, int width, int height, float* sum,
              std::uint64_t votes[2]) {
  const Floats d;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(d));
  constexpr int kLinesOfVector = (kLanes + kLineCells - 1) / kLineCells;
  const float* end = sum + static_cast<std::ptrdiff_t>(width) * height;
  int pixels = 0;
  for (int row = 0; row < height; ++row, sum += width) {
    // The mean is zero where one of the two is.
    const std::uint64_t lines =
        linesWithVotes(first.dirty, row) & linesWithVotes(second.dirty, row);
    if (lines == 0) continue;
    for (int x = 0; x < width; x += kLanes) {
      const std::uint64_t of_vector = lines >> (8 * (x / kLineCells));
      if ((of_vector & ((std::uint64_t{1} << (8 * kLinesOfVector)) - 1)) == 0) continue;
      const FloatV mean =
          Rule::mean(densitiesAt(first.cells, row, x), densitiesAt(second.cells, row, x));
      const auto within = hn::FirstN(d, static_cast<std::size_t>(width - x));
      const FloatV added = hn::IfThenElseZero(within, mean);
      storeBefore(end, hn::Add(hn::LoadU(d, sum + x), added), sum + x);
      pixels += std::min(kLanes, width - x);
    }
  }
  votes[0] += clearMarked(first, height);
  votes[1] += clearMarked(second, height);
  return pixels;
}

template <class Rule>
int addPair(const CellBuffer& first, const CellBuffer& second, int width, int height, float* sum,
            std::uint64_t votes[2]) {
  if (first.dirty != nullptr) return addMarked<Rule>(first, second, width, height, sum, votes);
  addAll<Rule>(first.cells, second.cells, width, height, sum, votes);
  return width * height;
}

constexpr ResolveFunctions kResolve = {resolveAll, addPair<Min>, addPair<Harmonic>,
                                       addPair<Geometric>};

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

// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/tile_scatter.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>

#include "mapping/kernels/highway_targets.h"

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

constexpr float kUnit = 1.0F / (1 << kWeightBits);

/// Returns the weights that a row of cells has for a vector of pixels. The lower 16 bits are for
/// the pixels above the row, the upper 16 bits for the pixels below.
/// @param cells the first cell, left of the first pixel.
HWY_INLINE UnsignedV weightsOf(const std::uint64_t* cells) {
  const Unsigned d;
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d,
                 static_cast<std::uint32_t>(cells[0] >> 32) + static_cast<std::uint32_t>(cells[1]));
#else
  const Cells d64;
  const std::size_t half = hn::Lanes(d64);
  const auto load = [&](const std::uint64_t* from) { return hn::BitCast(d, hn::LoadU(d64, from)); };
  // A cell's upper half is for the pixels on its right, the lower half for the pixels on its left.
  // The top bit of each sum is zero, so no addition overflows.
  return hn::Add(hn::ConcatOdd(d, load(cells + half), load(cells)),
                 hn::ConcatEven(d, load(cells + 1 + half), load(cells + 1)));
#endif
}

HWY_INLINE UnsignedV toAbove(UnsignedV weights) {
  return hn::And(weights, hn::Set(Unsigned(), 0xFFFFU));
}
HWY_INLINE UnsignedV toBelow(UnsignedV weights) { return hn::ShiftRight<16>(weights); }

HWY_INLINE FloatV floatsOf(UnsignedV units) {
  return hn::ConvertTo(Floats(), hn::BitCast(Signed(), units));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE std::uint64_t sumOfLanes(D d, V values) {
  HWY_ALIGN hn::TFromD<D> lanes[hn::MaxLanes(D())];
  hn::Store(values, d, lanes);
  return std::accumulate(lanes, lanes + hn::Lanes(d), std::uint64_t{0});
}

// ---------------------------------------------------------------- columns of pixels

/// Resolves a vector of a tile's pixel columns downwards, and clears the cells left of the pixels.
class ColumnResolver {
 public:
  /// @param cells the first row, from the cell left of the first pixel. @param within the lanes
  /// inside the tile.
  template <class Mask>
  HWY_INLINE ColumnResolver(std::uint64_t* cells, Mask within)
      : cells_(cells), within_(hn::VecFromMask(Unsigned(), within)) {
    next();  // skips the pixels above the tile
    units_ = hn::Zero(Unsigned());
  }

  /// Returns the weights of the next row of pixels, in units.
  HWY_INLINE FloatV next() {
    const Cells d;
    const UnsignedV weights = weightsOf(cells_);
    for (std::size_t x = 0; x < hn::Lanes(Unsigned()); x += hn::Lanes(d)) {
      hn::Store(hn::Zero(d), d, cells_ + x);
    }
    cells_ += kTileCells;
    const UnsignedV sum = hn::Add(from_above_, toAbove(weights));
    from_above_ = toBelow(weights);
    units_ = hn::Add(units_, hn::And(within_, sum));
    return floatsOf(sum);
  }
  /// Returns the sum over all pixels so far, in units.
  std::uint64_t units() const { return sumOfLanes(Unsigned(), units_); }

 private:
  std::uint64_t* cells_;
  UnsignedV within_;
  UnsignedV units_ = hn::Zero(Unsigned());
  UnsignedV from_above_ = hn::Zero(Unsigned());  // the weights of the cells above
};

/// Clears the cells to the right of the last pixels if no vector of columns includes them.
HWY_INLINE void clearLast(std::uint64_t* cells, int width, int height) {
  if (width % static_cast<int>(hn::Lanes(Unsigned())) != 0) return;
  for (int row = 0; row <= height; ++row) cells[row * kTileCells + width] = 0;
}

std::uint64_t resolveAll(std::uint64_t* cells, int width, int height, float* values) {
  const Floats d;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(d));
  std::uint64_t units = 0;
  for (int x = 0; x < width; x += kLanes) {
    const int lanes = std::min(kLanes, width - x);
    ColumnResolver column(cells + x, hn::FirstN(Unsigned(), static_cast<std::size_t>(lanes)));
    float* to = values + x;
    for (int row = 0; row < height; ++row, to += width) {
      const FloatV density = hn::Mul(column.next(), hn::Set(d, kUnit));
      if (lanes == kLanes) {
        hn::StoreU(density, d, to);
      } else {
        HWY_ALIGN float whole[kLanes];
        hn::Store(density, d, whole);
        std::copy_n(whole, lanes, to);
      }
    }
    units += column.units();
  }
  clearLast(cells, width, height);
  return units;
}

// ---------------------------------------------------------------- pairs

// The means of two inputs in units, with the same bits as in `fusion.cpp`. A unit is a power of
// two, so its factor rounds nothing.

struct Min {
  static HWY_INLINE FloatV mean(FloatV a, FloatV b) {
    return hn::Mul(hn::Set(Floats(), kUnit), hn::Min(a, b));
  }
};

struct Harmonic {
  static HWY_INLINE FloatV mean(FloatV a, FloatV b) {
    const Floats d;
    const FloatV low = hn::Min(a, b);
    const FloatV high = hn::Max(a, b);
    const FloatV sum = hn::Max(hn::Add(low, high), hn::Set(d, std::numeric_limits<float>::min()));
    return hn::Mul(hn::Mul(hn::Set(d, 2 * kUnit), low), hn::Div(high, sum));
  }
};

struct Geometric {
  static HWY_INLINE FloatV mean(FloatV a, FloatV b) {
    return hn::Mul(hn::Mul(hn::Set(Floats(), kUnit), hn::Sqrt(a)), hn::Sqrt(b));
  }
};

/// Adds the means of all pixels, by columns.
template <class Rule>
void addAll(std::uint64_t* first, std::uint64_t* second, int width, int height, float* sum,
            std::uint64_t units[2]) {
  const Floats d;
  for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d))) {
    const auto within = hn::FirstN(d, static_cast<std::size_t>(width - x));
    ColumnResolver first_column(first + x, hn::RebindMask(Unsigned(), within));
    ColumnResolver second_column(second + x, hn::RebindMask(Unsigned(), within));
    float* to = sum + x;
    for (int row = 0; row < height; ++row, to += width) {
      const FloatV mean = Rule::mean(first_column.next(), second_column.next());
      hn::StoreU(hn::Add(hn::LoadU(d, to), hn::IfThenElseZero(within, mean)), d, to);
    }
    units[0] += first_column.units();
    units[1] += second_column.units();
  }
  clearLast(first, width, height);
  clearLast(second, width, height);
}

/// Returns a byte for each line of a row of pixels. It is not zero if a neighbouring cell may have
/// votes: a cell of the rows above and below, in this line or the next one.
HWY_INLINE std::uint64_t linesWithVotes(const std::uint8_t* dirty, int row) {
  constexpr int kLinesInRow = kTileCells / kLineCells;
  std::uint64_t rows[2];
  static_assert(kLinesInRow == sizeof(rows[0]));
  std::memcpy(rows, dirty + static_cast<std::ptrdiff_t>(row) * kLinesInRow, sizeof(rows));
  const std::uint64_t lines = rows[0] | rows[1];
  return lines | lines >> 8;  // little-endian, as all processors with kernels are
}

/// Clears the marked lines and their marks. @return the sum of the tile's weights, in units.
std::uint64_t clearMarked(const CellBuffer& buffer, int width, int height) {
  constexpr int kLinesInRow = kTileCells / kLineCells;
  constexpr std::uint64_t kUpper = 0x0000'FFFF'0000'FFFFU;  // weights for upper pixels
  const Cells d;
  auto units = hn::Zero(d);     // lower half: left pixels, upper half: right pixels
  std::uint64_t of_border = 0;  // weights of pixels left and right of the tile
  for (int row = 0; row <= height; ++row) {
    std::uint8_t* dirty = buffer.dirty + static_cast<std::ptrdiff_t>(row) * kLinesInRow;
    std::uint64_t* cells = buffer.cells + static_cast<std::ptrdiff_t>(row) * kTileCells;
    std::uint64_t marks = 0;
    std::memcpy(&marks, dirty, sizeof(marks));
    if (marks == 0) continue;
    const std::uint64_t above = row > 0 ? kUpper : 0;
    const std::uint64_t below = row < height ? kUpper : 0;
    const auto inRows = [&](std::uint64_t cell) { return (cell & above) + (cell >> 16 & below); };
    of_border += (inRows(cells[0]) & 0xFFFF'FFFFU) + (inRows(cells[width]) >> 32);
    for (int line = 0; line < kLinesInRow; ++line) {
      if (dirty[line] == 0) continue;
      for (int x = kLineCells * line; x < kLineCells * (line + 1);
           x += static_cast<int>(hn::Lanes(d))) {
        const auto cell = hn::Load(d, cells + x);
        units = hn::Add(units, hn::Add(hn::And(cell, hn::Set(d, above)),
                                       hn::And(hn::ShiftRight<16>(cell), hn::Set(d, below))));
        hn::Store(hn::Zero(d), d, cells + x);
      }
    }
  }
  std::fill_n(buffer.dirty, kLines, std::uint8_t{0});
  return sumOfLanes(d,
                    hn::Add(hn::And(units, hn::Set(d, 0xFFFF'FFFFU)), hn::ShiftRight<32>(units))) -
         of_border;
}

/// Returns the weights of the pixels from x on, in units, from the rows of cells above and below.
HWY_INLINE FloatV unitsAt(const std::uint64_t* cells, int row, int x) {
  const std::uint64_t* above = cells + static_cast<std::ptrdiff_t>(row) * kTileCells + x;
  return floatsOf(hn::Add(toBelow(weightsOf(above)), toAbove(weightsOf(above + kTileCells))));
}

/// Adds the means of pixels in lines where both inputs have votes.
template <class Rule>
int addMarked(const CellBuffer& first, const CellBuffer& second, int width, int height, float* sum,
              std::uint64_t units[2]) {
  const Floats d;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(d));
  constexpr int kLinesOfVector = (kLanes + kLineCells - 1) / kLineCells;
  int pixels = 0;
  for (int row = 0; row < height; ++row, sum += width) {
    // The mean is zero if one of the two inputs is zero.
    const std::uint64_t lines =
        linesWithVotes(first.dirty, row) & linesWithVotes(second.dirty, row);
    if (lines == 0) continue;
    for (int x = 0; x < width; x += kLanes) {
      const std::uint64_t of_vector = lines >> (8 * (x / kLineCells));
      if ((of_vector & ((std::uint64_t{1} << (8 * kLinesOfVector)) - 1)) == 0) continue;
      const FloatV mean = Rule::mean(unitsAt(first.cells, row, x), unitsAt(second.cells, row, x));
      const auto within = hn::FirstN(d, static_cast<std::size_t>(width - x));
      hn::StoreU(hn::Add(hn::LoadU(d, sum + x), hn::IfThenElseZero(within, mean)), d, sum + x);
      pixels += std::min(kLanes, width - x);
    }
  }
  units[0] += clearMarked(first, width, height);
  units[1] += clearMarked(second, width, height);
  return pixels;
}

template <class Rule>
int addPair(const CellBuffer& first, const CellBuffer& second, int width, int height, float* sum,
            std::uint64_t units[2]) {
  if (first.dirty != nullptr) return addMarked<Rule>(first, second, width, height, sum, units);
  addAll<Rule>(first.cells, second.cells, width, height, sum, units);
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

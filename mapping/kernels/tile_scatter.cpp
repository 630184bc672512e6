// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/tile_scatter.h"

#include <algorithm>

#include "mapping/kernels/highway_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/kernels/tile_scatter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace efm::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Unsigned = hn::RebindToUnsigned<Floats>;
using FloatV = hn::Vec<Floats>;
using UnsignedV = hn::Vec<Unsigned>;

constexpr std::uint32_t kFractionMask = (1U << kFractionBits) - 1;
constexpr std::uint32_t kUnits = 1U << kWeightBits;  // units of a vote
constexpr std::uint64_t kFullCell = 0x8000'8000'8000'8000U;
/// After this number of votes, cells are checked. Before that, no sum can overflow its field.
constexpr std::size_t kVotesUnseen = kVotesPerCell;
static_assert(0x7FFF + kVotesUnseen * kUnits <= 0xFFFF && kVotesPerCell * kUnits == 0x8000);

/// Adding 2^23 to a float leaves its rounded value in the last bits.
constexpr float kToBits = 8388608.0F;
constexpr std::uint32_t kBitsOfZero = 0x4B000000U;

// ---------------------------------------------------------------- gathering

/// Moves the lanes with a true mask to the front. The same lanes of several vectors are moved.
class LanesToFront {
 public:
  template <class Mask>
  explicit HWY_INLINE LanesToFront(Mask mask)
#if HWY_MAX_BYTES >= 64
      : mask_(mask) {
  }
  HWY_INLINE FloatV operator()(FloatV values) const { return hn::Compress(values, mask_); }

 private:
  hn::Mask<Floats> mask_;
#else
      : indices_(hn::SetTableIndices(Floats(), table().lanes[bitsOf(mask)])) {
  }
  HWY_INLINE FloatV operator()(FloatV values) const {
    return hn::TableLookupLanes(values, indices_);
  }

 private:
  // Highway's Compress copies its table to the stack at each call.
  static constexpr std::size_t kLanes = hn::MaxLanes(Floats());
  struct Table {
    alignas(64) std::int32_t lanes[std::size_t{1} << kLanes][kLanes];
  };
  static constexpr Table makeTable() {
    Table table{};
    for (std::size_t bits = 0; bits < std::size_t{1} << kLanes; ++bits) {
      std::size_t front = 0;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if ((bits >> lane & 1) != 0) table.lanes[bits][front++] = static_cast<std::int32_t>(lane);
      }
    }
    return table;
  }
  static const Table& table() {
    static constexpr Table kTable = makeTable();
    return kTable;
  }
  template <class Mask>
  static HWY_INLINE std::size_t bitsOf(Mask mask) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(Floats(), mask, bits);
    return bits[0];
  }

  decltype(hn::SetTableIndices(Floats(), static_cast<const std::int32_t*>(nullptr))) indices_;
#endif
};

std::size_t gather(const BinnedRay* bin, std::size_t count, const GatherRequest& request,
                   const MovingRays& rays) {
  const Floats d;
  const auto set = [d](float value) { return hn::Set(d, value); };
  const FloatV scale = set(static_cast<float>(1 << kFractionBits));
  const FloatV shift_scale = hn::Mul(scale, set(request.moving));
  std::size_t size = rays.size;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    FloatV x;
    FloatV y;
    FloatV dx;
    FloatV dy;
    hn::LoadInterleaved4(d, &bin[i].x, x, y, dx, dy);
    const FloatV x0 = hn::MulAdd(set(request.to_first), dx, x);
    const FloatV y0 = hn::MulAdd(set(request.to_first), dy, y);
    const FloatV x1 = hn::MulAdd(set(request.to_last), dx, x);
    const FloatV y1 = hn::MulAdd(set(request.to_last), dy, y);
    const auto across = hn::And(hn::Ge(hn::Max(x0, x1), set(request.left)),
                                hn::Lt(hn::Min(x0, x1), set(request.right)));
    const auto along = hn::And(hn::Ge(hn::Max(y0, y1), set(request.top)),
                               hn::Lt(hn::Min(y0, y1), set(request.bottom)));
    const auto near = hn::And(hn::And(across, along), hn::FirstN(d, count - i));
    // Long vectors have a ray near nearly always, and their compression costs less than a branch.
    if (hn::MaxLanes(d) <= 8 && hn::AllFalse(d, near)) continue;
    // Whole vectors are stored, also into the padding: compressing directly into memory is slower.
    const LanesToFront to_front(near);
    const auto append = [&](FloatV values, float* to) {
      hn::StoreU(to_front(values), d, to + size);
    };
    const FloatV pixel_x = hn::MulAdd(set(request.to_pixels), dx, x);
    const FloatV pixel_y = hn::MulAdd(set(request.to_pixels), dy, y);
    append(hn::Mul(hn::Sub(pixel_x, set(request.origin_x)), scale), rays.x);
    append(hn::Mul(hn::Sub(pixel_y, set(request.origin_y)), scale), rays.y);
    append(hn::Mul(dx, shift_scale), rays.dx);
    append(hn::Mul(dy, shift_scale), rays.dy);
    size += hn::CountTrue(d, near);
  }
  return size;
}

// ---------------------------------------------------------------- voting

/// The weights of votes for the two left and the two right pixels. The upper pixel's weight is in
/// the lower 16 bits.
struct Weights {
  UnsignedV left, right;
};

/// @param x, y positions in cells; the last kFractionBits bits are fractions. @param inside if
/// false, the weights are zero.
template <class Mask>
HWY_INLINE Weights weightsOf(UnsignedV x, UnsignedV y, Mask inside) {
  const Unsigned d;
#if HWY_TARGET == HWY_SCALAR
  const auto set = [d](std::uint32_t value) { return hn::Set(d, value); };
  const UnsignedV a = hn::ShiftLeft<15 - kFractionBits>(hn::And(x, set(kFractionMask)));
  const UnsignedV lower = hn::ShiftRight<kFractionBits - kWeightBits>(
      hn::Add(hn::And(y, set(kFractionMask)), set(1U << (kFractionBits - kWeightBits - 1))));
  const UnsignedV upper = hn::Sub(set(kUnits), lower);
  const auto toRight = [&](UnsignedV weight) {
    return hn::ShiftRight<15>(hn::Add(hn::Mul(weight, a), set(1U << 14)));
  };
  const UnsignedV both = hn::IfThenElseZero(inside, hn::Or(upper, hn::ShiftLeft<16>(lower)));
  const UnsignedV right =
      hn::IfThenElseZero(inside, hn::Or(toRight(upper), hn::ShiftLeft<16>(toRight(lower))));
#else
  // Pairs of 16-bit numbers. Their products are rounded.
  const hn::Repartition<std::int16_t, Unsigned> d16;
  const hn::Repartition<std::uint8_t, Unsigned> d8;
  HWY_ALIGN static constexpr std::uint8_t kLowerHalfTwice[16] = {0, 1, 0, 1, 4,  5,  4,  5,
                                                                 8, 9, 8, 9, 12, 13, 12, 13};
  const auto twice = hn::LoadDup128(d8, kLowerHalfTwice);
  const auto fraction = hn::Set(d16, static_cast<std::int16_t>(kFractionMask));
  const auto fractionOf = [&](UnsignedV value) {
    return hn::And(hn::BitCast(d16, hn::TableLookupBytes(hn::BitCast(d8, value), twice)), fraction);
  };
  const auto pair = [d, d16](std::uint32_t low, std::uint32_t high) {
    return hn::BitCast(d16, hn::Set(d, low | high << 16));
  };
  const auto across = hn::ShiftLeft<15 - kFractionBits>(fractionOf(x));
  const auto below = hn::MulFixedPoint15(
      fractionOf(y), hn::Set(d16, std::int16_t{1} << (15 - kFractionBits + kWeightBits)));
  // Upper weights are kUnits - below.
  const auto down = hn::Add(hn::Xor(below, pair(0xFFFF, 0)), pair(kUnits + 1, 0));
  const UnsignedV both = hn::IfThenElseZero(inside, hn::BitCast(d, down));
  const UnsignedV right = hn::BitCast(d, hn::MulFixedPoint15(hn::BitCast(d16, both), across));
#endif
  return {hn::Sub(both, right), right};
}

/// A batch of votes. Votes are written as vectors and read one by one. The batch stays in the
/// first-level cache.
struct VoteBatch {
  static constexpr std::size_t kSize = 128;
  HWY_ALIGN std::uint32_t index[kSize] = {};
  HWY_ALIGN std::uint64_t sums[kSize];
};

/// Stores 64-bit values from their halves. A vector of four or more lanes changes the order of the
/// values: see `laneOf`.
HWY_INLINE void storeHalves(UnsignedV lower, UnsignedV upper, std::uint64_t* values) {
#if HWY_TARGET == HWY_SCALAR
  *values = hn::GetLane(lower) | static_cast<std::uint64_t>(hn::GetLane(upper)) << 32;
#else
  const Unsigned d;
  const hn::Repartition<std::uint64_t, Unsigned> d64;
  hn::Store(hn::BitCast(d64, hn::InterleaveLower(d, lower, upper)), d64, values);
  hn::Store(hn::BitCast(d64, hn::InterleaveUpper(d, lower, upper)), d64, values + hn::Lanes(d64));
#endif
}

/// Returns the lane of the k-th stored value.
HWY_INLINE std::size_t laneOf(std::size_t k, std::size_t lanes) {
  if (lanes == 1) return 0;
  const std::size_t half = lanes / 2;
  const std::size_t in_half = k % half;
  return in_half / 2 * 4 + in_half % 2 + (k < half ? 0 : 2);
}

/// Encodes the votes of a vector of rays: the index of each vote's cell, and the sums to add to it.
class VoteEncoder {
 public:
  VoteEncoder(const MovingRays& rays, float to_plane, const CellWindow& window)
      : rays_(rays),
        to_plane_(hn::Set(Floats(), to_plane)),
        left_(hn::Set(Unsigned(), bitsAt(window.left))),
        top_(hn::Set(Unsigned(), bitsAt(window.top))),
        width_(hn::Set(Unsigned(), window.columns << kFractionBits)),
        height_(hn::Set(Unsigned(), window.rows << kFractionBits)),
        first_(hn::Set(Unsigned(), window.first)) {}

  HWY_INLINE void encode(std::size_t ray, std::uint32_t* index, std::uint64_t* sums) const {
    const Unsigned du;
    const UnsignedV x = fixedPoint(rays_.x + ray, rays_.dx + ray, left_);
    const UnsignedV y = fixedPoint(rays_.y + ray, rays_.dy + ray, top_);
    const auto inside = hn::And(hn::Lt(x, width_), hn::Lt(y, height_));
    // A ray outside the window adds zero to a cell of the tile.
    const UnsignedV cell = hn::And(hn::Add(hn::ShiftLeft<6>(hn::ShiftRight<kFractionBits>(y)),
                                           hn::ShiftRight<kFractionBits>(x)),
                                   hn::Set(du, kTileCells * kTileCells - 1));
    static_assert(kTileCells == 1 << 6);
    hn::Store(hn::Add(cell, first_), du, index);
    const Weights weights = weightsOf(x, y, inside);
    storeHalves(weights.left, weights.right, sums);
  }

 private:
  static std::uint32_t bitsAt(std::int32_t cell) {
    return kBitsOfZero + (static_cast<std::uint32_t>(cell) << kFractionBits);
  }

  /// Returns coordinates from the window's edge. A coordinate before the edge wraps and is huge.
  HWY_INLINE UnsignedV fixedPoint(const float* start, const float* shift, UnsignedV edge) const {
    const Floats d;
    const FloatV position = hn::MulAdd(to_plane_, hn::Load(d, shift), hn::Load(d, start));
    return hn::Sub(hn::BitCast(Unsigned(), hn::Add(position, hn::Set(d, kToBits))), edge);
  }

  MovingRays rays_;
  FloatV to_plane_;
  UnsignedV left_, top_, width_, height_, first_;
};

/// Moves full cells to the list. @param index the cells of the last kVotesUnseen votes.
HWY_INLINE FullCell* takeFull(const std::uint32_t* index, std::uint64_t* cells, FullCell* full) {
  for (std::size_t vote = 0; vote < kVotesUnseen; ++vote) {
    std::uint64_t& cell = cells[index[vote]];
    if ((cell & kFullCell) == 0) continue;
    *full++ = {index[vote], cell};
    cell = 0;
  }
  return full;
}

/// Adds a batch's votes to their cells.
template <bool kMarks>
HWY_INLINE FullCell* scatter(const VoteBatch& batch, std::size_t count, const CellBuffer& tile,
                             FullCell* full) {
  std::uint64_t* const cells = tile.cells;
  std::uint8_t* const dirty = tile.dirty;
  constexpr std::size_t kLanes = hn::MaxLanes(Floats());
  static_assert(VoteBatch::kSize % kVotesUnseen == 0 && kVotesUnseen % kLanes == 0);
  for (std::size_t begin = 0; begin < count; begin += kVotesUnseen) {
    const std::size_t end = std::min(begin + kVotesUnseen, count);
    std::uint64_t seen = 0;
    for (std::size_t i = begin; i < end; i += kLanes) {
#pragma GCC unroll 16
      for (std::size_t k = 0; k < kLanes; ++k) {
        const std::uint32_t index = batch.index[i + laneOf(k, kLanes)];
        const std::uint64_t sums = batch.sums[i + k] + cells[index];
        cells[index] = sums;
        if (kMarks) dirty[index / kLineCells] = 1;
        seen |= sums;
      }
    }
    if (HWY_UNLIKELY((seen & kFullCell) != 0)) full = takeFull(batch.index + begin, cells, full);
  }
  return full;
}

template <bool kMarks>
FullCell* voteBy(const MovingRays& rays, float to_plane, const CellWindow& window, FullCell* full) {
  VoteBatch batch;
  const VoteEncoder encoder(rays, to_plane, window);
  const std::size_t lanes = hn::Lanes(Floats());
  // There are two steps: vectors write a batch to memory, then votes are added one by one. In one
  // loop the compiler extracts lanes from registers, which costs more.
  for (std::size_t begin = 0; begin < rays.size; begin += VoteBatch::kSize) {
    const std::size_t size = std::min(rays.size - begin, VoteBatch::kSize);
    for (std::size_t i = 0; i < size; i += lanes) {
      encoder.encode(begin + i, batch.index + i, batch.sums + i);
    }
    full = scatter<kMarks>(batch, size, window.tile, full);
  }
  return full;
}

FullCell* vote(const MovingRays& rays, float to_plane, const CellWindow& window, FullCell* full) {
  return (window.tile.dirty == nullptr ? voteBy<false> : voteBy<true>)(rays, to_plane, window,
                                                                       full);
}

constexpr TileFunctions kTile = {gather, vote};

}  // namespace efm::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace efm::kernels {

const TileFunctions& tileFunctions(VotingKernel kernel) {
  static constexpr KernelTable<TileFunctions> kTable = {nullptr, EFM_VECTOR_KERNELS(kTile)};
  return kernelIn(kTable, kernel);
}

}  // namespace efm::kernels
#endif

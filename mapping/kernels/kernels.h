// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace efm {

/// The code of the inner loops: plain scalar code (the specification), or vectors of one
/// instruction set. Within an architecture, vector kernels are ordered from slow to fast.
enum class VotingKernel {
  kPlain,
  kBaseline,  ///< Vectors that every processor of the architecture has; slower than plain.
  kSse4,
  kAvx2,    ///< AVX2 with FMA, BMI2 and F16C.
  kAvx512,  ///< AVX-512 F, BW, CD, DQ and VL.
  kNeon,
};

}  // namespace efm

namespace efm::kernels {

/// Returns the kernels of this build that this processor can run, in the order of `VotingKernel`.
std::vector<VotingKernel> availableKernels();

/// The votes of one camera on one depth plane: row-major, width x height, owned by the caller.
struct VotePlane {
  float* votes = nullptr;
  int width = 0;
  int height = 0;
};

/// Rays as two arrays of pixel coordinates on the plane that transfers start from.
struct RayArrays {
  const float* x = nullptr;
  const float* y = nullptr;
};

/// Transfer of rays [begin, end) to the pixels (scale * x + offset_x, scale * y + offset_y).
struct RayTransfer {
  std::size_t begin = 0;
  std::size_t end = 0;
  float scale = 0;
  float offset_x = 0;
  float offset_y = 0;
};

/// Adds one bilinear vote to the plane for each ray whose four neighbouring pixels are inside it:
/// 0 <= x < width - 1 and 0 <= y < height - 1. This plain scalar kernel is the specification.
/// @return the number of votes cast.
std::uint64_t voteBilinear(const RayArrays& rays, const RayTransfer& transfer,
                           const VotePlane& plane);

/// Vectors may read and write this number of values past the end of a column or a sum.
inline constexpr std::size_t kColumnPadding = 16;

/// A column stores a value as one byte: the square root of its distance below the column's peak.
/// Steps are fine near the peak, which decides the depth, and coarse (1/128 of the peak) near zero.
inline constexpr int kMaxRoot = 255;                       ///< The root of value 0.
inline constexpr float kColumnPeak = kMaxRoot * kMaxRoot;  ///< The peak, in units of the column.
/// Returns the value of a root, in units of the column.
inline float columnValue(std::uint8_t root) {
  return kColumnPeak - static_cast<float>(int{root} * int{root});
}

/// Arithmetic on columns of the DSI. A column has the values of one pixel on all planes.
struct ColumnFunctions {
  /// Adds unit * columnValue(roots[plane]) to each sum[plane]. Sums in the padding are undefined.
  void (*add)(float* sum, const std::uint8_t* roots, std::size_t planes, float unit) = nullptr;
};

/// @param kernel one of `availableKernels`; all kernels give the same bits.
const ColumnFunctions& columnFunctions(VotingKernel kernel);

/// The arithmetic of one fusion rule over n voxels. Pointers need no alignment. Values after the
/// n-th are not accessed.
struct FusionSteps {
  float start = 0;  ///< The sum before the first input.
  /// Adds an input to the sum.
  void (*fold)(float* sum, const float* values, std::size_t n) = nullptr;
  /// Turns the sum into the mean. @param inputs the number of inputs in the sum.
  void (*finish)(float* sum, float inputs, std::size_t n) = nullptr;
  /// Replaces `values`, the first of two inputs, by the mean of both inputs, without a sum.
  void (*pair)(float* values, const float* others, std::size_t n) = nullptr;
};

struct FusionFunctions {
  FusionSteps min;
  FusionSteps harmonic;
  FusionSteps geometric;
  FusionSteps arithmetic;
  FusionSteps rms;
  FusionSteps max;
};

/// Returns plain functions: kernels per instruction set would save only 2 % of a sweep's time.
const FusionFunctions& fusionFunctions();

/// The largest value of each pixel so far. The caller owns the arrays; they need no alignment.
struct PeakArrays {
  float* best = nullptr;          ///< The largest value; the first one if several are equal.
  std::int32_t* plane = nullptr;  ///< The plane of `best`.
  float* before = nullptr;        ///< The value one plane before `plane`; -1 if there is none.
  float* after = nullptr;         ///< The value one plane after `plane`; -1 if there is none.
  float* previous = nullptr;      ///< The value of the plane added last.
};

struct PeakFunctions {
  using Add = void (*)(const PeakArrays& peaks, std::int32_t plane, const float* values,
                       std::size_t n);
  /// Adds the n values of a plane. Planes are added in increasing order, without a gap.
  Add add = nullptr;
  /// Adds them to `best` and `plane` alone, in any order of the planes.
  Add addAlone = nullptr;
};

/// @param kernel one of `availableKernels`; all kernels give the same bits.
const PeakFunctions& peakFunctions(VotingKernel kernel);

/// Vectors may read, and write back, this number of values past the end of a fused plane
/// (`ResolveFunctions` in tile_scatter.h).
inline constexpr std::size_t kSumPadding = 16;

/// Vectors may read and write this number of values past the end of each array.
inline constexpr std::size_t kRankPadding = 16;

/// Ranks of a few weighted positions, from sums over all pairs. The sums have no branches: for up
/// to a hundred positions they are faster than sorting.
struct RankFunctions {
  /// Adds to `below`, for each position, the weights of all positions less than or equal to it.
  /// Each array has n values, and kRankPadding values more.
  void (*add)(float* below, const float* positions, const float* weights, std::size_t n) = nullptr;
};

/// @param kernel one of `availableKernels`; all kernels give the same bits.
const RankFunctions& rankFunctions(VotingKernel kernel);

}  // namespace efm::kernels

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace efm {

/// The code of the inner loops: plain scalar code, the specification, or vectors of one instruction
/// set. Vectors from slow to fast within an architecture.
enum class VotingKernel {
  kPlain,
  kBaseline,  ///< What any processor of the architecture has. Slower than plain.
  kSse4,
  kAvx2,    ///< With FMA, BMI2 and F16C.
  kAvx512,  ///< F, BW, CD, DQ and VL.
  kNeon,
};

}  // namespace efm

namespace efm::kernels {

/// The kernels that this build has and this processor can run, in the order of `VotingKernel`.
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

/// Rays [begin, end) meet the plane at (scale * x + offset_x, scale * y + offset_y).
struct RayTransfer {
  std::size_t begin = 0;
  std::size_t end = 0;
  float scale = 0;
  float offset_x = 0;
  float offset_y = 0;
};

/// Adds one bilinear vote per ray to the plane, where all four neighbouring pixels lie inside it:
/// 0 <= x < width - 1 and 0 <= y < height - 1. The plain scalar kernel: the specification.
/// @return the number of votes cast.
std::uint64_t voteBilinear(const RayArrays& rays, const RayTransfer& transfer,
                           const VotePlane& plane);

/// Vectors may read and write this number of values past the end of a column or a sum.
inline constexpr std::size_t kColumnPadding = 16;

/// A column stores the root of the distance of each value below the column's peak, in a byte: steps
/// are fine near the peak, which decides on the depth, and coarse (1/128 of the peak) near zero.
inline constexpr int kMaxRoot = 255;                       ///< Stands for 0.
inline constexpr float kColumnPeak = kMaxRoot * kMaxRoot;  ///< A column's peak, in its units.
/// The value that a root stands for, in units of the column.
inline float columnValue(std::uint8_t root) {
  return kColumnPeak - static_cast<float>(int{root} * int{root});
}

/// Arithmetic on columns of the DSI: the values of a pixel on all planes.
struct ColumnFunctions {
  /// sum[plane] += unit * columnValue(roots[plane]); also in the padding, where sums mean nothing.
  void (*add)(float* sum, const std::uint8_t* roots, std::size_t planes, float unit) = nullptr;
};

/// @param kernel one of `availableKernels`. All of them give the bits of the plain one.
const ColumnFunctions& columnFunctions(VotingKernel kernel);

/// One rule's arithmetic over n voxels. Pointers need no alignment, and nothing beyond n is
/// touched.
struct FusionSteps {
  float start = 0;  ///< The sum before the first input.
  /// Adds an input to the sum.
  void (*fold)(float* sum, const float* values, std::size_t n) = nullptr;
  /// Turns the sum of the inputs into their mean.
  void (*finish)(float* sum, float inputs, std::size_t n) = nullptr;
  /// Replaces the first of two inputs by their mean, without a sum in between.
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

/// Plain functions: kernels per instruction set would save 2 % of a sweep.
const FusionFunctions& fusionFunctions();

/// The best value so far of each pixel: arrays owned by the caller, that need no alignment.
struct PeakArrays {
  float* best = nullptr;          ///< The largest value; of equals the first.
  std::int32_t* plane = nullptr;  ///< Its plane.
  float* before = nullptr;        ///< The value one plane before it; -1 if there is none.
  float* after = nullptr;         ///< The value one plane after it; -1 if there is none.
  float* previous = nullptr;      ///< The value of the plane added last.
};

struct PeakFunctions {
  /// Adds the n values of the plane that follows the last one.
  void (*add)(const PeakArrays& peaks, std::int32_t plane, const float* values,
              std::size_t n) = nullptr;
};

/// @param kernel one of `availableKernels`. All of them give the bits of the plain one.
const PeakFunctions& peakFunctions(VotingKernel kernel);

/// Vectors may read and write this number of values past the end.
inline constexpr std::size_t kRankPadding = 16;

/// Ranks of a few weighted positions. Sums over all pairs have no branches: up to a hundred
/// positions they are faster than sorting.
struct RankFunctions {
  /// Adds to each position's sum the weights of all positions at or below it. All arrays have n
  /// values and kRankPadding.
  void (*add)(float* below, const float* positions, const float* weights, std::size_t n) = nullptr;
};

/// @param kernel one of `availableKernels`. All of them give the bits of the plain one.
const RankFunctions& rankFunctions(VotingKernel kernel);

}  // namespace efm::kernels

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "mapping/depth/depth_probability.h"
#include "mapping/geometry/reference_view.h"

namespace efm {

/// The non-zero pixels of a mask, row by row, from left to right. A semi-dense depth map uses a few
/// percent of the pixels; work on a sparse mask skips the others.
class SparseMask {
 public:
  explicit SparseMask(const cv::Mat1b& mask);

  std::size_t size() const { return columns_.size(); }
  int rows() const { return static_cast<int>(row_begin_.size()) - 1; }
  /// The pixels of row `y` have the indices [rowBegin(y), rowBegin(y + 1)).
  std::size_t rowBegin(int y) const { return row_begin_[static_cast<std::size_t>(y)]; }
  int column(std::size_t pixel) const { return columns_[pixel]; }

  /// Calls `visit(index, position)` for each pixel.
  template <typename Visit>
  void forEach(Visit visit) const {
    for (int y = 0; y < rows(); ++y) {
      for (std::size_t i = rowBegin(y); i < rowBegin(y + 1); ++i)
        visit(i, cv::Point(columns_[i], y));
    }
  }

 private:
  std::vector<int> columns_;
  std::vector<std::size_t> row_begin_;  // one more than rows
};

/// Search for the pixels of a sparse mask in the window of 9x9 pixels around a pixel, itself
/// included. It remembers the last window, so it is fast for pixels from left to right.
class PixelNeighbours {
 public:
  static constexpr int kRadius_px = 4;
  static constexpr int kRows = 2 * kRadius_px + 1;
  static constexpr std::size_t kMaxPixels = kRows * kRows;

  /// Gaussian weights; the index is the squared distance, pixels^2.
  using Weights = std::array<float, 2 * kRadius_px * kRadius_px + 1>;
  static Weights gaussian(float sigma_px) {
    Weights weights{};
    for (std::size_t distance_sq = 0; distance_sq < weights.size(); ++distance_sq) {
      weights[distance_sq] = std::exp(-static_cast<float>(distance_sq) / (2 * sigma_px * sigma_px));
    }
    return weights;
  }

  /// @param mask outlives this object.
  explicit PixelNeighbours(const SparseMask& mask) : mask_(&mask) {}

  /// Calls `visit(index, offset)` for each pixel of the mask in the window, row by row.
  template <typename Visit>
  void forEach(cv::Point pixel, Visit visit) {
    if (pixel.y != last_.y || pixel.x < last_.x) {
      for (int row = 0; row < kRows; ++row) {
        const int of_mask = std::clamp(pixel.y - kRadius_px + row, 0, mask_->rows());
        begins_[static_cast<std::size_t>(row)] = mask_->rowBegin(of_mask);
      }
    }
    last_ = pixel;
    const int first = std::max(0, pixel.y - kRadius_px);
    const int last = std::min(mask_->rows() - 1, pixel.y + kRadius_px);
    for (int y = first; y <= last; ++y) {
      std::size_t& begin = begins_[static_cast<std::size_t>(y - pixel.y + kRadius_px)];
      const std::size_t end = mask_->rowBegin(y + 1);
      while (begin < end && mask_->column(begin) < pixel.x - kRadius_px) ++begin;
      for (std::size_t i = begin; i < end && mask_->column(i) <= pixel.x + kRadius_px; ++i) {
        visit(i, cv::Point(mask_->column(i), y) - pixel);
      }
    }
  }

 private:
  const SparseMask* mask_;
  cv::Point last_{0, -1};
  std::array<std::size_t, kRows> begins_{};  // by row of the window
};

/// Counts of the pixels that have local contrast and so could have a depth.
struct PixelCounts {
  std::uint64_t candidates = 0;
  std::uint64_t at_nearest = 0;   ///< The peak lies on the first plane: no depth.
  std::uint64_t at_farthest = 0;  ///< The peak lies on the last plane: no depth.
  /// The probability is too low (`min_probability`), or the parallax is: no depth.
  std::uint64_t ambiguous = 0;
  std::uint64_t neighbours = 0;  ///< Pixels with a depth from the candidates around them.

  PixelCounts& operator+=(const PixelCounts& other);
};

/// What decides on the depth of a pixel, kept or not.
template <typename Inputs>
struct PixelEvidence {
  int x = 0;
  int y = 0;
  float depth_m = 0;
  float sigma_m = 0;
  float probability = 0;  ///< 0: never kept.
  Inputs inputs{};        ///< Of the network that gives the probability.
};
struct DepthEvidence {
  std::vector<PixelEvidence<CandidateInputs>> candidates;
  std::vector<PixelEvidence<NeighbourInputs>> neighbours;
};

/// A semi-dense depth map in the reference view.
struct DepthMap {
  cv::Mat1f depth;       ///< z-depth in metres; 0: no depth.
  cv::Mat1f confidence;  ///< The raw fused value at the peak; dilated pixels copy it.
  /// Variance of inverse depth, 1/m^2: 0 without a depth, infinite if the peak is flat or lies on
  /// the first or the last plane.
  cv::Mat1f variance;
  /// Probability that the depth is within 10 % of the truth: 0 without a depth, NaN if it is not
  /// known (`ExtractionMethod::kPaper`). Empty: not known for any pixel.
  cv::Mat1f probability = {};
  PixelCounts pixels = {};  ///< `ExtractionMethod::kPaper` keeps every candidate.
  /// Null unless `DepthExtractionOptions::keep_evidence` asks for it.
  std::shared_ptr<const DepthEvidence> evidence = {};
};

/// A position between planes, in planes, its variance, in planes^2, and its probability.
struct PlanePosition {
  double position = 0;
  double variance = 0;
  float probability = std::numeric_limits<float>::quiet_NaN();
};

/// Returns the image without its frame of two pixels, which has no depths. May be empty.
cv::Rect insideFrame(cv::Size size);

/// Returns a map without depths. @param confidence of all pixels of the view; shared, not copied.
DepthMap emptyDepthMap(const cv::Mat1f& confidence);

/// Adds depths of a mask's pixels inside the frame: those that are more probable than
/// `min_probability`, or whose probability is not known.
/// @param positions one per pixel of the mask. @return the number of added depths.
std::size_t addDepths(const SparseMask& mask, const std::vector<PlanePosition>& positions,
                      const DepthPlanes& planes, double min_probability, DepthMap& map);

/// Grows the depths by a pixel, except into the frame: an empty pixel adjacent to pixels of the
/// mask gets depth, confidence, variance and probability of the most confident of these pixels (of
/// the nearer pixel if two are equal). This is the paper's morphological filter (MF).
/// @param sparse the pixels of `mask`.
void dilate(const SparseMask& sparse, const cv::Mat1b& mask, DepthMap& map);

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "test/oracle/naive_mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace efm::oracle {
namespace {

constexpr int kReach = 4;  ///< Radius of the window of 9x9 pixels.

/// A candidate pixel.
struct Pixel {
  double excess = 0;
  double position = 0;
  double width_sq = 0;
  bool at_end = false;
  std::vector<double> sum;  // by plane
  int peak = 0;
};

class NaiveAggregation {
 public:
  NaiveAggregation(const std::vector<float>& dsi, const cv::Size& size, int planes, double step)
      : dsi_(dsi), size_(size), planes_(planes), place_(step) {}

  DepthMap run(const DepthPlanes& depths, const DepthExtractionOptions& options) {
    cv::Mat1f confidence(size_);
    forEach([&](cv::Point at) { confidence(at) = static_cast<float>(largestOf(at)); });
    lookAt(confidence, options);
    for (std::size_t i = 0; i < seen_.size(); ++i) aggregate(seen_[i], pixels_[i]);

    const int of_peak = beside();
    DepthMap map{cv::Mat1f::zeros(size_), confidence, cv::Mat1f::zeros(size_)};
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const auto [median, spread, share] = agreement(i);
      const Pixel& pixel = pixels_[i];
      if (planes_ > 2 && pixel.at_end) continue;
      const double quality = pixel.excess *
                             std::pow(std::max(0.0, 1 - ambiguity(pixel, of_peak)), 1.25) *
                             std::exp(-std::abs(pixel.position - median) / (10 * place_)) * share;
      if (quality <= options.min_quality) continue;
      const double variance = 0.09 * 0.09 + 0.0143 * pixel.width_sq * (spread + 0.03);
      const double step = depths.inverseDepthStepAt(median);
      map.depth(seen_[i]) = static_cast<float>(depths.depthAt(median));
      map.variance(seen_[i]) =
          static_cast<float>(std::isinf(variance) ? variance : step * step * variance);
    }
    return map;
  }

 private:
  struct Agreement {
    double median = 0;
    double spread = 0;
    double share = 0;
  };

  template <typename Visit>
  void forEach(const Visit& visit) const {
    for (int y = 0; y < size_.height; ++y) {
      for (int x = 0; x < size_.width; ++x) visit(cv::Point(x, y));
    }
  }
  double at(cv::Point pixel, int plane) const {
    return dsi_[static_cast<std::size_t>((plane * size_.height + pixel.y) * size_.width + pixel.x)];
  }
  double largestOf(cv::Point pixel) const {
    double largest = 0;
    for (int plane = 0; plane < planes_; ++plane) largest = std::max(largest, at(pixel, plane));
    return largest;
  }
  static std::vector<double> gaussian(int side) {
    std::vector<double> weights;
    const double sigma = 0.3 * ((side - 1) * 0.5 - 1) + 0.8;
    double sum = 0;
    for (int i = 0; i < side; ++i) {
      const double d = i - side / 2;
      sum += weights.emplace_back(std::exp(-d * d / (2 * sigma * sigma)));
    }
    for (double& weight : weights) weight /= sum;
    // OpenCV uses binomial weights for the smallest windows.
    if (side == 3) weights = {0.25, 0.5, 0.25};
    if (side == 5) weights = {1 / 16.0, 4 / 16.0, 6 / 16.0, 4 / 16.0, 1 / 16.0};
    return weights;
  }
  double surroundings(const cv::Mat1f& confidence, cv::Point pixel, int side) const {
    const std::vector<double> weights = gaussian(side);
    double sum = 0;
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const int x = std::clamp(pixel.x + i - side / 2, 0, size_.width - 1);
        const int y = std::clamp(pixel.y + j - side / 2, 0, size_.height - 1);
        sum += weights[static_cast<std::size_t>(i)] * weights[static_cast<std::size_t>(j)] *
               double{confidence(y, x)};
      }
    }
    return sum;
  }

  void lookAt(const cv::Mat1f& confidence, const DepthExtractionOptions& options) {
    double mean = 0;
    int voted = 0;
    forEach([&](cv::Point pixel) {
      mean += double{confidence(pixel)};
      voted += confidence(pixel) > 0 ? 1 : 0;
    });
    if (voted == 0) return;
    mean /= voted;
    forEach([&](cv::Point pixel) {
      const bool in_frame =
          pixel.x < 2 || pixel.y < 2 || pixel.x >= size_.width - 2 || pixel.y >= size_.height - 2;
      if (in_frame) return;
      const double around = surroundings(confidence, pixel, options.threshold_kernel);
      const double excess = (double{confidence(pixel)} - around) / mean;
      if (excess <= options.min_local_contrast) return;
      seen_.push_back(pixel);
      pixels_.emplace_back().excess = excess;
    });
  }

  template <typename Visit>
  void forEachAround(cv::Point pixel, const Visit& visit) const {
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const cv::Point offset = seen_[i] - pixel;
      if (std::abs(offset.x) <= kReach && std::abs(offset.y) <= kReach) {
        visit(i, double(offset.dot(offset)));
      }
    }
  }

  void aggregate(cv::Point at_pixel, Pixel& pixel) const {
    std::vector<double> sum(static_cast<std::size_t>(planes_));
    forEachAround(at_pixel, [&](std::size_t i, double distance_sq) {
      for (int plane = 0; plane < planes_; ++plane) {
        sum[static_cast<std::size_t>(plane)] +=
            std::exp(-distance_sq / (2 * 1.5 * 1.5)) * at(seen_[i], plane);
      }
    });
    const auto best = static_cast<int>(std::max_element(sum.begin(), sum.end()) - sum.begin());
    const double top = sum[static_cast<std::size_t>(best)];
    pixel.at_end = best == 0 || best == planes_ - 1;
    pixel.position = best;
    pixel.width_sq = std::numeric_limits<double>::infinity();
    if (!pixel.at_end) {
      const double before = sum[static_cast<std::size_t>(best - 1)];
      const double after = sum[static_cast<std::size_t>(best + 1)];
      pixel.position += 0.5 * (after - before) / (2 * top - before - after);
      pixel.width_sq = top / (2 * top - before - after);
    }
    pixel.sum = sum;
    pixel.peak = best;
  }

  /// Returns the number of planes on each side that belong to a peak: from the median peak width.
  int beside() const {
    std::vector<double> widths;
    for (const Pixel& pixel : pixels_) widths.push_back(std::sqrt(pixel.width_sq));
    if (widths.empty()) return 0;
    std::sort(widths.begin(), widths.end());
    const double places = std::round(1.6 * widths[widths.size() / 2] / place_);
    return static_cast<int>(std::lround(std::clamp(places, 3.0, 12.0) * place_));
  }
  static double ambiguity(const Pixel& pixel, int beside) {
    double second = 0;
    for (int plane = 0; plane < static_cast<int>(pixel.sum.size()); ++plane) {
      if (std::abs(plane - pixel.peak) <= beside) continue;
      second = std::max(second, pixel.sum[static_cast<std::size_t>(plane)]);
    }
    return second / pixel.sum[static_cast<std::size_t>(pixel.peak)];
  }

  Agreement agreement(std::size_t of) const {
    std::vector<std::pair<double, double>> around;  // position, weight
    double total = 0;
    double agreeing = 0;
    double others = 0;
    forEachAround(seen_[of], [&](std::size_t i, double distance_sq) {
      around.emplace_back(pixels_[i].position, pixels_[i].excess);
      total += pixels_[i].excess;
      if (i == of) return;
      const double weight = pixels_[i].excess * std::exp(-distance_sq / (2 * 2.0 * 2.0));
      others += weight;
      if (std::abs(pixels_[i].position - pixels_[of].position) < 2.5 * place_) agreeing += weight;
    });
    std::sort(around.begin(), around.end());
    Agreement found;
    double below = 0;
    for (const auto& [position, weight] : around) {
      if (below < total / 2) found.median = position;
      below += weight;
    }
    std::vector<double> distances;
    for (const auto& [position, weight] : around) {
      distances.push_back(std::abs(position - found.median));
    }
    std::sort(distances.begin(), distances.end());
    found.spread = distances[distances.size() / 2];
    found.share = others > 0 ? agreeing / others : 0;
    return found;
  }

  const std::vector<float>& dsi_;
  cv::Size size_;
  int planes_;
  double place_;
  std::vector<cv::Point> seen_;
  std::vector<Pixel> pixels_;
};

}  // namespace

DepthMap extractAggregated(const std::vector<float>& dsi, const cv::Size& size,
                           const DepthPlanes& planes, const DepthExtractionOptions& options,
                           double step_planes) {
  return NaiveAggregation(dsi, size, planes.size(), step_planes).run(planes, options);
}

}  // namespace efm::oracle

// SPDX-License-Identifier: BSD-3-Clause
#include "test/oracle/naive_mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "mapping/depth/probability_weights.h"

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
  double p = 0;            // that its depth is right
  bool has_depth = false;  // it may be kept
  double variance = 0;
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
    DepthMap map{cv::Mat1f::zeros(size_), confidence, cv::Mat1f::zeros(size_),
                 cv::Mat1f::zeros(size_)};
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const auto [median, spread, share, count] = agreement(i);
      Pixel& pixel = pixels_[i];
      const double second = ambiguity(pixel, of_peak);
      const bool at_end = planes_ > 2 && pixel.at_end;
      pixel.p = probability(
          kCandidateNetwork,
          {std::log(pixel.excess), std::log(1.01 - std::min(second, 0.999)), std::log(share + 0.05),
           std::log(1.0 + count), std::log(spread / place_ + 0.1),
           std::log(std::min(std::sqrt(pixel.width_sq) / place_, 50.0) + 0.1),
           std::log(tenPercent(median, depths))});
      pixel.has_depth = !at_end && second < 0.98 && count > 0;
      if (planes_ <= 2) pixel.p = std::numeric_limits<double>::quiet_NaN();
      pixel.variance = 0.09 * 0.09 + 0.0143 * pixel.width_sq * (spread + 0.03);
      if (pixel.has_depth) {
        keep(seen_[i], median, pixel.variance, pixel.p, options, depths, map);
      }
      if (at_end || second >= 0.98) pixel.p = 0.01;
    }
    if (options.neighbours && planes_ > 2) {
      forEach([&](cv::Point at) { addNeighbour(at, confidence, options, depths, map); });
    }
    return map;
  }

 private:
  struct Agreement {
    double median = 0;
    double spread = 0;
    double share = 0;
    int count = 0;  // of agreeing others
  };

  double tenPercent(double position, const DepthPlanes& depths) const {
    return 0.1 / depths.depthAt(position) / depths.inverseDepthStepAt(position) / place_;
  }
  static void keep(cv::Point at, double position, double variance, double p,
                   const DepthExtractionOptions& options, const DepthPlanes& depths,
                   DepthMap& map) {
    if (p <= options.min_probability) return;
    const double step = depths.inverseDepthStepAt(position);
    map.depth(at) = static_cast<float>(depths.depthAt(position));
    map.variance(at) = static_cast<float>(std::isinf(variance) ? variance : step * step * variance);
    map.probability(at) = static_cast<float>(p);
  }

  /// Gives a pixel without a depth of its own the median of the candidates around it.
  void addNeighbour(cv::Point at, const cv::Mat1f& confidence,
                    const DepthExtractionOptions& options, const DepthPlanes& depths,
                    DepthMap& map) const {
    const bool in_frame =
        at.x < 2 || at.y < 2 || at.x >= size_.width - 2 || at.y >= size_.height - 2;
    if (in_frame || !(confidence(at) > 0)) return;
    double beside = 0;
    double variance = std::numeric_limits<double>::infinity();
    bool touches = false;
    bool has_depth = false;
    std::vector<std::pair<double, double>> around;  // position, weight
    std::vector<std::pair<double, double>> others;  // position, probability
    forEachAround(at, [&](std::size_t i, double distance_sq) {
      const Pixel& pixel = pixels_[i];
      around.emplace_back(pixel.position, pixel.excess);
      touches = touches || distance_sq <= 2;
      if (distance_sq == 0) has_depth = pixel.has_depth;
      if (distance_sq == 0) return;
      others.emplace_back(pixel.position, pixel.p);
      if (distance_sq > 2 || pixel.p <= beside) return;
      beside = pixel.p;
      variance = 1.5 * pixel.variance;
    });
    if (!touches || has_depth) return;
    const auto [median, spread] = medianAndSpread(around);
    double near = 0;
    double far = 0;
    for (const auto& [position, p] : others) {
      (std::abs(position - median) < 2.5 * place_ ? near : far) += p;
    }
    double mean = 0;
    int voted = 0;
    forEach([&](cv::Point pixel) {
      mean += double{confidence(pixel)};
      voted += confidence(pixel) > 0 ? 1 : 0;
    });
    mean /= voted;
    const double p = probability(
        kNeighbourNetwork, {std::log(double{confidence(at)} / mean + 0.02), std::log(near + 0.05),
                            std::log(far + 0.05), std::log(spread / place_ + 0.1),
                            std::log(beside + 0.02), std::log(tenPercent(median, depths))});
    keep(at, median, variance, p, options, depths, map);
  }

  /// The network in double, one hidden unit after the other.
  template <typename Net>
  static double probability(const Net& net, const std::vector<double>& inputs) {
    double logit = double{net.b2};
    for (std::size_t j = 0; j < net.b1.size(); ++j) {
      double sum = double{net.b1[j]};
      for (std::size_t i = 0; i < inputs.size(); ++i) {
        const double z = (inputs[i] - double{net.mean[i]}) / double{net.sd[i]};
        sum += double{net.w1[i][j]} * std::max(-5.0, std::min(5.0, z));
      }
      logit += double{net.w2[j]} * std::tanh(sum);
    }
    return 1 / (1 + std::exp(-logit));
  }

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

  static std::pair<double, double> medianAndSpread(std::vector<std::pair<double, double>> around) {
    double total = 0;
    for (const auto& [position, weight] : around) total += weight;
    std::sort(around.begin(), around.end());
    double median = 0;
    double below = 0;
    for (const auto& [position, weight] : around) {
      if (below < total / 2) median = position;
      below += weight;
    }
    std::vector<double> distances;
    for (const auto& [position, weight] : around) distances.push_back(std::abs(position - median));
    std::sort(distances.begin(), distances.end());
    return {median, distances[distances.size() / 2]};
  }

  Agreement agreement(std::size_t of) const {
    std::vector<std::pair<double, double>> around;  // position, weight
    double agreeing = 0;
    double others = 0;
    Agreement found;
    forEachAround(seen_[of], [&](std::size_t i, double distance_sq) {
      around.emplace_back(pixels_[i].position, pixels_[i].excess);
      if (i == of) return;
      const double weight = pixels_[i].excess * std::exp(-distance_sq / (2 * 2.0 * 2.0));
      others += weight;
      if (std::abs(pixels_[i].position - pixels_[of].position) >= 2.5 * place_) return;
      agreeing += weight;
      ++found.count;
    });
    std::tie(found.median, found.spread) = medianAndSpread(around);
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

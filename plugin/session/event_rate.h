// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace efm {

/// The rate of events over a recording of any length, in constant memory: a fixed number of bins.
/// Where time goes beyond the last bin, neighbouring bins are joined and all become twice as wide.
class EventRate {
 public:
  /// Adds an event. One before the first event counts for the first bin.
  void add(std::int64_t t_ns) {
    if (!start_ns_) start_ns_ = t_ns;
    std::int64_t bin = t_ns < *start_ns_ ? 0 : (t_ns - *start_ns_) >> log2_width_;
    for (; bin >= kBins; bin >>= 1) joinBins();
    ++counts_[static_cast<std::size_t>(bin)];
  }

  /// Events per second in intervals of equal length that divide [t0, t1]. An event counts for the
  /// intervals that its bin overlaps: a bin is at most 1/4096 of the time from the first event on.
  std::vector<double> over(std::int64_t t0_ns, std::int64_t t1_ns, int intervals) const;
  /// The number of events in [t0, t1): of each bin, in proportion to its overlap.
  double countIn(std::int64_t t0_ns, std::int64_t t1_ns) const;

 private:
  static constexpr std::int64_t kBins = 8192;

  void joinBins();

  std::optional<std::int64_t> start_ns_;
  int log2_width_ = 10;  // nanoseconds
  std::array<std::uint64_t, kBins> counts_{};
};

/// A line of block characters (UTF-8), one per value: of eight heights up to the largest value; a
/// blank for 0.
std::string sparkline(const std::vector<double>& values);

}  // namespace efm

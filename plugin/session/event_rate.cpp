// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/event_rate.h"

#include <algorithm>
#include <cmath>

#include "mapping/geometry/timestamp.h"

namespace efm {

void EventRate::joinBins() {
  for (std::size_t bin = 0; bin < kBins / 2; ++bin) {
    counts_[bin] = counts_[2 * bin] + counts_[2 * bin + 1];
  }
  std::fill(counts_.begin() + kBins / 2, counts_.end(), 0);
  ++log2_width_;
}

std::vector<double> EventRate::over(std::int64_t t0_ns, std::int64_t t1_ns, int intervals) const {
  std::vector<double> rates(static_cast<std::size_t>(intervals), 0.0);
  const double interval_s = secondsBetween(t0_ns, t1_ns) / intervals;
  if (!start_ns_ || interval_s <= 0) return rates;
  const double width_s = std::ldexp(1e-9, log2_width_);
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    if (counts_[bin] == 0) continue;
    // The last bins may reach beyond t1, but their events do not.
    const double from =
        (secondsBetween(t0_ns, *start_ns_) + static_cast<double>(bin) * width_s) / interval_s;
    const double first = std::clamp<double>(from, 0, intervals - 1e-3);
    const double last = std::clamp<double>(from + width_s / interval_s, first + 1e-3, intervals);
    for (int i = static_cast<int>(first); i < last; ++i) {
      const double overlap = std::min(last, i + 1.0) - std::max<double>(first, i);
      rates[static_cast<std::size_t>(i)] +=
          static_cast<double>(counts_[bin]) * overlap / (last - first) / interval_s;
    }
  }
  return rates;
}

double EventRate::countIn(std::int64_t t0_ns, std::int64_t t1_ns) const {
  double count = 0;
  if (!start_ns_) return count;
  const double width_s = std::ldexp(1e-9, log2_width_);
  const double first = secondsBetween(*start_ns_, t0_ns) / width_s;
  const double last = secondsBetween(*start_ns_, t1_ns) / width_s;
  const auto end = static_cast<std::size_t>(std::clamp<double>(std::ceil(last), 0, kBins));
  for (auto bin = static_cast<std::size_t>(std::clamp<double>(first, 0, kBins)); bin < end; ++bin) {
    const auto begin = static_cast<double>(bin);
    const double overlap = std::min(last, begin + 1) - std::max(first, begin);
    count += static_cast<double>(counts_[bin]) * std::max(overlap, 0.0);
  }
  return count;
}

std::string sparkline(const std::vector<double>& values) {
  static constexpr const char* kBlocks[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double max = values.empty() ? 0 : *std::max_element(values.begin(), values.end());
  std::string line;
  for (const double value : values) {
    line += value > 0 ? kBlocks[std::min(7, static_cast<int>(8 * value / max))] : " ";
  }
  return line;
}

}  // namespace efm

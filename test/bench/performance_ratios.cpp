// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/performance_ratios.h"

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "test/bench/growth_fit.h"

namespace efm::bench {
namespace {

/// The quantity of the row with the same group, name, kernel and threads.
std::optional<double> quantityOf(const std::vector<PerformanceRow>& rows, PerformanceRow like,
                                 const char* quantity) {
  for (const PerformanceRow& row : rows) {
    if (row.group == like.group && row.name == like.name && row.kernel == like.kernel &&
        row.threads == like.threads) {
      return row.find(quantity);
    }
  }
  return std::nullopt;
}

struct GrowthSamples {
  std::vector<double> sizes;
  std::vector<double> times_ms;
};

}  // namespace

void addRatios(std::vector<PerformanceRow>& rows) {
  for (PerformanceRow& row : rows) {
    const auto add = [&](const char* name, const std::optional<double>& base, const char* time) {
      const std::optional<double> own = row.find(time);
      if (base && own && *own > 0) row.quantities.push_back({name, *base / *own});
    };
    const auto other_kernel = [&](const char* kernel) -> std::optional<double> {
      if (row.kernel == kernel || row.threads != 1) return std::nullopt;
      const std::string group = row.group == kOneCameraSweep ? kVoting : row.group;
      return quantityOf(rows, {group, row.name, kernel, 1, {}}, "cpu_ms");
    };
    add("times_yardstick", other_kernel(kYardstick), "cpu_ms");
    add("times_unfused", other_kernel(kUnfused), "cpu_ms");
    if (row.group == kAsShipped || row.group == kAsPaper) {
      add("times_plain", other_kernel("plain"), "cpu_ms");
    }
    if (row.group == kAsShipped && row.kernel != "plain") {
      add("times_plain_paper", quantityOf(rows, {kAsPaper, row.name, "plain", 1, {}}, "cpu_ms"),
          "cpu_ms");
      const auto paper = quantityOf(rows, {kAsPaper, row.name, row.kernel, 1, {}}, "cpu_ms");
      const auto own = row.find("cpu_ms");
      if (paper && own) row.quantities.push_back({"over_paper", *own / *paper});
    }
    if (row.threads > 1) {
      add("times_one_thread", quantityOf(rows, {row.group, row.name, row.kernel, 1, {}}, "real_ms"),
          "real_ms");
    }
  }
}

void addExponents(std::vector<PerformanceRow>& rows) {
  std::map<std::pair<std::string, std::string>, GrowthSamples> grown;  // by growth and kernel
  for (const PerformanceRow& row : rows) {
    const auto size = row.find("size");
    const auto time_ms = row.find("cpu_ms");
    if (!size || !time_ms) continue;
    GrowthSamples& sizes = grown[{row.name.substr(0, row.name.find('/')), row.kernel}];
    sizes.sizes.push_back(*size);
    sizes.times_ms.push_back(*time_ms);
  }
  for (const auto& [key, sizes] : grown) {
    if (sizes.sizes.size() < 2) continue;
    PerformanceRow row{"growth", key.first, key.second, 1, {}};
    row.quantities.push_back({"exponent", fittedExponent(sizes.sizes, sizes.times_ms)});
    rows.push_back(std::move(row));
  }
}

}  // namespace efm::bench

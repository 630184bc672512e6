// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "maps/metrics/depth_pairs.h"

namespace efm {

/// Precision (the fraction of the estimates that are correct) and recall (the fraction of the truth
/// that was found) over a list of allowed errors (Pizzoli et al., ICRA 2014; Ghosh and Gallego
/// 2022, Sec. 4, "Metrics"). Stored as counts, which can be added over maps.
struct PrecisionRecall {
  /// The counts at one allowed error.
  struct Step {
    double threshold_m = 0;
    std::uint64_t correct_estimates = 0;
    std::uint64_t found_truths = 0;
  };
  std::vector<Step> steps;
  std::uint64_t estimates = 0;  ///< Pixels with an estimate and a truth.
  std::uint64_t truths = 0;     ///< Pixels with a truth.
  /// Pixels with an estimate and no truth: in none of the other counts.
  std::uint64_t estimates_without_truth = 0;

  /// Fraction of the estimates within the threshold of the truth; 0 without estimates.
  double precision(std::size_t step) const;
  /// Fraction of the truths with an estimate within the threshold; 0 without truths.
  double recall(std::size_t step) const;
  /// The harmonic mean of the two; 0 where both are 0.
  double f1(std::size_t step) const;

  /// Adds the counts of another map.
  /// @throws std::invalid_argument where its thresholds differ.
  void add(const PrecisionRecall& other);
};

/// 1 cm to 5 m, about even in the logarithm, for rooms and streets.
std::vector<double> defaultDepthThresholds();

/// Counts |Z - Z_true| <= threshold. An estimate is compared with its truth in `pairDepths`. A
/// truth is compared with the estimate of the nearest depth within the tolerance.
/// @param thresholds_m above 0, in any order; the steps have the same order.
/// @throws std::invalid_argument where a threshold is not above 0, the maps differ in size or the
/// options are not valid.
PrecisionRecall precisionRecall(const ComparedDepths& depths,
                                const std::vector<double>& thresholds_m,
                                const DepthPairingOptions& options = {});

}  // namespace efm

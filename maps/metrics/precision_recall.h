// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "maps/metrics/depth_pairs.h"

namespace efm {

/// How much of what was found is right, and how much of what is there was found, over a list of
/// allowed errors (Pizzoli et al., ICRA 2014, as Ghosh and Gallego 2022, Sec. 4, "Metrics", use
/// them). Counts, so that those of several maps add up.
struct PrecisionRecall {
  /// One allowed error.
  struct Step {
    double threshold_m = 0;
    std::uint64_t correct_estimates = 0;
    std::uint64_t found_truths = 0;
  };
  std::vector<Step> steps;
  std::uint64_t estimates = 0;  ///< Pixels with an estimate and a truth to hold it against.
  std::uint64_t truths = 0;     ///< Pixels with a truth.
  /// Pixels with an estimate that no truth stands beside: they count for nothing.
  std::uint64_t estimates_without_truth = 0;

  /// Share of the estimates that lie within the threshold of the truth; 0 of none.
  double precision(std::size_t step) const;
  /// Share of the pixels with a truth that have an estimate within the threshold of it; 0 of none.
  double recall(std::size_t step) const;
  /// The harmonic mean of the two; 0 where both are.
  double f1(std::size_t step) const;

  /// Adds another map's counts.
  /// @throws std::invalid_argument where its thresholds are others.
  void add(const PrecisionRecall& other);
};

/// Thresholds that suit rooms and streets: 1 cm to 5 m, about even in the logarithm.
std::vector<double> defaultDepthThresholds();

/// Counts |Z - Z_true| <= threshold. Estimates are held against the best truth within the
/// tolerance, as `pairDepths` does; a truth is found by the nearest estimate (in depth) within the
/// tolerance around it.
/// @param thresholds_m above 0, in any order; kept in theirs.
/// @throws std::invalid_argument where a threshold is not above 0, the maps differ in size or the
/// options are not valid.
PrecisionRecall precisionRecall(const ComparedDepths& depths,
                                const std::vector<double>& thresholds_m,
                                const DepthPairingOptions& options = {});

}  // namespace efm

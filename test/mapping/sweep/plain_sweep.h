// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "test/mapping/kernels/exact_votes.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/sweep/sweep_case.h"

namespace efm::test {

/// Holds a fast kernel's counts and DSI against the plain one's, to the bounds that rounding gives:
/// counts exactly but for votes at the border of the view.
/// @param input fused by arithmetic means, in which errors neither grow nor vanish.
inline void expectThePlainSweep(const SweepCase& input, VotingKernel kernel) {
  // Of few votes some may all be rounded far: a shift of 1/4096 px in x and in y.
  constexpr double kFewVotes = 1000;
  constexpr double kMostPerVote = 4.0 / 4096 + 4.0 / 32'768;
  const SweepOutput fast = sweep(input, kernel, 2);
  const SweepOutput plain = sweep(input, VotingKernel::kPlain, 2);
  double at_border = 0;
  double float_shift_px = 0;
  double cast = 0;
  for (std::size_t c = 0; c < input.cameras.size(); ++c) {
    double camera_at_border = 0;
    std::uint64_t rays = 0;
    for (const RayBundle& bundle : input.cameras[c]) {
      const ExactVotes exact = voteExactly(bundle, input.view, input.planes);
      camera_at_border += static_cast<double>(exact.at_border);
      float_shift_px += exact.float_shift_px;
      rays += bundle.size();
    }
    at_border += camera_at_border;
    const VoteCounts& counts = fast.result.votes[c];
    const VoteCounts& plain_counts = plain.result.votes[c];
    EXPECT_EQ(counts.total(), rays * static_cast<std::uint64_t>(input.planes.size()));
    EXPECT_EQ(counts.behind_camera, plain_counts.behind_camera);
    EXPECT_NEAR(static_cast<double>(counts.cast), static_cast<double>(plain_counts.cast),
                camera_at_border);
    cast += static_cast<double>(plain_counts.cast);
  }
  const DsiDifference difference = differenceOf(fast.dsi, plain.dsi);
  if (cast == 0) {
    EXPECT_LE(difference.error_sum, at_border);
    return;
  }
  const double per_vote = cast < kFewVotes ? kMostPerVote : kFastErrorOverMass;
  EXPECT_LE(difference.error, per_vote + (at_border + 2 * float_shift_px) / cast);
  EXPECT_LE(std::abs(difference.signed_error), 1e-5 + at_border / cast);
}

}  // namespace efm::test

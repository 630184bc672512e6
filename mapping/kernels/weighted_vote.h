// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace efm::kernels {

/// A vote on one plane that need not count as one.
struct WeightedVote {
  float x = 0;  ///< Pixels.
  float y = 0;
  float weight = 0;
};

/// Some rows of one plane: row-major, owned by the caller.
struct VoteRows {
  float* votes = nullptr;
  int first = 0;  ///< Of the rows.
  int count = 0;
  int width = 0;   ///< Of the whole plane.
  int height = 0;  ///< Of the whole plane.
};

/// Adds bilinear votes, each times its weight, where all four neighbouring pixels lie inside the
/// plane, as `votePlain` casts them. What falls outside the rows is left out.
void voteWeighted(const WeightedVote* votes, std::size_t n, const VoteRows& rows);

}  // namespace efm::kernels

// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/weighted_vote.h"

#include <cstddef>

namespace efm::kernels {

void voteWeighted(const WeightedVote* votes, std::size_t n, const VoteRows& rows) {
  const auto right = static_cast<float>(rows.width - 1);
  const auto bottom = static_cast<float>(rows.height - 1);
  const std::ptrdiff_t stride = rows.width;
  for (const WeightedVote* vote = votes; vote != votes + n; ++vote) {
    if (!(vote->x >= 0 && vote->x < right && vote->y >= 0 && vote->y < bottom)) continue;
    const int column = static_cast<int>(vote->x);
    const int row = static_cast<int>(vote->y);
    const float to_right = vote->x - static_cast<float>(column);
    const float lower_weight = vote->weight * (vote->y - static_cast<float>(row));
    const float upper_weight = vote->weight - lower_weight;
    float* upper = rows.votes + (row - rows.first) * stride + column;
    if (row >= rows.first && row < rows.first + rows.count) {
      upper[0] += upper_weight * (1 - to_right);
      upper[1] += upper_weight * to_right;
    }
    if (row + 1 >= rows.first && row + 1 < rows.first + rows.count) {
      float* lower = upper + stride;
      lower[0] += lower_weight * (1 - to_right);
      lower[1] += lower_weight * to_right;
    }
  }
}

}  // namespace efm::kernels

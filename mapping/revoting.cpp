// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/revoting.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mapping/option_check.h"

namespace efm {
namespace {

constexpr double kMaxPower = 8;
constexpr float kUnreached = std::numeric_limits<float>::infinity();

}  // namespace

void RevotingOptions::validate() const {
  requireOption(revote_power > 0 && revote_power <= kMaxPower, "revote_power", revote_power,
                "above 0, at most 8");
}

SharedVotes::SharedVotes(ImageOrderedRays rays, const PriorDsi& prior, const VoteSharing& sharing)
    : rays_(std::move(rays)),
      prior_(&prior),
      sharing_(sharing),
      functions_(&kernels::raySampleFunctions(sharing.kernel)) {
  if (keepsVotes()) {
    kept_.resize(patches());
  } else {
    scales_.resize(patches());
  }
}

void SharedVotes::sample(const kernels::SlopedRays& rays, int plane, float* values,
                         float* sums) const {
  const kernels::SampledPlane sampled = prior_->plane(plane);
  if (sharing_.power == 1) {
    functions_->sample(rays, sampled, kernels::SamplePower::kOne, values, sums);
  } else if (sharing_.power == 2) {
    functions_->sample(rays, sampled, kernels::SamplePower::kTwo, values, sums);
  } else {
    std::vector<float> plain_sums(rays.n);
    functions_->sample(rays, sampled, kernels::SamplePower::kOne, values, plain_sums.data());
    const auto power = static_cast<float>(sharing_.power);
    for (std::size_t i = 0; i < rays.n; ++i) sums[i] += values[i] = std::pow(values[i], power);
  }
}

void SharedVotes::weigh(std::size_t patch, Workplace& workplace) {
  const kernels::SlopedRays rays = rays_.patch(patch);
  const auto planes = static_cast<std::size_t>(prior_->planes());
  // Samples of all planes, or of one after the other where only their sums count.
  const std::size_t stride = keepsVotes() ? rays.n : 0;
  workplace.values.resize(keepsVotes() ? planes * rays.n : rays.n);
  workplace.sums.assign(rays.n, 0);
  for (std::size_t plane = 0; plane < planes; ++plane) {
    sample(rays, static_cast<int>(plane), workplace.values.data() + plane * stride,
           workplace.sums.data());
  }
  workplace.thresholds.resize(rays.n);
  workplace.scales.resize(rays.n);
  for (std::size_t i = 0; i < rays.n; ++i) {
    const float sum = workplace.sums[i];
    workplace.scales[i] = sum > 0 ? 1 / sum : 0;
    workplace.thresholds[i] = sum > 0 ? sharing_.min_share * sum : kUnreached;
  }
  if (!keepsVotes()) {
    scales_[patch] = workplace.scales;
    return;
  }
  KeptVotes& kept = kept_[patch];
  workplace.votes.clear();
  for (std::size_t plane = 0; plane < planes; ++plane) {
    kept.plane_begin.push_back(workplace.votes.size());
    appendVotes(rays, static_cast<int>(plane), workplace.values.data() + plane * stride,
                workplace.thresholds.data(), workplace.scales.data(), workplace.found,
                workplace.votes);
  }
  kept.plane_begin.push_back(workplace.votes.size());
  kept.votes = workplace.votes;
  for (const kernels::WeightedVote& vote : kept.votes) {
    kept.min_y = std::min(kept.min_y, vote.y);
    kept.max_y = std::max(kept.max_y, vote.y);
  }
}

void SharedVotes::appendVotes(const kernels::SlopedRays& rays, int plane, const float* values,
                              const float* thresholds, const float* scales, Found& found,
                              Votes& votes) const {
  found.resize(rays.n + kernels::kRayBlock);
  const std::size_t count = functions_->find_large(values, thresholds, rays.n, found.data());
  const float q = prior_->plane(plane).inverse_depth;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t i = found[k];
    votes.push_back(
        {rays.x[i] + rays.dx[i] * q, rays.y[i] + rays.dy[i] * q, values[i] * scales[i]});
  }
}

void SharedVotes::vote(int plane, const kernels::VoteRows& rows, Workplace& workplace) const {
  const auto first = static_cast<float>(rows.first - 1);
  const auto end = static_cast<float>(rows.first + rows.count);
  for (const KeptVotes& kept : kept_) {
    if (kept.max_y < first || kept.min_y >= end) continue;
    const std::size_t begin = kept.plane_begin[static_cast<std::size_t>(plane)];
    const std::size_t count = kept.plane_begin[static_cast<std::size_t>(plane) + 1] - begin;
    kernels::voteWeighted(kept.votes.data() + begin, count, rows);
  }
  for (std::size_t patch = 0; patch < scales_.size(); ++patch) {
    const kernels::SlopedRays rays = rays_.patch(patch);
    workplace.values.resize(rays.n);
    workplace.sums.assign(rays.n, 0);  // not asked for here
    workplace.thresholds.assign(rays.n, std::numeric_limits<float>::min());
    workplace.votes.clear();
    sample(rays, plane, workplace.values.data(), workplace.sums.data());
    appendVotes(rays, plane, workplace.values.data(), workplace.thresholds.data(),
                scales_[patch].data(), workplace.found, workplace.votes);
    kernels::voteWeighted(workplace.votes.data(), workplace.votes.size(), rows);
  }
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "mapping/image_ordered_rays.h"
#include "mapping/kernels/ray_samples.h"
#include "mapping/kernels/weighted_vote.h"
#include "mapping/prior_dsi.h"
#include "mapping/voting_kernel.h"

namespace efm {

/// Re-voting: an event saw one point, so it should vote once. A second pass over the events shares
/// each event's single vote along its ray, in proportion to a power of the DSI that the first pass
/// fused: one step of expectation and maximisation, as in emission tomography (Shepp and Vardi,
/// 1982). It trusts poses more than plain votes do: it sharpens exact ones, and costs accuracy
/// where they are off by a good part of a plane.
struct RevotingOptions {
  bool revote = false;
  /// Of the DSI, above 0, at most 8. Larger: more of the vote to the best plane. 1 and 2 are fast.
  double revote_power = 2;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// How votes are shared.
struct VoteSharing {
  double power = 2;
  /// Smaller shares are not voted and their part of the vote is lost, so that a ray that knows no
  /// plane does not vote. Several cameras leave 2 to 6 shares above 0.05; a single one has flat
  /// rays, none of whose shares can be spared: 0.
  float min_share = 0;
  VotingKernel kernel = fastestKernel();
};

/// The second votes of rays whose first ones made a prior. With a `min_share` the few votes of all
/// planes are kept, else a factor per ray: then the prior is sampled again.
class SharedVotes {
  using Found = std::vector<std::uint32_t>;
  using Votes = std::vector<kernels::WeightedVote>;

 public:
  /// What a thread needs, kept from call to call.
  struct Workplace {
    std::vector<float> values;      // [plane][ray]
    std::vector<float> sums;        // by ray
    std::vector<float> scales;      // by ray
    std::vector<float> thresholds;  // by ray
    Found found;
    Votes votes;
  };

  /// @param prior must stay.
  SharedVotes(ImageOrderedRays rays, const PriorDsi& prior, const VoteSharing& sharing);

  /// Whether votes are kept, so that few rows take little time.
  bool keepsVotes() const { return sharing_.min_share > 0; }

  /// The rays are weighed patch by patch, each once: by several threads at once.
  std::size_t patches() const { return rays_.patches(); }
  void weigh(std::size_t patch, Workplace& workplace);

  /// Adds the votes of all rays on rows of one plane, once all are weighed. Where they
  /// are not kept it takes as long for few rows as for all.
  void vote(int plane, const kernels::VoteRows& rows, Workplace& workplace) const;

 private:
  struct KeptVotes {
    Votes votes;  // by plane, then ray
    std::vector<std::size_t> plane_begin;
    float min_y = std::numeric_limits<float>::infinity();  // of the votes
    float max_y = -std::numeric_limits<float>::infinity();
  };

  void sample(const kernels::SlopedRays& rays, int plane, float* values, float* sums) const;
  void appendVotes(const kernels::SlopedRays& rays, int plane, const float* values,
                   const float* thresholds, const float* scales, Found& found, Votes& votes) const;

  ImageOrderedRays rays_;
  const PriorDsi* prior_;
  VoteSharing sharing_;
  const kernels::RaySampleFunctions* functions_;
  std::vector<KeptVotes> kept_;             // by patch, with a `min_share`
  std::vector<std::vector<float>> scales_;  // by patch and ray, without one
};

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/second_votes.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "mapping/image_ordered_rays.h"

namespace efm {

SecondVotes::SecondVotes(const std::vector<CameraRays>& inputs, const BundleOrder& order,
                         const ReferenceView& view, const DepthPlanes& planes,
                         const std::vector<PriorDsi>& priors, const VoteSharing& sharing)
    : slots_(order.slots), polarities_(order.polarities), view_(view) {
  for (const CameraRays& input : inputs) {
    for (int slot = 0; slot < slots_; ++slot) {
      for (int polarity = 0; polarity < polarities_; ++polarity) {
        std::vector<const RayBundle*> bundles;
        for (const std::size_t bundle : order.of(slot, polarity)) {
          bundles.push_back(&input[bundle]);
        }
        votes_.emplace_back(ImageOrderedRays(bundles, view, planes),
                            priors[static_cast<std::size_t>(polarity)], sharing);
      }
    }
  }
}

void SecondVotes::weigh() {
  // Patch by patch, all that samples the same prior in a row: it stays in the cache.
  const std::size_t per_patch = votes_.size();
  const auto polarities = static_cast<std::size_t>(polarities_);
  const std::size_t of_polarity = per_patch / polarities;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, votes_.front().patches()),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      SharedVotes::Workplace& workplace = workplaces_.local();
                      for (std::size_t patch = range.begin(); patch < range.end(); ++patch) {
                        for (std::size_t i = 0; i < per_patch; ++i) {
                          votes_[i % of_polarity * polarities + i / of_polarity].weigh(patch,
                                                                                       workplace);
                        }
                      }
                    });
}

void SecondVotes::vote(int input, int slot, int plane, const cv::Range& rows,
                       PlaneValues& density) {
  std::fill(density.begin(), density.end(), 0.0F);
  const kernels::VoteRows votes{density.data(), rows.start, rows.size(), view_.width, view_.height};
  const auto first = votes_.begin() + (input * slots_ + slot) * polarities_;
  for (auto of_polarity = first; of_polarity != first + polarities_; ++of_polarity) {
    of_polarity->vote(plane, votes, workplaces_.local());
  }
}

}  // namespace efm

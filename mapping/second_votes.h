// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstddef>
#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/depth_planes.h"
#include "mapping/plane_values.h"
#include "mapping/reference_view.h"
#include "mapping/revoting.h"
#include "mapping/space_sweep.h"

namespace efm {

/// The order of an input's bundles: group by group, each slot by slot; of groups the polarities
/// are next to each other.
struct BundleOrder {
  int groups = 1;
  int slots = 1;
  int polarities = 1;

  /// Those of one slot and polarity.
  std::vector<std::size_t> of(int slot, int polarity) const {
    std::vector<std::size_t> bundles;
    for (int group = polarity; group < groups; group += polarities) {
      bundles.push_back(static_cast<std::size_t>(group * slots + slot));
    }
    return bundles;
  }
};

/// The second votes of all inputs of a sweep, the groups of each slot together.
class SecondVotes {
 public:
  /// @param inputs their rays are copied. @param priors by polarity; must stay, and be filled
  /// before `weigh`.
  SecondVotes(const std::vector<CameraRays>& inputs, const BundleOrder& order,
              const ReferenceView& view, const DepthPlanes& planes,
              const std::vector<PriorDsi>& priors, const VoteSharing& sharing);

  /// On the threads of the task arena that it is called in.
  void weigh();

  bool keepsVotes() const { return votes_.front().keepsVotes(); }

  /// Fills `density` with one input's votes in one slot on rows of one plane, once all are weighed.
  /// By several threads at once.
  void vote(int input, int slot, int plane, const cv::Range& rows, PlaneValues& density);

 private:
  int slots_;
  int polarities_;
  ReferenceView view_;
  std::vector<SharedVotes> votes_;  // [input][slot][polarity]
  tbb::enumerable_thread_specific<SharedVotes::Workplace> workplaces_;
};

}  // namespace efm

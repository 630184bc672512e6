// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/kernels.h"

#include "mapping/kernels/highway_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/kernels/weighted_ranks.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace efm::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void add(float* below, const float* positions, const float* weights, std::size_t n) {
  const hn::ScalableTag<float> d;
  for (std::size_t j = 0; j < n; ++j) {
    const auto position = hn::Set(d, positions[j]);
    const auto weight = hn::Set(d, weights[j]);
    for (std::size_t i = 0; i < n; i += hn::Lanes(d)) {
      const auto is_below = hn::Le(position, hn::LoadU(d, positions + i));
      hn::StoreU(hn::Add(hn::LoadU(d, below + i), hn::IfThenElseZero(is_below, weight)), d,
                 below + i);
    }
  }
}

constexpr RankFunctions kRanks = {add};

}  // namespace efm::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace efm::kernels {
namespace {

void addPlain(float* below, const float* positions, const float* weights, std::size_t n) {
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) {
      below[i] += positions[j] <= positions[i] ? weights[j] : 0.0F;
    }
  }
}

constexpr RankFunctions kPlainRanks = {addPlain};

}  // namespace

const RankFunctions& rankFunctions(VotingKernel kernel) {
  static constexpr KernelTable<RankFunctions> kTable = EFM_KERNEL_TABLE(kPlainRanks, kRanks);
  return kernelIn(kTable, kernel);
}

}  // namespace efm::kernels
#endif

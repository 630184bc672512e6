// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/kernels.h"

#include "mapping/kernels/highway_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/kernels/peaks.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace efm::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Stores the lanes of `value` for which the mask is true.
template <class D, class M>
HWY_INLINE void storeWhere(D d, M where, hn::Vec<D> value, hn::TFromD<D>* to) {
#if HWY_TARGET == HWY_AVX3
  // Masked stores are cheap only here. One-lane vectors must not use them: the mask has more lanes.
  if constexpr (hn::MaxLanes(D()) > 1) return hn::BlendedStore(value, where, d, to);
#endif
  hn::StoreU(hn::IfThenElse(where, value, hn::LoadU(d, to)), d, to);
}

/// Adds pixels [i, n) in whole vectors of the tag's lanes. @return the first pixel that is left.
template <bool kNeighbours, class D>
HWY_INLINE std::size_t addBy(D d, std::size_t i, std::size_t n, const PeakArrays& peaks,
                             std::int32_t plane, const float* values) {
  const hn::RebindToSigned<D> d_plane;
  const auto none = hn::Set(d, -1.0F);
  const auto this_plane = hn::Set(d_plane, plane);
  const auto last_plane = hn::Set(d_plane, plane - 1);
  for (; i + hn::Lanes(d) <= n; i += hn::Lanes(d)) {
    const auto value = hn::LoadU(d, values + i);
    const auto better = hn::Gt(value, hn::LoadU(d, peaks.best + i));
    // No branch skips unchanged vectors: noise makes it unpredictable, and that costs more.
    storeWhere(d, better, value, peaks.best + i);
    if constexpr (kNeighbours) {
      const auto previous = hn::LoadU(d, peaks.previous + i);
      const auto follows =
          hn::RebindMask(d, hn::Eq(hn::LoadU(d_plane, peaks.plane + i), last_plane));
      storeWhere(d, better, previous, peaks.before + i);
      storeWhere(d, hn::Or(better, follows), hn::IfThenElse(better, none, value), peaks.after + i);
      hn::StoreU(value, d, peaks.previous + i);
    }
    storeWhere(d_plane, hn::RebindMask(d_plane, better), this_plane, peaks.plane + i);
  }
  return i;
}

// Adds full vectors first, then the rest in vectors of one lane.
template <bool kNeighbours>
void add(const PeakArrays& peaks, std::int32_t plane, const float* values, std::size_t n) {
  const std::size_t done = addBy<kNeighbours>(hn::ScalableTag<float>(), 0, n, peaks, plane, values);
  addBy<kNeighbours>(hn::CappedTag<float, 1>(), done, n, peaks, plane, values);
}

constexpr PeakFunctions kPeaks = {add<true>, add<false>};

}  // namespace efm::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace efm::kernels {
namespace {

constexpr float kNoValue = -1;

void addPlain(const PeakArrays& peaks, std::int32_t plane, const float* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const float value = values[i];
    if (value > peaks.best[i]) {
      peaks.best[i] = value;
      peaks.before[i] = peaks.previous[i];
      peaks.after[i] = kNoValue;
      peaks.plane[i] = plane;
    } else if (peaks.plane[i] == plane - 1) {
      peaks.after[i] = value;
    }
    peaks.previous[i] = value;
  }
}

void addAlonePlain(const PeakArrays& peaks, std::int32_t plane, const float* values,
                   std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    if (!(values[i] > peaks.best[i])) continue;
    peaks.best[i] = values[i];
    peaks.plane[i] = plane;
  }
}

constexpr PeakFunctions kPlainPeaks = {addPlain, addAlonePlain};

}  // namespace

const PeakFunctions& peakFunctions(VotingKernel kernel) {
  static constexpr KernelTable<PeakFunctions> kTable = EFM_KERNEL_TABLE(kPlainPeaks, kPeaks);
  return kernelIn(kTable, kernel);
}

}  // namespace efm::kernels
#endif

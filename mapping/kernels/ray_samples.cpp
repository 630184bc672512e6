// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/ray_samples.h"

#include "mapping/kernels/highway_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/kernels/ray_samples.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace efm::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::ScalableTag<std::int32_t>;
using Uints = hn::ScalableTag<std::uint32_t>;

/// values[index] in the lower half of each lane and values[index + 1] in the upper one.
HWY_INLINE hn::Vec<Ints> pairsAt(const std::uint16_t* values, hn::Vec<Ints> index) {
  const Ints d;
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
  // The processor's own gather needs no alignment.
  const auto* bytes = reinterpret_cast<const std::int32_t*>(values);
  return hn::GatherOffset(d, bytes, hn::ShiftLeft<1>(index));
#else
  HWY_ALIGN std::int32_t lanes[hn::MaxLanes(Ints())];
  hn::Store(index, d, lanes);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    const std::uint16_t* pair = values + lanes[i];
    lanes[i] = static_cast<std::int32_t>(pair[0] | std::uint32_t{pair[1]} << 16U);
  }
  return hn::Load(d, lanes);
#endif
}

/// From the first to the second value of each pair, by a share of the way.
HWY_INLINE hn::Vec<Floats> between(hn::Vec<Ints> pairs, hn::Vec<Floats> share) {
  const Floats d;
  const auto first = hn::BitCast(d, hn::ShiftLeft<16>(pairs));
  const auto second =
      hn::BitCast(d, hn::And(pairs, hn::Set(Ints(), static_cast<std::int32_t>(0xFFFF0000U))));
  return hn::MulAdd(share, hn::Sub(second, first), first);
}

template <SamplePower kPower>
HWY_INLINE void sampleTo(const SlopedRays& rays, const SampledPlane& plane, float* values,
                         float* sums) {
  const Floats d;
  const Ints d_int;
  const auto right = hn::Set(d, static_cast<float>(plane.width - 1));
  const auto bottom = hn::Set(d, static_cast<float>(plane.height - 1));
  const auto q = hn::Set(d, plane.inverse_depth);
  const auto zero = hn::Zero(d);
  const auto width = hn::Set(d_int, plane.width);
  for (std::size_t i = 0; i < rays.n; i += hn::Lanes(d)) {
    const auto x_any = hn::MulAdd(hn::LoadU(d, rays.dx + i), q, hn::LoadU(d, rays.x + i));
    const auto y_any = hn::MulAdd(hn::LoadU(d, rays.dy + i), q, hn::LoadU(d, rays.y + i));
    const auto limit = hn::LoadU(d, rays.limit + i);
    const auto in_view = hn::And(hn::And(hn::Ge(x_any, zero), hn::Lt(x_any, right)),
                                 hn::And(hn::Ge(y_any, zero), hn::Lt(y_any, bottom)));
    const auto cast = hn::And(in_view, hn::Lt(hn::CopySign(q, limit), limit));
    auto value = zero;
    if (!hn::AllFalse(d, cast)) {
      const auto x = hn::IfThenElseZero(cast, x_any);
      const auto y = hn::IfThenElseZero(cast, y_any);
      const auto column = hn::ConvertTo(d_int, x);
      const auto row = hn::ConvertTo(d_int, y);
      const auto to_right = hn::Sub(x, hn::ConvertTo(d, column));
      const auto to_bottom = hn::Sub(y, hn::ConvertTo(d, row));
      const auto upper = hn::Add(hn::Mul(row, width), column);
      const auto above = between(pairsAt(plane.values, upper), to_right);
      const auto below = between(pairsAt(plane.values, hn::Add(upper, width)), to_right);
      value = hn::IfThenElseZero(cast, hn::MulAdd(to_bottom, hn::Sub(below, above), above));
      if constexpr (kPower == SamplePower::kTwo) value = hn::Mul(value, value);
    }
    hn::StoreU(value, d, values + i);
    hn::StoreU(hn::Add(hn::LoadU(d, sums + i), value), d, sums + i);
  }
}

void sample(const SlopedRays& rays, const SampledPlane& plane, SamplePower power, float* values,
            float* sums) {
  if (power == SamplePower::kTwo) {
    sampleTo<SamplePower::kTwo>(rays, plane, values, sums);
  } else {
    sampleTo<SamplePower::kOne>(rays, plane, values, sums);
  }
}

std::size_t findLarge(const float* values, const float* thresholds, std::size_t n,
                      std::uint32_t* found) {
  const Floats d;
  const Uints d_index;
  const auto lanes = hn::Set(d_index, static_cast<std::uint32_t>(hn::Lanes(d)));
  auto index = hn::Iota(d_index, 0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; i += hn::Lanes(d)) {
    const auto large = hn::Ge(hn::LoadU(d, values + i), hn::LoadU(d, thresholds + i));
    if (!hn::AllFalse(d, large)) {
      count += hn::CompressStore(index, hn::RebindMask(d_index, large), d_index, found + count);
    }
    index = hn::Add(index, lanes);
  }
  return count;
}

constexpr RaySampleFunctions kRaySamples = {sample, findLarge};

}  // namespace efm::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace efm::kernels {

const RaySampleFunctions& raySampleFunctions(VotingKernel kernel) {
  static const KernelTable<RaySampleFunctions> kTable =
      EFM_KERNEL_TABLE(plainRaySamples(), kRaySamples);
  return kernelIn(kTable, kernel);
}

}  // namespace efm::kernels
#endif

// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/kernels.h"

#include "mapping/kernels/highway_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/kernels/columns.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace efm::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void add(float* sum, const std::uint8_t* roots, std::size_t planes, float unit) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> d_signed;
  const hn::Rebind<std::uint8_t, decltype(d)> d_narrow;
  const auto units = hn::Set(d, unit);
  const auto peak = hn::Set(d, kColumnPeak);
  for (std::size_t plane = 0; plane < planes; plane += hn::Lanes(d)) {
    const auto below =
        hn::ConvertTo(d, hn::PromoteTo(d_signed, hn::LoadU(d_narrow, roots + plane)));
    const auto value = hn::NegMulAdd(below, below, peak);  // exact
    // No fused multiply-add, so that all kernels give the same bits.
    hn::StoreU(hn::Add(hn::LoadU(d, sum + plane), hn::Mul(units, value)), d, sum + plane);
  }
}

constexpr ColumnFunctions kColumns = {add};

}  // namespace efm::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace efm::kernels {
namespace {

void addPlain(float* sum, const std::uint8_t* roots, std::size_t planes, float unit) {
  for (std::size_t plane = 0; plane < planes; ++plane) {
    sum[plane] += unit * columnValue(roots[plane]);
  }
}

constexpr ColumnFunctions kPlainColumns = {addPlain};

}  // namespace

const ColumnFunctions& columnFunctions(VotingKernel kernel) {
  static constexpr KernelTable<ColumnFunctions> kTable = EFM_KERNEL_TABLE(kPlainColumns, kColumns);
  return kernelIn(kTable, kernel);
}

}  // namespace efm::kernels
#endif

// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/fusion.h"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "mapping/kernels/highway_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/kernels/fusion.cpp"
#include <hwy/foreach_target.h>

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace efm::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kSmallest = std::numeric_limits<float>::min();

// The rules as in fusion_plain.cpp, on vectors V of the lanes that the tag D names.

struct Min {
  static constexpr float kStart = kInfinity;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V fold(D, V sum, V value) {
    return hn::Min(sum, value);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V finish(D, V sum, V) {
    return sum;
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V pair(D, V a, V b) {
    return hn::Min(a, b);
  }
};

struct Harmonic {
  static constexpr float kStart = 0;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V fold(D d, V sum, V value) {
    return hn::Add(sum, hn::Div(hn::Set(d, 1.0F), value));
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V finish(D, V sum, V inputs) {
    return hn::Div(inputs, sum);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V pair(D d, V a, V b) {
    const V low = hn::Min(a, b);
    const V high = hn::Max(a, b);
    const V sum = hn::Max(hn::Add(low, high), hn::Set(d, kSmallest));
    return hn::Mul(hn::Add(low, low), hn::Div(high, sum));
  }
};

struct Geometric {
  static constexpr float kStart = 0;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V fold(D d, V sum, V value) {
    // Highway's logarithm knows numbers above zero only.
    const V log =
        hn::IfThenElse(hn::Gt(value, hn::Zero(d)), hn::Log(d, value), hn::Set(d, -kInfinity));
    return hn::Add(sum, log);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V finish(D d, V sum, V inputs) {
    const V mean = hn::Exp(d, hn::Div(sum, inputs));
    return hn::IfThenElseZero(hn::Gt(sum, hn::Set(d, -kInfinity)), mean);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V pair(D, V a, V b) {
    return hn::Mul(hn::Sqrt(a), hn::Sqrt(b));
  }
};

struct Arithmetic {
  static constexpr float kStart = 0;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V fold(D, V sum, V value) {
    return hn::Add(sum, value);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V finish(D, V sum, V inputs) {
    return hn::Div(sum, inputs);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V pair(D d, V a, V b) {
    return hn::Mul(hn::Add(a, b), hn::Set(d, 0.5F));
  }
};

struct Rms {
  static constexpr float kStart = 0;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V fold(D, V sum, V value) {
    return hn::MulAdd(value, value, sum);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V finish(D, V sum, V inputs) {
    return hn::Sqrt(hn::Div(sum, inputs));
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V pair(D d, V a, V b) {
    return hn::Sqrt(hn::Mul(hn::MulAdd(a, a, hn::Mul(b, b)), hn::Set(d, 0.5F)));
  }
};

struct Max {
  static constexpr float kStart = 0;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V fold(D, V sum, V value) {
    return hn::Max(sum, value);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V finish(D, V sum, V) {
    return sum;
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V pair(D, V a, V b) {
    return hn::Max(a, b);
  }
};

// Full vectors first, then the rest in vectors of one lane.
using Wide = hn::ScalableTag<float>;
using One = hn::CappedTag<float, 1>;

template <class Rule, class D>
HWY_INLINE std::size_t foldBy(D d, std::size_t i, std::size_t n, float* sum, const float* values) {
  for (; i + hn::Lanes(d) <= n; i += hn::Lanes(d)) {
    hn::StoreU(Rule::fold(d, hn::LoadU(d, sum + i), hn::LoadU(d, values + i)), d, sum + i);
  }
  return i;
}

template <class Rule>
void fold(float* sum, const float* values, std::size_t n) {
  const std::size_t done = foldBy<Rule>(Wide(), 0, n, sum, values);
  foldBy<Rule>(One(), done, n, sum, values);
}

template <class Rule, class D>
HWY_INLINE std::size_t finishBy(D d, std::size_t i, std::size_t n, float* sum, float inputs) {
  for (; i + hn::Lanes(d) <= n; i += hn::Lanes(d)) {
    hn::StoreU(Rule::finish(d, hn::LoadU(d, sum + i), hn::Set(d, inputs)), d, sum + i);
  }
  return i;
}

template <class Rule>
void finish(float* sum, float inputs, std::size_t n) {
  const std::size_t done = finishBy<Rule>(Wide(), 0, n, sum, inputs);
  finishBy<Rule>(One(), done, n, sum, inputs);
}

template <class Rule, class D>
HWY_INLINE std::size_t pairBy(D d, std::size_t i, std::size_t n, float* values,
                              const float* others) {
  for (; i + hn::Lanes(d) <= n; i += hn::Lanes(d)) {
    hn::StoreU(Rule::pair(d, hn::LoadU(d, values + i), hn::LoadU(d, others + i)), d, values + i);
  }
  return i;
}

template <class Rule>
void pair(float* values, const float* others, std::size_t n) {
  const std::size_t done = pairBy<Rule>(Wide(), 0, n, values, others);
  pairBy<Rule>(One(), done, n, values, others);
}

/// @param within which lanes to add to.
template <class Rule, class D>
HWY_INLINE void addPairAt(D d, hn::Mask<D> within, float* sum, const float* values,
                          const float* others) {
  const auto mean = Rule::pair(d, hn::LoadU(d, values), hn::LoadU(d, others));
  const auto before = hn::LoadU(d, sum);
  hn::StoreU(hn::IfThenElse(within, hn::Add(before, mean), before), d, sum);
}

template <class Rule>
void addPair(float* sum, const float* values, const float* others, const PixelBlocks& blocks) {
  const auto end = static_cast<std::size_t>(blocks.width * blocks.height);
  const auto width = static_cast<std::size_t>(blocks.width);
  for (std::size_t block = 0; block < blocks.size; ++block) {
    const std::size_t first = blocks.blocks[block] % kBlocksInRow * kBlockPixels;
    const std::size_t row = blocks.blocks[block] / kBlocksInRow * width;
    const std::size_t last = std::min(first + kBlockPixels, width);
    const Wide wide;
    const One one;
    for (std::size_t x = first; x < last; x += hn::Lanes(wide)) {
      std::size_t i = row + x;
      if (i + hn::Lanes(wide) <= end) {
        addPairAt<Rule>(wide, hn::FirstN(wide, last - x), sum + i, values + i, others + i);
      } else {
        for (; i < row + last; ++i) {
          addPairAt<Rule>(one, hn::FirstN(one, 1), sum + i, values + i, others + i);
        }
      }
    }
  }
}

template <class Rule>
constexpr FusionSteps steps() {
  return {Rule::kStart, fold<Rule>, finish<Rule>, pair<Rule>, addPair<Rule>};
}

constexpr FusionFunctions kFusion = {steps<Min>(),        steps<Harmonic>(), steps<Geometric>(),
                                     steps<Arithmetic>(), steps<Rms>(),      steps<Max>()};

}  // namespace efm::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace efm::kernels {

const FusionFunctions& fusionFunctions(VotingKernel kernel) {
  static const KernelTable<FusionFunctions> kTable = EFM_KERNEL_TABLE(plainFusion(), kFusion);
  return kernelIn(kTable, kernel);
}

}  // namespace efm::kernels
#endif

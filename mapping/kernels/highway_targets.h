// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The instruction sets that kernels are compiled for, and the table of a kernel's functions. A
// kernel file `x.cpp` is written once and compiled once per instruction set:
//
//   #include "mapping/kernels/kernels.h"          // struct XFunctions { ... pointers ... };
//   #include "mapping/kernels/highway_targets.h"  // before anything of Highway
//
//   #undef HWY_TARGET_INCLUDE
//   #define HWY_TARGET_INCLUDE "mapping/kernels/x.cpp"
//   #include <hwy/foreach_target.h>
//
//   #include <hwy/highway.h>
//
//   HWY_BEFORE_NAMESPACE();
//   namespace efm::kernels::HWY_NAMESPACE {
//   ...
//   constexpr XFunctions kX = {...};
//   }
//   HWY_AFTER_NAMESPACE();
//
//   #if HWY_ONCE
//   namespace efm::kernels {
//   const XFunctions& xFunctions(VotingKernel kernel) {
//     static constexpr KernelTable<XFunctions> kTable = EFM_KERNEL_TABLE(kPlainX, kX);
//     return kernelIn(kTable, kernel);
//   }
//   }
//   #endif
//
// The kernel is an argument, not Highway's global choice, so that tests and threads can run several
// kernels side by side. Highway's baseline may have vectors of one lane: use only functions that
// exist for one lane.

#ifdef HIGHWAY_HWY_DETECT_TARGETS_H_
#error "include highway_targets.h before anything of Highway"
#endif
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#include <hwy/targets.h>

#include <array>
#include <cassert>
#include <cstddef>

#include "mapping/kernels/kernels.h"

#if HWY_TARGETS & HWY_SCALAR
#define EFM_BASELINE_OF(name) &N_SCALAR::name
#elif HWY_TARGETS & HWY_EMU128
#define EFM_BASELINE_OF(name) &N_EMU128::name
#else
#define EFM_BASELINE_OF(name) nullptr
#endif
#if HWY_TARGETS & HWY_SSE4
#define EFM_SSE4_OF(name) &N_SSE4::name
#else
#define EFM_SSE4_OF(name) nullptr
#endif
#if HWY_TARGETS & HWY_AVX2
#define EFM_AVX2_OF(name) &N_AVX2::name
#else
#define EFM_AVX2_OF(name) nullptr
#endif
#if HWY_TARGETS & HWY_AVX3
#define EFM_AVX512_OF(name) &N_AVX3::name
#else
#define EFM_AVX512_OF(name) nullptr
#endif
#if HWY_TARGETS & HWY_NEON
#define EFM_NEON_OF(name) &N_NEON::name
#else
#define EFM_NEON_OF(name) nullptr
#endif

/// The object `name` of each instruction set's namespace, in the order of a KernelTable.
#define EFM_VECTOR_KERNELS(name)                                                    \
  EFM_BASELINE_OF(name), EFM_SSE4_OF(name), EFM_AVX2_OF(name), EFM_AVX512_OF(name), \
      EFM_NEON_OF(name)
/// A KernelTable of `plain` and of the objects of EFM_VECTOR_KERNELS.
#define EFM_KERNEL_TABLE(plain, name) \
  { &(plain), EFM_VECTOR_KERNELS(name) }

namespace efm::kernels {

/// One kernel's functions for each `VotingKernel`, in the order of the enum; null if none.
template <typename Functions>
using KernelTable = std::array<const Functions*, 6>;

/// @param kernel one of `availableKernels`.
template <typename Functions>
const Functions& kernelIn(const KernelTable<Functions>& table, VotingKernel kernel) {
  const Functions* functions = table[static_cast<std::size_t>(kernel)];
  assert(functions != nullptr);
  return *functions;
}

}  // namespace efm::kernels

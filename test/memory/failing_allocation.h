// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace efm {

/// Which threads' allocations count: the thread that calls `failAllocation`, or all others.
enum class Allocating { kThisThread, kOtherThreads };

/// From now on one allocation fails with std::bad_alloc, once: the one after `skipped` others.
/// Operator new of the whole test program counts; memory of Eigen and OpenCV does not.
void failAllocation(Allocating threads, std::size_t skipped);

/// None fails any more.
/// @return the sizes of the allocations since `failAllocation`, in bytes; at most the first 65,536.
std::vector<std::size_t> stopFailing();

/// The numbers of the allocations with a size that is rare. The others are those of the inner loops
/// of PCL's search, which ends the program where its memory fails, and of Ceres.
std::vector<std::size_t> rareOnes(const std::vector<std::size_t>& sizes);

}  // namespace efm

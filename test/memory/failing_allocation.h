// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace efm {

/// The threads whose allocations count: the thread that calls `failAllocation`, or all others.
enum class Allocating { kThisThread, kOtherThreads };

/// Lets one later allocation fail with std::bad_alloc: the one after `skipped` other allocations.
/// Operator new of the whole test program counts; memory of Eigen and OpenCV does not.
void failAllocation(Allocating threads, std::size_t skipped);

/// Ends the failing: all later allocations succeed.
/// @return the sizes of the allocations since `failAllocation`, in bytes; at most the first 65,536.
std::vector<std::size_t> stopFailing();

/// Returns the numbers of the allocations whose size is rare. Frequent sizes belong to inner loops:
/// of Ceres, and of PCL's search, which ends the program if its memory fails.
std::vector<std::size_t> rareOnes(const std::vector<std::size_t>& sizes);

}  // namespace efm

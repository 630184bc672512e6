// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

namespace efm::bench {

/// The additional peak memory of this process while `work` runs, in MB of 1e6 bytes. Works on Linux
/// only, which can reset the peak.
std::optional<double> peakMemory_mb(const std::function<void()>& work);

}  // namespace efm::bench

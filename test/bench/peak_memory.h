// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

namespace efm::bench {

/// How far the memory of this process rises above where it stood while `work` runs, in MB of 1e6
/// bytes. Nothing where the system does not tell (it takes Linux, which can forget an earlier
/// peak).
std::optional<double> peakMemory_mb(const std::function<void()>& work);

}  // namespace efm::bench

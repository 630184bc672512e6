// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace efm {

/// Runs a function in a copy of this process first, for a library that may crash on damaged files.
/// Nothing that it does or prints is seen here.
/// @return false if the copy crashed, or used a minute of processor time. True if the function
/// returned or threw, or there can be no copy.
bool survives(const std::function<void()>& function);

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <string>

namespace efm {

/// An exception in words for the user: one sentence, without what a library adds for its
/// programmers (call stacks, places in its sources, names of types).
std::string inWords(const std::exception& error);

}  // namespace efm

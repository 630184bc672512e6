// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>

namespace efm {

/// The exception of a step; null if it throws none.
template <typename Step>
std::exception_ptr exceptionOf(const Step& step) {
  try {
    step();
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

}  // namespace efm

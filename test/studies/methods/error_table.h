// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "test/studies/methods/method_comparison.h"
#include "test/studies/report/study_section.h"

namespace efm::studies {

struct ErrorTableOptions {
  bool equal_numbers = false;  ///< Adds a third row per method.
  bool in_metres = false;      ///< Absolute errors in metres, else in centimetres.
};

/// The paper's ten columns, two or three rows per method.
TextTable errorTable(const std::vector<MethodResult>& results,
                     const ErrorTableOptions& options = {});

}  // namespace efm::studies

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <vector>

#include "test/bench/machine.h"
#include "test/bench/performance_row.h"

namespace efm::bench {

/// One line per row: its case, a column for every quantity (empty without a value), and the
/// conditions. The conditions are in every line, so tables of several runs can be joined.
void writeCsv(std::ostream& out, const std::vector<PerformanceRow>& rows,
              const Conditions& conditions);

/// The same for readers: the conditions once, and a table per group with its own columns.
void writeMarkdown(std::ostream& out, const std::vector<PerformanceRow>& rows,
                   const Conditions& conditions);

}  // namespace efm::bench

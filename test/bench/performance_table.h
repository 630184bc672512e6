// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <vector>

#include "test/bench/machine.h"
#include "test/bench/performance_row.h"

namespace efm::bench {

/// One line per row: what it is, then a column for every quantity that any row has, empty where
/// this one has not, then the conditions, the same in every line: so that tables of several runs
/// can be put together.
void writeCsv(std::ostream& out, const std::vector<PerformanceRow>& rows,
              const Conditions& conditions);

/// The same for reading: the conditions once, then a table per group with the columns that it has.
void writeMarkdown(std::ostream& out, const std::vector<PerformanceRow>& rows,
                   const Conditions& conditions);

}  // namespace efm::bench

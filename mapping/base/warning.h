// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace efm {

/// Something implausible, which does not stop a run: docs/recordings.md has a table of the names.
struct Warning {
  std::string name;  ///< "clock-overlap"
  std::string text;  ///< A sentence with the values, and the option or file that would mend it.
};

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/session_status.h"

namespace efm {

double LiveStatus::dropRatio() const {
  std::uint64_t received = 0;
  std::uint64_t missing = 0;
  for (const auto& [index, camera] : cameras) {
    received += camera.received;
    missing += camera.thinned + camera.dropped;
  }
  return received == 0 ? 0 : static_cast<double>(missing) / static_cast<double>(received);
}

}  // namespace efm

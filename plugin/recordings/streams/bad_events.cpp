// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/bad_events.h"

#include <fmt/format.h>

#include <stdexcept>

namespace efm {

void BadEvents::skip(const std::string& error) {
  if (count_ == limit_) {
    throw std::runtime_error(limit_ == 0
                                 ? error + " (--skip-bad-events N leaves out up to N bad events)"
                                 : fmt::format("{} ({} bad events before it were left out, as "
                                               "--skip-bad-events allows)",
                                               error, count_));
  }
  if (count_++ == 0) first_ = error;
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/session_status.h"

#include <fmt/format.h>

namespace efm {

std::string asText(const WindowsGivenUp& windows) {
  std::string text = fmt::format("{} windows given up", windows.total());
  const char* separator = ": ";
  for (const NamedReason& reason : kGiveUpReasons) {
    const std::uint64_t count = windows.*reason.count;
    if (count == 0) continue;
    text += fmt::format("{}{} {}", separator, count, reason.text);
    separator = ", ";
  }
  return text;
}

double LiveStatus::dropRatio() const {
  std::uint64_t received = 0;
  std::uint64_t missing = 0;
  for (const auto& [index, camera] : cameras) {
    received += camera.received;
    missing += camera.thinned + camera.dropped + camera.refused + camera.after_end + camera.lost;
  }
  return received == 0 ? 0 : static_cast<double>(missing) / static_cast<double>(received);
}

std::string choiceText(const SessionStatus& status) {
  std::string text = "options chosen from the data:";
  for (const ChosenOption& option : status.chosen) {
    text += fmt::format(" {} = {:g} ({});", option.key, option.value, option.reason);
  }
  text.pop_back();
  return text;
}

}  // namespace efm

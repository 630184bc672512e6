// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <iostream>

namespace efm {
namespace {

constexpr std::chrono::milliseconds kPeriod{200};
constexpr const char* kClearLine = "\r\033[K";

}  // namespace

Progress::Progress()
    : terminal_(isatty(STDERR_FILENO) == 1), next_(std::chrono::steady_clock::now() + kPeriod) {}

Progress::~Progress() {
  if (shown_) std::cerr << kClearLine << std::flush;
}

bool Progress::due() const { return terminal_ && std::chrono::steady_clock::now() >= next_; }

void Progress::show(const std::string& line) {
  if (!terminal_) return;
  std::cerr << kClearLine << line << std::flush;
  shown_ = true;
  next_ = std::chrono::steady_clock::now() + kPeriod;
}

void Progress::showFraction(const std::string& activity, double fraction) {
  if (due()) show(fmt::format("{}: {} %", activity, static_cast<int>(100 * fraction)));
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <utility>

#include "plugin/session/session_status.h"

namespace efm {
namespace {

constexpr double kTerminalPeriodS = 0.2;
constexpr double kFirstPlainPeriodS = 10;  // shorter runs print nothing
constexpr double kMaxPlainPeriodS = 60;
constexpr const char* kClearLine = "\r\033[K";

std::optional<int> columnsOfStandardError() {
  if (isatty(STDERR_FILENO) != 1) return std::nullopt;
  constexpr int kUsual = 80;
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kUsual;
}

double steadySeconds() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

}  // namespace

ProgressOutput ProgressOutput::standardError() {
  return {std::cerr, columnsOfStandardError, steadySeconds};
}

Progress::Progress(std::string activity, Verbosity verbosity, ProgressOutput output)
    : activity_(std::move(activity)),
      verbosity_(verbosity),
      output_(std::move(output)),
      start_s_(output_.clock()),
      next_s_(start_s_ + (output_.columns() ? kTerminalPeriodS : kFirstPlainPeriodS)),
      plain_period_s_(kFirstPlainPeriodS) {}

Progress::~Progress() { removeLine(); }

void Progress::begin(std::string activity) {
  activity_ = std::move(activity);
  start_s_ = output_.clock();
  if (verbosity_ != Verbosity::kQuiet && output_.columns()) replaceLine(activity_);
}

bool Progress::due() const { return verbosity_ != Verbosity::kQuiet && output_.clock() >= next_s_; }

double Progress::seconds() const { return output_.clock() - start_s_; }

void Progress::show(double fraction, const std::string& details) {
  if (!due()) return;
  fraction = std::clamp(fraction, 0.0, 1.0);
  const std::string line = text(fraction, details);
  if (const std::optional<int> columns = output_.columns()) {
    replaceLine(withBar(line, fraction, *columns));
    next_s_ = output_.clock() + kTerminalPeriodS;
  } else {
    output_.stream << "event-fusion: " << activity_ << line << std::endl;
    plain_period_s_ = std::min(2 * plain_period_s_, kMaxPlainPeriodS);
    next_s_ = output_.clock() + plain_period_s_;
  }
}

void Progress::print(const std::string& line) {
  if (verbosity_ != Verbosity::kVerbose) return;
  removeLine();
  output_.stream << line << std::endl;
}

/// Returns " 43 %, 12 s left, details".
std::string Progress::text(double fraction, const std::string& details) const {
  constexpr double kMinFraction = 0.01;  // with less, the remaining time is a guess
  std::string text = fmt::format(" {:3.0f} %", std::floor(100 * fraction));
  if (fraction >= kMinFraction && fraction < 1) {
    text += fmt::format(", {} left", durationText(seconds() * (1 - fraction) / fraction));
  }
  if (!details.empty()) text += ", " + details;
  return text;
}

/// Returns activity, bar (if it fits) and text, within the width of the terminal in columns.
std::string Progress::withBar(const std::string& text, double fraction, int columns) const {
  constexpr int kMinBar = 8;
  constexpr int kMaxBar = 40;
  // The last column stays free, because some terminals wrap a full line.
  const int room = std::max(columns - 1, 0);
  const int bar = std::min(room - static_cast<int>(activity_.size() + text.size() + 3), kMaxBar);
  if (bar < kMinBar) return (activity_ + text).substr(0, static_cast<std::size_t>(room));
  const auto done = static_cast<std::size_t>(fraction * bar);
  std::string filled(done, '=');
  filled.resize(static_cast<std::size_t>(bar), ' ');
  return activity_ + " [" + filled + "]" + text;
}

void Progress::replaceLine(const std::string& line) {
  output_.stream << kClearLine << line << std::flush;
  shown_ = true;
}

void Progress::removeLine() {
  if (std::exchange(shown_, false)) output_.stream << kClearLine << std::flush;
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/interruption.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <string_view>

namespace efm {
namespace {

constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGHUP};

/// Time in which signals count as one: `timeout` signals the process and its group.
constexpr double kSameSignalS = 0.3;
constexpr std::string_view kNote =
    "\nevent-fusion: stopping as soon as possible; a second signal ends it at once\n";

volatile std::sig_atomic_t signal_came = 0;
volatile std::sig_atomic_t on_terminal = 0;
std::timespec came_at;  // used by the handler only
std::array<struct sigaction, kSignals.size()> earlier_actions;

double secondsSince(const std::timespec& before) {
  std::timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec - before.tv_sec) +
         1e-9 * static_cast<double>(now.tv_nsec - before.tv_nsec);
}

/// Handles a signal. All calls are safe in a handler, and the signals do not interrupt it.
void noteSignal(int signal) {
  const int error = errno;
  if (signal_came == 0) {
    clock_gettime(CLOCK_MONOTONIC, &came_at);
    signal_came = 1;
    if (on_terminal != 0 && write(STDERR_FILENO, kNote.data(), kNote.size()) < 0) {
      // The terminal is gone.
    }
  } else if (secondsSince(came_at) > kSameSignalS) {
    std::signal(signal, SIG_DFL);
    raise(signal);  // takes effect when the handler returns
  }
  errno = error;
}

}  // namespace

Interruption::Interruption() {
  signal_came = 0;
  on_terminal = isatty(STDERR_FILENO);
  struct sigaction action = {};
  action.sa_handler = noteSignal;
  action.sa_flags = SA_RESTART;
  for (const int signal : kSignals) sigaddset(&action.sa_mask, signal);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &earlier_actions[i]);
    // A shell starts background jobs with ignored signals: they stay ignored.
    if (earlier_actions[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &action, nullptr);
  }
}

Interruption::~Interruption() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], &earlier_actions[i], nullptr);
  }
}

bool Interruption::requested() const { return signal_came != 0; }

void Interruption::check() const {
  if (requested()) throw Interrupted();
}

}  // namespace efm

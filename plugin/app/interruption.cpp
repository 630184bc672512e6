// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/interruption.h"

#include <array>
#include <csignal>

namespace efm {
namespace {

constexpr std::array<int, 2> kSignals = {SIGINT, SIGTERM};

volatile std::sig_atomic_t signal_came = 0;
std::array<struct sigaction, kSignals.size()> earlier_actions;

/// From now on, signals have their default action. All calls are safe in a handler.
void noteSignal(int) {
  signal_came = 1;
  for (const int signal : kSignals) {
    struct sigaction action = {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler == noteSignal) std::signal(signal, SIG_DFL);
  }
}

}  // namespace

Interruption::Interruption() {
  signal_came = 0;
  struct sigaction action = {};
  action.sa_handler = noteSignal;
  action.sa_flags = SA_RESTART;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &earlier_actions[i]);
    // A shell starts background jobs with signals ignored: they stay so.
    if (earlier_actions[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &action, nullptr);
  }
}

Interruption::~Interruption() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], &earlier_actions[i], nullptr);
  }
}

bool Interruption::requested() const { return signal_came != 0; }

}  // namespace efm

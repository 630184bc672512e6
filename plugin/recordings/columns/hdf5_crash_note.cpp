// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_crash_note.h"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <string>

namespace efm {
namespace {

constexpr std::array<int, 5> kSignals = {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGALRM};

bool is_enabled = false;
bool has_note = false;
// The state of the current note:
pthread_t note_thread;
std::string crash_sentence;
std::string limit_sentence;
std::array<struct sigaction, kSignals.size()> earlier_actions;
stack_t earlier_stack;
alignas(16) std::array<char, 65'536> handler_stack;  // the library may have used up the thread's

/// Handles a signal. All calls are safe in a signal handler.
void endWithSentence(int signal) {
  if (signal != SIGALRM && pthread_equal(pthread_self(), note_thread) == 0) {
    std::signal(signal, SIG_DFL);
    raise(signal);  // ends the process when the handler returns
    return;
  }
  const std::string& sentence = signal == SIGALRM ? limit_sentence : crash_sentence;
  if (write(STDERR_FILENO, sentence.data(), sentence.size()) < 0) {
    // stderr is closed.
  }
  _exit(EXIT_FAILURE);
}

}  // namespace

void Hdf5CrashNote::enable() { is_enabled = true; }

Hdf5CrashNote::Hdf5CrashNote(const std::filesystem::path& file, unsigned limit_s)
    : active_(is_enabled && !has_note) {
  if (!active_) return;
  constexpr const char* kSentence =
      "event-fusion: error: {}: the HDF5 library {}: expected a file without damage\n";
  crash_sentence = fmt::format(kSentence, file.string(), "crashes on it");
  limit_sentence = fmt::format(kSentence, file.string(),
                               fmt::format("does not come back from it within {} s", limit_s));
  note_thread = pthread_self();
  has_note = true;
  const stack_t stack = {handler_stack.data(), 0, handler_stack.size()};
  sigaltstack(&stack, &earlier_stack);
  struct sigaction action = {};
  action.sa_handler = endWithSentence;
  action.sa_flags = SA_ONSTACK;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], &action, &earlier_actions[i]);
  }
  alarm(limit_s);
}

Hdf5CrashNote::~Hdf5CrashNote() {
  if (!active_) return;
  alarm(0);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], &earlier_actions[i], nullptr);
  }
  sigaltstack(&earlier_stack, nullptr);
  has_note = false;
}

}  // namespace efm

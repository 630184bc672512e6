// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/hdf5/crash_probe.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <exception>

namespace efm {

bool survives(const std::function<void()>& function) {
  constexpr rlimit kProcessorSeconds = {60, 60};
  constexpr rlimit kNoCoreFile = {0, 0};
  const pid_t copy = fork();
  if (copy < 0) return true;
  if (copy == 0) {
    setrlimit(RLIMIT_CPU, &kProcessorSeconds);
    setrlimit(RLIMIT_CORE, &kNoCoreFile);
    const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nothing, STDOUT_FILENO);
    dup2(nothing, STDERR_FILENO);
    try {
      function();
    } catch (const std::exception&) {
      // The caller gets the same one from its own call.
    }
    _exit(0);
  }
  int status = 0;
  while (waitpid(copy, &status, 0) < 0) {
    if (errno != EINTR) return true;
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace efm

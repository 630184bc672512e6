// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/program.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <functional>
#include <iostream>

#include "plugin/app/commands.h"
#include "plugin/app/interruption.h"
#include "plugin/recordings/columns/hdf5_crash_note.h"

namespace efm {
namespace {

/// Flushes stdout. @return the status, or a failure if stdout cannot be written.
int finished(int status) {
  errno = 0;
  std::cout.flush();
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && std::cout && std::ferror(stdout) == 0) return status;
  // errno is 0 if an earlier flush failed.
  return fail("the output cannot be written" +
              (errno != 0 ? std::string(": ") + std::strerror(errno) : std::string()));
}

}  // namespace

int fail(const std::string& message, int status) {
  std::cerr << "event-fusion: error: " << message << "\n";
  return status;
}

int runProgram(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file above `ulimit -f` is an error of writing
  Hdf5CrashNote::enable();
  try {
    const std::function<int()> run = parseCommandLine(argc, argv);
    return finished(run());
  } catch (const UsageError& error) {
    return fail(error.what(), kUsageStatus);
  } catch (const Interrupted& interrupted) {
    std::cerr << "event-fusion: " << interrupted.what() << "\n";
    return kInterruptedStatus;
  } catch (const std::exception& error) {
    return fail(userMessage(error));
  }
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/hdf5_trial.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <thread>

#include "plugin/recordings/columns/hdf5_files.h"

namespace efm {

int runHdf5Trial(const std::string& source) {
  constexpr rlimit kNoCoreFile = {0, 0};
  setrlimit(RLIMIT_CORE, &kNoCoreFile);
  try {
    RecordingParts parts = openHdf5({source}, {});
    std::vector<Event> events;
    for (const auto& camera : parts.cameras) camera->read(events);
  } catch (const std::exception&) {
    // The first program gets the same one.
  }
  return 0;
}

void tryHdf5(const std::vector<std::string>& arguments) {
  constexpr std::chrono::seconds kLimit(60);
  for (const std::string& argument : arguments) {
    const bool is_option = argument.compare(0, 2, "--") == 0;  // --poses=FILE
    const std::string source = is_option ? argument.substr(argument.find('=') + 1) : argument;
    if (!looksLikeHdf5(source)) continue;
    const auto failure = failureOf({"/proc/self/exe", std::string(kHdf5Trial), source}, kLimit);
    if (!failure) continue;
    throw std::runtime_error(
        fmt::format("{}: the HDF5 library {}: expected a file without damage", source, *failure));
  }
}

std::optional<std::string> failureOf(const std::vector<std::string>& command,
                                     std::chrono::milliseconds limit) {
  constexpr std::chrono::milliseconds kStep(2);
  std::vector<std::string> texts = command;
  std::vector<char*> arguments;
  for (std::string& text : texts) arguments.push_back(text.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&files, stream, "/dev/null", O_RDWR, 0);
  }
  pid_t process = 0;
  const int error =
      posix_spawnp(&process, arguments[0], &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) return std::nullopt;

  const auto end = std::chrono::steady_clock::now() + limit;
  int status = 0;
  while (waitpid(process, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() >= end) {
      kill(process, SIGKILL);
      waitpid(process, &status, 0);
      return fmt::format("does not end within {} s", std::chrono::duration<double>(limit).count());
    }
    std::this_thread::sleep_for(kStep);
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::nullopt;
  return "crashes";
}

}  // namespace efm

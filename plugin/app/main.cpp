// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <iostream>
#include <new>
#include <string>

#include "plugin/app/command_line.h"
#include "plugin/mrpt/registration.h"

namespace {

int fail(const std::string& message) {
  std::cerr << "event-fusion: error: " << message << "\n";
  return 1;
}

/// The exit status: a failure too where stdout did not take what was printed.
int finished(int status) {
  errno = 0;
  std::cout.flush();
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && std::cout && std::ferror(stdout) == 0) return status;
  // The reason is lost where something was flushed before.
  return fail("the output cannot be written" +
              (errno != 0 ? std::string(": ") + std::strerror(errno) : std::string()));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Maps with event cameras: events and poses in, semi-dense depth maps and one global point "
      "cloud out.\n\n"
      "From a recording to a map:\n"
      "  event-fusion simulate --preset desk_stereo --out desk\n"
      "  event-fusion import desk --out desk.rawlog\n"
      "  event-fusion map config/simulated_stereo.ini desk.rawlog --out out\n",
      "event-fusion");
  app.set_version_flag("--version", std::string("event-fusion ") + EFM_VERSION);
  app.set_help_all_flag("--help-all", "Print the help of every command and exit");
  std::function<int()> run;
  efm::addCommands(app, run);
  try {
    app.parse(argc, argv);
    efm::registerClasses();
    return finished(run());
  } catch (const CLI::ParseError& error) {
    return finished(app.exit(error));  // prints help and version, too
  } catch (const std::bad_alloc&) {
    return fail("out of memory");
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}

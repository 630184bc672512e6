// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/commands.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <stdexcept>

#include "plugin/playback/session_export.h"
#include "plugin/results/output/result_folder.h"

namespace efm {
namespace {

/// Makes the page of a session, beside it: session.mcap.html.
std::filesystem::path pageOf(const std::filesystem::path& session) {
  SessionExport what;
  what.sessions = {session};
  const SessionFile file(session);
  what.refined = file.generations() > 0;
  const std::filesystem::path page = session.string() + ".html";
  exportSession(SessionMap(what), page);
  return std::filesystem::absolute(page).lexically_normal();
}

std::filesystem::path pageIn(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  if (const auto session = sessionAt(path); session && !fs::exists(path / "map.html")) {
    return pageOf(*session);
  }
  const bool is_unfinished = !fs::exists(path / "report.json") && ResultFolder::hasPartial(path);
  if (!fs::exists(path) && !is_unfinished) {
    throw std::runtime_error(path.string() + ": no such folder: expected one that `map` wrote");
  }
  if (!fs::is_directory(path) && !is_unfinished) {
    if (path.extension() == ".html") return fs::absolute(path);
    throw std::runtime_error(path.string() +
                             ": expected a folder that `map` wrote, or its map.html");
  }
  if (fs::exists(path / "map.html")) return fs::absolute(path / "map.html").lexically_normal();
  const char* const why =
      is_unfinished ? ": the run that writes it was killed, or is not at its end yet"
      : fs::exists(path / "map.pcd")
          ? ": an earlier version made this map, or it was not written to its end; map it again"
          : ": expected the page that `map` writes into its folder";
  throw std::runtime_error((path / "map.html").string() + why);
}

/// @return true if the system's program for pages opened the page.
bool openPage(const std::filesystem::path& page) {
#ifdef __APPLE__
  const char* const opener = "open";
#else
  const char* const opener = "xdg-open";
  // Without a screen, xdg-open may start a text browser, which cannot show a map.
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return false;
#endif
  const std::string file = page.string();
  const pid_t child = fork();
  if (child == 0) {
    const int null = open("/dev/null", O_RDWR);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    execlp(opener, opener, file.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = -1;
  return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

}  // namespace

int runView(const ViewArguments& arguments) {
  const std::filesystem::path page = pageIn(arguments.path);
  std::cout << page.string() << std::endl;
  if (!openPage(page)) {
    std::cerr << "event-fusion: no browser could be started here: open the file in one\n";
  }
  return 0;
}

}  // namespace efm

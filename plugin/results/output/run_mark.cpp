// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/run_mark.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "mapping/base/atomic_file.h"

namespace efm {
namespace {

/// A lock of the whole file. It is of this opening of the file, so it also excludes another run in
/// the same process.
flock wholeFile() {
  flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

std::runtime_error atWork(const std::filesystem::path& folder) {
  return std::runtime_error(folder.string() +
                            ": another run is writing its result there: expected another folder");
}

}  // namespace

RunMark::RunMark(const std::filesystem::path& folder, const std::vector<std::string>& recording) {
  const std::filesystem::path path = folder / kName;
  const auto fail = [&] {
    const std::string why = reasonNotWritten(errno);
    const std::string text = why.empty() ? std::strerror(errno) : why;
    if (file_ >= 0) ::close(file_);
    return std::runtime_error("cannot write '" + path.string() + "': " + text);
  };
  struct stat status {};
  do {  // until the file is still there when it is locked: its run may have ended meanwhile
    if (file_ >= 0) ::close(file_);
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file_ < 0) throw fail();
    flock lock = wholeFile();
    if (::fcntl(file_, F_OFD_SETLK, &lock) != 0 && (errno == EAGAIN || errno == EACCES)) {
      ::close(file_);
      throw atWork(folder);
    }  // a file system without locks cannot tell
  } while (::fstat(file_, &status) == 0 && status.st_nlink == 0);
  const std::string text = nlohmann::json{{"recording", recording}, {"process", getpid()}}.dump(
                               2, ' ', false, nlohmann::json::error_handler_t::replace) +
                           "\n";
  if (::ftruncate(file_, 0) != 0 ||
      ::write(file_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw fail();
  }
}

RunMark::~RunMark() { ::close(file_); }

std::optional<UnfinishedRun> RunMark::ofKilledRun(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kName;
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  std::ifstream stream(path);
  const nlohmann::json mark = nlohmann::json::parse(stream, nullptr, false);
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  flock lock = wholeFile();
  const bool asked = ::fcntl(file, F_OFD_GETLK, &lock) == 0;
  ::close(file);
  if (asked && lock.l_type != F_UNLCK) throw atWork(folder);
  try {
    return UnfinishedRun{mark.at("recording").get<std::vector<std::string>>(),
                         mark.at("process").get<pid_t>()};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace efm {
namespace {

std::runtime_error cannotWrite(const std::filesystem::path& path, const std::string& why) {
  return std::runtime_error("cannot write '" + path.string() + "': " + why);
}

/// Returns the path itself, or the target of its symbolic links.
std::filesystem::path replaceableFile(const std::filesystem::path& path) {
  constexpr int kMaxLinks = 40;  // the limit of Linux
  const auto reject = [&](const std::string& why) { return cannotWrite(path, why); };
  if (path.empty()) throw reject("expected the name of a file");
  std::error_code error;
  std::filesystem::path file = path;
  for (int links = 0; std::filesystem::is_symlink(file, error); ++links) {
    if (links == kMaxLinks) throw reject("too many symbolic links");
    file = file.parent_path() / std::filesystem::read_symlink(file, error);
    if (error) throw reject(error.message());
  }
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (error == std::errc::filename_too_long) throw reject(error.message());
  if (std::filesystem::is_directory(status) || !file.has_filename()) throw reject("it is a folder");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw reject("it is there and not a regular file");
  }
  return file;
}

}  // namespace

std::string reasonNotWritten(int error_number) {
  switch (error_number) {
    case ENOSPC:
      return "the disk is full";
    case EDQUOT:
      return "the disk quota is used up";
    case EFBIG:
      return "the file would be larger than the system allows (ulimit -f)";
    default:
      return "";
  }
}

namespace {

/// Returns a temporary name: "map.partial-1234.pcd" for "map.pcd" and process 1234. If that file
/// exists, trial 1 gives "map.partial-1234-1.pcd", and so on. A killed process leaves its file.
std::filesystem::path temporaryName(const std::filesystem::path& path, int trial) {
  const std::string number =
      std::to_string(getpid()) + (trial == 0 ? "" : "-" + std::to_string(trial));
  const std::string end = ".partial-" + number + path.extension().string();
  std::string begin = path.stem().string();
  // Two long names may begin with the same characters: then `trial` makes them different.
  begin.resize(std::min(begin.size(), NAME_MAX - std::min<std::size_t>(end.size(), NAME_MAX)));
  std::filesystem::path temporary = path;
  temporary.replace_filename(begin + end);
  return temporary;
}

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& path) : path_(replaceableFile(path)) {
  for (int trial = 0;; ++trial) {
    temporary_ = temporaryName(path_, trial);
    const int file = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0) {
      ::close(file);
      return;
    }
    if (errno == EEXIST) continue;
    const std::string why = reasonNotWritten(errno);
    throw cannotWrite(path, why.empty() ? std::strerror(errno) : why);
  }
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (!temporary_.empty()) std::filesystem::remove(temporary_, ignored);
}

void fillFile(const std::filesystem::path& path, const std::filesystem::path& named,
              const std::function<void(const std::filesystem::path& path)>& write) {
  errno = 0;
  try {
    write(path);
  } catch (const std::exception& error) {
    const std::string why = reasonNotWritten(errno);
    throw std::runtime_error("cannot write " + named.string() + ": " +
                             (why.empty() ? error.what() : why));
  }
}

std::function<void(const std::filesystem::path& path)> byStream(
    std::function<void(std::ostream&)> write) {
  return [write = std::move(write)](const std::filesystem::path& path) {
    std::ofstream file(path, std::ios::binary);
    write(file);
    file.close();
    if (!file) throw std::runtime_error("the file cannot be created or the disk is full");
  };
}

void AtomicFile::replace() {
  syncToDisk(temporary_);
  std::filesystem::rename(temporary_, path_);
  temporary_.clear();  // from now on another process may use this name
  syncToDisk(path_.has_parent_path() ? path_.parent_path() : ".");
}

void syncToDisk(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;  // the folder may be writable, but not readable
  const int error = ::fsync(file) == 0 ? 0 : errno;
  ::close(file);
  if (error == 0 || error == EINVAL || error == ENOSYS || error == EOPNOTSUPP) return;
  errno = error;
  throw std::filesystem::filesystem_error("cannot be written to the disk", path,
                                          std::error_code(error, std::generic_category()));
}

void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write) {
  AtomicFile file(path);
  fillFile(file.temporary(), file.path(), [&](const std::filesystem::path& temporary) {
    write(temporary);
    file.replace();
  });
}

std::string readBytes(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) throw std::runtime_error("there is no such file");
  if (!std::filesystem::is_regular_file(path)) throw std::runtime_error("it is not a regular file");
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto end = file.tellg();
  if (!file || end < 0) throw std::runtime_error("the file cannot be opened");
  std::string bytes(static_cast<std::size_t>(end), '\0');
  file.seekg(0);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file) throw std::runtime_error("the file cannot be read to its end");
  return bytes;
}

namespace fs = std::filesystem;

NewFolder::NewFolder(fs::path folder) : folder_(std::move(folder)) {
  if (folder_.empty()) {
    throw std::runtime_error("'': expected the name of the folder to write");
  }
  folder_ = fs::absolute(folder_).lexically_normal();
  if (!folder_.has_filename()) folder_ = folder_.parent_path();  // a trailing slash
  std::error_code error;
  if (fs::exists(folder_, error) && !(fs::is_directory(folder_) && fs::is_empty(folder_))) {
    throw std::runtime_error(folder_.string() + ": exists already and is not an empty folder");
  }
  const fs::path parent = folder_.parent_path();
  fs::create_directories(parent, error);
  if (error) throw std::runtime_error(parent.string() + ": cannot be made: " + error.message());
  constexpr std::size_t kMostOfName = NAME_MAX - 40;  // the other 40 characters are for the numbers
  const std::string name = "." + folder_.filename().string().substr(0, kMostOfName) +
                           ".unfinished-" + std::to_string(getpid());
  for (int trial = 0;; ++trial) {
    const fs::path unfinished = parent / (name + (trial == 0 ? "" : "-" + std::to_string(trial)));
    if (::mkdir(unfinished.c_str(), 0777) == 0) {
      unfinished_ = unfinished;
      return;
    }
    if (errno == EEXIST) continue;
    throw std::runtime_error(unfinished.string() + ": cannot be made: " + std::strerror(errno));
  }
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  if (!unfinished_.empty()) fs::remove_all(unfinished_, ignored);
}

void NewFolder::finish() {
  for (const auto& entry : fs::recursive_directory_iterator(unfinished_)) syncToDisk(entry.path());
  syncToDisk(unfinished_);
  std::error_code error;
  fs::rename(unfinished_, folder_, error);
  if (error) throw std::runtime_error(folder_.string() + ": cannot be made: " + error.message());
  unfinished_.clear();
  syncToDisk(folder_.parent_path());
}

}  // namespace efm

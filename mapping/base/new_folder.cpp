// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/new_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "mapping/base/atomic_file.h"

namespace efm {

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
  constexpr std::size_t kMostOfName = NAME_MAX - 40;  // the rest is room for the numbers
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

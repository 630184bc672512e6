// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/truth/new_folder.h"

#include <unistd.h>

#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

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
  const fs::path unfinished =
      parent / ("." + folder_.filename().string() + ".unfinished-" + std::to_string(getpid()));
  fs::remove_all(unfinished, error);  // of a killed process with the same id
  if (!fs::create_directory(unfinished, error)) {
    throw std::runtime_error(unfinished.string() + ": cannot be made: " + error.message());
  }
  unfinished_ = unfinished;
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  if (!unfinished_.empty()) fs::remove_all(unfinished_, ignored);
}

void NewFolder::finish() {
  std::error_code error;
  fs::rename(unfinished_, folder_, error);
  if (error) throw std::runtime_error(folder_.string() + ": cannot be made: " + error.message());
  unfinished_.clear();
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/config_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "plugin/app/exit_status.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSuffix = ".ini";

/// Empty if there is none.
fs::path configFolder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed =
      program.parent_path().parent_path() / "share" / "event-fusion-mapper" / "config";
  if (!error && fs::is_directory(installed, error)) return installed;
  const fs::path source = EFM_CONFIG_DIR;
  return fs::is_directory(source, error) ? source : fs::path();
}

}  // namespace

std::vector<std::string> configNames() {
  std::vector<std::string> names;
  const fs::path folder = configFolder();
  if (folder.empty()) return names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == kSuffix) names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path findConfig(const std::string& name_or_path) {
  std::error_code ignored;
  const fs::path path = name_or_path;
  if (fs::is_regular_file(path, ignored)) return path;
  if (path.extension() == kSuffix) {
    if (fs::exists(path, ignored)) return path;  // reading it says what it is
    throw UsageError(name_or_path + ": no such option file");
  }
  const std::vector<std::string> names = configNames();
  if (std::binary_search(names.begin(), names.end(), name_or_path)) {
    return configFolder() / (name_or_path + kSuffix);
  }
  throw UsageError(fmt::format("--config {}: no such option file: {}", inQuotes(name_or_path),
                               expectedName(name_or_path, names)));
}

}  // namespace efm

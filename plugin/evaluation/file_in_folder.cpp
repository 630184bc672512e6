// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/file_in_folder.h"

#include <stdexcept>
#include <string>

namespace efm {

std::filesystem::path fileInFolder(const std::filesystem::path& path,
                                   std::initializer_list<const char*> names) {
  if (!std::filesystem::is_directory(path)) return path;
  std::string expected;
  for (const char* name : names) {
    if (std::filesystem::is_regular_file(path / name)) return path / name;
    expected += (expected.empty() ? "" : " or ") + std::string(name);
  }
  const bool killed = std::filesystem::exists(path / "report.partial.json");
  throw std::runtime_error(
      path.string() + ": a folder without " + expected +
      (killed ? ": the run that writes it was killed, or is not at its end yet" : ""));
}

}  // namespace efm

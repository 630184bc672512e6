// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/timed_files.h"

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "mapping/geometry/timestamp.h"
#include "mapping/options/quoted_text.h"

namespace efm {

std::vector<TimedFile> timedFilesIn(const std::filesystem::path& list) {
  std::ifstream file(list);
  if (!file) throw std::runtime_error("cannot read " + list.string());
  std::vector<TimedFile> files;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream fields(line.substr(0, line.find('#')));
    std::string time;
    std::string name;
    if (!(fields >> time)) continue;
    const auto t_ns = parseSeconds(time);
    if (!t_ns || !(fields >> name)) {
      throw std::runtime_error(list.string() + ":" + std::to_string(number) + ": " +
                               inQuotes(line) + ": expected a time in seconds and a file");
    }
    files.push_back({*t_ns, list.parent_path() / name});
  }
  return files;
}

}  // namespace efm

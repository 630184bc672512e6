// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

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

namespace {

namespace fs = std::filesystem;

/// <t>/depth.tiff
std::vector<TimedFile> keyframesOf(const fs::path& folder) {
  std::vector<TimedFile> maps;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto t_ns = parseSeconds(entry.path().filename().string());
    const fs::path file = entry.path() / "depth.tiff";
    if (t_ns && fs::exists(file)) maps.push_back({*t_ns, file});
  }
  return maps;
}

std::vector<TimedFile> listedIn(const fs::path& index) {
  std::vector<TimedFile> maps = timedFilesIn(index);
  if (maps.empty()) throw std::runtime_error(index.string() + " lists no depth maps");
  return maps;
}

/// The time in a name like "1.25.tiff" or "cam0_1.25.tiff".
std::optional<std::int64_t> timeInName(const fs::path& file) {
  const std::set<std::string> extensions = {".tiff", ".tif", ".pfm", ".npy", ".png"};
  if (extensions.count(file.extension().string()) == 0) return std::nullopt;
  const std::string stem = file.stem().string();
  return parseSeconds(stem.substr(stem.rfind('_') + 1));
}

std::vector<TimedFile> namedIn(const fs::path& folder) {
  std::vector<TimedFile> maps;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (const auto t_ns = timeInName(entry.path())) maps.push_back({*t_ns, entry.path()});
  }
  return maps;
}

std::vector<TimedFile> keyframesIn(const fs::path& folder) {
  return keyframesOf(fs::is_directory(folder / "keyframes") ? folder / "keyframes" : folder);
}

std::vector<TimedFile> indexIn(const fs::path& folder) {
  for (const fs::path& index : {folder / "depth" / "index.txt", folder / "index.txt"}) {
    if (fs::exists(index)) return listedIn(index);
  }
  return {};
}

}  // namespace

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
      throw std::runtime_error(fmt::format("{}:{}: {}: expected a time in seconds and a file",
                                           list.string(), number, inQuotes(line)));
    }
    files.push_back({*t_ns, list.parent_path() / name});
  }
  return files;
}

std::vector<TimedFile> depthSeries(const fs::path& folder, DepthSeriesRole role) {
  const bool truth = role == DepthSeriesRole::kTruth;
  std::vector<TimedFile> maps = truth ? indexIn(folder) : keyframesIn(folder);
  if (maps.empty()) maps = truth ? keyframesIn(folder) : indexIn(folder);
  if (maps.empty()) maps = namedIn(folder);
  if (maps.empty()) {
    throw std::runtime_error("no depth maps in " + folder.string() +
                             ": expected keyframes/<t>/depth.tiff, depth/index.txt, index.txt, or "
                             "files with their time as name");
  }
  std::sort(maps.begin(), maps.end(), [](const TimedFile& a, const TimedFile& b) {
    return a.t_ns != b.t_ns ? a.t_ns < b.t_ns : a.file < b.file;
  });
  return maps;
}

const TimedFile* nearestFile(const std::vector<TimedFile>& series, std::int64_t t_ns,
                             std::int64_t within_ns) {
  const TimedFile* best = nullptr;
  const auto consider = [&](const TimedFile& file) {
    const std::int64_t off_ns = std::abs(file.t_ns - t_ns);
    if (off_ns <= within_ns && (!best || off_ns < std::abs(best->t_ns - t_ns))) best = &file;
  };
  const auto after = std::lower_bound(
      series.begin(), series.end(), t_ns,
      [](const TimedFile& file, std::int64_t time_ns) { return file.t_ns < time_ns; });
  if (after != series.begin()) consider(*(after - 1));
  if (after != series.end()) consider(*after);
  return best;
}

}  // namespace efm

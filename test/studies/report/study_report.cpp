// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/report/study_report.h"

#include <fstream>
#include <stdexcept>
#include <utility>

namespace efm::studies {
namespace {

constexpr const char* kMarker = "<!-- study ";
constexpr const char* kMarkerEnd = " -->";

constexpr const char* kPreface =
    "# Studies\n"
    "\n"
    "The experiments of Ghosh and Gallego 2022 (\"Multi-Event-Camera Depth Estimation and Outlier\n"
    "Rejection by Refocused Events Fusion\"), repeated with this project's implementation.\n"
    "The events are simulated and have an exact truth. Where the paper has real recordings, the "
    "rigs\n"
    "and trajectories are real. `test/studies/run.sh` writes this file and measures every number "
    "in\n"
    "a table without a cited source.\n"
    "\n"
    "**How to read the tables.** Errors are over the points of all windows together. A pixel's\n"
    "truth is the best within one pixel: an edge may fall on the far background. *own*: at the "
    "pixels\n"
    "of each method. *common*: at the pixels of all methods of the table. *equal*: at equal "
    "numbers of\n"
    "pixels, the min number of all methods in each window; a method's pixels with the highest "
    "local\n"
    "contrast count. A rule that keeps more, harder pixels looks worse at its own pixels.\n"
    "\n"
    "**Settings** of a study by default: 100 planes even in inverse depth, one\n"
    "sub-interval, harmonic mean across cameras, adaptive Gaussian threshold of 5x5 with C = 5,\n"
    "confidence normalised by a robust maximum over the sequence (95th percentile of the windows'\n"
    "maxima), median of 5x5, the plane's own depth without interpolation, the reference view in\n"
    "the middle of the window.\n"
    "\n"
    "**Trends** are judged by the program: *agrees* or *departs*. The reason of a departure "
    "follows.\n"
    "Scenes and settings were not tuned to agree.\n"
    "\n";

}  // namespace

StudyReport::StudyReport(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream stream(file_);
  std::string* section = nullptr;
  for (std::string line; std::getline(stream, line);) {
    if (line.rfind(kMarker, 0) == 0) {
      const std::size_t begin = std::string(kMarker).size();
      section = &sections_[line.substr(begin, line.find(kMarkerEnd) - begin)];
    } else if (section != nullptr) {
      *section += line + "\n";
    }
  }
}

void StudyReport::replace(const std::string& study, const StudySection& section) {
  sections_[study] = "## " + section.title() + "\n\n" + section.markdown();
}

void StudyReport::write(const std::vector<std::string>& order) const {
  std::ofstream stream(file_);
  stream << kPreface;
  for (const std::string& study : order) {
    const auto section = sections_.find(study);
    if (section == sections_.end()) continue;
    std::string text = section->second;
    while (!text.empty() && text.back() == '\n') text.pop_back();
    stream << kMarker << study << kMarkerEnd << "\n" << text << "\n\n";
  }
  stream.close();
  if (!stream) throw std::runtime_error(file_.string() + ": cannot be written");
}

}  // namespace efm::studies

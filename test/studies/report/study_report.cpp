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
    "# Studies\n\n"
    "The experiments of Ghosh and Gallego 2022 (\"Multi-Event-Camera Depth Estimation and Outlier\n"
    "Rejection by Refocused Events Fusion\"), made again with this project's own implementation:\n"
    "on simulated events with exact truth, of real rigs on real trajectories where the paper has\n"
    "real recordings. This file is made by `test/studies/run.sh`; every number in a table was\n"
    "measured by it, but where a source is cited.\n\n"
    "**How to read the tables.** Errors are over the points of all windows together. A pixel's\n"
    "truth is the best within one pixel: an edge may fall on the far background. *own*: each "
    "method\n"
    "on the pixels that it chose. *common*: on the pixels that all methods of the table chose.\n"
    "*equal*: on as many as the method with the fewest has in each window, of the method's own\n"
    "those that stand out most. A rule that keeps more, harder pixels looks worse on its own.\n\n"
    "**Settings**, where a study does not say otherwise: 100 planes even in inverse depth, one\n"
    "sub-interval, harmonic mean across cameras, adaptive Gaussian threshold of 5x5 with C = 5,\n"
    "confidence normalised by a robust maximum over the sequence (95th percentile of the windows'\n"
    "maxima), median of 5x5, the plane's own depth without interpolation, the reference view in\n"
    "the middle of the window.\n\n"
    "**Trends** are judged by the program that measured them: *agrees* or *departs*. Where they\n"
    "depart, the reason follows; scenes and settings were not tuned to agree.\n\n";

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

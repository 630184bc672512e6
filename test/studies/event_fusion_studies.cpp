// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/paths.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/report/study_report.h"
#include "test/studies/studies.h"

namespace {

namespace fs = std::filesystem;
using namespace efm::studies;  // NOLINT(google-build-using-namespace)

constexpr int kSkipped = 77;  // as ctest wants it

struct Study {
  const char* name;
  const char* title;
  void (*run)(const StudyRun&, StudySection&);
};

/// In the order of the report.
constexpr Study kStudies[] = {
    {"fusion_functions", "1. Fusion functions across cameras", studyFusionFunctions},
    {"algorithms", "2. Comparison of algorithms", studyAlgorithms},
    {"subintervals", "3. Temporal fusion", studySubintervals},
    {"driving", "4. Driving", studyDriving},
    {"resolution", "5. Resolution", studyResolution},
    {"contrast_threshold", "6. Contrast threshold", studyContrastThreshold},
    {"three_cameras", "7. Three cameras", studyThreeCameras},
    {"runtime", "8. Runtime and complexity", studyRuntime},
    {"convergence", "9. Convergence over time", studyConvergence},
    {"pose_accuracy", "10. Accuracy of the poses", studyPoseAccuracy},
    {"slider", "11. The real slider", studySlider},
    {"better_depth", "12. Depth better than the paper's", studyBetterDepth},
    {"motion", "13. Motion corrected inside the keyframe", studyMotionCorrection},
    {"refinement", "14. Poses refined, the map corrected", studyRefinement},
};

constexpr const char* kUsage =
    "usage: event_fusion_studies [--quick] --out DIR --cache DIR [--data DIR] [NAME ...]\n"
    "Runs the studies (all where none is named) and writes DIR/studies.md and DIR/studies/*.png.\n"
    "Simulated events are kept in the cache. Names:";

std::string usage() {
  std::string text = kUsage;
  for (const Study& study : kStudies) text += std::string(" ") + study.name;
  return text;
}

struct Arguments {
  bool quick = false;
  fs::path out;
  fs::path cache;
  fs::path data = EFM_SHARED_DATA;
  std::vector<std::string> names;  // empty: all

  bool asksFor(const Study& study) const {
    return names.empty() || std::find(names.begin(), names.end(), study.name) != names.end();
  }
};

Arguments readArguments(const std::vector<std::string>& words) {
  Arguments arguments;
  for (auto word = words.begin(); word != words.end(); ++word) {
    const auto value = [&] {
      if (word + 1 == words.end()) throw std::invalid_argument(*word + ": expected a value");
      return *++word;
    };
    const auto is_it = [&](const Study& study) { return *word == study.name; };
    if (*word == "--quick") {
      arguments.quick = true;
    } else if (*word == "--out") {
      arguments.out = value();
    } else if (*word == "--cache") {
      arguments.cache = value();
    } else if (*word == "--data") {
      arguments.data = value();
    } else if (std::any_of(std::begin(kStudies), std::end(kStudies), is_it)) {
      arguments.names.push_back(*word);
    } else {
      throw std::invalid_argument(*word + " is not known\n" + usage());
    }
  }
  if (arguments.out.empty() || arguments.cache.empty()) throw std::invalid_argument(usage());
  return arguments;
}

/// @return how many studies lacked their data.
int runStudies(const Arguments& arguments) {
  const fs::path pictures = arguments.out / "studies";
  fs::create_directories(pictures);
  RecordingCache recordings(arguments.cache);
  const StudyRun run{arguments.quick, arguments.data, pictures, &recordings};
  StudyReport report(arguments.out / "studies.md");
  std::vector<std::string> order;
  for (const Study& study : kStudies) order.emplace_back(study.name);

  int lacking = 0;
  for (const Study& study : kStudies) {
    if (!arguments.asksFor(study)) continue;
    std::cout << study.title << std::endl;
    const auto began = std::chrono::steady_clock::now();
    StudySection section(study.title, pictures);
    try {
      study.run(run, section);
    } catch (const MissingData& error) {
      std::cout << "  skipped: " << error.what() << '\n';
      ++lacking;
      continue;
    }
    if (section.markdown().empty()) throw std::logic_error(std::string(study.name) + ": is empty");
    report.replace(study.name, section);
    report.write(order);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    std::cout << "  took " << took.count() << " s" << std::endl;
  }
  return lacking;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return runStudies(readArguments({argv + 1, argv + argc})) > 0 ? kSkipped : 0;
  } catch (const std::exception& error) {
    std::cerr << "event_fusion_studies: " << error.what() << '\n';
    return 1;
  }
}

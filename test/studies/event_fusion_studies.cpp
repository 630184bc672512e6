// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
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

constexpr int kSkipped = 77;  // ctest's status of a skipped test

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
    {"automatic", "15. Options chosen from the data", studyAutomatic},
};

struct Arguments {
  bool quick = false;
  std::string out;
  std::string cache;
  std::string data = EFM_SHARED_DATA;
  std::vector<std::string> names;  ///< Of studies; empty for all.
};

/// @return the number of studies without their data.
int runStudies(const Arguments& arguments) {
  const fs::path out = arguments.out;
  const fs::path pictures = out / "studies";
  fs::create_directories(pictures);
  RecordingCache recordings(arguments.cache);
  const StudyRun run{arguments.quick, arguments.data, pictures, &recordings};
  StudyReport report(out / "studies.md");
  std::vector<std::string> order;
  for (const Study& study : kStudies) order.emplace_back(study.name);

  const auto& names = arguments.names.empty() ? order : arguments.names;
  int skipped = 0;
  for (const Study& study : kStudies) {
    if (std::find(names.begin(), names.end(), study.name) == names.end()) continue;
    std::cout << study.title << std::endl;
    const auto began = std::chrono::steady_clock::now();
    StudySection section(study.title, pictures);
    try {
      study.run(run, section);
    } catch (const MissingData& error) {
      std::cout << "  skipped: " << error.what() << '\n';
      ++skipped;
      continue;
    }
    if (section.markdown().empty()) throw std::logic_error(std::string(study.name) + ": is empty");
    report.replace(study.name, section);
    report.write(order);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    std::cout << "  took " << took.count() << " s" << std::endl;
  }
  return skipped;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<std::string> known;
    for (const Study& study : kStudies) known.emplace_back(study.name);
    Arguments arguments;
    CLI::App app("Runs the studies and writes DIR/studies.md and DIR/studies/*.png");
    app.add_flag("--quick", arguments.quick, "tiny: tests that every study runs");
    app.add_option("--out", arguments.out, "DIR")->required();
    app.add_option("--cache", arguments.cache, "folder of simulated events")->required();
    app.add_option("--data", arguments.data, "folder of real recordings");
    app.add_option("names", arguments.names, "studies; all by default")
        ->check(CLI::IsMember(known));
    CLI11_PARSE(app, argc, argv);
    return runStudies(arguments) > 0 ? kSkipped : 0;
  } catch (const std::exception& error) {
    std::cerr << "event_fusion_studies: " << error.what() << '\n';
    return 1;
  }
}

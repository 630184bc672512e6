// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/stereo_baseline.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "mapping/geometry/rig.h"
#include "plugin/recordings/calibration/calibration_formats.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

/// The file of that name in a folder or in one of `levels` folders above it.
std::optional<fs::path> fileAtOrAbove(const fs::path& path, const std::string& name, int levels) {
  fs::path folder = fs::absolute(path).lexically_normal();
  for (int level = 0; level <= levels; ++level) {
    if (fs::is_regular_file(folder / name)) return folder / name;
    folder = folder.parent_path();
  }
  return std::nullopt;
}

/// Nothing if the file is not the report of a run.
std::optional<StereoBaseline> fromReport(const fs::path& file) {
  std::ifstream stream(file);
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  if (!report.is_object() || !report.contains("reference_view")) return std::nullopt;
  const auto& view = report["reference_view"];
  if (!view.is_object() || !view.contains("fx") || !view["fx"].is_number()) return std::nullopt;
  if (!report.contains("baseline_m") || !report["baseline_m"].is_number()) return std::nullopt;
  return StereoBaseline{view["fx"], report["baseline_m"], file.string()};
}

std::optional<StereoBaseline> fromCamchain(const fs::path& file) {
  const Rig rig = readCamchain(file);
  if (rig.cameras.size() < 2) return std::nullopt;
  return StereoBaseline{rig.cameras[0].model.fx, rig.cameras[1].T_rig_cam.translation.norm(),
                        file.string()};
}

bool isUsable(const StereoBaseline& stereo) { return stereo.focal_px > 0 && stereo.baseline_m > 0; }

}  // namespace

std::optional<StereoBaseline> findStereoBaseline(const fs::path& estimate, const fs::path& truth) {
  if (const auto report = fileAtOrAbove(estimate, "report.json", 3)) {
    auto stereo = fromReport(*report);
    if (stereo && isUsable(*stereo)) return stereo;
  }
  if (const auto camchain = fileAtOrAbove(truth, "camchain.yaml", 2)) {
    auto stereo = fromCamchain(*camchain);
    if (stereo && isUsable(*stereo)) return stereo;
  }
  return std::nullopt;
}

}  // namespace efm

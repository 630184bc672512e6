// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/stereo_baseline.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "mapping/geometry/rig.h"
#include "plugin/calibration/camchain.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

/// The file of that name in a path's folder or in one of so many above it.
std::optional<fs::path> fileAtOrAbove(const fs::path& path, const std::string& name, int above) {
  fs::path folder = fs::absolute(path).lexically_normal();
  for (int level = 0; level <= above; ++level) {
    if (fs::is_regular_file(folder / name)) return folder / name;
    folder = folder.parent_path();
  }
  return std::nullopt;
}

/// Of a run's report; other files of that name say nothing.
std::optional<StereoBase> fromReport(const fs::path& file) {
  std::ifstream stream(file);
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  if (!report.is_object() || !report.contains("reference_view")) return std::nullopt;
  const auto& view = report["reference_view"];
  if (!view.is_object() || !view.contains("fx") || !view["fx"].is_number()) return std::nullopt;
  if (!report.contains("baseline_m") || !report["baseline_m"].is_number()) return std::nullopt;
  return StereoBase{view["fx"], report["baseline_m"], file.string()};
}

std::optional<StereoBase> fromCamchain(const fs::path& file) {
  const Rig rig = readCamchain(file);
  if (rig.cameras.size() < 2) return std::nullopt;
  return StereoBase{rig.cameras[0].model.fx, rig.cameras[1].T_rig_cam.translation.norm(),
                    file.string()};
}

bool isUsable(const StereoBase& base) { return base.focal_px > 0 && base.baseline_m > 0; }

}  // namespace

std::optional<StereoBase> findStereoBase(const fs::path& estimate, const fs::path& truth) {
  if (const auto report = fileAtOrAbove(estimate, "report.json", 3)) {
    auto base = fromReport(*report);
    if (base && isUsable(*base)) return base;
  }
  if (const auto camchain = fileAtOrAbove(truth, "camchain.yaml", 2)) {
    auto base = fromCamchain(*camchain);
    if (base && isUsable(*base)) return base;
  }
  return std::nullopt;
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
// Mistakes about the calibration and the command line.

#include "test/integration/mistakes.h"

namespace efm {
namespace {

using Draft = DraftRecording;

std::function<void(Draft&)> camchain(const std::string& part, const std::string& by) {
  return [part, by](Draft& draft) { draft.replaceInCamchain(part, by); };
}

constexpr auto kNoChange = [](Draft&) {};

}  // namespace

std::vector<Mistake> calibrationMistakes() {
  return {
      {"a baseline of 90 m",
       camchain("-0.10000000000000001", "-90"),
       {"warning: baseline: cameras 0 and 1 are 90 m apart",
        "warning: no-points: the map has no point", "error: the map has no point", "…"}},
      {"a baseline of 0.1 mm",
       camchain("-0.10000000000000001", "-0.0001"),
       {"warning: depths-disagree: the depths from the cameras of the rig and those from the "
        "motion of one camera agree within 15 % in ~35 % of the pixels",
        "warning: baseline: cameras 0 and 1 are 0.0001 m apart",
        "warning: depths-at-limit: ~13 % of the depths lie at the nearest plane, ~0.55 m"}},
      {"a focal length in millimetres",
       camchain("[226, 226", "[4, 4"),
       {"warning: focal-length: camera #: a focal length of 4 px and 346 columns are a field of "
        "view of 177 degrees"}},
      {"a focal length of another resolution",
       camchain("[226, 226", "[22600, 22600"),
       {"warning: focal-length: camera #: a focal length of 22600 px and 346 columns are a field "
        "of view of 0.877 degrees",
        "warning: no-points: the map has no point", "error: the map has no point", "…"}},
      {"a larger resolution",
       camchain("[346, 260]", "[1280, 720]"),
       {"warning: principal-point: camera #: the principal point (173, 130) lies outside the "
        "middle half of the 1280x720 pixels",
        "warning: sensor-area: camera # has events in columns 0 to 345 of 0 to 1279 and rows 0 to "
        "259 of 0 to 719 alone"}},
      {"the resolution with its sides swapped",
       camchain("[346, 260]", "[260, 346]"),
       {"error: data/cam0/events.txt:2: x = '276': expected a whole number from 0 to 259 (the "
        "sensor has 260x346 pixels; are x and y in this order, and is the resolution right?"}},
      {"coefficients of a lens that cannot be inverted",
       [](Draft& draft) {
         draft.replaceInCamchain("distortion_coeffs: []", "distortion_coeffs: [-3, 0, 0, 0]");
         draft.replaceInCamchain("distortion_model: none", "distortion_model: radtan");
       },
       {"warning: lens: camera #: the lens model has no viewing ray for 91 % of the pixels",
        "warning: outside-lens: 181426 of 197617 events of camera 0 were not used",
        "warning: outside-lens: 181552 of 196643 events of camera 1 were not used"}},
      {"a calibration of one camera, in the folder",
       [](Draft& draft) { draft.camchain.resize(draft.camchain.find("cam1:")); },
       {"error: data/camchain.yaml: 1 cameras: expected 2"}},
  };
}

std::vector<Mistake> commandMistakes() {
  return {
      {"depth limits in front of the scene",
       kNoChange,
       {"warning: depths-at-limit: ~31 % of the depths lie at the farthest plane, 1 m"},
       "--set dsi.min_depth_m=0.2 --set dsi.max_depth_m=1"},
      {"depth limits behind the scene",
       kNoChange,
       {"warning: rotation-only: the poses move by at most 0.0912863 m and 1.42 degrees within a "
        "window",
        "warning: no-points: the map has no point", "error: the map has no point"},
       "--set dsi.min_depth_m=40 --set dsi.max_depth_m=80"},
      {"a warning that counts as an error",
       [](Draft& draft) { draft.events[1].clear(); },
       {"warning: silent-camera: camera 1 has no event",
        "warning: silent-keyframes: camera 1 had no event in 2 of 2 keyframes",
        "warning: no-points: the map has no point",
        "error: 3 warnings, and --strict makes them errors", "error: the map has no point"},
       "--strict"},
  };
}

}  // namespace efm

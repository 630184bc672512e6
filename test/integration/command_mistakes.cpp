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
       "",
       kJobError,
       {"warning: baseline: cameras 0 and 1 are 90 m apart"}},
      {"a baseline of 0.1 mm",
       camchain("-0.10000000000000001", "-0.0001"),
       "",
       kFine,
       {"warning: baseline:"}},
      {"a focal length in millimetres",
       camchain("[226, 226", "[4, 4"),
       "",
       kFine,
       {"warning: focal-length: camera 0", "warning: focal-length: camera 1"}},
      {"a focal length of another resolution",
       camchain("[226, 226", "[22600, 22600"),
       "",
       kJobError,
       {"warning: focal-length:"}},
      {"a larger resolution",
       camchain("[346, 260]", "[1280, 720]"),
       "",
       kFine,
       {"warning: principal-point:"}},
      {"the resolution with its sides swapped",
       camchain("[346, 260]", "[260, 346]"),
       "",
       kJobError,
       {"cam0/events.txt:", "the sensor has 260x346 pixels", "is the resolution right?"}},
      {"coefficients of a lens that cannot be inverted",
       [](Draft& draft) {
         draft.replaceInCamchain("distortion_coeffs: []", "distortion_coeffs: [-3, 0, 0, 0]");
         draft.replaceInCamchain("distortion_model: none", "distortion_model: radtan");
       },
       "",
       kFine,
       {"warning: lens:", "warning: outside-lens:"}},
      {"a calibration of one camera, in the folder",
       [](Draft& draft) { draft.camchain.resize(draft.camchain.find("cam1:")); },
       "",
       kJobError,
       {"camchain.yaml: 1 cameras: expected 2"}},
      {"a calibration of one camera, as an option",
       [](Draft& draft) {
         draft.files["one.yaml"] = draft.camchain.substr(0, draft.camchain.find("cam1:"));
       },
       "--calibration data/one.yaml",
       kJobError,
       {"one.yaml: 1 camera, but the recording has"}},
  };
}

std::vector<Mistake> commandMistakes() {
  return {
      {"depth limits in front of the scene",
       kNoChange,
       "--set dsi.min_depth_m=0.2 --set dsi.max_depth_m=1",
       kFine,
       {"warning: depths-at-limit:"}},
      {"depth limits behind the scene",
       kNoChange,
       "--set dsi.min_depth_m=40 --set dsi.max_depth_m=80",
       kJobError,
       {"warning: no-points:", "error: the map has no point"}},
      {"a folder with other files",
       file("../out/thesis.tex", "\\section{}"),
       "",
       kJobError,
       {"out: holds other files", "--force"}},
      {"a mistyped key", kNoChange, "--set dsi.num_plane=50", kUsageError, {"num_planes"}},
      {"a recording that is not there",
       kNoChange,
       "more_data",
       kJobError,
       {"more_data: no such file or folder"}},
      {"a warning that counts as an error",
       [](Draft& draft) { draft.events[1].clear(); },
       "--strict",
       kJobError,
       {"warning: silent-camera:", "--strict makes them errors"}},
  };
}

}  // namespace efm

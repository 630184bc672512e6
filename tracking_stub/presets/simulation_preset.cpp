// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/simulation_preset.h"

#include <string_view>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/presets/presets.h"

namespace efm {
namespace {

using MakePreset = Simulation (*)(std::uint64_t seed);

constexpr NamedChoice<MakePreset> kPresets[] = {
    {makeDeskStereo, "desk_stereo"}, {makeDriveStereo, "drive_stereo"},
    {makeHdStereo, "hd_stereo"},     {makePolesStereo, "poles_stereo"},
    {makeRoomStereo, "room_stereo"}, {makeSlider, "slider"},
    {makeTrinocular, "trinocular"},
};

}  // namespace

void SimulationOptions::validate() const {
  try {
    valueIn(kPresets, preset);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("preset: ") + error.what());
  }
  if (duration_s) {
    requireOption(*duration_s >= 0.001 && *duration_s <= 600, "duration_s", *duration_s,
                  "0.001 to 600");
  }
}

std::vector<std::string> simulationPresets() {
  std::vector<std::string> names;
  for (const auto& preset : kPresets) names.emplace_back(preset.name);
  return names;
}

Simulation makeSimulation(const SimulationOptions& options) {
  options.validate();
  Simulation simulation = valueIn(kPresets, options.preset)(options.seed);
  if (options.duration_s) simulation.duration_ns = durationFromSeconds(*options.duration_s);
  return simulation;
}

}  // namespace efm

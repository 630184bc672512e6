// SPDX-License-Identifier: BSD-3-Clause
// Experiments on arrays: simulated recordings with their exact truth, and single windows.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "mapping/base/atomic_file.h"
#include "mapping/depth/peak_fit.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "plugin/options/tracker_fault_keys.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/event_fusion_options.h"
#include "tracking_stub/faults/tracker_faults.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/rendering/frame_renderer.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using Times = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

SimulationRun runWith(const OnProgress& on_progress) {
  SimulationRun run;
  run.progress = [calls = ProgressCalls(on_progress)](double fraction) mutable {
    checkSignals();
    calls("simulating", fraction);
  };
  return run;
}

void record(const Simulation& simulation, const std::filesystem::path& out,
            const OnProgress& on_progress) {
  NewFolder folder(out);  // reports errors before the simulation runs
  writeDataset(folder.temporary(), simulation, simulateEvents(simulation, runWith(on_progress)),
               checkSignals);
  folder.finish();
}

/// Returns the events of each camera, and the surface points that they saw; NaN for noise.
py::list simulatedEvents(const Simulation& simulation, const OnProgress& on_progress) {
  std::vector<CameraRecording> recordings;
  {
    const Released released;
    recordings = simulateEvents(simulation, runWith(on_progress));
  }
  py::list all;
  for (const CameraRecording& recording : recordings) {
    py::array_t<float> points({static_cast<py::ssize_t>(recording.sources.size()), py::ssize_t{3}});
    float* next = points.mutable_data();
    for (const SurfacePoint& source : recording.sources) {
      Eigen::Map<Eigen::Vector3f> point(next);
      point.setConstant(std::numeric_limits<float>::quiet_NaN());
      if (source.surface >= 0) point = simulation.scene.pointAt(source).cast<float>();
      next += 3;
    }
    all.append(py::make_tuple(recordsOf(recording.events), points));
  }
  return all;
}

py::tuple posesAt(const Simulation& simulation, const Times& times_ns) {
  std::vector<StampedPose> poses;
  for (py::ssize_t i = 0; i < times_ns.size(); ++i) {
    poses.push_back({times_ns.at(i), simulation.motion->poseAt(times_ns.at(i))});
  }
  return posesOf(poses);
}

py::array depthFrom(const Simulation& simulation, const Array& T_world_ref, const Array& K_array,
                    std::pair<int, int> size) {
  const auto K = matrixOf<Matrix3>(K_array, "K");
  const ReferenceView view{size.first, size.second, K(0, 0), K(1, 1), K(0, 2), K(1, 2)};
  const Rigid3 pose = rigidOf(T_world_ref, "T_world_ref");
  cv::Mat1f depth;
  {
    const Released released;
    depth = renderDepth(simulation.scene, pose, view);
  }
  return imageOf(depth);
}

/// Returns the rectangles of a scene (n, 3, 3): a corner and the vectors of both edges, metres.
py::array_t<double> surfacesOf(const Simulation& simulation) {
  const py::ssize_t count = simulation.scene.size();
  py::array_t<double> surfaces({count, py::ssize_t{3}, py::ssize_t{3}});
  for (int i = 0; i < count; ++i) {
    const Rectangle& rectangle = simulation.scene.rectangle(i);
    Matrix3 rows;
    rows << rectangle.corner.transpose(), (rectangle.width_m * rectangle.axis_u).transpose(),
        (rectangle.height_m * rectangle.axis_v).transpose();
    Eigen::Map<Matrix3>(surfaces.mutable_data(i)) = rows;
  }
  return surfaces;
}

/// The recorded arrays of a rig: inputs of windows. Events are on the clock of the poses.
struct RigArrays {
  Rig rig;
  std::vector<std::vector<Event>> events;
  std::vector<StampedPose> poses;

  std::vector<EventSpan> eventsIn(const Window& window) const {
    std::vector<EventSpan> spans;
    for (const EventSpan of_camera : events) {
      spans.push_back(of_camera.between(window.t0_ns, window.t1_ns));
    }
    return spans;
  }
};

RigArrays rigArraysOf(const std::vector<RigCamera>& cameras, const std::vector<EventArray>& events,
                      const Times& times_ns, const Array& T_world_rig) {
  if (events.size() != cameras.size()) {
    throw std::invalid_argument("events: " + std::to_string(events.size()) +
                                " arrays: expected one per camera, " +
                                std::to_string(cameras.size()));
  }
  RigArrays arrays{{cameras}, {}, stampedPoses(times_ns, T_world_rig)};
  for (std::size_t camera = 0; camera < events.size(); ++camera) {
    std::vector<Event>& all = arrays.events.emplace_back(eventsOf(events[camera]));
    requirePossible(all, static_cast<int>(camera), cameras[camera]);
    for (Event& event : all) event.t_ns += cameras[camera].time_offset_ns;
    const auto earlier = [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; };
    if (!std::is_sorted(all.begin(), all.end(), earlier)) {
      throw std::invalid_argument("events of camera " + std::to_string(camera) +
                                  ": expected the order of time");
    }
  }
  return arrays;
}

using KeyframePointer = std::shared_ptr<const Keyframe>;

std::vector<KeyframePointer> mapOnce(const RigArrays& arrays, const std::vector<Window>& windows,
                                     const FusionMapperOptions& options) {
  std::vector<int> cameras = options.cameras;
  for (std::size_t i = 0; options.cameras.empty() && i < arrays.rig.cameras.size(); ++i) {
    cameras.push_back(static_cast<int>(i));
  }
  Trajectory trajectory(options.trajectory);
  for (const StampedPose& pose : arrays.poses) trajectory.add(pose);
  KeyframeMapper mapper(arrays.rig, cameras, options.keyframe);
  std::vector<KeyframePointer> keyframes;
  for (const Window& window : windows) {
    checkSignals();
    auto keyframe = mapper.map(window, arrays.eventsIn(window), trajectory);
    if (!keyframe) {
      throw std::invalid_argument("t_ref = " + std::to_string(window.t_ref_ns) +
                                  ": the poses have none at this time, nanoseconds");
    }
    keyframes.push_back(std::make_shared<const Keyframe>(std::move(*keyframe)));
  }
  return keyframes;
}

/// Maps windows of arrays. With the white level of the sequence, a first pass finds it.
std::vector<KeyframePointer> mapWindows(const RigArrays& arrays, const std::vector<Window>& windows,
                                        const Options& given) {
  const EventFusionOptions values = given.values();
  if (values.automatic.min_depth_m || values.automatic.max_depth_m) {
    throw std::invalid_argument(
        "dsi.min_depth_m, dsi.max_depth_m: expected both: windows alone do not tell the depths");
  }
  FusionMapperOptions options = mapperOptions(values);
  std::vector<KeyframePointer> keyframes = mapOnce(arrays, windows, options);
  if (options.keyframe.extraction.max_confidence.level != WhiteLevel::kSequence) return keyframes;
  RobustMaximum maximum;
  for (const KeyframePointer& keyframe : keyframes) maximum.add(keyframe->max_confidence);
  options.keyframe.sequence_maximum = maximum.value();
  return mapOnce(arrays, windows, options);
}

/// Moves poses as `--perturb` does.
py::tuple perturbed(const Times& times_ns, const Array& T_world_rig,
                    const std::vector<std::string>& assignments, const RigCamera& camera) {
  TrackerFaults faults;
  for (const std::string& assignment : assignments) setTrackerFault(assignment, faults);
  faults.perturbation.tick_ns = kTickNs;
  faults.process.T_body_cam = camera.T_rig_cam;
  faults.validate();
  return posesOf(withFaults(stampedPoses(times_ns, T_world_rig), faults));
}

}  // namespace

void defineExperiments(py::module_& module) {
  py::class_<Simulation>(module, "Simulation")
      .def(py::init([](const std::string& preset, const std::string& scene,
                       const std::vector<RigCamera>& cameras, const Times& times_ns,
                       const Array& T_world_cam0, std::optional<std::int64_t> start_ns,
                       std::optional<double> duration_s, std::uint64_t seed,
                       std::optional<double> threshold, double mismatch, double refractory_us,
                       double noise_hz, double hot_fraction, double hot_hz) {
        return makeSimulation({preset, duration_s, seed, scene,
                               stampedPoses(times_ns, T_world_cam0), cameras, start_ns, threshold,
                               threshold, mismatch, refractory_us,
                               EventNoiseOptions{noise_hz, hot_fraction, hot_hz}});
      }))
      .def_property_readonly("cameras", [](const Simulation& s) { return s.rig.cameras; })
      .def_property_readonly("start_ns", [](const Simulation& s) { return s.start_ns; })
      .def_property_readonly("end_ns", &Simulation::endNs)
      .def_property_readonly("surfaces", &surfacesOf)
      .def("poses", &posesAt)
      .def("depth", &depthFrom)
      .def("events", &simulatedEvents)
      .def("record", &record, py::call_guard<Released>());
  py::class_<RigArrays>(module, "RigArrays").def(py::init(&rigArraysOf));
  module.def("keyframes", [](const RigArrays& arrays,
                             const std::vector<std::array<std::int64_t, 3>>& times_ns,
                             const Options& options) {
    const Released released;
    std::vector<Window> windows;
    for (const auto& [t0_ns, t1_ns, t_ref_ns] : times_ns) {
      if (t1_ns <= t0_ns) {
        throw std::invalid_argument("a window [" + std::to_string(t0_ns) + ", " +
                                    std::to_string(t1_ns) + ") ns: expected t1 above t0");
      }
      windows.push_back({t0_ns, t1_ns, t_ref_ns});
    }
    return mapWindows(arrays, windows, options);
  });
  module.def("simulation_presets", &simulationPresets);
  module.def("perturbed", &perturbed);
  module.def("read_calibration",
             [](const std::filesystem::path& file) { return readCalibration(file).rig.cameras; });
  module.def("format_calibration",
             [](const std::vector<RigCamera>& cameras) { return formatCamchain({cameras}); });
  module.def("read_pose_file", [](const std::filesystem::path& file, const std::string& unit) {
    ReaderOptions options;
    options.pose_time_unit = unit;
    return posesOf(readPoses(file, options));
  });
}

}  // namespace efm

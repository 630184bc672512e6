// SPDX-License-Identifier: BSD-3-Clause
// Whole recordings: mapped, evaluated and simulated as the program does.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "arrays.h"
#include "mapping/depth/aggregated_extraction.h"
#include "plugin/engine/host_text.h"
#include "plugin/evaluation/cloud_evaluation.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/evaluation/trajectory_evaluation.h"
#include "plugin/playback/map_job.h"
#include "plugin/playback/recording_info.h"
#include "plugin/playback/session_export.h"
#include "plugin/session_file/session_file.h"

namespace efm {
namespace {

using StopFlag = std::atomic<bool>;
MapJob jobOf(const RecordingSource& source, const Options& options, const OnKeyframe& on_keyframe,
             const OnProgress& on_progress) {
  MapJob job = MapJob::of(source, options);
  job.on_keyframe = [on_keyframe](const Keyframe& keyframe, const RecordingKeyframes&) {
    give(keyframe, on_keyframe);
  };
  job.on_progress = ProgressCalls(on_progress);
  return job;
}

MapResult mapRecordingInto(const RecordingSource& source, const Options& options,
                           const std::filesystem::path& out, bool force, bool resume,
                           const std::shared_ptr<StopFlag>& stop, const OnKeyframe& on_keyframe,
                           const OnProgress& on_progress) {
  MapJob job = jobOf(source, options, on_keyframe, on_progress);
  job.out = out;
  job.force = force;
  job.resume = resume;
  job.needs_map = true;
  job.stop = [stop] { return stop->load(); };
  return mapInto(std::move(job));
}

/// The DSI of a window, its depths and its keyframe.
struct WindowDsi {
  std::vector<float> values;  // planes, rows, columns
  cv::Size size;
  int num_planes = 0;
  std::mutex mutex;

  void addPlane(int plane, int planes, const cv::Mat1f& from) {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      size = from.size();
      num_planes = planes;
      values.resize(static_cast<std::size_t>(planes) * from.total());
    }
    std::memcpy(&values[static_cast<std::size_t>(plane) * from.total()], from.ptr(),
                from.total() * sizeof(float));
  }
};

/// A window [t0, t1) to map.
struct WindowTimes {
  std::int64_t t0_ns, t1_ns;
  std::optional<std::int64_t> t_ref_ns;
};

/// Maps one window. @param prepare changes the job before it runs.
template <typename Prepare>
std::pair<std::shared_ptr<const Keyframe>, MapResult> mapWindow(const RecordingSource& source,
                                                                const Options& options,
                                                                const WindowTimes& times,
                                                                const OnProgress& on_progress,
                                                                const Prepare& prepare) {
  const Released released;
  std::shared_ptr<const Keyframe> made;
  MapJob job = jobOf(source, options, nullptr, on_progress);
  FusionMapperOptions& mapper = job.options.mapper;
  mapper.only_window = windowOf(times.t0_ns, times.t1_ns, mapper.policy.reference);
  if (times.t_ref_ns) mapper.only_window->t_ref_ns = *times.t_ref_ns;
  job.options.mapper.validate();
  job.on_keyframe = [&](const Keyframe& keyframe, const RecordingKeyframes&) {
    made = std::make_shared<const Keyframe>(keyframe);
  };
  prepare(job);
  MapResult result = mapWindowInto(std::move(job));
  result.rejectError();
  return {std::move(made), std::move(result)};
}

py::tuple mapDsi(const RecordingSource& source, const Options& options, std::int64_t t0_ns,
                 std::int64_t t1_ns, std::optional<std::int64_t> t_ref_ns,
                 const OnProgress& on_progress) {
  auto dsi = std::make_shared<WindowDsi>();
  const auto caller = std::this_thread::get_id();
  const auto [made, result] =
      mapWindow(source, options, {t0_ns, t1_ns, t_ref_ns}, on_progress, [&](MapJob& job) {
        job.on_dsi_plane = [&](int plane, int planes, const cv::Mat1f& values) {
          dsi->addPlane(plane, planes, values);
          if (std::this_thread::get_id() == caller) checkSignals();
        };
      });
  const DepthPlanes planes(result.report.options.mapper.keyframe.planes);
  py::array_t<double> depths(planes.size());
  for (int plane = 0; plane < planes.size(); ++plane)
    depths.mutable_at(plane) = planes.depth(plane);
  const py::ssize_t row = dsi->size.width * py::ssize_t{sizeof(float)};
  const py::array values = sharedArray(
      py::dtype::of<float>(), {dsi->num_planes, dsi->size.height, dsi->size.width},
      {row * dsi->size.height, row, py::ssize_t{sizeof(float)}}, dsi->values.data(), dsi);
  cv::Mat1f largest = cv::Mat1f::zeros(dsi->size);
  for (int plane = 0; plane < dsi->num_planes; ++plane) {
    const cv::Mat1f of(largest.rows, largest.cols,
                       &dsi->values[static_cast<std::size_t>(plane) * largest.total()]);
    largest = cv::max(largest, of);
  }
  const int window = result.report.options.mapper.keyframe.extraction.threshold_kernel;
  return py::make_tuple(values, depths, made, imageOf(localContrast(largest, window)));
}

template <typename Inputs>
py::array evidenceOf(const std::vector<PixelEvidence<Inputs>>& evidence) {
  py::array_t<PixelEvidence<Inputs>> records(static_cast<py::ssize_t>(evidence.size()));
  std::copy(evidence.begin(), evidence.end(), records.mutable_data());
  return records;
}

py::tuple mapCandidates(const RecordingSource& source, const Options& options, std::int64_t t0_ns,
                        std::int64_t t1_ns, std::optional<std::int64_t> t_ref_ns,
                        const OnProgress& on_progress) {
  const auto [made, result] =
      mapWindow(source, options, {t0_ns, t1_ns, t_ref_ns}, on_progress, [](MapJob& job) {
        DepthExtractionOptions& extraction = job.options.mapper.keyframe.extraction;
        if (extraction.extraction != ExtractionMethod::kAggregated) {
          throw std::invalid_argument("depth.extraction: must be aggregated, for candidates");
        }
        extraction.keep_evidence = extraction.neighbours = true;
      });
  const DepthEvidence none;
  const DepthEvidence& evidence = made->map.evidence ? *made->map.evidence : none;
  return py::make_tuple(evidenceOf(evidence.candidates), evidenceOf(evidence.neighbours), made);
}

std::string infoOf(const RecordingSource& source) {
  RecordingInfo info = readInfo(source, [](double) { checkSignals(); });
  if (!info.error.empty()) throw std::runtime_error(info.error);
  info.warnings = hostTexts(std::move(info.warnings), HostFace::kRecording);
  info.notes = hostTexts(std::move(info.notes), HostFace::kRecording);
  return infoJson(info);
}

using Path = std::filesystem::path;

/// Returns times and T_world_ref of the keyframes. @param refined false: by the tracker.
py::object storedPoses(const SessionFile& file, bool refined) {
  std::vector<StampedPose> poses;
  {
    const Released released;
    poses = file.poses(refined);
  }
  return posesOf(poses);
}

/// @param box x0 y0 z0 x1 y1 z1. @param T_first_this of further sessions: matrices.
std::unique_ptr<SessionMap> sessionMapOf(std::vector<Path> sessions, std::vector<std::string> sets,
                                         std::optional<std::int64_t> t0_ns,
                                         std::optional<std::int64_t> t1_ns,
                                         const std::optional<std::vector<double>>& box,
                                         bool refined, const Path& poses,
                                         const std::vector<Array>& T_first_this, bool registers) {
  SessionExport what;
  what.sessions = std::move(sessions);
  what.sets = std::move(sets);
  what.limits = {t0_ns, t1_ns};
  what.refined = refined;
  what.poses = poses;
  what.registers = registers;
  what.on_progress = [](double) { checkSignals(); };
  for (const Array& T : T_first_this) what.T_first_this.emplace_back(rigidOf(T, "transforms"));
  if (box) what.box = Box::of(*box);
  const Released released;
  return std::make_unique<SessionMap>(std::move(what));
}

py::list registrationsOf(const SessionMap& map) {
  py::list all;
  for (const MapRegistration& found : map.registrations()) {
    py::dict one;
    one["T_first_this"] = arrayOf(matrixOf(*map.what().T_first_this[all.size()]));
    one["moved_m"] = found.moved_m;
    one["moved_deg"] = found.moved_rad / kRadiansPerDegree;
    one["sigma_m"] = found.sigma_m;
    one["sigma_deg"] = found.sigma_rad / kRadiansPerDegree;
    one["pairs"] = found.pairs;
    one["checked"] = found.checked;
    all.append(one);
  }
  return all;
}

py::array sessionPoints(const SessionMap& map) {
  MapSnapshot made;
  {
    const Released released;
    made = map.snapshot(false);
  }
  return pointsOf(*made.points);
}

void exportMap(const SessionMap& map, const Path& out) {
  requireMapFile(out, map.what());
  exportSession(map, out);
}

std::string depthErrorJson(const Path& estimate, const Path& truth, int tolerance_px,
                           std::optional<double> max_depth_m, std::optional<double> png_scale,
                           const Path& mask, const std::vector<double>& thresholds_m,
                           std::optional<double> focal_baseline) {
  DepthEvaluationOptions options;
  options.pairing.tolerance_px = tolerance_px;
  if (max_depth_m) options.pairing.max_depth_m = *max_depth_m;
  options.png_scale = png_scale;
  options.mask = mask;
  if (!thresholds_m.empty()) options.thresholds_m = thresholds_m;
  std::optional<StereoBaseline> stereo;
  if (!focal_baseline) stereo = findStereoBaseline(estimate, truth);
  if (stereo) focal_baseline = stereo->focal_px * stereo->baseline_m;
  options.focal_baseline = focal_baseline;
  return evaluationJson(evaluateDepth(estimate, truth, options), stereo);
}

std::string cloudErrorJson(const Path& estimate, const Path& truth, bool align, const Path& to_find,
                           const std::vector<double>& distances_m) {
  CloudEvaluationOptions options;
  options.align = align;
  options.to_find = to_find;
  if (!distances_m.empty()) options.distances_m = distances_m;
  return evaluationJson(evaluateCloud(estimate, truth, options));
}

std::string trajectoryErrorJson(const Path& estimate, const Path& truth,
                                const std::string& alignment, double max_difference_s,
                                const std::string& estimate_unit, const std::string& truth_unit) {
  TrajectoryEvaluationOptions options;
  options.estimate_time_unit = estimate_unit;
  options.truth_time_unit = truth_unit;
  options.alignment = valueIn(kTrajectoryAlignments, alignment);
  options.max_difference_s = max_difference_s;
  return evaluationJson(evaluateTrajectory(estimate, truth, options));
}

/// Returns the true depth map of a folder that is nearest to a time, at most 1 ms away.
py::array trueDepth(const Path& folder, std::int64_t t_ns) {
  const std::vector<TimedFile> series = depthSeries(folder, DepthSeriesRole::kTruth);
  const TimedFile* nearest = nearestFile(series, t_ns, kSameTimeNs);
  if (nearest == nullptr) {
    throw std::runtime_error(folder.string() + ": none of its " + std::to_string(series.size()) +
                             " depth maps is within 1 ms of t = " + std::to_string(t_ns) + " ns");
  }
  return imageOf(readDepthFile(nearest->file));
}

void writePoses(const Path& file, const py::array_t<std::int64_t>& times_ns,
                const Array& T_world_rig) {
  writeTumTrajectory(file, stampedPoses(times_ns, T_world_rig));
}

}  // namespace

void defineJobs(py::module_& module) {
  const py::call_guard<Released> releases;
  py::class_<StopFlag, std::shared_ptr<StopFlag>>(module, "StopFlag")
      .def(py::init([] { return std::make_shared<StopFlag>(false); }))
      .def("set", [](StopFlag& flag) { flag = true; });
  py::class_<MapResult>(module, "MapResult")
      .def_property_readonly("points", [](const MapResult& r) { return pointsOf(*r.map->points); })
      .def(
          "hash", [](const MapResult& r) { return mapHash(*r.map->points); }, releases)
      .def_property_readonly("trajectory",
                             [](const MapResult& r) { return posesOf(r.map->trajectory); })
      .def_property_readonly("tracker_trajectory",
                             [](const MapResult& r) { return posesOf(r.map->tracker_trajectory); })
      .def_property_readonly("report",
                             [](const MapResult& r) {
                               return r.complete_before.empty() ? reportJson(r.report)
                                                                : r.complete_before;
                             })
      .def(
          "save", [](const MapResult& r, const Path& file) { savePoints(*r.map, file); }, releases)
      .def("reject_error", &MapResult::rejectError);
  module.def("run_map", &mapRecordingInto, releases);
  py::class_<SessionFile>(module, "SessionFile")
      .def(py::init<const Path&>(), releases)
      .def_property_readonly("keyframes", &SessionFile::keyframes)
      .def(
          "keyframe",
          [](const SessionFile& f, std::size_t i) {
            return std::make_shared<Keyframe>(f.keyframe(i));
          },
          releases)
      .def("poses", &storedPoses)
      .def_property_readonly("run", [](const SessionFile& f) { return f.run().dump(); })
      .def_property_readonly("report", &SessionFile::report)
      .def_property_readonly("damage", &SessionFile::damage);
  py::class_<SessionMap>(module, "SessionMap")
      .def(py::init(&sessionMapOf))
      .def("points", &sessionPoints)
      .def("export", &exportMap, releases)
      .def("store_poses", &SessionMap::storePoses, releases)
      .def_property_readonly("registrations", &registrationsOf);
  module.def("run_dsi", &mapDsi);
  PYBIND11_NUMPY_DTYPE_EX(PixelEvidence<CandidateInputs>, x, "x", y, "y", depth_m, "depth", sigma_m,
                          "sigma", probability, "probability", inputs, "inputs");
  PYBIND11_NUMPY_DTYPE_EX(PixelEvidence<NeighbourInputs>, x, "x", y, "y", depth_m, "depth", sigma_m,
                          "sigma", probability, "probability", inputs, "inputs");
  module.def("run_candidates", &mapCandidates);
  module.def("read_info", &infoOf, releases);
  module.def("true_depth", &trueDepth);
  module.def("write_poses", &writePoses);
  module.def("depth_errors", &depthErrorJson, releases);
  module.def("map_errors", &cloudErrorJson, releases);
  module.def("trajectory_errors", &trajectoryErrorJson, releases);
}

}  // namespace efm

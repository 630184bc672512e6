// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/engine/mapper_driver.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"
#include "plugin/engine/host_text.h"
#include "plugin/engine/live_mapper.h"
#include "plugin/engine/playback_mapper.h"
#include "plugin/session_file/run_record.h"

namespace efm {
namespace {

std::vector<float> depthsIn(const cv::Mat1f& depth) {
  std::vector<float> depths_m;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(depths_m),
               [](float depth_m) { return depth_m > 0; });
  return depths_m;
}

/// Returns why an ended input made no keyframe. @return std::nullopt if it made one.
std::optional<Warning> noKeyframe(const SessionStatus& state, const FusionMapperOptions& options) {
  if (state.counts.keyframes > 0) return std::nullopt;
  return Warning{"no-keyframe",
                 fmt::format("there is no keyframe: {}", whyNoKeyframe(state, options).what())};
}

/// Gives the file of an earlier session another name: NAME.1, NAME.2, …
void keepEarlier(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return;
  int number = 1;
  while (std::filesystem::exists(fmt::format("{}.{}", file.string(), number))) ++number;
  std::filesystem::rename(file, fmt::format("{}.{}", file.string(), number));
}

}  // namespace

std::shared_ptr<MapperDriver> MapperDriver::make(const EventFusionOptions& options,
                                                 Callbacks callbacks,
                                                 const std::vector<StoredKeyframe>& earlier,
                                                 QualityFacts facts) {
  if (options.live.enabled) {
    return LiveMapper::make(options, std::move(callbacks), earlier, std::move(facts));
  }
  return std::make_shared<PlaybackMapper>(options, std::move(callbacks), earlier, std::move(facts));
}

std::shared_ptr<MapperDriver> MapperDriver::forHost(const EventFusionOptions& options,
                                                    Callbacks callbacks,
                                                    const std::vector<StoredKeyframe>& earlier) {
  for (auto* log : {&callbacks.warn, &callbacks.info}) {
    if (!*log) continue;
    *log = [log = std::move(*log)](const std::string& text) {
      log(hostText(text, HostFace::kMapper));
    };
  }
  return efm::forHost(HostFace::kMapper,
                      [&] { return make(options, std::move(callbacks), earlier); });
}

MapperDriver::MapperDriver(const EventFusionOptions& options, Callbacks callbacks,
                           const std::vector<StoredKeyframe>& earlier, QualityFacts facts,
                           ChoiceBy choice_by)
    : options_(options),
      callbacks_(std::move(callbacks)),
      setup_(readRigSetup(options.rig.calibration, options.rig.hand_eye)),
      session_(options, earlier, std::move(facts), choice_by),
      earlier_(earlier.size()),
      statistics_(statisticsOptions(options)) {
  if (!options.session || options.session_file.empty()) return;
  const std::filesystem::path folder =
      std::filesystem::absolute(options.session_file).parent_path();
  if (!std::filesystem::is_directory(folder)) {
    throw std::runtime_error(fmt::format("[output] session_file {}: there is no folder {}",
                                         options.session_file.string(), folder.string()));
  }
  if (std::filesystem::exists(options.session_file) &&
      !std::filesystem::is_regular_file(options.session_file)) {
    throw std::runtime_error(fmt::format("[output] session_file {}: expected the name of a file",
                                         options.session_file.string()));
  }
}

// --- Input ---

int MapperDriver::addCamera(const RigCamera& camera) {
  camera.validate();
  const std::lock_guard<std::mutex> lock(cameras_mutex_);
  if (rig_is_fixed_) throw std::logic_error("a camera was added after the first events");
  given_rig_.cameras.push_back(camera);
  return static_cast<int>(given_rig_.cameras.size()) - 1;
}

void MapperDriver::addCameras(const Rig& rig) {
  const std::lock_guard<std::mutex> lock(cameras_mutex_);
  if (!given_rig_.cameras.empty()) {
    const std::vector<RigCamera>& given = given_rig_.cameras;
    if (!std::equal(given.begin(), given.end(), rig.cameras.begin(), rig.cameras.end(),
                    [](const RigCamera& a, const RigCamera& b) { return isSame(a, b); })) {
      throw std::invalid_argument("the cameras differ from those that were added before");
    }
  }
  if (!rig_is_fixed_) fixRig(rig);
}

/// Gives the cameras to the session. @throws std::invalid_argument if they do not fit the options.
void MapperDriver::fixRig(const Rig& given) {
  const Rig rig = calibrated(given, setup_, options_.rig.time_offsets_ns);
  requireMappable(rig, options_);
  useRig(rig);
  given_rig_ = given;
  rig_is_fixed_ = true;
  const std::lock_guard<std::mutex> lock(copies_mutex_);
  statistics_.setCameras(rig, {});
}

void MapperDriver::addEvents(int camera, std::vector<Event> events,
                             std::optional<std::int64_t> complete_until_ns) {
  {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    if (static_cast<std::size_t>(camera) >= given_rig_.cameras.size()) {
      throw std::invalid_argument(
          fmt::format("events of camera {}: there are {} cameras: expected a camera that was added",
                      camera, given_rig_.cameras.size()));
    }
    if (!rig_is_fixed_) fixRig(given_rig_);
  }
  useEvents(camera, std::move(events), complete_until_ns);
}

void MapperDriver::add(Sample sample) {
  if (auto* const packet = std::get_if<EventPacket>(&sample)) {
    {
      const std::lock_guard<std::mutex> lock(cameras_mutex_);
      if (!rig_is_fixed_ || std::size_t(packet->camera) >= given_rig_.cameras.size()) {
        throw std::invalid_argument(
            fmt::format("a packet of camera {}: expected addCameras(recording.rig()) before it",
                        packet->camera));
      }
    }
    usePacket(std::move(*packet));
  } else if (auto* const pose = std::get_if<PoseSample>(&sample)) {
    if (setup_.T_body_rig) pose->T_body_rig = *setup_.T_body_rig;
    usePose(std::move(*pose));
  }
}

void MapperDriver::setSink(DsiSink* sink) {
  const std::lock_guard<std::mutex> lock(copies_mutex_);
  sink_ = sink;
}

// --- Mapping ---

void MapperDriver::feed(Input input) {
  std::optional<PoseSample> pose;
  if (const auto* const of_tracker = std::get_if<PoseSample>(&input)) pose = *of_tracker;
  session_.add(std::move(input));
  if (!pose) return;
  const std::lock_guard<std::mutex> lock(copies_mutex_);
  statistics_.addPose(*pose);
}

std::optional<KeyframeDepthMap> MapperDriver::mapWindow() {
  DsiSink* sink = nullptr;
  {
    const std::lock_guard<std::mutex> lock(copies_mutex_);
    sink = sink_;
  }
  std::optional<KeyframeDepthMap> keyframe = session_.next(sink);
  if (!keyframe) return keyframe;
  const std::lock_guard<std::mutex> lock(copies_mutex_);
  newest_depth_ = keyframe->map.depth;
  pixel_sizes_.add(depthsIn(keyframe->map.depth), keyframe->view.fx);
  newest_planes_ = keyframe->planes;
  return keyframe;
}

// --- The session file ---

template <typename Write>
void MapperDriver::writeStored(const Write& write) {
  if (!options_.session || options_.session_file.empty() || store_failed_) return;
  try {
    write();
  } catch (...) {
    store_failed_ = true;
    stored_.reset();
    throw;
  }
}

void MapperDriver::store(const KeyframeDepthMap& keyframe) {
  writeStored([&] {
    if (!stored_) {
      nlohmann::ordered_json run = runOf(options_);
      const SessionStatus status = session_.status();
      addChosen(run, status.rig, session_.options(), status.chosen);
      keepEarlier(options_.session_file);
      stored_ = std::make_unique<SessionWriter>(options_.session_file, run);
    }
    stored_->add(keyframe);
  });
}

void MapperDriver::endStored() {
  writeStored([&] {
    if (!stored_) return;
    const auto map = session_.snapshot(true);
    const SessionStatus status = session_.status();
    if (status.refinement) {
      const auto first = map->trajectory.begin() + static_cast<std::ptrdiff_t>(earlier_);
      stored_->addPoses({first, map->trajectory.end()});
    }
    stored_->finish(nlohmann::ordered_json{{"version", EFM_VERSION},
                                           {"keyframes", status.counts.keyframes},
                                           {"points", map->points->size()},
                                           {"map_hash", mapHash(*map->points)},
                                           {"quality",
                                            {{"word", std::string(nameOf(status.quality.word))},
                                             {"wrong_share", status.quality.wrong_share},
                                             {"reasons", status.quality.reasons}}}}
                        .dump(2));
    stored_.reset();
  });
}

// --- Results ---

std::pair<cv::Mat1f, DepthPlanesOptions> MapperDriver::newestDepth() const {
  const std::lock_guard<std::mutex> lock(copies_mutex_);
  return {newest_depth_, newest_planes_};
}

SessionStatus MapperDriver::statusForHost() const {
  SessionStatus status = this->status();
  status.pose_warnings = hostTexts(std::move(status.pose_warnings), HostFace::kMapper);
  status.pose_notes = hostTexts(std::move(status.pose_notes), HostFace::kMapper);
  if (status.live) status.live->last_error = hostText(status.live->last_error, HostFace::kMapper);
  return status;
}

std::vector<Warning> MapperDriver::warnings() {
  const bool ended = hasEnded();
  const EventFusionOptions used = usedOptions();
  const FusionMapperOptions& options = used.mapper;
  const SessionStatus state = status();
  PixelSizes pixels;
  RecordingStatistics statistics;
  {
    const std::lock_guard<std::mutex> lock(copies_mutex_);
    pixels = pixel_sizes_;
    statistics = statistics_;
  }
  Findings findings{statistics, {}};
  describeInput(findings.read);
  findings.use(options.keyframe.planes, state.chosen);
  findings.max_pose_gap_s = options.trajectory.max_pose_gap_s;
  findings.checks = options_.checks;
  findings.session = &state;
  findings.options = &options;
  findings.voxel_size_m = used.cloud.voxel_size_m;
  if (ended) findings.pixels = &pixels;
  std::vector<Warning> warnings = warningsOf(findings);
  double reach_m = 4 * options.keyframe.planes.max_depth_m;  // of points around the keyframes
  const auto map = newest(false);
  for (const StampedPose& pose : map->trajectory) {
    reach_m = std::max(reach_m, pose.T_world_rig.translation.cwiseAbs().maxCoeff() +
                                    4 * options.keyframe.planes.max_depth_m);
  }
  if (ended && coarseStepAt(reach_m, findings.voxel_size_m)) {  // only then is the map exported
    if (auto far = farPointsWarning(*newest(true)->points, findings.voxel_size_m)) {
      warnings.push_back(std::move(*far));
    }
  }
  const auto no_keyframe = ended ? noKeyframe(state, options) : std::nullopt;
  if (no_keyframe) warnings.insert(warnings.begin(), *no_keyframe);
  return warnings;
}

std::vector<std::string> MapperDriver::warningsOfSilence(const KeyframeDepthMap& keyframe) {
  std::vector<std::string> warnings;
  for (const int camera : keyframe.silent_cameras) {
    if (!silent_cameras_.insert(camera).second) continue;
    warnings.push_back(fmt::format("camera {} had no event for the keyframe at {} s", camera,
                                   formatSeconds(keyframe.window.t_ref_ns)));
  }
  return warnings;
}

MapperDriver::News MapperDriver::takeNews() {
  News news;
  if (std::exchange(told_news_, session_.news()) == session_.news()) return news;
  SessionStatus status = session_.status();
  const bool is_first_blur = status.counts.motion.corrected > 0 && !std::exchange(blur_told_, true);
  if (is_first_blur) {
    news.blur = status;
    news.options = session_.options();
  }
  if (std::exchange(told_choices_, status.choices) != status.choices) {
    news.choice = std::move(status);
  }
  return news;
}

void MapperDriver::tell(const News& news, const Say& say) const {
  if (news.blur) say(callbacks_.info, motionText(*news.blur, news.options.mapper));
  if (!news.choice) return;
  const SessionStatus& status = *news.choice;
  say(callbacks_.info, choiceText(status));
  for (const Warning& note : status.pose_notes) say(callbacks_.info, note.name + ": " + note.text);
  std::vector<Warning> warnings = status.pose_warnings;
  if (status.scene_unknown && status.events && status.poses) warnings.push_back(noSceneWarning());
  for (const Warning& warning : warnings) say(callbacks_.warn, warning.name + ": " + warning.text);
}

void MapperDriver::tellOfEnd(const Say& say) {
  if (const auto warning = noKeyframe(status(), usedOptions().mapper)) {
    say(callbacks_.warn, warning->name + ": " + warning->text);
  }
  for (const Warning& warning : warnings()) {
    if (warning.name == "poses-blur" || warning.name == "far-coordinates" ||
        warning.name == "voxel-size" || warning.name == "skipped-events" ||
        warning.name == "skipped-poses") {
      say(callbacks_.warn, warning.name + ": " + warning.text);
    }
  }
  const MapQuality quality = status().quality;
  if (quality.word == QualityWord::kUnknown) return;
  say(callbacks_.info, "quality: " + textOf(quality));
}

}  // namespace efm

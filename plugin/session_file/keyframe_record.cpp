// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session_file/keyframe_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/recordings/writers/mcap_file.h"

namespace efm {
namespace {

/// The fields of /efm/keyframe: numbers, texts and lists of numbers. A list of a value that may be
/// unknown has no element or one.
struct KeyframeRecord {
  std::int64_t t0_ns = 0, t1_ns = 0, t_ref_ns = 0;
  std::array<double, 7> T_world_ref{}, T_odom_ref{}, T_rig_ref{};
  std::uint32_t width = 0, height = 0;
  std::array<double, 4> intrinsics{};
  double min_depth_m = 0, max_depth_m = 0;
  std::uint32_t num_planes = 0;
  std::string spacing;
  double parallax_px_m = 0, max_confidence = 0;
  double knot_spacing_s = 0;
  std::uint32_t reference_knot = 0;
  std::vector<double> knots, expected_walk;
  std::vector<double> blur_px;
  double sharpness_gain = 1;
  std::vector<double> watched_blurs;
  std::int32_t since_look = 0;
  std::vector<double> pose_noise;
  std::uint8_t after_stop = 0;
  std::vector<std::uint64_t> events;
  std::uint64_t without_pose = 0, outside_lens = 0, over_budget = 0;
  std::array<std::uint64_t, 4> votes{};
  std::vector<std::int32_t> silent_cameras;
  std::uint64_t silent_subintervals = 0;
  std::array<std::uint64_t, 5> pixels{};
  std::vector<std::int32_t> map_camera;
  std::vector<std::uint32_t> map_points;
  std::vector<std::uint16_t> u, v;
  std::vector<float> depth_m, confidence, variance, probability;
  std::uint8_t has_events = 0;
  std::vector<std::uint16_t> event_u, event_v, negative_events, positive_events;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("t0_ns", self.t0_ns, "the window is [t0, t1)");
    visit("t1_ns", self.t1_ns);
    visit("t_ref_ns", self.t_ref_ns, "time of the poses");
    visit("t_world_ref", self.T_world_ref, "x y z qx qy qz qw: p_world = T_world_ref * p_ref");
    visit("t_odom_ref", self.T_odom_ref, "by the tracker; T_world_ref may be refined");
    visit("t_rig_ref", self.T_rig_ref);
    visit("width", self.width, "of the view, pixels");
    visit("height", self.height);
    visit("intrinsics", self.intrinsics, "fx fy cx cy, pixels");
    visit("min_depth_m", self.min_depth_m, "of the depth planes");
    visit("max_depth_m", self.max_depth_m);
    visit("num_planes", self.num_planes);
    visit("spacing", self.spacing, "inverse or linear");
    visit("parallax_px_m", self.parallax_px_m, "pixels per 1/m");
    visit("max_confidence", self.max_confidence);
    visit("knot_spacing_s", self.knot_spacing_s, "correction of the motion in the window");
    visit("reference_knot", self.reference_knot);
    visit("knots", self.knots, "six each: metres, then a rotation vector; none: no correction");
    visit("expected_walk", self.expected_walk, "m and rad per root of a second");
    visit("blur_px", self.blur_px, "by the poses; none: not known");
    visit("sharpness_gain", self.sharpness_gain, "by the correction");
    visit("watched_blurs", self.watched_blurs, "of earlier windows, the newest first");
    visit("since_look", self.since_look, "windows since the last of them");
    visit("pose_noise", self.pose_noise, "stated by the tracker: m, rad; none: not stated");
    visit("after_stop", self.after_stop, "1: made after the run was stopped");
    visit("events", self.events, "that voted, per camera");
    visit("without_pose", self.without_pose);
    visit("outside_lens", self.outside_lens);
    visit("over_budget", self.over_budget);
    visit("votes", self.votes, "cast, interpolated, outside the view, behind the camera");
    visit("silent_cameras", self.silent_cameras);
    visit("silent_subintervals", self.silent_subintervals);
    visit("pixels", self.pixels, "candidates, nearest, farthest, ambiguous, neighbours");
    visit("map_camera", self.map_camera, "of each depth map; -1: all cameras fused");
    visit("map_points", self.map_points, "number of points of each depth map");
    visit("u", self.u, "column of each point, one depth map after the other");
    visit("v", self.v, "row");
    visit("depth_m", self.depth_m, "along the view's z axis");
    visit("confidence", self.confidence);
    visit("variance", self.variance, "of inverse depth, 1/m^2");
    visit("probability", self.probability, "that the depth is within 10 %; none: not known");
    visit("has_events", self.has_events, "1: the events for pictures are known");
    visit("event_u", self.event_u, "pixels with events of the reference camera near t_ref");
    visit("event_v", self.event_v);
    visit("negative_events", self.negative_events);
    visit("positive_events", self.positive_events);
  }
};

template <typename Field>
struct ListOf : std::false_type {};
template <typename Number>
struct ListOf<std::vector<Number>> : std::true_type {};
template <typename Field>
struct ArrayOf : std::false_type {};
template <typename Number, std::size_t Size>
struct ArrayOf<std::array<Number, Size>> : std::true_type {};

template <typename Field>
std::string typeName() {
  if constexpr (std::is_same_v<Field, std::string>) {
    return "string";
  } else if constexpr (ListOf<Field>::value) {
    return typeName<typename Field::value_type>() + "[]";
  } else if constexpr (ArrayOf<Field>::value) {
    return fmt::format("{}[{}]", typeName<typename Field::value_type>(), std::tuple_size_v<Field>);
  } else {
    const char* kind = std::is_floating_point_v<Field> ? "float"
                       : std::is_signed_v<Field>       ? "int"
                                                       : "uint";
    return fmt::format("{}{}", kind, 8 * sizeof(Field));
  }
}

ByteReader bodyOf(std::string_view message) {
  ByteReader body(reinterpret_cast<const std::uint8_t*>(message.data()), message.size());
  body.take(4);  // CDR's header: little-endian
  body.alignFromHere();
  return body;
}

std::string takeText(ByteReader& body) {
  const auto size = body.number<std::uint32_t>();
  return std::string(body.text(size).substr(0, size > 0 ? size - 1 : 0));
}

template <typename Field>
void take(ByteReader& body, Field& field) {
  if constexpr (std::is_same_v<Field, std::string>) {
    field = takeText(body);
  } else if constexpr (std::is_arithmetic_v<Field>) {
    field = body.number<Field>();
  } else {
    if constexpr (ListOf<Field>::value) {
      using Number = typename Field::value_type;
      const auto size = body.number<std::uint32_t>();
      if (size > body.remaining() / sizeof(Number)) {
        throw std::runtime_error(fmt::format("{} numbers: expected at most {}", size,
                                             body.remaining() / sizeof(Number)));
      }
      field.resize(size);
    }
    for (auto& number : field) number = body.number<std::decay_t<decltype(number)>>();
  }
}

std::array<double, 7> numbersOf(const Rigid3& T) {
  const Eigen::Vector3d& p = T.translation;
  const Eigen::Quaterniond& q = T.rotation;
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

Rigid3 rigidOf(const std::array<double, 7>& n) {
  return {Eigen::Quaterniond(n[6], n[3], n[4], n[5]), {n[0], n[1], n[2]}};
}

void addMap(int camera, const DepthMap& map, KeyframeRecord& record) {
  const std::size_t before = record.u.size();
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth(y, x) > 0)) continue;
      record.u.push_back(static_cast<std::uint16_t>(x));
      record.v.push_back(static_cast<std::uint16_t>(y));
      record.depth_m.push_back(map.depth(y, x));
      record.confidence.push_back(map.confidence(y, x));
      record.variance.push_back(map.variance(y, x));
      if (!map.probability.empty()) record.probability.push_back(map.probability(y, x));
    }
  }
  record.map_camera.push_back(camera);
  record.map_points.push_back(static_cast<std::uint32_t>(record.u.size() - before));
}

DepthMap mapOf(const KeyframeRecord& record, std::size_t begin, std::size_t end) {
  DepthMap map;
  const cv::Size size(static_cast<int>(record.width), static_cast<int>(record.height));
  const bool has_probability = !record.probability.empty() || record.u.empty();
  for (cv::Mat1f* image : {&map.depth, &map.confidence, &map.variance, &map.probability}) {
    if (image != &map.probability || has_probability) *image = cv::Mat1f::zeros(size);
  }
  for (std::size_t i = begin; i < end; ++i) {
    const cv::Point pixel(record.u[i], record.v[i]);
    if (pixel.x >= size.width || pixel.y >= size.height) {
      throw std::runtime_error(fmt::format("a point at pixel ({}, {}): expected it in {} x {}",
                                           pixel.x, pixel.y, size.width, size.height));
    }
    map.depth(pixel) = record.depth_m[i];
    map.confidence(pixel) = record.confidence[i];
    map.variance(pixel) = record.variance[i];
    if (has_probability) map.probability(pixel) = record.probability[i];
  }
  return map;
}

/// @throws std::runtime_error if lists that belong together differ in length.
void requireAgreement(const KeyframeRecord& record) {
  std::size_t points = 0;
  for (const std::uint32_t count : record.map_points) points += count;
  const std::size_t probabilities = record.probability.empty() ? points : record.probability.size();
  const std::size_t events = record.event_u.size();
  for (const std::size_t size : {record.u.size(), record.v.size(), record.depth_m.size(),
                                 record.confidence.size(), record.variance.size(), probabilities}) {
    if (size != points) {
      throw std::runtime_error(fmt::format("a list of {} points: expected {}", size, points));
    }
  }
  const bool is_whole =
      !record.map_points.empty() && record.map_camera.size() == record.map_points.size() &&
      record.event_v.size() == events && record.negative_events.size() == events &&
      record.positive_events.size() == events && record.knots.size() % 6 == 0 &&
      record.expected_walk.size() == (record.knots.empty() ? 0 : 2) &&
      (record.pose_noise.empty() || record.pose_noise.size() == 2);
  constexpr std::uint32_t kMaxSide = std::numeric_limits<std::uint16_t>::max();
  if (!is_whole || record.width > kMaxSide || record.height > kMaxSide) {
    throw std::runtime_error("lists that belong together differ in length");
  }
}

/// The begin of a message: time and frame.
CdrWriter stampedMessage(std::int64_t t_ns, std::string_view frame) {
  return CdrWriter().add(static_cast<std::int32_t>(logTime(t_ns) / kNanosecondsPerSecond),
                         static_cast<std::uint32_t>(logTime(t_ns) % kNanosecondsPerSecond), frame);
}

void addPose(CdrWriter& message, const Rigid3& T) {
  for (const double value : numbersOf(T)) message.add(value);
}

}  // namespace

std::string keyframeSchema() {
  std::string schema;
  KeyframeRecord record;
  KeyframeRecord::fields(record, [&](const char* name, const auto& field, const char* text = "") {
    schema += fmt::format("{} {}{}{}\n", typeName<std::decay_t<decltype(field)>>(), name,
                          *text == '\0' ? "" : "  # ", text);
  });
  return schema;
}

std::string keyframeMessage(const KeyframeDepthMap& keyframe) {
  KeyframeRecord record;
  record.t0_ns = keyframe.window.t0_ns;
  record.t1_ns = keyframe.window.t1_ns;
  record.t_ref_ns = keyframe.window.t_ref_ns;
  record.T_world_ref = numbersOf(keyframe.T_world_ref);
  record.T_odom_ref = numbersOf(keyframe.T_odom_ref);
  record.T_rig_ref = numbersOf(keyframe.T_rig_ref);
  record.width = static_cast<std::uint32_t>(keyframe.view.width);
  record.height = static_cast<std::uint32_t>(keyframe.view.height);
  record.intrinsics = {keyframe.view.fx, keyframe.view.fy, keyframe.view.cx, keyframe.view.cy};
  record.min_depth_m = keyframe.planes.min_depth_m;
  record.max_depth_m = keyframe.planes.max_depth_m;
  record.num_planes = static_cast<std::uint32_t>(keyframe.planes.num_planes);
  record.spacing = nameOf(keyframe.planes.spacing);
  record.parallax_px_m = keyframe.parallax_px_m;
  record.max_confidence = keyframe.max_confidence;
  if (const auto& correction = keyframe.motion_correction) {
    record.knot_spacing_s = correction->spacing_s;
    record.reference_knot = static_cast<std::uint32_t>(correction->reference);
    for (const Vector6d& knot : correction->knots) {
      record.knots.insert(record.knots.end(), knot.data(), knot.data() + knot.size());
    }
    record.expected_walk = {correction->walk_m, correction->walk_rad};
  }
  if (keyframe.blur_px) record.blur_px = {*keyframe.blur_px};
  record.sharpness_gain = keyframe.sharpness_gain;
  record.watched_blurs = keyframe.blur_watch.last_px;
  record.since_look = keyframe.blur_watch.since_look;
  if (const auto& noise = keyframe.pose_noise)
    record.pose_noise = {noise->noise_m, noise->noise_rad};
  record.after_stop = keyframe.after_stop ? 1 : 0;
  record.events = keyframe.events;
  record.without_pose = keyframe.without_pose;
  record.outside_lens = keyframe.outside_lens;
  record.over_budget = keyframe.over_budget;
  const VoteCounts& votes = keyframe.votes;
  record.votes = {votes.cast, votes.interpolated, votes.outside_view, votes.behind_camera};
  record.silent_cameras = keyframe.silent_cameras;
  record.silent_subintervals = keyframe.silent_subintervals;
  const PixelCounts& pixels = keyframe.map.pixels;
  record.pixels = {pixels.candidates, pixels.at_nearest, pixels.at_farthest, pixels.ambiguous,
                   pixels.neighbours};
  constexpr int kAllCameras = -1;
  addMap(kAllCameras, keyframe.map, record);
  for (const CameraDepthMap& of_one : keyframe.camera_maps)
    addMap(of_one.camera, of_one.map, record);
  record.has_events = keyframe.view_events.empty() ? 0 : 1;
  const auto count = [](int events) {
    return static_cast<std::uint16_t>(
        std::min<int>(events, std::numeric_limits<std::uint16_t>::max()));
  };
  for (int y = 0; y < keyframe.view_events.rows; ++y) {
    for (int x = 0; x < keyframe.view_events.cols; ++x) {
      const cv::Vec2i& events = keyframe.view_events(y, x);
      if (events[0] == 0 && events[1] == 0) continue;
      record.event_u.push_back(static_cast<std::uint16_t>(x));
      record.event_v.push_back(static_cast<std::uint16_t>(y));
      record.negative_events.push_back(count(events[0]));
      record.positive_events.push_back(count(events[1]));
    }
  }
  CdrWriter message;
  KeyframeRecord::fields(record, [&](const char*, const auto& field, const char* = "") {
    if constexpr (ArrayOf<std::decay_t<decltype(field)>>::value) {
      for (const auto number : field) message.add(number);
    } else {
      message.add(field);
    }
  });
  return std::move(message.bytes());
}

KeyframeDepthMap keyframeOf(std::string_view message) {
  KeyframeRecord record;
  ByteReader body = bodyOf(message);
  KeyframeRecord::fields(record, [&](const char* name, auto& field, const char* = "") {
    try {
      take(body, field);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("field {}: {}", name, error.what()));
    }
  });
  requireAgreement(record);
  KeyframeDepthMap keyframe;
  keyframe.window = {record.t0_ns, record.t1_ns, record.t_ref_ns};
  keyframe.T_world_ref = rigidOf(record.T_world_ref);
  keyframe.T_odom_ref = rigidOf(record.T_odom_ref);
  keyframe.T_rig_ref = rigidOf(record.T_rig_ref);
  const auto& [fx, fy, cx, cy] = record.intrinsics;
  keyframe.view = {static_cast<int>(record.width), static_cast<int>(record.height), fx, fy, cx, cy};
  keyframe.planes = {record.min_depth_m, record.max_depth_m, static_cast<int>(record.num_planes),
                     fromName<PlaneSpacing>(record.spacing)};
  keyframe.parallax_px_m = record.parallax_px_m;
  keyframe.max_confidence = record.max_confidence;
  if (!record.knots.empty()) {
    MotionCorrection& correction = keyframe.motion_correction.emplace();
    correction.spacing_s = record.knot_spacing_s;
    correction.reference = record.reference_knot;
    for (std::size_t i = 0; i < record.knots.size(); i += 6) {
      correction.knots.emplace_back(Vector6d::Map(record.knots.data() + i));
    }
    correction.walk_m = record.expected_walk[0];
    correction.walk_rad = record.expected_walk[1];
  }
  if (!record.blur_px.empty()) keyframe.blur_px = record.blur_px.front();
  keyframe.sharpness_gain = record.sharpness_gain;
  keyframe.blur_watch.last_px = record.watched_blurs;
  keyframe.blur_watch.since_look = record.since_look;
  if (!record.pose_noise.empty()) {
    keyframe.pose_noise = PoseNoise{record.pose_noise[0], record.pose_noise[1]};
  }
  keyframe.after_stop = record.after_stop != 0;
  keyframe.events = record.events;
  keyframe.without_pose = record.without_pose;
  keyframe.outside_lens = record.outside_lens;
  keyframe.over_budget = record.over_budget;
  const auto& votes = record.votes;
  keyframe.votes = {votes[0], votes[1], votes[2], votes[3]};
  keyframe.silent_cameras = record.silent_cameras;
  keyframe.silent_subintervals = record.silent_subintervals;
  std::size_t end = 0;
  for (std::size_t i = 0; i < record.map_points.size(); ++i) {
    const std::size_t begin = std::exchange(end, end + record.map_points[i]);
    DepthMap map = mapOf(record, begin, end);
    if (i == 0) {
      keyframe.map = std::move(map);
    } else {
      keyframe.camera_maps.push_back({record.map_camera[i], std::move(map)});
    }
  }
  const auto& pixels = record.pixels;
  keyframe.map.pixels = {pixels[0], pixels[1], pixels[2], pixels[3], pixels[4]};
  if (record.has_events == 0) return keyframe;
  keyframe.view_events.create(keyframe.view.height, keyframe.view.width);
  keyframe.view_events = cv::Vec2i();
  for (std::size_t i = 0; i < record.event_u.size(); ++i) {
    const cv::Point pixel(record.event_u[i], record.event_v[i]);
    if (!cv::Rect({}, keyframe.view_events.size()).contains(pixel)) {
      throw std::runtime_error(fmt::format("events at pixel ({}, {})", pixel.x, pixel.y));
    }
    keyframe.view_events(pixel) = {record.negative_events[i], record.positive_events[i]};
  }
  return keyframe;
}

std::uint64_t logTime(std::int64_t t_ns) {
  constexpr std::int64_t kMaxS = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::uint64_t>(
      std::clamp<std::int64_t>(t_ns, 0, kMaxS * kNanosecondsPerSecond));
}

std::string pointsMessage(const KeyframeDepthMap& keyframe) {
  constexpr std::array<const char*, 5> kFields = {"x", "y", "z", "intensity", "sigma_m"};
  constexpr std::uint8_t kFloat32 = 7;
  const std::vector<ViewPoint> points = viewPoints(keyframe);
  CdrWriter message = stampedMessage(keyframe.window.t_ref_ns, "keyframe");
  const auto count = static_cast<std::uint32_t>(points.size());
  message.add(1U, count, static_cast<std::uint32_t>(kFields.size()));
  std::uint32_t step = 0;
  for (const char* name : kFields) {
    message.add(name, step, kFloat32, 1U);
    step += sizeof(float);
  }
  message.add(std::uint8_t{0}, step, step * count, step * count);
  for (const ViewPoint& point : points) {
    for (const float value :
         {point.p_ref.x(), point.p_ref.y(), point.p_ref.z(), point.confidence, point.sigma}) {
      appendLittleEndian(message.bytes(), value);
    }
  }
  message.add(std::uint8_t{1});
  return std::move(message.bytes());
}

std::string poseMessage(const StampedPose& pose) {
  CdrWriter message = stampedMessage(pose.t_ns, "world");
  addPose(message, pose.T_world_rig);
  return std::move(message.bytes());
}

std::string transformMessage(const StampedPose& pose) {
  CdrWriter message;
  message.add(1U, static_cast<std::int32_t>(logTime(pose.t_ns) / kNanosecondsPerSecond),
              static_cast<std::uint32_t>(logTime(pose.t_ns) % kNanosecondsPerSecond), "world",
              "keyframe");
  addPose(message, pose.T_world_rig);
  return std::move(message.bytes());
}

std::string pathMessage(const std::vector<StampedPose>& poses) {
  CdrWriter message = stampedMessage(poses.empty() ? 0 : poses.back().t_ns, "world");
  message.add(static_cast<std::uint32_t>(poses.size()));
  for (const StampedPose& pose : poses) {
    message.add(static_cast<std::int32_t>(logTime(pose.t_ns) / kNanosecondsPerSecond),
                static_cast<std::uint32_t>(logTime(pose.t_ns) % kNanosecondsPerSecond), "world");
    addPose(message, pose.T_world_rig);
  }
  return std::move(message.bytes());
}

std::vector<Rigid3> pathOf(std::string_view message) {
  ByteReader body = bodyOf(message);
  const auto skipHeader = [&] {
    body.number<std::int32_t>();
    body.number<std::uint32_t>();
    takeText(body);
  };
  skipHeader();
  std::vector<Rigid3> poses;
  for (auto left = body.number<std::uint32_t>(); left > 0; --left) {
    std::array<double, 7> numbers{};
    skipHeader();
    take(body, numbers);
    poses.push_back(rigidOf(numbers));
  }
  return poses;
}

std::string textMessage(std::string_view text) { return std::move(CdrWriter().add(text).bytes()); }

std::string messageText(std::string_view message) {
  ByteReader body = bodyOf(message);
  return takeText(body);
}

}  // namespace efm

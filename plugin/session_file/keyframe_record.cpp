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

/// The points of a keyframe's depth maps and its events, as lists.
struct Lists {
  std::vector<std::int32_t> map_camera;
  std::vector<std::uint32_t> map_points;
  std::vector<std::uint16_t> u, v;
  std::vector<float> depth_m, confidence, variance, probability;
  bool has_events = false;
  std::vector<std::uint16_t> event_u, event_v, negative_events, positive_events;
};

/// Calls `visit` with the name, the value and an explanation of each field of /efm/keyframe: the
/// schema, the writer and the reader.
template <typename Keyframe, typename ListsOf, typename Visit>
void visitFields(Keyframe& keyframe, ListsOf& lists, Visit&& visit) {
  visit("t0_ns", keyframe.window.t0_ns, "the window is [t0, t1)");
  visit("t1_ns", keyframe.window.t1_ns);
  visit("t_ref_ns", keyframe.window.t_ref_ns, "time of the poses");
  visit("t_world_ref", keyframe.T_world_ref, "x y z qx qy qz qw: p_world = T_world_ref * p_ref");
  visit("t_odom_ref", keyframe.T_odom_ref, "by the tracker; T_world_ref may be refined");
  visit("t_rig_ref", keyframe.T_rig_ref);
  visit("width", keyframe.view.width, "of the view, pixels");
  visit("height", keyframe.view.height);
  visit("fx", keyframe.view.fx);
  visit("fy", keyframe.view.fy);
  visit("cx", keyframe.view.cx);
  visit("cy", keyframe.view.cy);
  visit("min_depth_m", keyframe.planes.min_depth_m, "of the depth planes");
  visit("max_depth_m", keyframe.planes.max_depth_m);
  visit("num_planes", keyframe.planes.num_planes);
  visit("spacing", keyframe.planes.spacing, "inverse or linear");
  visit("parallax_px_m", keyframe.parallax_px_m, "pixels per 1/m");
  visit("max_confidence", keyframe.max_confidence);
  visit(
      "motion_correction", keyframe.motion_correction,
      "none, or: seconds between knots, number of the knot at t_ref, expected walk (m and rad per "
      "root of a second), then six numbers per knot: metres, rotation vector");
  visit("blur_px", keyframe.blur_px, "by the poses; none: not known");
  visit("sharpness_gain", keyframe.sharpness_gain, "by the correction");
  visit("watched_blurs", keyframe.blur_watch.last_px, "of earlier windows, the newest first");
  visit("since_look", keyframe.blur_watch.since_look, "windows since the last of them");
  visit("pose_noise", keyframe.pose_noise, "stated by the tracker: m, rad; none: not stated");
  visit("after_stop", keyframe.after_stop, "1: made after the run was stopped");
  visit("kernel", keyframe.kernel, "that made it: kernels may round differently");
  visit("events", keyframe.events, "that voted, per camera");
  visit("without_pose", keyframe.without_pose);
  visit("outside_lens", keyframe.outside_lens);
  visit("over_budget", keyframe.over_budget);
  visit("votes_cast", keyframe.votes.cast);
  visit("votes_interpolated", keyframe.votes.interpolated);
  visit("votes_outside_view", keyframe.votes.outside_view);
  visit("votes_behind_camera", keyframe.votes.behind_camera);
  visit("silent_cameras", keyframe.silent_cameras);
  visit("silent_subintervals", keyframe.silent_subintervals);
  visit("candidates", keyframe.map.pixels.candidates, "pixels with contrast");
  visit("at_nearest", keyframe.map.pixels.at_nearest, "of them");
  visit("at_farthest", keyframe.map.pixels.at_farthest);
  visit("ambiguous", keyframe.map.pixels.ambiguous);
  visit("neighbours", keyframe.map.pixels.neighbours, "pixels with a depth beside them");
  visit("map_camera", lists.map_camera, "of each depth map; -1: all cameras fused");
  visit("map_points", lists.map_points, "number of points of each depth map");
  visit("u", lists.u, "column of each point, one depth map after the other");
  visit("v", lists.v, "row");
  visit("depth_m", lists.depth_m, "along the view's z axis");
  visit("confidence", lists.confidence);
  visit("variance", lists.variance, "of inverse depth, 1/m^2");
  visit("probability", lists.probability, "that the depth is within 10 %; none: not known");
  visit("has_events", lists.has_events, "1: the events for pictures are known");
  visit("event_u", lists.event_u, "pixels with events of the reference camera near t_ref");
  visit("event_v", lists.event_v);
  visit("negative_events", lists.negative_events);
  visit("positive_events", lists.positive_events);
}

// A field is a number, a text or a list of numbers. Other types are lists of numbers: `numbersIn`
// and `setNumbers`.

using Numbers = std::vector<double>;

bool setNumbers(const Numbers& numbers, Rigid3& T) {
  if (numbers.size() != 7) return false;
  T = {Eigen::Quaterniond(numbers[6], numbers[3], numbers[4], numbers[5]),
       {numbers[0], numbers[1], numbers[2]}};
  return true;
}

Numbers numbersIn(const std::optional<double>& value) {
  return value ? Numbers{*value} : Numbers();
}
bool setNumbers(const Numbers& numbers, std::optional<double>& value) {
  if (!numbers.empty()) value = numbers.front();
  return numbers.size() < 2;
}

Numbers numbersIn(const std::optional<PoseNoise>& noise) {
  return noise ? Numbers{noise->noise_m, noise->noise_rad} : Numbers();
}
bool setNumbers(const Numbers& numbers, std::optional<PoseNoise>& noise) {
  if (numbers.size() == 2) noise = PoseNoise{numbers[0], numbers[1]};
  return numbers.size() == 2 || numbers.empty();
}

Numbers numbersIn(const std::optional<MotionCorrection>& correction) {
  if (!correction) return {};
  Numbers numbers = {correction->spacing_s, static_cast<double>(correction->reference),
                     correction->walk_m, correction->walk_rad};
  for (const Vector6d& knot : correction->knots) {
    numbers.insert(numbers.end(), knot.data(), knot.data() + knot.size());
  }
  return numbers;
}
bool setNumbers(const Numbers& numbers, std::optional<MotionCorrection>& correction) {
  constexpr std::size_t kHead = 4, kKnot = 6;
  if (numbers.empty()) return true;
  if (numbers.size() % kKnot != kHead || !(numbers[1] >= 0 && numbers[1] < 1e9)) return false;
  MotionCorrection& made = correction.emplace();
  made.spacing_s = numbers[0];
  made.reference = static_cast<std::size_t>(numbers[1]);
  made.walk_m = numbers[2];
  made.walk_rad = numbers[3];
  for (std::size_t i = kHead; i < numbers.size(); i += kKnot) {
    made.knots.emplace_back(Vector6d::Map(numbers.data() + i));
  }
  return true;
}

template <typename Field>
struct ListOf : std::false_type {};
template <typename Number>
struct ListOf<std::vector<Number>> : std::true_type {};

template <typename Field>
std::string typeName() {
  if constexpr (std::is_enum_v<Field> || std::is_same_v<Field, std::string>) {
    return "string";
  } else if constexpr (std::is_same_v<Field, bool>) {
    return "uint8";
  } else if constexpr (std::is_arithmetic_v<Field>) {
    const char* kind = std::is_floating_point_v<Field> ? "float"
                       : std::is_signed_v<Field>       ? "int"
                                                       : "uint";
    return fmt::format("{}{}", kind, 8 * sizeof(Field));
  } else if constexpr (ListOf<Field>::value) {
    return typeName<typename Field::value_type>() + "[]";
  } else {
    return "float64[]";
  }
}

template <typename Field>
void add(CdrWriter& message, const Field& field) {
  if constexpr (std::is_enum_v<Field>) {
    message.add(nameOf(field));
  } else if constexpr (std::is_same_v<Field, bool>) {
    message.add(static_cast<std::uint8_t>(field));
  } else if constexpr (std::is_arithmetic_v<Field> || std::is_same_v<Field, std::string> ||
                       ListOf<Field>::value) {
    message.add(field);
  } else {
    message.add(numbersIn(field));
  }
}

ByteReader bodyOf(std::string_view message) {
  ByteReader body = readerOf(message);
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
  if constexpr (std::is_enum_v<Field>) {
    field = fromName<Field>(takeText(body));
  } else if constexpr (std::is_same_v<Field, std::string>) {
    field = takeText(body);
  } else if constexpr (std::is_same_v<Field, bool>) {
    field = body.number<std::uint8_t>() != 0;
  } else if constexpr (std::is_arithmetic_v<Field>) {
    field = body.number<Field>();
  } else if constexpr (ListOf<Field>::value) {
    using Number = typename Field::value_type;
    const auto size = body.number<std::uint32_t>();
    const std::size_t most = body.remaining() / sizeof(Number);
    if (size > most) throw std::runtime_error(fmt::format("{} numbers: at most {}", size, most));
    field.resize(size);
    for (Number& number : field) number = body.number<Number>();
  } else {
    Numbers numbers;
    take(body, numbers);
    if (!setNumbers(numbers, field)) {
      throw std::runtime_error(fmt::format("{} numbers: another count", numbers.size()));
    }
  }
}

void addMap(int camera, const DepthMap& map, Lists& lists) {
  const std::size_t before = lists.u.size();
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth(y, x) > 0)) continue;
      lists.u.push_back(static_cast<std::uint16_t>(x));
      lists.v.push_back(static_cast<std::uint16_t>(y));
      lists.depth_m.push_back(map.depth(y, x));
      lists.confidence.push_back(map.confidence(y, x));
      lists.variance.push_back(map.variance(y, x));
      if (!map.probability.empty()) lists.probability.push_back(map.probability(y, x));
    }
  }
  lists.map_camera.push_back(camera);
  lists.map_points.push_back(static_cast<std::uint32_t>(lists.u.size() - before));
}

void addEvents(const cv::Mat_<cv::Vec2i>& events, Lists& lists) {
  const auto count = [](int number) {
    return static_cast<std::uint16_t>(
        std::min<int>(number, std::numeric_limits<std::uint16_t>::max()));
  };
  lists.has_events = !events.empty();
  for (int y = 0; y < events.rows; ++y) {
    for (int x = 0; x < events.cols; ++x) {
      const cv::Vec2i& here = events(y, x);
      if (here == cv::Vec2i()) continue;
      lists.event_u.push_back(static_cast<std::uint16_t>(x));
      lists.event_v.push_back(static_cast<std::uint16_t>(y));
      lists.negative_events.push_back(count(here[0]));
      lists.positive_events.push_back(count(here[1]));
    }
  }
}

/// @throws std::runtime_error if lists that belong together differ, or a pixel is outside the view.
void requireAgreement(const ReferenceView& view, const Lists& lists) {
  std::size_t points = 0;
  for (const std::uint32_t count : lists.map_points) points += count;
  const auto have = [](std::size_t count, const auto&... all) {
    return ((all.size() == count) && ...);
  };
  const auto below = [](int end, const std::vector<std::uint16_t>& all) {
    return all.empty() || *std::max_element(all.begin(), all.end()) < end;
  };
  constexpr int kMaxSide = std::numeric_limits<std::uint16_t>::max();
  const bool agree =
      view.width > 0 && view.width <= kMaxSide && view.height > 0 && view.height <= kMaxSide &&
      !lists.map_points.empty() && have(lists.map_points.size(), lists.map_camera) &&
      have(points, lists.u, lists.v, lists.depth_m, lists.confidence, lists.variance) &&
      (lists.probability.empty() || have(points, lists.probability)) &&
      have(lists.event_u.size(), lists.event_v, lists.negative_events, lists.positive_events) &&
      below(view.width, lists.u) && below(view.height, lists.v) &&
      below(view.width, lists.event_u) && below(view.height, lists.event_v);
  if (!agree) throw std::runtime_error("its lists do not belong together");
}

/// Returns the depth map of the points [begin, end).
DepthMap mapOf(cv::Size size, const Lists& lists, std::size_t begin, std::size_t end) {
  DepthMap map;
  const bool has_probability = !lists.probability.empty() || lists.u.empty();
  for (cv::Mat1f* image : {&map.depth, &map.confidence, &map.variance, &map.probability}) {
    if (image != &map.probability || has_probability) *image = cv::Mat1f::zeros(size);
  }
  for (std::size_t i = begin; i < end; ++i) {
    const cv::Point pixel(lists.u[i], lists.v[i]);
    map.depth(pixel) = lists.depth_m[i];
    map.confidence(pixel) = lists.confidence[i];
    map.variance(pixel) = lists.variance[i];
    if (has_probability) map.probability(pixel) = lists.probability[i];
  }
  return map;
}

void addStamp(CdrWriter& message, std::int64_t t_ns, std::string_view frame) {
  message.add(static_cast<std::int32_t>(logTime(t_ns) / kNanosecondsPerSecond),
              static_cast<std::uint32_t>(logTime(t_ns) % kNanosecondsPerSecond), frame);
}

void addPose(CdrWriter& message, const Rigid3& T) {
  for (const double value : numbersIn(T)) message.add(value);
}

}  // namespace

std::vector<double> numbersIn(const Rigid3& T) {
  const Eigen::Vector3d& p = T.translation;
  const Eigen::Quaterniond& q = T.rotation;
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

std::string keyframeSchema() {
  std::string schema;
  const KeyframeDepthMap keyframe;
  const Lists lists;
  visitFields(keyframe, lists, [&](const char* name, const auto& field, const char* text = "") {
    schema += fmt::format("{} {}{}{}\n", typeName<std::decay_t<decltype(field)>>(), name,
                          *text == '\0' ? "" : "  # ", text);
  });
  return schema;
}

std::string keyframeMessage(const KeyframeDepthMap& keyframe) {
  constexpr int kAllCameras = -1;
  Lists lists;
  addMap(kAllCameras, keyframe.map, lists);
  for (const CameraDepthMap& of_one : keyframe.camera_maps)
    addMap(of_one.camera, of_one.map, lists);
  addEvents(keyframe.view_events, lists);
  CdrWriter message;
  visitFields(keyframe, lists,
              [&](const char*, const auto& field, const char* = "") { add(message, field); });
  return std::move(message.bytes());
}

KeyframeDepthMap keyframeOf(std::string_view message) {
  KeyframeDepthMap keyframe;
  Lists lists;
  ByteReader body = bodyOf(message);
  visitFields(keyframe, lists, [&](const char* name, auto& field, const char* = "") {
    try {
      take(body, field);
    } catch (const std::exception& error) {
      throw std::runtime_error(fmt::format("field {}: {}", name, error.what()));
    }
  });
  requireAgreement(keyframe.view, lists);
  const cv::Size size(keyframe.view.width, keyframe.view.height);
  const PixelCounts pixels = keyframe.map.pixels;
  std::size_t end = 0;
  for (std::size_t i = 0; i < lists.map_points.size(); ++i) {
    const std::size_t begin = std::exchange(end, end + lists.map_points[i]);
    DepthMap map = mapOf(size, lists, begin, end);
    if (i == 0) {
      keyframe.map = std::move(map);
    } else {
      keyframe.camera_maps.push_back({lists.map_camera[i], std::move(map)});
    }
  }
  keyframe.map.pixels = pixels;
  if (!lists.has_events) return keyframe;
  keyframe.view_events = cv::Mat_<cv::Vec2i>(size, cv::Vec2i());
  for (std::size_t i = 0; i < lists.event_u.size(); ++i) {
    keyframe.view_events(lists.event_v[i], lists.event_u[i]) = {lists.negative_events[i],
                                                                lists.positive_events[i]};
  }
  return keyframe;
}

KeyframePoses posesIn(std::string_view message) {
  ByteReader body = bodyOf(message);
  Window window;
  KeyframePoses poses;
  take(body, window.t0_ns);
  take(body, window.t1_ns);
  take(body, poses.t_ref_ns);
  take(body, poses.T_world_ref);
  take(body, poses.T_odom_ref);
  return poses;
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
  CdrWriter message;
  addStamp(message, keyframe.window.t_ref_ns, "keyframe");
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
  CdrWriter message;
  addStamp(message, pose.t_ns, "world");
  addPose(message, pose.T_world_rig);
  return std::move(message.bytes());
}

std::string transformMessage(const StampedPose& pose) {
  CdrWriter message;
  message.add(1U);  // number of transforms
  addStamp(message, pose.t_ns, "world");
  message.add("keyframe");
  addPose(message, pose.T_world_rig);
  return std::move(message.bytes());
}

std::string pathMessage(const std::vector<StampedPose>& poses) {
  CdrWriter message;
  addStamp(message, poses.empty() ? 0 : poses.back().t_ns, "world");
  message.add(static_cast<std::uint32_t>(poses.size()));
  for (const StampedPose& pose : poses) {
    addStamp(message, pose.t_ns, "world");
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
    skipHeader();
    Numbers numbers(7);
    for (double& number : numbers) number = body.number<double>();
    setNumbers(numbers, poses.emplace_back());
  }
  return poses;
}

std::string textMessage(std::string_view text) { return std::move(CdrWriter().add(text).bytes()); }

std::string messageText(std::string_view message) {
  ByteReader body = bodyOf(message);
  return takeText(body);
}

}  // namespace efm

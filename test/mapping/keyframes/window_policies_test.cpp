// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "mapping/events/event.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"

namespace efm::window_policies_test {
namespace {

using test::LongRecording;
using test::play;
using test::Played;
using test::playedOptions;
using test::same;

/// Returns options of each policy, including windows that overlap and windows with gaps.
std::vector<FusionMapperOptions> allPolicies() {
  std::vector<FusionMapperOptions> all(7, playedOptions());
  all[0].policy.window_s = 0.11;
  all[0].policy.stride_s = 0.04;
  all[1].policy.window_s = 0.03;
  all[1].policy.stride_s = 0.07;
  all[1].policy.reference = ReferenceTime::kEnd;
  all[2].policy.policy = KeyframePolicyKind::kEvents;
  all[2].policy.window_events = 700;
  all[3] = all[2];
  all[3].policy.window_events = 1;
  all[3].policy.reference = ReferenceTime::kEnd;
  all[3].limits = {LongRecording::kStart_ns + 30'000'000, LongRecording::kStart_ns + 60'000'000};
  all[4].policy.policy = KeyframePolicyKind::kBaseline;
  all[4].policy.window_s = 0.12;
  all[4].policy.stride_s = 0.01;
  all[4].policy.min_baseline_ratio = 0.05;
  all[5] = all[4];
  all[5].limits.t0_ns = LongRecording::kStart_ns + 123'456'789;
  all[5].limits.t1_ns = LongRecording::kStart_ns + 444'444'444;
  all[6] = all[0];
  all[6].keyframe.max_events_per_camera = 100;
  return all;
}

std::string labelOf(const FusionMapperOptions& options, std::uint32_t seed) {
  return std::string(nameOf(options.policy.policy)) + ", seed " + std::to_string(seed);
}

/// Plays the recording as a whole and cut in three ways. @return the number of keyframes.
std::size_t expectTheSameHoweverCut(const LongRecording& recording,
                                    const FusionMapperOptions& options, const std::string& label) {
  const Played whole = play(recording, options, 0);
  for (std::uint32_t cut = 1; cut <= 3; ++cut) {
    const Played cut_up = play(recording, options, cut);
    EXPECT_EQ(cut_up.keyframes.size(), whole.keyframes.size()) << label;
    for (std::size_t k = 0; k < std::min(whole.keyframes.size(), cut_up.keyframes.size()); ++k) {
      const KeyframeDepthMap& a = whole.keyframes[k];
      const KeyframeDepthMap& b = cut_up.keyframes[k];
      EXPECT_EQ(a.window.t0_ns, b.window.t0_ns) << label;
      EXPECT_EQ(a.window.t1_ns, b.window.t1_ns) << label;
      EXPECT_EQ(a.window.t_ref_ns, b.window.t_ref_ns) << label;
      EXPECT_EQ(a.events, b.events) << label;
      EXPECT_TRUE(same(a.map, b.map)) << label;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(cut_up.counts.cameras[c], whole.counts.cameras[c]) << label;
    }
    EXPECT_EQ(cut_up.counts.keyframes_without_pose, whole.counts.keyframes_without_pose) << label;
    EXPECT_EQ(cut_up.counts.windows_without_events, whole.counts.windows_without_events) << label;
  }
  return whole.keyframes.size();
}

TEST(WindowPolicies, TheResultDoesNotDependOnThePackets) {
  std::vector<FusionMapperOptions> all = allPolicies();
  for (const std::size_t filtered : {0, 2}) {
    all.push_back(all[filtered]);
    all.back().filter.hot_pixel.ratio = 2;  // so strict that many random events are filtered
    all.back().filter.hot_pixel.min_events = 4;
    all.back().filter.background_activity_s = 0.02;
  }
  for (const FusionMapperOptions& options : all) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      EXPECT_GE(expectTheSameHoweverCut(LongRecording(seed, 1.0), options, labelOf(options, seed)),
                2U);
    }
  }
}

TEST(WindowPolicies, TheResultDoesNotDependOnThePacketsWithFewEventsLateCamerasAndMissingPoses) {
  std::size_t keyframes = 0;
  for (FusionMapperOptions options : allPolicies()) {
    for (std::uint32_t seed = 1; seed <= 40; ++seed) {
      // Each camera has an event per 20 or 6 ms: data of others often end between two events.
      const bool few = seed % 2 == 0;
      options.policy.window_events = few ? 3 : 40;
      LongRecording recording(seed, 1.0, few ? 30 : 100);
      // Camera 1 begins at any time: often in the gap of the poses, after the begin of camera 0.
      std::vector<Event>& late = recording.events[1];
      late.erase(late.begin(),
                 late.begin() + static_cast<std::ptrdiff_t>(seed * 7 % (few ? 20 : 80)));
      keyframes +=
          expectTheSameHoweverCut(recording, options, "few events, " + labelOf(options, seed));
    }
  }
  EXPECT_GE(keyframes, 500U);
}

/// Numbers of keyframes whose windows contain an event, and of keyframes that used the event.
struct Choices {
  std::uint64_t windows = 0;
  std::uint64_t chosen = 0;
};

/// Returns the choices of each event of a camera.
std::vector<Choices> choicesOf(const LongRecording& recording, std::size_t camera,
                               const FusionMapperOptions& options,
                               const std::vector<KeyframeDepthMap>& keyframes) {
  const std::vector<Event>& events = recording.events[camera];
  std::vector<Choices> choices(events.size());
  for (const KeyframeDepthMap& keyframe : keyframes) {
    std::vector<std::size_t> inside;
    for (std::size_t i = 0; i < events.size(); ++i) {
      const std::int64_t t_ns = recording.timeOf(camera, events[i]);
      if (!keyframe.window.contains(t_ns) || !options.limits.contain(t_ns)) continue;
      inside.push_back(i);
      ++choices[i].windows;
    }
    const EvenChoice choice(inside.size(), options.keyframe.max_events_per_camera);
    for (std::size_t k = 0; k < choice.size(); ++k) ++choices[inside[choice[k]]].chosen;
  }
  return choices;
}

TEST(WindowPolicies, EveryEventIsCountedOnce) {
  std::uint64_t used = 0;
  std::uint64_t without_pose = 0;
  std::uint64_t outside = 0;
  std::uint64_t over_budget = 0;
  for (const FusionMapperOptions& options : allPolicies()) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      const LongRecording recording(seed, 1.0);
      const Trajectory trajectory = recording.trajectory();
      const Played played = play(recording, options, seed + 10);
      std::uint64_t uses = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        EventCounts expected;
        const std::vector<Choices> choices = choicesOf(recording, c, options, played.keyframes);
        for (std::size_t i = 0; i < recording.events[c].size(); ++i) {
          const std::int64_t t_ns = recording.timeOf(c, recording.events[c][i]);
          const bool has_pose = trajectory.poseAt(t_ns).has_value();
          ++expected.read;
          if (c == 2) {
            ++expected[EventFate::kUnselected];
          } else if (!options.limits.contain(t_ns)) {
            ++expected[EventFate::kOutsideWindow];
          } else if (!has_pose) {
            ++expected[EventFate::kWithoutPose];
          } else if (choices[i].windows == 0) {
            ++expected[EventFate::kOutsideWindow];
          } else if (choices[i].chosen == 0) {
            ++expected[EventFate::kOverBudget];
          } else {
            ++expected[EventFate::kUsed];
            uses += choices[i].chosen;
          }
        }
        EXPECT_EQ(played.counts.cameras[c], expected) << labelOf(options, seed) << ", camera " << c;
      }
      EXPECT_EQ(played.counts.event_uses, uses) << labelOf(options, seed);
      EXPECT_EQ(played.counts.votes.total(), uses * 4) << "of four planes";
      EXPECT_EQ(played.counts.keyframes, played.keyframes.size());
      used += played.counts.total()[EventFate::kUsed];
      without_pose += played.counts.total()[EventFate::kWithoutPose];
      outside += played.counts.total()[EventFate::kOutsideWindow];
      over_budget += played.counts.total()[EventFate::kOverBudget];
    }
  }
  EXPECT_GT(std::min({used, without_pose, outside, over_budget}), 1000U)
      << "there is some of everything";
}

/// Returns the sorted times of the selected cameras' events, from the first event with a pose on.
std::vector<std::int64_t> eventTimes(const LongRecording& recording) {
  const Trajectory trajectory = recording.trajectory();
  std::vector<std::int64_t> times;
  for (std::size_t c = 0; c < 2; ++c) {
    for (const Event& event : recording.events[c]) times.push_back(recording.timeOf(c, event));
  }
  std::sort(times.begin(), times.end());
  const auto start = std::find_if(times.begin(), times.end(), [&](std::int64_t t_ns) {
    return trajectory.poseAt(t_ns).has_value();
  });
  return {start, times.end()};
}

/// Returns the time of the last event that has a pose and is before the last pose.
std::int64_t lastPosed(const std::vector<std::int64_t>& times, const LongRecording& recording) {
  const Trajectory trajectory = recording.trajectory();
  const auto last = std::find_if(times.rbegin(), times.rend(), [&](std::int64_t t_ns) {
    return t_ns < recording.poses.back().t_ns && trajectory.poseAt(t_ns);
  });
  return *last;
}

/// Expects that windows with a pose at their reference time are mapped, and others are counted.
void expectWindows(const Played& played, const std::vector<Window>& windows,
                   const Trajectory& trajectory) {
  std::size_t k = 0;
  for (const Window& window : windows) {
    if (!trajectory.poseAt(window.t_ref_ns)) continue;
    ASSERT_LT(k, played.keyframes.size());
    EXPECT_EQ(played.keyframes[k].window.t0_ns, window.t0_ns) << k;
    EXPECT_EQ(played.keyframes[k].window.t1_ns, window.t1_ns) << k;
    EXPECT_EQ(played.keyframes[k].window.t_ref_ns, window.t_ref_ns) << k;
    ++k;
  }
  EXPECT_EQ(played.keyframes.size(), k);
  EXPECT_EQ(played.counts.keyframes_without_pose, windows.size() - k);
}

TEST(WindowPolicies, WindowsOfAFixedNumberOfEventsFollowEachOtherAndTheLastIsMovedBack) {
  int moved_back = 0;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const LongRecording recording(seed, 1.0);
    const std::vector<std::int64_t> times = eventTimes(recording);
    const std::int64_t last_pose_ns = recording.poses.back().t_ns;
    for (const std::size_t count : {1U, 37U, 700U, 2000U}) {
      FusionMapperOptions options = playedOptions();
      options.policy.policy = KeyframePolicyKind::kEvents;
      options.policy.window_events = static_cast<std::int64_t>(count);
      std::vector<Window> windows;
      auto first = times.begin();
      while (times.end() - first >= static_cast<std::ptrdiff_t>(count)) {
        const std::int64_t last_ns = *(first + static_cast<std::ptrdiff_t>(count) - 1);
        if (last_ns >= last_pose_ns) break;  // not within the poses
        windows.push_back({*first, last_ns + 1, *first + (last_ns + 1 - *first) / 2});
        first = std::upper_bound(first, times.end(), last_ns);  // includes equal times
      }
      EXPECT_GE(windows.size(), 2U);
      if (count == 1) windows.resize(10);  // fewer keyframes, for speed
      if (count == 1) options.limits.t1_ns = windows.back().t1_ns;
      const std::int64_t end_ns = lastPosed(times, recording) + 1;
      const auto end = std::lower_bound(times.begin(), times.end(), end_ns);
      const auto unmapped = static_cast<std::size_t>(end - std::min(first, end));
      if (count > 1 && 10 * unmapped >= count) {  // the last `count` events
        const std::int64_t t0_ns = *(end - static_cast<std::ptrdiff_t>(count));
        windows.push_back({t0_ns, end_ns, t0_ns + (end_ns - t0_ns) / 2});
        ++moved_back;
      }
      expectWindows(play(recording, options, seed), windows, recording.trajectory());
    }
  }
  EXPECT_GE(moved_back, 9) << "of 12";
}

double meanDepth(const cv::Mat1f& depth) { return cv::mean(depth, depth > 0)[0]; }

TEST(WindowPolicies, BaselineWindowsAreTheShortestWithEnoughMotion) {
  std::size_t keyframes = 0;
  std::size_t different_lengths = 0;
  std::size_t moved_back = 0;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const LongRecording recording(seed, seed % 2 == 0 ? 2.0 : 0.7);
    const std::vector<std::int64_t> times = eventTimes(recording);
    const Trajectory trajectory = recording.trajectory();
    FusionMapperOptions options = playedOptions();
    options.policy.policy = KeyframePolicyKind::kBaseline;
    options.policy.window_s = 0.1;
    options.policy.stride_s = 0.012;
    options.policy.min_baseline_ratio = 0.04;
    options.policy.min_visible_fraction = 0;
    options.keyframe.extraction.min_probability = 0;  // random events: enough depths
    options.keyframe.reference_camera = 1;
    const Played played = play(recording, options, seed);

    const auto centre = [&](std::int64_t t_ns) -> std::optional<Eigen::Vector3d> {
      const auto T_world_rig = trajectory.poseAt(t_ns);
      if (!T_world_rig) return std::nullopt;
      return (*T_world_rig * recording.rig.cameras[1].T_rig_cam).translation;
    };
    double mean_depth_m = 2 / (1 / 0.5 + 1 / 4.0);
    std::vector<Window> windows;
    std::int64_t from_ns = times.front();
    bool over = false;
    while (!over) {
      const auto first = std::lower_bound(times.begin(), times.end(), from_ns);
      if (first == times.end() || *first >= recording.poses.back().t_ns) break;
      const std::int64_t t0_ns = *first;
      from_ns = t0_ns + 12'000'000;
      for (int strides = 1; strides <= 8 && centre(t0_ns); ++strides) {
        const std::int64_t t1_ns = t0_ns + strides * std::int64_t{12'000'000};
        over = t1_ns > recording.poses.back().t_ns;
        if (over) from_ns = t0_ns;  // not decided yet
        if (over) break;
        if (!centre(t1_ns) || (*centre(t1_ns) - *centre(t0_ns)).norm() < 0.04 * mean_depth_m) {
          continue;
        }
        windows.push_back({t0_ns, t1_ns, t0_ns + (t1_ns - t0_ns) / 2});
        from_ns = t1_ns;
        if (t1_ns - t0_ns != windows.front().t1_ns - windows.front().t0_ns) ++different_lengths;
        for (const KeyframeDepthMap& keyframe : played.keyframes) {
          if (keyframe.window.t0_ns != t0_ns || cv::countNonZero(keyframe.map.depth) == 0) continue;
          mean_depth_m = meanDepth(keyframe.map.depth);
        }
        break;
      }
    }
    // The begin moves back from the end, stride by stride, until the motion is enough.
    const std::int64_t end_ns = lastPosed(times, recording) + 1;
    const auto rest = std::lower_bound(times.begin(), times.end(), from_ns);
    if (rest != times.end() && *rest < end_ns) {
      std::int64_t t0_ns = std::min(*rest, end_ns - 12'000'000);
      for (; t0_ns >= times.front() && end_ns - t0_ns <= 100'000'000; t0_ns -= 12'000'000) {
        if (!centre(t0_ns)) continue;
        if ((*centre(end_ns - 1) - *centre(t0_ns)).norm() < 0.04 * mean_depth_m) continue;
        if (10 * (end_ns - *rest) < end_ns - t0_ns) break;  // little of it is new
        windows.push_back({t0_ns, end_ns, t0_ns + (end_ns - t0_ns) / 2});
        ++moved_back;
        break;
      }
    }
    expectWindows(played, windows, trajectory);
    keyframes += played.keyframes.size();
  }
  EXPECT_GE(keyframes, 20U);
  EXPECT_GE(different_lengths, 5U);
  EXPECT_GE(moved_back, 3U) << "of 5";
}

TEST(WindowPolicies, ARigAtRestTakesNoMemoryAndMakesNoKeyframe) {
  constexpr std::int64_t kMs = LongRecording::kMs;
  FusionMapperOptions options = playedOptions();
  options.cameras = {};
  options.fill_last_window = false;
  options.policy.policy = KeyframePolicyKind::kBaseline;
  options.policy.window_s = 0.1;
  options.policy.stride_s = 0.02;
  FusionMapper mapper(options);
  mapper.addCamera({test::smallCamera(), {}, 0});
  test::RandomScene random(1);
  for (int packet = 0; packet < 500; ++packet) {  // 5 s of 10 events per millisecond
    const std::int64_t t_ns = LongRecording::kStart_ns + packet * 10 * kMs;
    mapper.addPose({t_ns, {}});
    mapper.addEvents(0, CheckedEvents(random.events(test::smallCamera(), 100, t_ns, 10 * kMs)));
    EXPECT_FALSE(mapper.next());
    const EventCounts counts = mapper.counts().total();
    // Kept events: the longest window, a stride, the allowed delay of events and the last packet.
    EXPECT_LE(counts.read - counts[EventFate::kOutsideWindow], 10U * (100 + 20 + 10 + 10));
    EXPECT_LE(mapper.trajectory().poses().size(), 2U * (14 + 2)) << "freed by the half";
  }
  // Then the camera moves at 1 m/s: 10 % of the mean depth of 8/9 m in 89 ms.
  std::vector<KeyframeDepthMap> keyframes;
  for (int packet = 500; packet < 540; ++packet) {
    const std::int64_t t_ns = LongRecording::kStart_ns + packet * 10 * kMs;
    mapper.addPose({t_ns, {Eigen::Quaterniond::Identity(), {0.01 * (packet - 500), 0, 0}}});
    mapper.addEvents(0, CheckedEvents(random.events(test::smallCamera(), 100, t_ns, 10 * kMs)));
    while (auto keyframe = mapper.next()) keyframes.push_back(std::move(*keyframe));
  }
  ASSERT_FALSE(keyframes.empty());
  EXPECT_EQ(keyframes[0].window.t1_ns - keyframes[0].window.t0_ns, 100 * kMs);
}

}  // namespace
}  // namespace efm::window_policies_test

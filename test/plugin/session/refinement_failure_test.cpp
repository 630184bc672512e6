// SPDX-License-Identifier: BSD-3-Clause
// What stays of a map where the refinement of a keyframe fails.

#include <gtest/gtest.h>

#include <memory>
#include <new>
#include <thread>

#include "failing_allocation.h"
#include "test/plugin/recordings/shaken_recording.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

constexpr std::size_t kFailing = 3;  // this keyframe's refinement or insertion fails

/// A session whose memory fails once, after the depth map of a keyframe is made.
struct FailingSession {
  std::unique_ptr<MappingSession> session;
  std::vector<KeyframeDepthMap> keyframes;  ///< That the session returned.
  std::size_t errors = 0;
  std::vector<std::size_t> allocations;  ///< From that depth map to the keyframe's return.

  FailingSession(const EventFusionOptions& options, const SyntheticRecording& recording,
                 std::size_t skipped)
      : session(std::make_unique<MappingSession>(options)) {
    addPoses(*session, recording);
    addEvents(*session, recording);
    session->finish();
    for (bool more = true; more;) more = step(skipped);
  }

  bool step(std::size_t skipped) {
    // The clock is read at the begin and at the end of each stage; the depth map is the last one.
    std::size_t reading = 0;
    const bool fails = attempts_++ == kFailing;
    const auto clock = [&] {
      ++reading;
      if (fails && reading == readings_) failAllocation(Allocating::kThisThread, skipped);
      return 0.0;
    };
    bool more = true;
    try {
      auto keyframe = session->next(nullptr, clock);
      more = keyframe.has_value();
      if (fails) allocations = stopFailing();
      if (keyframe) keyframes.push_back(std::move(*keyframe));
    } catch (const std::bad_alloc&) {
      stopFailing();
      ++errors;
    }
    if (!fails) readings_ = reading;
    return more;
  }

 private:
  std::size_t attempts_ = 0;
  std::size_t readings_ = 0;  // of the clock, for the last keyframe
};

TEST(RefinementFailure, LeavesEachKeyframeItsOwnPoseAndReachesTheCallerOnce) {
  const SyntheticRecording recording = shaken(SyntheticRecording(0.6));
  const EventFusionOptions options = refinedOptions();
  const FailingSession undisturbed(options, recording, std::size_t(-1));
  ASSERT_EQ(undisturbed.errors, 0U);
  for (const std::size_t skipped : rareOnes(undisturbed.allocations)) {
    SCOPED_TRACE("allocation " + std::to_string(skipped));
    const FailingSession disturbed(options, recording, skipped);
    const MappingSession& session = *disturbed.session;
    if (disturbed.errors == 0) {  // the standard library sorts with less memory
      expectSameMap(session, *undisturbed.session);
      continue;
    }
    EXPECT_EQ(disturbed.errors, 1U);
    ASSERT_EQ(session.T_world_ref().size(), disturbed.keyframes.size());
    ASSERT_EQ(session.T_odom_ref().size(), disturbed.keyframes.size());
    EXPECT_EQ(session.cloud().keyframes(), disturbed.keyframes.size());
    for (std::size_t i = 0; i < disturbed.keyframes.size(); ++i) {
      // The tracker's noise is 1 cm on each axis; the next keyframe is 8 cm away.
      EXPECT_LT((session.T_world_ref()[i].translation - session.T_odom_ref()[i].translation).norm(),
                0.05)
          << "keyframe " << i;
    }
    if (HasFailure()) return;
  }
}

/// A refinement in the background whose memory fails once, while it refines a keyframe.
struct FailingBackground {
  RefinementState state;
  std::map<std::size_t, Rigid3> T_world_ref;
  std::vector<std::size_t> allocations;  ///< For that keyframe.

  FailingBackground(const std::vector<KeyframeDepthMap>& keyframes, std::size_t skipped) {
    MapRefinementOptions options;
    options.background = true;
    MapRefinement refinement(options);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      if (i == kFailing) failAllocation(Allocating::kOtherThreads, skipped);
      refinement.add(keyframes[i], std::nullopt);
      // A keyframe that the refiner could not take waits for the next one.
      while (refinement.state().waiting > refinement.state().failures) std::this_thread::yield();
      if (i == kFailing) allocations = stopFailing();
    }
    refinement.finish();
    EXPECT_NO_THROW(refinement.throwFailure()) << "it is counted";
    state = refinement.state();
    T_world_ref = refinement.takeMoved();
  }
};

TEST(RefinementFailure, InTheBackgroundIsCountedAndTheNextKeyframeIsRefined) {
  EventFusionOptions options = refinedOptions();
  options.refinement.enabled = false;
  MappingSession tracked(options);
  const auto keyframes = mapAll(tracked, shaken(SyntheticRecording(0.6)));
  const FailingBackground undisturbed(keyframes, std::size_t(-1));
  EXPECT_EQ(undisturbed.state.failures, 0U);
  EXPECT_EQ(undisturbed.state.last_error, "");
  std::size_t failures = 0;
  for (const std::size_t skipped : rareOnes(undisturbed.allocations)) {
    SCOPED_TRACE("allocation " + std::to_string(skipped));
    const FailingBackground disturbed(keyframes, skipped);
    ASSERT_EQ(disturbed.T_world_ref.size(), keyframes.size());
    for (const auto& [number, T_world_ref] : disturbed.T_world_ref) {
      const Rigid3& T_odom_ref = keyframes[number].T_world_ref;
      EXPECT_LT((T_world_ref.translation - T_odom_ref.translation).norm(), 0.05) << number;
    }
    EXPECT_EQ(disturbed.state.waiting, 0U);
    EXPECT_GE(disturbed.state.counts.registered + 1, undisturbed.state.counts.registered);
    if (disturbed.state.failures == 0) continue;  // the standard library sorts with less memory
    EXPECT_EQ(disturbed.state.failures, 1U);
    EXPECT_EQ(disturbed.state.last_error, std::bad_alloc().what());
    ++failures;
    if (HasFailure()) return;
  }
  EXPECT_GT(failures, 10U);
}

}  // namespace
}  // namespace efm

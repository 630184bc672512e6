// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/keyframe_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <future>
#include <iostream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::ElementsAre;

KeyframeDepthMap keyframeAt(std::int64_t t_ref_ns) {
  KeyframeDepthMap keyframe;
  keyframe.window.t_ref_ns = t_ref_ns;
  return keyframe;
}

/// Writes nothing before it is opened.
struct Gate {
  std::promise<void> promise;
  std::shared_future<void> opened = promise.get_future().share();
  std::vector<std::int64_t> written;

  KeyframeWriter::Write write() {
    return [this](const KeyframeDepthMap& keyframe) {
      opened.wait();
      if (keyframe.window.t_ref_ns == 13) throw std::runtime_error("keyframe 13 cannot be written");
      written.push_back(keyframe.window.t_ref_ns);
    };
  }
};

TEST(KeyframeWriter, WritesInOrderBesideItsCallerWhoWaitsWhereTooManyWait) {
  Gate gate;
  KeyframeWriter writer(gate.write());
  std::atomic<int> added = 0;
  std::thread caller([&] {
    for (const int t : {1, 2, 3, 4, 5, 6}) {
      writer.add(keyframeAt(t));
      ++added;
    }
    writer.finish();
  });
  while (added < 1) std::this_thread::yield();
  EXPECT_LE(added, 2) << "one is being written and one waits";
  gate.promise.set_value();
  caller.join();
  EXPECT_THAT(gate.written, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_GT(writer.cpuSeconds(), 0);
}

TEST(KeyframeWriter, AnErrorReachesTheCallerAndNothingMoreIsWritten) {
  Gate gate;
  KeyframeWriter writer(gate.write());
  for (const int t : {12, 13}) writer.add(keyframeAt(t));
  gate.promise.set_value();
  const std::string message = messageOf([&] {
    for (int t = 14; t < 1000; ++t) writer.add(keyframeAt(t));
  });
  EXPECT_EQ(message, "keyframe 13 cannot be written");
  EXPECT_EQ(messageOf([&] { writer.finish(); }), message);
  EXPECT_THAT(gate.written, ElementsAre(12));
}

TEST(KeyframeWriter, ASignalEndsTheProgramOnceTheWaitingKeyframesAreWritten) {
  const auto interrupted = [](void (*handler)(int)) {
    std::signal(SIGINT, handler);
    KeyframeWriter writer([](const KeyframeDepthMap& keyframe) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      std::cerr << "written " << keyframe.window.t_ref_ns << ";";
    });
    writer.add(keyframeAt(1));
    writer.add(keyframeAt(2));
    kill(getpid(), SIGINT);
    for (const int t : {3, 4}) writer.add(keyframeAt(t));
    writer.finish();
    std::exit(0);
  };
  EXPECT_EXIT(interrupted(SIG_DFL), testing::KilledBySignal(SIGINT), "1;written 2;written 3;$");
  EXPECT_EXIT(interrupted(SIG_IGN), testing::ExitedWithCode(0), "2;written 3;written 4;$");
}

TEST(KeyframeWriter, WritesTheWaitingKeyframesWhenItIsDestroyed) {
  Gate gate;
  {
    KeyframeWriter writer(gate.write());
    for (const int t : {1, 2}) writer.add(keyframeAt(t));
    gate.promise.set_value();
  }
  EXPECT_THAT(gate.written, ElementsAre(1, 2));
}

}  // namespace
}  // namespace efm

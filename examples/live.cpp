// SPDX-License-Identifier: BSD-3-Clause
// Mapping beside a sensor: a thread feeds, keyframes come as they are made. live RECORDING… plays a
// recording at the speed of its sensor.
#include <event_fusion/engine.h>

#include <chrono>
#include <future>
#include <iostream>
#include <thread>

/// Stands for a driver: sends each sample at its time.
void feed(efm::Recording& recording, efm::Mapper& mapper) {
  mapper.addCameras(recording.rig());
  const auto begin = std::chrono::steady_clock::now();
  std::int64_t first_ns = -1;
  while (auto sample = recording.next()) {
    const auto* pose = std::get_if<efm::PoseSample>(&*sample);
    const auto* packet = std::get_if<efm::EventPacket>(&*sample);
    if (pose || packet) {
      const std::int64_t t_ns = pose ? pose->t_ns : packet->events.back().t_ns;
      if (first_ns < 0) first_ns = t_ns;
      std::this_thread::sleep_until(begin + std::chrono::nanoseconds(t_ns - first_ns));
    }
    mapper.add(std::move(*sample));  // never waits
  }
}

int main(int argc, char** argv) try {
  efm::Options options;
  options.set("live.enabled", "true");
  efm::Mapper::Callbacks callbacks;  // called in the mapper's own thread
  callbacks.on_keyframe = [](const efm::Keyframe& keyframe) {
    std::cout << "keyframe at " << keyframe.window.t_ref_ns << " ns, camera at "
              << keyframe.T_world_ref.translation.transpose() << " m" << std::endl;
  };
  callbacks.info = [](const std::string& text) { std::cout << text << std::endl; };
  callbacks.warn = [](const std::string& text) { std::cerr << "warning: " << text << '\n'; };
  efm::Mapper mapper(options, callbacks);

  const auto recording = efm::openRecording({argv + 1, argv + argc});
  auto driver = std::async(std::launch::async, feed, std::ref(*recording), std::ref(mapper));
  driver.get();  // throws the error of the thread, if there is one
  mapper.finish();
  efm::writePcd("live.pcd", *mapper.points());
  const efm::SessionStatus status = mapper.status();
  std::cout << status.counts.keyframes << " keyframes, " << mapper.points()->size()
            << " points in live.pcd, " << 100 * status.live->dropRatio()
            << " % of the events lost\n";
} catch (const std::exception& error) {
  std::cerr << "error: " << error.what() << '\n';
  return 1;
}

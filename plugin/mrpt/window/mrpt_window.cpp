// SPDX-License-Identifier: BSD-3-Clause
// The library libevent-fusion-window.so: the only code that is linked with mrpt-gui.
#include <mrpt/gui/CDisplayWindow3D.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "plugin/mrpt/window/map_scene.h"
#include "plugin/engine/map_watcher.h"

namespace efm {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPeriod{100};
constexpr int kMaxCost = 20;  // an export takes at most 1/20 of the time

class MrptWindow : public MapWindow {
 public:
  MrptWindow() : window_("event-fusion map", 1280, 720), thread_([this] { run(); }) {}
  ~MrptWindow() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
    // MRPT destroys the window's scene in a thread that may outlive main(), when the table of
    // textures is gone. So the window gets an empty scene, and `scene_` releases the textures.
    window_.get3DSceneAndLock() = mrpt::opengl::COpenGLScene::Create();
    window_.unlockAccess3DScene();
  }

  bool appears() const { return window_.wait_for_GL_context(5); }
  bool isOpen() override { return window_.isOpen(); }

  bool due(bool is_last) override {
    if (!window_.isOpen()) {
      if (!std::exchange(reported_, true)) {
        std::cerr << "event-fusion: the window was closed; the mapping goes on\n";
      }
      return false;
    }
    const auto now = Clock::now();
    if (!is_last && now < next_) return false;
    asked_ = now;
    return true;
  }

  void show(WatchedMap snapshot) override {
    const auto now = Clock::now();
    next_ = now + std::max<Clock::duration>(kPeriod, kMaxCost * (now - asked_));
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_ = std::move(snapshot);  // replaces a snapshot that was not drawn yet
    changed_.notify_all();
  }

  void wait(const std::function<bool()>& stop) override {
    window_.clearKeyHitFlag();
    while (window_.isOpen() && !window_.keyHit() && !stop()) std::this_thread::sleep_for(kPeriod);
  }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stop_ || waiting_; });
      if (stop_) return;
      const WatchedMap snapshot = *std::exchange(waiting_, std::nullopt);
      lock.unlock();
      if (window_.isOpen()) draw(snapshot);
      lock.lock();
    }
  }

  void draw(const WatchedMap& snapshot) {
    auto& scene = window_.get3DSceneAndLock();
    scene_.show(snapshot);
    scene = scene_.scene();
    const bool follows = !placed_ || !userMoved();
    if (follows) place(scene->getViewport()->getCamera());
    window_.unlockAccess3DScene();
    window_.forceRepaint();
  }

  void place(const mrpt::opengl::CCamera& camera) {
    const auto target = camera.getPointingAt();
    window_.setFOV(camera.getProjectiveFOVdeg());
    window_.setCameraPointingToPoint(target.x, target.y, target.z);
    window_.setCameraZoom(camera.getZoomDistance());
    window_.setCameraElevationDeg(camera.getElevationDegrees());
    window_.setCameraAzimuthDeg(camera.getAzimuthDegrees());
    placed_ = view();
  }
  std::array<float, 3> view() const {
    return {window_.getCameraZoom(), window_.getCameraElevationDeg(),
            window_.getCameraAzimuthDeg()};
  }
  bool userMoved() const {
    const auto now = view();
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (std::abs(now[i] - (*placed_)[i]) > 1e-3F * std::abs(now[i])) return true;
    }
    return false;
  }

  mrpt::gui::CDisplayWindow3D window_;
  MapScene scene_;
  std::optional<std::array<float, 3>> placed_;  // the view that was set last
  Clock::time_point asked_, next_;
  bool reported_ = false;  // the user knows that the window was closed
  std::mutex mutex_;       // protects the members below
  std::condition_variable changed_;
  std::optional<WatchedMap> waiting_;
  bool stop_ = false;
  std::thread thread_;  // last, because it uses the other members
};

}  // namespace
}  // namespace efm

extern "C" __attribute__((visibility("default"))) efm::MapWindow* efmOpenMapWindow() {
  try {
    auto window = std::make_unique<efm::MrptWindow>();
    return window->appears() ? window.release() : nullptr;
  } catch (const std::exception&) {
    return nullptr;
  }
}

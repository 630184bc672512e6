// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/slice_alignment.h"

#include <tbb/parallel_for.h>
#include <Eigen/SparseCholesky>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Length of a slice. A longer one would be blurred by its own motion.
constexpr double kLengthS = 0.01;
constexpr std::size_t kLevels = 3;
/// A finer image has no more information about the motion: an error of half of its pixels does not
/// blur it.
constexpr int kMaxPixels = 400'000;
constexpr std::size_t kMinEvents = 50;  // of a slice and camera
constexpr std::size_t kMinPoints = 100;
/// The points of a slice and camera count as this many independent ones. Their errors are common:
/// neighbours lie on the same edge.
constexpr double kIndependentPoints = 170;
/// Error of a tracker's velocity from one slice to the next, relative to the speed: of the
/// hand-held trackers, 13 to 27 % of the travel within 0.2 s, and noise of each pose.
constexpr double kVelocityError = 0.5;

/// One Gauss-Newton step.
struct Step {
  std::size_t level = 0;  // of the edges; 0: the finest
  double reach = 1;       // farthest slice, relative to the longer side of the window
};

/// The first steps reach farther and farther: a slice begins where its inner neighbour is.
std::vector<Step> schedule() {
  constexpr int kReaching = 8;
  std::vector<Step> steps;
  for (int i = 1; i <= kReaching; ++i) steps.push_back({2, static_cast<double>(i) / kReaching});
  for (const std::size_t level : {1, 1, 0, 0, 0}) steps.push_back({level});
  return steps;
}

cv::Mat1f halved(const cv::Mat1f& image) {
  const cv::Size size(std::max(1, image.cols / 2), std::max(1, image.rows / 2));
  cv::Mat1f half;
  cv::resize(image(cv::Rect(0, 0, std::min(image.cols, 2 * size.width),
                            std::min(image.rows, 2 * size.height))),
             half, size, 0, 0, cv::INTER_AREA);
  return half;
}

/// Returns the value that 3 % of the pixels exceed; approximate.
float highValueOf(const cv::Mat1f& image) {
  constexpr std::size_t kEvery = 7;
  constexpr double kBelow = 0.97;
  std::vector<float> values;
  for (std::size_t i = 0; i < image.total(); i += kEvery) {
    values.push_back(image.ptr<float>()[i]);
  }
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(kBelow * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

cv::Mat1b edgesOf(const cv::Mat1f& counts) {
  constexpr double kNearPx = 1;
  constexpr double kFarPx = 3;
  constexpr float kMinCount = 0.02F;  // events per pixel
  cv::Mat1f near, far;
  cv::GaussianBlur(counts, near, {7, 7}, kNearPx);
  cv::GaussianBlur(counts, far, {19, 19}, kFarPx);
  cv::Mat1f edges = (near - far) / (far + kMinCount);
  const float high = std::max(highValueOf(edges), 1e-3F);
  cv::Mat1b bytes;
  edges.convertTo(bytes, CV_8U, 127.5 / high, 127.5);
  return bytes;
}

/// The value of an image between pixels, and its gradient.
struct Sampled {
  double value = 0;
  Eigen::RowVector2d gradient;
};

std::optional<Sampled> sampleAt(const cv::Mat1b& image, double x, double y) {
  if (!(x >= 0 && y >= 0 && x < image.cols - 1 && y < image.rows - 1)) return std::nullopt;
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const double right = x - column;
  const double below = y - row;
  const std::uint8_t* upper = image[row] + column;
  const std::uint8_t* lower = image[row + 1] + column;
  const double upper_step = upper[1] - upper[0];
  const double lower_step = lower[1] - lower[0];
  const double left_step = lower[0] - upper[0];
  const double right_step = lower[1] - upper[1];
  return Sampled{
      upper[0] + right * upper_step + below * left_step + right * below * (lower_step - upper_step),
      {(1 - below) * upper_step + below * lower_step,
       (1 - right) * left_step + right * right_step}};
}

}  // namespace

EdgeLevels edgesIn(EventSpan slice, const UndistortionTable& undistortion,
                   const ReferenceView& view, int finest) {
  EdgeLevels levels;
  if (slice.size() < kMinEvents) return levels;
  const double scale = std::ldexp(1.0, -finest);
  cv::Mat1f counts =
      cv::Mat1f::zeros(std::max(2, view.height >> finest), std::max(2, view.width >> finest));
  for (const Event& event : slice) {
    const Eigen::Vector2d ray = undistortion.ray(event.x, event.y);
    const double x = scale * (view.fx * ray.x() + view.cx + 0.5) - 0.5;
    const double y = scale * (view.fy * ray.y() + view.cy + 0.5) - 0.5;
    if (!(x >= 0 && y >= 0 && x < counts.cols - 1 && y < counts.rows - 1)) continue;
    const int column = static_cast<int>(x);
    const int row = static_cast<int>(y);
    const auto right = static_cast<float>(x - column);
    const auto below = static_cast<float>(y - row);
    float* upper = counts[row] + column;
    float* lower = counts[row + 1] + column;
    upper[0] += (1 - right) * (1 - below);
    upper[1] += right * (1 - below);
    lower[0] += (1 - right) * below;
    lower[1] += right * below;
  }
  constexpr float kMaxCount = 3;  // a hot pixel is no edge
  counts = cv::min(counts, kMaxCount);
  for (std::size_t level = 0; level < kLevels; ++level) {
    if (level > 0) counts = halved(counts);
    levels.push_back(edgesOf(counts));
  }
  return levels;
}

SliceAlignment::SliceAlignment(const WindowInput& input, const Trajectory& tracked,
                               const MotionCorrectionOptions& options, const SliceEffort& effort)
    : input_(input),
      options_(options),
      effort_(effort),
      none_(knotsOf(input.window, effort.spacing_s)) {
  const std::size_t count = none_.knots.size();
  for (const CameraEvents& camera : input.cameras) {
    views_.push_back(ReferenceView::of(camera.calibration->model));
    while (static_cast<double>(views_.back().pixels()) > std::ldexp(kMaxPixels, 2 * finest_)) {
      ++finest_;
    }
  }
  const Rigid3 T_ref_world = input.T_world_ref.inverse();
  const auto timeOf = [&](std::size_t slice) { return timeOfKnot(none_, slice, input.window); };
  for (std::size_t slice = 0; slice < count; ++slice) {
    const std::optional<Rigid3> T_world_rig = tracked.poseAt(timeOf(slice));
    has_pose_.push_back(T_world_rig.has_value());
    T_ref_tracked_.push_back(T_ref_world * T_world_rig.value_or(Rigid3{}));
  }
  edges_.resize(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t slice) {
    const std::int64_t half_ns = durationFromSeconds(kLengthS / 2);
    for (std::size_t c = 0; c < views_.size() && has_pose_[slice]; ++c) {
      const CameraEvents& camera = input.cameras[c];
      const std::int64_t t_ns = timeOf(slice);
      edges_[slice].push_back(edgesIn(camera.events.between(t_ns - half_ns, t_ns + half_ns),
                                      *camera.undistortion, views_[c], finest_));
    }
  });
  speed_m_s_ = speed();
}

/// Returns the mean speed of the rig, over tenths of a second: noise of single poses is no speed.
double SliceAlignment::speed() const {
  constexpr double kOverS = 0.1;
  const auto over = static_cast<std::size_t>(std::max(1.0, kOverS / none_.spacing_s));
  double path_m = 0;
  double duration_s = 0;
  for (std::size_t slice = over; slice < has_pose_.size(); slice += over) {
    if (!has_pose_[slice] || !has_pose_[slice - over]) continue;
    path_m += (T_ref_tracked_[slice].translation - T_ref_tracked_[slice - over].translation).norm();
    duration_s += static_cast<double>(over) * none_.spacing_s;
  }
  return duration_s > 0 ? path_m / duration_s : 0;
}

/// Returns evenly chosen points of a depth map, frame `ref`.
std::vector<Eigen::Vector3d> SliceAlignment::pointsOf(const cv::Mat1f& depth) const {
  std::vector<Eigen::Vector3d> points;
  const int every = std::max(1, cv::countNonZero(depth > 0) / effort_.max_points);
  int index = 0;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (!(depth(y, x) > 0) || index++ % every != every / 2) continue;
      points.push_back(input_.view.pointAt(x, y, double{depth(y, x)}));
    }
  }
  return points;
}

/// The normal equations of one slice for a small motion of the rig.
struct SliceAlignment::Equations {
  /// The residuals of a point in the cameras that see it.
  struct Residuals {
    double sum = 0;
    int count = 0;
  };

  Matrix6d information = Matrix6d::Zero();  // its lower half
  Vector6d gradient = Vector6d::Zero();
  std::vector<Residuals> residuals;  // of each point; none: the slice takes no part

  void add(double residual, double weight, const Vector6d& by_motion) {
    const Vector6d weighted = weight * by_motion;
    for (int column = 0; column < 6; ++column) {
      for (int row = column; row < 6; ++row) {
        information(row, column) += by_motion[row] * weighted[column];
      }
    }
    gradient += residual * weighted;
  }
};

SliceAlignment::Equations SliceAlignment::equationsOf(std::size_t slice, const Rigid3& T_ref_rig,
                                                      const WeightedPoints& points,
                                                      std::size_t level) const {
  Equations sums;
  sums.residuals.resize(points.p_ref.size());
  const Rigid3 T_rig_ref = T_ref_rig.inverse();
  const Eigen::Matrix3d R_rig_ref = T_rig_ref.rotation.toRotationMatrix();
  const double scale = std::ldexp(1.0, -finest_ - static_cast<int>(level));
  for (std::size_t c = 0; c < edges_[slice].size(); ++c) {
    if (edges_[slice][c].empty()) continue;
    const cv::Mat1b& edges = edges_[slice][c][level];
    const ReferenceView& view = views_[c];
    const Rigid3 T_cam_rig = input_.cameras[c].calibration->T_rig_cam.inverse();
    const Eigen::Matrix3d R_cam_rig = T_cam_rig.rotation.toRotationMatrix();
    for (std::size_t i = 0; i < points.p_ref.size(); ++i) {
      const Eigen::Vector3d p_rig = R_rig_ref * points.p_ref[i] + T_rig_ref.translation;
      const Eigen::Vector3d p_cam = R_cam_rig * p_rig + T_cam_rig.translation;
      if (!(p_cam.z() > kMinDepthM)) continue;
      const Eigen::Vector2d pixel = view.project(p_cam);
      const auto sampled =
          sampleAt(edges, scale * (pixel.x() + 0.5) - 0.5, scale * (pixel.y() + 0.5) - 0.5);
      if (!sampled) continue;
      // The residual is 2 on no edge, 0 on an edge. If the rig moves, the point moves backwards in
      // its frame.
      const double residual = 2 - sampled->value / 127.5;
      const double right = scale * sampled->gradient.x() * view.fx / (127.5 * p_cam.z());
      const double down = scale * sampled->gradient.y() * view.fy / (127.5 * p_cam.z());
      const Eigen::Vector3d by_cam(right, down,
                                   -(right * p_cam.x() + down * p_cam.y()) / p_cam.z());
      const Eigen::Vector3d by_rig = R_cam_rig.transpose() * by_cam;
      Vector6d by_motion;
      by_motion << by_rig, p_rig.cross(by_rig);
      sums.add(residual, points.weights[i], by_motion);
      sums.residuals[i].sum += residual;
      ++sums.residuals[i].count;
    }
  }
  const double weight =
      kIndependentPoints / std::accumulate(points.weights.begin(), points.weights.end(), 0.0);
  sums.information *= weight;
  sums.gradient *= weight;
  return sums;
}

/// Weighs each point by its mean residual in all slices: from 1 on the edges to nearly 0 for a
/// point whose residual is that of any place, because its depth is wrong. Otherwise wrong points
/// decide on the motions that the view of one wall hardly shows.
void SliceAlignment::weigh(WeightedPoints& points, const std::vector<Equations>& slices) const {
  constexpr double kAnywhere = 1;  // the mean residual over the image: edges sum to 0
  constexpr double kLeast = 0.01;
  for (std::size_t i = 0; i < points.p_ref.size(); ++i) {
    Equations::Residuals all;
    for (const Equations& slice : slices) {
      if (slice.residuals.empty()) continue;
      all.sum += slice.residuals[i].sum;
      all.count += slice.residuals[i].count;
    }
    const double mean = all.count > 0 ? all.sum / all.count : kAnywhere;
    points.weights[i] = std::max(kLeast, kAnywhere - mean);
  }
}

namespace {

/// Solves for the changes of all slices: the equations of each one, and a random walk of the
/// correction from slice to slice that begins at 0 at the reference time.
class WalkSolver {
 public:
  WalkSolver(const Vector6d& sigmas, std::size_t reference)
      : information_(sigmas.cwiseAbs2().cwiseInverse()), reference_(reference) {}

  void addSlice(const Matrix6d& information, const Vector6d& gradient, const Vector6d& now) {
    const Eigen::Index at = 6 * count_;
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column <= row; ++column) {
        add(at + row, at + column, information(row, column));
      }
    }
    right_.insert(right_.end(), 6, 0.0);
    descend(at, gradient);
    if (count_ > 0) {
      const Vector6d slope = information_.cwiseProduct(now - last_);
      descend(at, slope);
      descend(at - 6, -slope);
      for (int row = 0; row < 6; ++row) {
        add(at + row, at + row, information_[row]);
        add(at - 6 + row, at - 6 + row, information_[row]);
        add(at + row, at - 6 + row, -information_[row]);
      }
    }
    if (static_cast<std::size_t>(count_) == reference_) {
      descend(at, information_.cwiseProduct(now));
      for (int row = 0; row < 6; ++row) add(at + row, at + row, information_[row]);
    }
    last_ = now;
    ++count_;
  }

  /// Returns six numbers per slice; std::nullopt if the equations cannot be solved.
  std::optional<Eigen::VectorXd> solve() const {
    Eigen::SparseMatrix<double> left(6 * count_, 6 * count_);
    left.setFromTriplets(left_.begin(), left_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(left);
    if (solver.info() != Eigen::Success) return std::nullopt;
    Eigen::VectorXd changes = solver.solve(
        Eigen::Map<const Eigen::VectorXd>(right_.data(), static_cast<Eigen::Index>(right_.size())));
    return changes.allFinite() ? std::make_optional(std::move(changes)) : std::nullopt;
  }

 private:
  void add(Eigen::Index row, Eigen::Index column, double value) {
    left_.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
  }
  void descend(Eigen::Index at, const Vector6d& gradient) {
    for (int row = 0; row < 6; ++row) right_[static_cast<std::size_t>(at + row)] -= gradient[row];
  }

  Vector6d information_;
  std::size_t reference_;
  Eigen::Index count_ = 0;
  Vector6d last_ = Vector6d::Zero();
  std::vector<Eigen::Triplet<double>> left_;  // lower half
  std::vector<double> right_;
};

}  // namespace

std::optional<AlignedMotion> SliceAlignment::align(const cv::Mat1f& depth,
                                                   const MotionCorrection& start) const {
  WeightedPoints points{pointsOf(depth), {}};
  points.weights.assign(points.p_ref.size(), 1.0);
  const std::size_t count = none_.knots.size();
  if (points.p_ref.size() < kMinPoints || !has_pose_[none_.reference]) return std::nullopt;
  double inverse_depth = 0;
  for (const Eigen::Vector3d& point : points.p_ref) inverse_depth += 1 / point.z();
  inverse_depth /= static_cast<double>(points.p_ref.size());
  const double sigma_m =
      none_.spacing_s * std::max(options_.motion_sigma_m_s, kVelocityError * speed_m_s_);
  // Errors of position and rotation together keep the image aligned.
  const double sigma_rad = std::max(
      none_.spacing_s * kRadiansPerDegree * options_.motion_sigma_deg_s, sigma_m * inverse_depth);
  Vector6d sigmas;
  sigmas << Eigen::Vector3d::Constant(sigma_m), Eigen::Vector3d::Constant(sigma_rad);

  std::vector<Vector6d> knots = start.knots;
  const auto poseAt = [&](std::size_t slice) {
    return T_ref_tracked_[slice] * rigidFromDifference(knots[slice]);
  };
  const std::size_t longer = std::max(none_.reference, count - 1 - none_.reference);
  for (const Step& step : schedule()) {
    std::vector<Equations> equations(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t slice) {
      const std::size_t away = std::max(slice, none_.reference) - std::min(slice, none_.reference);
      if (static_cast<double>(away) > step.reach * static_cast<double>(longer)) return;
      equations[slice] = equationsOf(slice, poseAt(slice), points, step.level);
    });
    WalkSolver solver(sigmas, none_.reference);
    for (std::size_t slice = 0; slice < count; ++slice) {
      solver.addSlice(equations[slice].information, equations[slice].gradient, knots[slice]);
    }
    const auto changes = solver.solve();
    if (!changes) return std::nullopt;
    weigh(points, equations);
    for (std::size_t slice = 0; slice < count; ++slice) {
      knots[slice] += changes->segment<6>(static_cast<Eigen::Index>(6 * slice));
    }
  }

  // All poses move together, so that the pose at the reference time stays.
  const Rigid3 back = T_ref_tracked_[none_.reference] * poseAt(none_.reference).inverse();
  AlignedMotion found{none_, 0, std::ldexp(1.0, finest_)};
  found.correction.walk_m = sigma_m / std::sqrt(none_.spacing_s);
  found.correction.walk_rad = sigma_rad / std::sqrt(none_.spacing_s);
  for (std::size_t slice = 0; slice < count; ++slice) {
    if (!has_pose_[slice] || slice == none_.reference) continue;
    found.correction.knots[slice] =
        differenceOf(T_ref_tracked_[slice].inverse() * back * poseAt(slice));
  }
  found.shift_px = shiftBetween(start, found.correction, points.p_ref);
  return found;
}

double SliceAlignment::shiftBetween(const MotionCorrection& a, const MotionCorrection& b,
                                    const std::vector<Eigen::Vector3d>& points) const {
  constexpr std::size_t kEvery = 20;
  const Rigid3 T_cam_rig = input_.cameras.front().calibration->T_rig_cam.inverse();
  double sum = 0;
  std::size_t terms = 0;
  for (std::size_t slice = 0; slice < a.knots.size(); ++slice) {
    if (!has_pose_[slice]) continue;
    const auto fromRef = [&](const MotionCorrection& by) {
      return T_cam_rig * (T_ref_tracked_[slice] * rigidFromDifference(by.knots[slice])).inverse();
    };
    const Rigid3 T_a_ref = fromRef(a);
    const Rigid3 T_b_ref = fromRef(b);
    for (std::size_t i = 0; i < points.size(); i += kEvery) {
      const Eigen::Vector3d p_a = T_a_ref * points[i];
      const Eigen::Vector3d p_b = T_b_ref * points[i];
      if (!(p_a.z() > kMinDepthM && p_b.z() > kMinDepthM)) continue;
      sum += (views_.front().project(p_a) - views_.front().project(p_b)).squaredNorm();
      ++terms;
    }
  }
  return terms > 0 ? std::sqrt(sum / static_cast<double>(terms)) : 0;
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/camera_check.h"

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/survey/depth_agreement.h"

namespace efm {
namespace {

// The effort: finer maps, more events or pixels change the fits by less than their errors.
constexpr int kMaxMapPixels = 90'000;  // of a map
constexpr std::uint32_t kMaxMapEvents = 30'000;
constexpr double kPlaneStepPx = 2;
constexpr int kFittedPixels = 1500;  // of a window
constexpr double kWindowS = 0.2;
constexpr std::size_t kMinWindows = 3;
constexpr double kMinComparedS = 0.5;
constexpr double kMinBaselineM = 1e-3;
/// With less parallax by the baseline, either no depth depends on the two cameras, or the poses
/// have another unit, and the maps lie at wrong places.
constexpr double kMinBaselinePx = 1;
constexpr double kMinProbability = 0.8;  // of the depths that are compared
/// Points beyond the farthest plane would be moved along the epipolar lines.
constexpr double kFarther = 4;  // than the map's farthest plane

/// When a fault is reported. Right calibrations have less, with exact poses and with the errors of
/// trackers. Such errors have other baselines in each window: these are `kBlurred`, or more.
struct Limits {
  double least = 0;          // degrees, ms or per cent
  double errors = 0;         // least value in standard errors
  double least_blurred = 0;  // the same, if the poses blur the maps
  double errors_blurred = 0;
};
constexpr double kNever = 1e9;
constexpr Limits kLimits[] = {
    {0.06, 3, 0.1, 4}, {0.15, 2, 0.2, 4}, {0.12, 2, 0.2, 4}, {3, 2, 4, 6}, {0.5, 0, kNever, 0}};
constexpr double kBlurredPercent = 3.5;
constexpr double kMaxHiddenChange = 0.055;  // of the depths, by a rotation that poses may hide
constexpr double kMinClockPx = 0.25;        // a clock matters where the image moves
constexpr double kMinZoomGain = 0.002;      // of the correlation
constexpr double kMinCorrelation = 0.45;    // otherwise the maps are too different
constexpr double kMinCorrelationAcross = 0.3;

/// The parameters of a fit, in the order in which they are added: rotations across, along, roll
/// (degrees), clock (ms), focal length (per cent); and of each window the baseline (per cent), for
/// poses that travel too far make all depths too large.
constexpr int kParameters = 6;
constexpr int kClock = 3;
constexpr int kZoom = 4;
constexpr int kBaseline = 5;
using Parameters = Eigen::Matrix<double, kParameters, 1>;
using Information = Eigen::Matrix<double, kParameters, kParameters>;

/// Scales of the edges, pixels: from coarse to fine.
constexpr std::array<double, 3> kScalesPx{4, 2.5, 1.5};
using EdgeScales = std::array<cv::Mat1f, kScalesPx.size()>;

/// Returns the edges of a map: the difference of two means, relative to its local size.
EdgeScales edgesOf(const cv::Mat1f& confidence) {
  EdgeScales scales;
  for (std::size_t s = 0; s < scales.size(); ++s) {
    const int side = 2 * static_cast<int>(1.7 * (3 * kScalesPx[s] + 4)) + 1;
    cv::Mat1f near, far, power;
    cv::GaussianBlur(confidence, near, {}, kScalesPx[s]);
    cv::blur(confidence, far, {side, side});
    const cv::Mat1f edges = near - far;
    cv::blur(edges.mul(edges), power, {side, side});
    const double floor = 1e-3 * cv::mean(power)[0] + 1e-12;
    cv::sqrt(power + floor, power);
    scales[s] = edges / power;
  }
  return scales;
}

bool isInside(const cv::Mat1f& image, double x, double y) {
  return x >= 1 && y >= 1 && x < image.cols - 2 && y < image.rows - 2;
}

double valueAt(const cv::Mat1f& image, double x, double y) {
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const double right = x - column;
  const double below = y - row;
  const float* upper = image[row] + column;
  const float* lower = image[row + 1] + column;
  return (1 - below) * ((1 - right) * double{upper[0]} + right * double{upper[1]}) +
         below * ((1 - right) * double{lower[0]} + right * double{lower[1]});
}

/// A pixel of the reference camera's map, and how the parameters move it in the other map.
struct MapPixel {
  Eigen::Vector2d at;
  Eigen::Matrix<double, 2, kParameters> moves;  // pixels
};

/// The maps of a window by the other camera and by this one, in the reference view.
struct MapPair {
  EdgeScales other, own;
  std::vector<MapPixel> pixels;
};

/// Sums of one Gauss-Newton step, and of a correlation.
struct Sums {
  Information information = Information::Zero();
  Parameters gradient = Parameters::Zero();
  double xy = 0, xx = 0, yy = 0;
  std::size_t inside = 0;  // pixels that lie in both maps

  void add(const MapPair& pair, std::size_t scale, const Parameters& now) {
    const cv::Mat1f& own = pair.own[scale];
    for (const MapPixel& pixel : pair.pixels) {
      const Eigen::Vector2d at = pixel.at + pixel.moves * now;
      if (!isInside(own, at.x(), at.y())) continue;
      const double x = valueAt(pair.other[scale], pixel.at.x(), pixel.at.y());
      const double y = valueAt(own, at.x(), at.y());
      const Eigen::RowVector2d slope(
          0.5 * (valueAt(own, at.x() + 1, at.y()) - valueAt(own, at.x() - 1, at.y())),
          0.5 * (valueAt(own, at.x(), at.y() + 1) - valueAt(own, at.x(), at.y() - 1)));
      const Eigen::Matrix<double, 1, kParameters> row = slope * pixel.moves;
      const double residual = x - y;
      const double weight = 1 / (1 + residual * residual);  // Cauchy
      information += weight * row.transpose() * row;
      gradient += weight * residual * row.transpose();
      ++inside;
      xy += x * y;
      xx += x * x;
      yy += y * y;
    }
  }
  double correlation() const { return xy / std::sqrt(xx * yy + 1e-12); }
};

struct Fit {
  Parameters value = Parameters::Zero();
  double correlation = 0;
  double baseline_rms = 0;  // of the windows, per cent
};

using Pairs = std::vector<const MapPair*>;

/// Moves one map onto the other one.
/// @param free number of the parameters, from the first, that are fitted.
/// @param with_baseline true: also a baseline of each window.
/// @param scale the first one.
Fit fit(const Pairs& pairs, int free, bool with_baseline, Parameters start, std::size_t scale) {
  constexpr double kIndependentPixels = 3000;  // of all: neighbours see the same edge
  constexpr int kSteps = 5;                    // of each scale
  Parameters sigmas;                           // rotations have no prior
  sigmas << 1e3, 1e3, 1e3, 4, 1, 10;
  const Parameters prior = sigmas.cwiseAbs2().cwiseInverse();
  Fit result{start};
  std::vector<double> baselines(pairs.size(), start[kBaseline]);
  double count = 0;
  for (const MapPair* pair : pairs) count += static_cast<double>(pair->pixels.size());
  const double weight = kIndependentPixels / std::max(1.0, count);
  for (; scale < kScalesPx.size(); ++scale) {
    for (int step = 0; step < kSteps; ++step) {
      Information left = prior.asDiagonal();
      Parameters right = -prior.cwiseProduct(result.value);
      struct Own {
        Parameters row;
        double information = 0, gradient = 0;
      };
      std::vector<Own> own;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        Parameters now = result.value;
        now[kBaseline] = baselines[i];
        Sums sums;
        sums.add(*pairs[i], scale, now);
        left += weight * sums.information;
        right += weight * sums.gradient;
        if (!with_baseline) continue;
        // The window's own baseline is eliminated.
        const Own& of =
            own.emplace_back(Own{weight * sums.information.col(kBaseline),
                                 weight * sums.information(kBaseline, kBaseline) + prior[kBaseline],
                                 weight * sums.gradient[kBaseline] -
                                     prior[kBaseline] * (baselines[i] - start[kBaseline])});
        left -= of.row * of.row.transpose() / of.information;
        right -= of.row * (of.gradient / of.information);
      }
      const Eigen::VectorXd change = left.topLeftCorner(free, free).ldlt().solve(right.head(free));
      result.value.head(free) += change;
      for (std::size_t i = 0; i < own.size(); ++i) {
        baselines[i] += (own[i].gradient - own[i].row.head(free).dot(change)) / own[i].information;
      }
    }
  }
  Sums all;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Parameters now = result.value;
    now[kBaseline] = baselines[i];
    all.add(*pairs[i], kScalesPx.size() - 1, now);
    result.baseline_rms += baselines[i] * baselines[i] / static_cast<double>(pairs.size());
  }
  result.correlation = all.correlation();
  result.baseline_rms = std::sqrt(result.baseline_rms);
  return result;
}

/// Makes maps of one camera alone, in the reference view and around the depths of the map.
class OwnMaps {
 public:
  OwnMaps(const Rig& rig, const FusionMapperOptions& options, int camera, ExtractionMethod method)
      : options_(optionsOf(rig, options, method)),
        mapper_(rig, {camera}, options_),
        camera_(camera) {}

  std::optional<KeyframeDepthMap> map(const SamplePiece& piece) {
    const WindowData data = piece.along(piece.trajectory);
    const auto motion = motionIn(data, mapper_.rig(), {camera_}, options_);
    if (!motion || motion->parallax_px_m <= 0) return std::nullopt;
    DepthPlanesOptions planes = options_.planes;
    const double steps =
        motion->parallax_px_m * (1 / planes.min_depth_m - 1 / planes.max_depth_m) / kPlaneStepPx;
    planes.num_planes = static_cast<int>(std::clamp(steps, 10.0, 200.0));
    mapper_.setPlanes(planes);
    return mapper_.map(data.window, data.events, piece.trajectory);
  }

 private:
  static KeyframeMapperOptions optionsOf(const Rig& rig, const FusionMapperOptions& given,
                                         ExtractionMethod method) {
    KeyframeMapperOptions options;
    options.planes = given.keyframe.planes;
    options.planes.spacing = PlaneSpacing::kInverse;
    options.planes.max_depth_m *= kFarther;
    options.reference_camera = given.keyframe.reference_camera;
    const auto reference = static_cast<std::size_t>(options.reference_camera);
    options.view = given.keyframe.view;
    const ReferenceView view = makeReferenceView(rig.cameras.at(reference).model, options.view);
    const double scale = std::sqrt(kMaxMapPixels / static_cast<double>(view.pixels()));
    options.view.width = static_cast<int>(std::min(1.0, scale) * view.width);
    options.view.height = static_cast<int>(std::min(1.0, scale) * view.height);
    options.sweep.threads = given.keyframe.sweep.threads;
    options.sweep.kernel = given.keyframe.sweep.kernel;
    options.split = SplitFusionOptions::none();
    options.extraction.extraction = method;
    options.extraction.median_size = 1;  // of kPaper: its depths are not used
    options.extraction.min_probability = kMinProbability;
    return options;
  }

  KeyframeMapperOptions options_;
  KeyframeMapper mapper_;
  int camera_;
};

/// Compares one camera with another one.
class CameraFit {
 public:
  /// @param T_ref_cam pose of the camera in the reference view.
  /// @param baseline_m distance of the two cameras.
  CameraFit(Rigid3 T_ref_cam, double baseline_m)
      : T_ref_cam_(std::move(T_ref_cam)), baseline_m_(baseline_m) {
    Eigen::Vector3d across = T_ref_cam_.rotation.conjugate() * T_ref_cam_.translation;
    across.z() = 0;
    if (across.norm() < 1e-9) across = Eigen::Vector3d::UnitX();
    axes_ << across.normalized(), Eigen::Vector3d::UnitZ().cross(across.normalized()),
        Eigen::Vector3d::UnitZ();
  }

  void add(const SamplePiece& piece, const KeyframeDepthMap& other, const KeyframeDepthMap& own) {
    MapPair& pair = pairs_.emplace_back();
    pair.other = edgesOf(other.map.confidence);
    pair.own = edgesOf(own.map.confidence);
    clocks_.clear();
    constexpr int kTimes = 5;  // of a window
    const Window& window = piece.window;
    for (int i = 0; i < kTimes; ++i) {
      addClock(piece.trajectory, other.T_world_ref,
               window.t0_ns + (2 * i + 1) * (window.t1_ns - window.t0_ns) / (2 * kTimes));
    }
    const cv::Mat1f& depth = other.map.depth;
    const int every = std::max(1, cv::countNonZero(depth > 0) / kFittedPixels);
    constexpr double kBeside[5][2] = {{0, 0}, {2, 0}, {-2, 0}, {0, 2}, {0, -2}};
    int index = 0;
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        if (!(depth(y, x) > 0) || ++index % every != 0) continue;
        const double* beside = kBeside[index / every % 5];
        const Eigen::Vector2d at(x + beside[0], y + beside[1]);
        if (!isInside(depth, at.x(), at.y())) continue;
        pair.pixels.push_back({at, movesOf(other.view, at, double{depth(y, x)})});
        depths_m_.push_back(double{depth(y, x)});
      }
    }
    if (pair.pixels.empty()) pairs_.pop_back();
  }

  std::size_t windows() const { return pairs_.size(); }

  /// @param scale size of a pixel of the maps, in raw pixels.
  void judge(double scale, CameraComparison& result) const {
    Pairs all;
    for (const MapPair& pair : pairs_) all.push_back(&pair);
    if (scale * 100 * shiftBy(Parameters::Unit(kBaseline)) < kMinBaselinePx) return;
    const Fit turned = fit(all, kClock, false, Parameters::Zero(), 0);
    const Fit timed = fit(all, kClock + 1, false, turned.value, 1);
    const Fit whole = fit(all, kClock + 1, true, timed.value, 1);
    result.scale = otherScale(all, whole);
    if (result.scale != 1) return;
    const Fit zoomed = fit(all, kZoom + 1, true, whole.value, 1);
    // Two fits must agree, which differ in what else may explain the distance of the maps.
    const auto sure = [](double a, double b) {
      return a * b <= 0 ? 0 : std::abs(a) < std::abs(b) ? a : b;
    };
    Parameters value = Parameters::Zero();
    for (int i = 0; i < kClock; ++i) value[i] = sure(turned.value[i], whole.value[i]);
    value[kClock] = sure(timed.value[kClock], whole.value[kClock]);
    if (scale * shiftBy(value[kClock] * Parameters::Unit(kClock)) < kMinClockPx) value[kClock] = 0;
    const bool zooms = zoomed.correlation - whole.correlation >= kMinZoomGain;
    if (zooms) value[kZoom] = zoomed.value[kZoom];
    const Parameters errors = errorsOf(all, whole);
    result.correlation = whole.correlation;
    const bool blurred = (zooms ? zoomed : whole).baseline_rms >= kBlurredPercent ||
                         whole.correlation < kMinCorrelation;
    result.blurred = blurred;
    const double along_rad = kRadiansPerDegree * std::abs(blurred ? value[1] : turned.value[1]);
    if (along_rad > 0) result.sure_depth_m = 0.1 * baseline_m_ / along_rad;
    const auto isProven = [&](int i) {
      const Limits& limits = kLimits[i];
      const double size = std::abs(value[i]);
      return whole.correlation >= (i == 0 ? kMinCorrelationAcross : kMinCorrelation) &&
             size >= (blurred ? limits.least_blurred : limits.least) &&
             size >= (blurred ? limits.errors_blurred : limits.errors) * errors[i];
    };
    const auto strength = [&](int i) { return std::abs(value[i]) / kLimits[i].least; };
    int found = 0;
    for (int i = 1; i <= kZoom; ++i) found = strength(i) > strength(found) ? i : found;
    if (strength(kZoom) >= 1) found = kZoom;  // it looks like a clock, too
    if (strength(found) < 1) {
      // The fit with baselines may take a rotation for an error of the poses.
      const double along_deg = std::max(std::abs(turned.value[1]), std::abs(whole.value[1]));
      const bool hides = blurred && depthChange(along_deg + errors[1]) >= kMaxHiddenChange;
      result.fault = hides ? CameraFault::kUnknown : CameraFault::kNone;
      return;
    }
    if (!isProven(found) && isProven(0)) found = 0;  // poses hardly move points across the lines
    result.fault = isProven(found) ? static_cast<CameraFault>(1 + found) : CameraFault::kUnknown;
    if (!blurred) value.head<kClock>() = turned.value.head<kClock>();  // the better estimate
    if (result.fault != CameraFault::kUnknown) describe(found, value, scale, result);
  }

 private:
  /// Returns the distance of the cameras, relative to the given one, with which the maps fit better
  /// than after a fit; 1 if there is none. Positions of the poses in another unit or scale look so.
  static double otherScale(const Pairs& all, const Fit& whole) {
    Parameters best = Parameters::Zero();
    double best_correlation = 0;
    std::size_t pixels = 0;
    for (const MapPair* pair : all) pixels += pair->pixels.size();
    for (const double factor : {1.0, 0.7, 0.5, 0.3, 0.1, 0.01, 1.4, 2.0, 3.0, 10.0, 100.0}) {
      const Parameters start = 100 * (factor - 1) * Parameters::Unit(kBaseline);
      Sums sums;
      for (const MapPair* pair : all) sums.add(*pair, 0, start);
      const bool is_seen = 2 * sums.inside >= pixels;  // otherwise the fit is one of chance
      if (!is_seen || sums.correlation() <= best_correlation) continue;
      best_correlation = sums.correlation();
      best = start;
    }
    if (best.isZero()) return 1;
    const Fit scaled = fit(all, kClock, true, best, 0);
    if (scaled.correlation <= std::max(whole.correlation, kMinCorrelation)) return 1;
    return 1 + 0.01 * std::copysign(scaled.baseline_rms, best[kBaseline]);
  }

  /// Returns the standard errors of a fit, from the fits without one window each (jackknife).
  static Parameters errorsOf(const Pairs& all, const Fit& whole) {
    std::vector<Parameters> without;
    Parameters mean = Parameters::Zero();
    const auto count = static_cast<double>(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      Pairs others = all;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      without.push_back(fit(others, kClock + 1, true, whole.value, kScalesPx.size() - 1).value);
      mean += without.back() / count;
    }
    Parameters sum = Parameters::Zero();
    for (const Parameters& value : without) sum += (value - mean).cwiseAbs2();
    return (sum * (count - 1) / count).cwiseSqrt();
  }

  /// Tells what a fault does, and the calibration without it.
  void describe(int found, Parameters value, double scale, CameraComparison& result) const {
    if (found < kClock) value[kClock] = 0;
    if (found >= kClock) value.head(kClock).setZero();
    if (found == kZoom) value[kClock] = 0;
    if (found != kZoom) value[kZoom] = 0;
    result.shift_px = scale * shiftBy(value);
    result.clock_s = 1e-3 * value[kClock];
    result.zoom = 1 + 0.01 * value[kZoom];
    if (found >= kClock) return;
    result.angle_rad = kRadiansPerDegree * std::abs(value[found]);
    result.R_cam_fitted = rotationBy(kRadiansPerDegree * (axes_ * value.head<3>()));
    result.depth_change = depthChange(std::abs(value[1]));
  }

  /// Returns the change of a fused depth by a rotation along the epipolar lines: relative, at the
  /// median depth.
  double depthChange(double along_deg) const {
    std::vector<double> depths_m = depths_m_;
    return kRadiansPerDegree * along_deg * upperMedian(depths_m) / baseline_m_;
  }

  /// Adds a time of the window: how far the rig moves the scene in 5 ms before and after it.
  void addClock(const Trajectory& trajectory, const Rigid3& T_world_ref, std::int64_t t_ns) {
    const auto now = trajectory.poseAt(t_ns);
    const auto early = trajectory.poseAt(t_ns - kClockNs);
    const auto late = trajectory.poseAt(t_ns + kClockNs);
    if (!now || !early || !late) return;
    const Rigid3 T_ref_now = T_world_ref.inverse() * *now;
    clocks_.push_back(
        {T_ref_now * early->inverse() * T_world_ref, T_ref_now * late->inverse() * T_world_ref});
  }

  /// Returns where a point of the reference view moves in the camera's map, per unit of the
  /// parameters by which the camera's calibration is corrected.
  Eigen::Matrix<double, 2, kParameters> movesOf(const ReferenceView& view,
                                                const Eigen::Vector2d& at, double depth_m) const {
    const Eigen::Vector3d p_ref = view.pointAt(at.x(), at.y(), depth_m);
    const Eigen::Vector3d p_cam = T_ref_cam_.inverse() * p_ref;
    const auto to = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
      return view.project(p) - at;
    };
    Eigen::Matrix<double, 2, kParameters> moves = Eigen::Matrix<double, 2, kParameters>::Zero();
    for (int axis = 0; axis < kClock; ++axis) {
      moves.col(axis) = to(T_ref_cam_ * (rotationBy(-kRadiansPerDegree * axes_.col(axis)) * p_cam));
    }
    constexpr double kBetweenMs = 2e-6 * kClockNs;
    for (const auto& [early, late] : clocks_) {
      moves.col(kClock) += (to(late * p_ref) - to(early * p_ref)) /
                           (kBetweenMs * static_cast<double>(clocks_.size()));
    }
    moves.col(kBaseline) = to(p_ref - 0.01 * T_ref_cam_.translation);
    moves.col(kZoom) =
        to(T_ref_cam_ * Eigen::Vector3d(1.01 * p_cam.x(), 1.01 * p_cam.y(), p_cam.z()));
    return moves;
  }

  /// Returns the root mean square of the pixels' moves.
  double shiftBy(const Parameters& value) const {
    double sum = 0;
    for (const MapPair& pair : pairs_) {
      for (const MapPixel& pixel : pair.pixels) sum += (pixel.moves * value).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(depths_m_.size()));
  }

  static constexpr std::int64_t kClockNs = 5'000'000;
  Rigid3 T_ref_cam_;
  double baseline_m_;
  Eigen::Matrix3d axes_;  // of the rotations, in the camera's frame
  std::vector<MapPair> pairs_;
  std::vector<double> depths_m_;               // of all pixels
  std::vector<std::array<Rigid3, 2>> clocks_;  // of the current window
};

}  // namespace

std::vector<CameraComparison> compareCameras(const Rig& rig,
                                             const std::vector<WindowSample>& samples,
                                             const FusionMapperOptions& options) {
  const std::vector<int> cameras = selectedCameras(rig, options.cameras);
  if (cameras.size() < 2 || samples.empty()) return {};
  const auto cameraAt = [&](int index) -> const RigCamera& {
    return rig.cameras.at(static_cast<std::size_t>(index));
  };
  const int reference = options.keyframe.reference_camera;
  const bool selected = std::count(cameras.begin(), cameras.end(), reference) > 0;
  const int other = selected ? reference : cameras.front();
  const Rigid3 T_rig_ref = cameraAt(reference).T_rig_cam *
                           Rigid3{Eigen::Quaterniond::Identity(), options.keyframe.view.offset_m};
  const auto pieces = piecesOf(samples, options.trajectory, {kWindowS, kMaxMapEvents});
  double seen_s = 0;
  OwnMaps other_maps(rig, options, other, ExtractionMethod::kAggregated);
  std::vector<std::optional<KeyframeDepthMap>> of_other;
  for (const SamplePiece& piece : pieces) {
    of_other.push_back(other_maps.map(piece));
    if (of_other.back()) seen_s += secondsBetween(piece.window.t0_ns, piece.window.t1_ns);
  }
  if (seen_s < kMinComparedS) return {};
  std::vector<CameraComparison> comparisons;
  for (const int camera : cameras) {
    const double baseline_m =
        (cameraAt(camera).T_rig_cam.translation - cameraAt(other).T_rig_cam.translation).norm();
    if (baseline_m < kMinBaselineM) continue;  // no fused depth depends on the two cameras
    OwnMaps maps(rig, options, camera, ExtractionMethod::kPaper);
    CameraFit fit(T_rig_ref.inverse() * cameraAt(camera).T_rig_cam, baseline_m);
    double scale = 1;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (!of_other[i]) continue;
      const auto own = maps.map(pieces[i]);
      if (!own) continue;
      fit.add(pieces[i], *of_other[i], *own);
      scale = cameraAt(camera).model.fx / own->view.fx;
    }
    if (fit.windows() < kMinWindows) continue;
    CameraComparison& comparison = comparisons.emplace_back();
    comparison.camera = camera;
    comparison.other = other;
    fit.judge(scale, comparison);
  }
  return comparisons;
}

Rig fittedRig(const CameraComparison& found, Rig rig) {
  RigCamera& camera = rig.cameras[static_cast<std::size_t>(found.camera)];
  camera.T_rig_cam = camera.T_rig_cam * Rigid3{found.R_cam_fitted, Eigen::Vector3d::Zero()};
  camera.model.fx *= found.zoom;
  camera.model.fy *= found.zoom;
  return rig;
}

double sharpnessGain(const CameraComparison& found, double travel, const Rig& rig,
                     const std::vector<WindowSample>& samples, const FusionMapperOptions& options) {
  const Rig fitted = fittedRig(found, rig);
  EventSharpness before(rig, options);
  EventSharpness after(fitted, options);
  double sum = 0;
  auto pieces = piecesOf(samples, options.trajectory);
  for (SamplePiece& piece : pieces) {
    const double as_given = before.of(piece, piece.trajectory);
    for (Event& event : piece.events[static_cast<std::size_t>(found.camera)]) {
      event.t_ns += durationFromSeconds(found.clock_s);
    }
    Trajectory scaled(options.trajectory);
    for (const auto& [t_ns, pose] : piece.trajectory.poses()) {
      scaled.add({t_ns, {pose.rotation, travel * pose.translation}});
    }
    const double as_fitted = after.of(piece, scaled);
    if (as_given > 0 && as_fitted > 0) sum += std::log(as_fitted / as_given);
  }
  return pieces.empty() ? 1 : std::exp(sum / static_cast<double>(pieces.size()));
}

}  // namespace efm

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "maps/refinement/pose_refinement.h"
#include "random_poses.h"

namespace efm {
namespace {

using test::drawMatrix;
using test::drawPose;
using test::drawVector;

Vector6d rotationOnly(const Eigen::Vector3d& rotation) {
  Vector6d difference = Vector6d::Zero();
  difference.tail<3>() = rotation;
  return difference;
}

TEST(PoseDifference, IsWorkedOutByHand) {
  // 90 deg about z, and 1 m along x.
  const Rigid3 T_a_b{Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5)), {1, 0, 0}};
  Vector6d expected;
  expected << 1, 0, 0, 0, 0, M_PI / 2;
  EXPECT_LT((differenceOf(T_a_b) - expected).norm(), 1e-15);
}

TEST(PoseDifference, OfNothingIsZeroAndBackExactly) {
  EXPECT_EQ(differenceOf(Rigid3{}), Vector6d::Zero());
  EXPECT_TRUE(test::sameBits(rigidFromDifference(Vector6d::Zero()), Rigid3{}));
}

RC_GTEST_PROP(PoseDifference, OfAPoseGivesThePoseBack, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const Rigid3 T_a_b = drawPose(1e3, random);
  const Rigid3 back = rigidFromDifference(differenceOf(T_a_b));
  RC_ASSERT(back.translation == T_a_b.translation);
  // Matrices are compared, because a quaternion and its negative are the same rotation.
  RC_ASSERT((back.rotation.matrix() - T_a_b.rotation.matrix()).norm() < 1e-14);
}

RC_GTEST_PROP(PoseDifference, IsFoundAgainUpToHalfARotation, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const Eigen::Vector3d axis = drawVector(1, random).normalized();
  // Near pi, only the scalar of the quaternion determines the angle: 1e-9 is the limit.
  for (const double angle : {1e-300, 1e-20, 1e-12, 1e-6, 1e-3, 1.0, M_PI - 1e-3, M_PI - 1e-9}) {
    const Vector6d difference = rotationOnly(angle * axis);
    RC_ASSERT((differenceOf(rigidFromDifference(difference)) - difference).norm() <=
              1e-15 + 1e-14 * angle);
  }
}

RC_GTEST_PROP(PoseDifference, DoesNotDependOnTheSignOfAQuaternion, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const Rigid3 T_a_b = drawPose(1, random);
  const Rigid3 negated{Eigen::Quaterniond(-T_a_b.rotation.coeffs()), T_a_b.translation};
  RC_ASSERT((differenceOf(negated) - differenceOf(T_a_b)).norm() < 1e-14);
  RC_ASSERT(differenceOf(negated).tail<3>().norm() <= M_PI + 1e-15);
}

RC_GTEST_PROP(SqrtInformation, ScalesErrorsOfSixAndThreeDimensionsToUnitCovariance, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const auto scales = [](const auto& matrix, double tolerance) {
    const auto unit = sqrtInformation(matrix);
    return (unit * matrix * unit.transpose()).isIdentity(tolerance);
  };
  Matrix6d factor6 = drawMatrix<6>(random);
  factor6.topRows<3>() *= 1e-2;  // metres and radians may differ
  RC_ASSERT(scales(Matrix6d(factor6 * factor6.transpose()), 1e-10));
  const Eigen::Matrix3d factor = drawMatrix<3>(random);
  const Eigen::Matrix3d covariance = factor * factor.transpose();
  RC_ASSERT(scales(covariance, 1e-12));
  RC_ASSERT(isPositiveDefinite(covariance));
  RC_ASSERT(!isPositiveDefinite(-covariance));
  RC_ASSERT(!isPositiveDefinite(covariance -
                                2 * maxEigenvalue(covariance) * Eigen::Matrix3d::Identity()));
}

using test::drawMotion;
using test::metresApart;
using test::moved;
using test::priorOf;
using test::radiansApart;
using test::sameBits;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Returns the derivative of an error by the small motions of a pose: central differences.
Eigen::MatrixXd byMotions(const std::function<Eigen::VectorXd(const Rigid3&)>& error,
                          const Rigid3& pose, double step) {
  Eigen::MatrixXd jacobian(error(pose).size(), 6);
  for (int i = 0; i < 6; ++i) {
    const Vector6d d = step * Vector6d::Unit(i);
    jacobian.col(i) = (error(moved(pose, d)) - error(moved(pose, -d))) / (2 * step);
  }
  return jacobian;
}

Vector6d errorVector(const RelativePoseFactor& factor, const Rigid3& T_world_from,
                     const Rigid3& T_world_to) {
  return factor.sqrt_information *
             differenceOf(factor.T_from_to.inverse() * (T_world_from.inverse() * T_world_to)) +
         factor.offset;
}

RelativePoseFactor factorBetween(std::size_t from, std::size_t to, const Rigid3& T_from_to,
                                 double sigma_m, double sigma_rad) {
  Vector6d sqrt_information;
  sqrt_information << Eigen::Vector3d::Constant(1 / sigma_m),
      Eigen::Vector3d::Constant(1 / sigma_rad);
  return {from, to, T_from_to, sqrt_information.asDiagonal()};
}

/// Draws points of a keyframe and the same points of the map with noise.
std::vector<PointPair> drawPairs(const Rigid3& T_map_ref, int count, double sigma_m,
                                 std::mt19937& random) {
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    PointPair pair;
    pair.p_ref = drawVector(1, random) + Eigen::Vector3d(0, 0, 3);
    pair.p_map = T_map_ref * pair.p_ref + drawVector(sigma_m, random);
    pair.sqrt_information *= 100;  // 1 cm
    pairs.push_back(pair);
  }
  return pairs;
}

AlignmentOptions patient() {
  AlignmentOptions options;
  options.max_iterations = 100;
  return options;
}

/// Returns a ring of nodes with exact factors between nodes that are one or two steps apart.
PoseGraph ring(std::size_t count) {
  PoseGraph graph;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * static_cast<double>(i) / static_cast<double>(count);
    graph.T_world_node.push_back(
        {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
         {3 * std::cos(angle), 3 * std::sin(angle), 0.1 * std::sin(2 * angle)}});
  }
  graph.fixed.assign(count, false);
  graph.fixed[0] = true;
  for (std::size_t i = 0; i < count; ++i) {
    for (const std::size_t step : {1, 2}) {
      const std::size_t to = (i + step) % count;
      graph.factors.push_back(factorBetween(
          i, to, graph.T_world_node[i].inverse() * graph.T_world_node[to], 0.01, 0.01));
    }
  }
  return graph;
}

void perturbFree(PoseGraph& graph, double sigma_m, double sigma_rad, std::mt19937& random) {
  for (std::size_t i = 0; i < graph.T_world_node.size(); ++i) {
    const Rigid3 motion = drawMotion(sigma_m, sigma_rad, random);
    if (!graph.fixed[i]) graph.T_world_node[i] = graph.T_world_node[i] * motion;
  }
}

double mostApart(const std::vector<Rigid3>& a, const std::vector<Rigid3>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max({most, metresApart(a[i], b[i]), radiansApart(a[i], b[i])});
  }
  return most;
}

RC_GTEST_PROP(AlignToMap, FindsThePoseOfExactPairs, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const Rigid3 T_map_ref = drawPose(3, random);
  const std::vector<PointPair> pairs = drawPairs(T_map_ref, 50, 0, random);
  const Rigid3 start = T_map_ref * drawMotion(0.02, 0.01, random);
  // A prior of 1 m and 1 rad keeps 1e-4 / 50 of the 4 cm against 50 pairs of 1 cm.
  const Rigid3 found = alignToMap(pairs, priorOf(start, 1, 1), start, patient()).value();
  RC_ASSERT(metresApart(found, T_map_ref) < 1e-5);
  RC_ASSERT(radiansApart(found, T_map_ref) < 1e-5);
}

TEST(AlignToMap, WeighsPairsAndPriorByTheirInformation) {
  // 4 pairs (sigma 1 cm) are 9 mm farther than the prior (sigma 1 cm): the result is 4/5 of 9 mm,
  // worked out by hand. The rotation is held by its prior.
  std::vector<PointPair> pairs;
  for (const double x : {-1, 1}) {
    for (const double y : {-1, 1}) {
      PointPair pair{{x + 0.009, y, 2}, {x, y, 2}, 100 * Eigen::Matrix3d::Identity()};
      pairs.push_back(pair);
    }
  }
  AlignmentOptions options = patient();
  options.robust_sigmas = 1e6;
  const Rigid3 found = alignToMap(pairs, priorOf({}, 0.01, 1e-6), {}, options).value();
  EXPECT_NEAR(found.translation.x(), 0.0072, 1e-6);
  EXPECT_NEAR(found.translation.y(), 0, 1e-6);
}

/// Solving ends if the sum of squares (here 0.25) changes by less than the fraction 1e-6: by 5e-4
/// standard deviations of the prior (0.1 m, 0.05 rad).
constexpr double kSolvedTo = 5e-5;

/// Returns the motion from the prior. The pairs constrain the points along the directions `held`
/// only. The map is 5 cm farther along z.
Vector6d alignedAlong(const std::vector<Eigen::Vector3d>& p_ref, const Eigen::Vector3d& held,
                      const Rigid3& T_map_ref) {
  std::vector<PointPair> pairs;
  const Rigid3 T_map_truth = T_map_ref * Rigid3{Eigen::Quaterniond::Identity(), {0, 0, 0.05}};
  const Eigen::Matrix3d R_map_ref = T_map_ref.rotation.toRotationMatrix();
  for (const Eigen::Vector3d& p : p_ref) {
    const Eigen::Matrix3d information = 100 * Eigen::Matrix3d(held.asDiagonal());
    pairs.push_back({T_map_truth * p, p, information * R_map_ref.transpose()});
  }
  AlignmentOptions options = patient();
  options.robust_sigmas = 100;
  return differenceOf(T_map_ref.inverse() *
                      *alignToMap(pairs, priorOf(T_map_ref, 0.1, 0.05), T_map_ref, options));
}

TEST(AlignToMap, DirectionsThatAPlaneOrALineLeavesOpenStayWithThePrior) {
  std::vector<Eigen::Vector3d> plane;
  for (int x = -4; x <= 4; ++x) {
    for (int y = -4; y <= 4; ++y) plane.emplace_back(0.2 * x, 0.2 * y, 2);
  }
  std::vector<Eigen::Vector3d> line;
  for (int x = -40; x <= 40; ++x) line.emplace_back(0.02 * x, 0, 2);
  struct Case {
    std::vector<Eigen::Vector3d> p_ref;
    Eigen::Vector3d held;
    std::vector<int> open;
  };
  std::mt19937 random(3);
  for (const Case& shape :
       {Case{plane, {0, 0, 1}, {0, 1, 5}}, Case{line, {0, 1, 1}, {0, 1, 3, 4, 5}}}) {
    const Vector6d difference = alignedAlong(shape.p_ref, shape.held, drawPose(2, random));
    EXPECT_NEAR(difference[2], 0.05, 1e-4) << "81 pairs of 1 cm against 10 cm";
    for (const int open : shape.open) EXPECT_NEAR(difference[open], 0, kSolvedTo) << open;
  }
}

TEST(AlignToMap, OutliersOfAThirdOfThePairsHaveLittleWeight) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    std::mt19937 random(seed);
    const Rigid3 T_map_ref = drawPose(3, random);
    std::vector<PointPair> pairs = drawPairs(T_map_ref, 200, 0.01, random);
    const Eigen::Vector3d aside(0.3, 0.2, -0.1);  // all to one side: no average of 0
    for (int i = 0; i < 60; ++i) pairs[i].p_map += aside;
    const Rigid3 start = T_map_ref * drawMotion(0.02, 0.01, random);
    const Rigid3 found = alignToMap(pairs, priorOf(start, 0.05, 0.02), start, patient()).value();
    // 140 pairs of 1 cm at 3 m give about 2 mm, because rotation and translation are correlated.
    // Outliers at 37 sigmas still have 1/12 of the maximum weight of a pair.
    EXPECT_LT(metresApart(found, T_map_ref), 0.008) << seed;
    EXPECT_LT(radiansApart(found, T_map_ref), 0.004) << seed;
    AlignmentOptions trusting = patient();
    trusting.robust_sigmas = 1e6;
    const Rigid3 pulled = alignToMap(pairs, priorOf(start, 0.05, 0.02), start, trusting).value();
    EXPECT_GT((pulled * Eigen::Vector3d(0, 0, 3) - T_map_ref * Eigen::Vector3d(0, 0, 3)).norm(),
              0.05)
        << "without the loss: " << seed;
  }
}

TEST(AlignToMap, FindsNothingWhereAPairOrThePriorIsNotFinite) {
  std::mt19937 random(6);
  const Rigid3 start = drawPose(3, random);
  for (int what = 0; what < 5; ++what) {
    std::vector<PointPair> pairs = drawPairs(start, 10, 0.01, random);
    PosePrior prior = priorOf(start, 1, 1);
    if (what == 0) pairs[3].p_map.x() = kNan;
    if (what == 1) pairs[3].p_ref.z() = std::numeric_limits<double>::infinity();
    if (what == 2) pairs[3].sqrt_information(1, 1) = kNan;
    if (what == 3) prior.T_map_ref.translation.z() = kNan;
    if (what == 4) prior.sqrt_information(5, 5) = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(alignToMap(pairs, prior, start, {})) << what;
  }
}

TEST(SolvePoseGraph, ARingComesBackFromAPerturbedStartAndFixedPosesStay) {
  PoseGraph exact = ring(20);
  exact.fixed[5] = exact.fixed[6] = true;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    std::mt19937 random(seed);
    PoseGraph graph = exact;
    perturbFree(graph, 0.2, 0.1, random);
    solvePoseGraph({}, graph);
    EXPECT_LT(mostApart(graph.T_world_node, exact.T_world_node), 1e-6) << seed;
    for (const std::size_t i : {0, 5, 6}) {
      EXPECT_TRUE(sameBits(graph.T_world_node[i], exact.T_world_node[i])) << i;
    }
  }
}

TEST(SolvePoseGraph, AnOffsetMovesAFactorsMinimumByAsMuch) {
  // The error is 100 d + 2, least at d = -2 cm (d: translation along the first axis).
  PoseGraph graph{{Rigid3{}, Rigid3{}}, {true, false}, {factorBetween(0, 1, {}, 0.01, 0.01)}};
  graph.factors[0].offset[0] = 2;
  solvePoseGraph({}, graph);
  EXPECT_NEAR(graph.T_world_node[1].translation.x(), -0.02, 1e-9);
  EXPECT_NEAR(errorOf(graph.factors[0], Rigid3{}, graph.T_world_node[1]), 0, 1e-6);
  EXPECT_NEAR(errorOf(graph.factors[0], Rigid3{}, Rigid3{}), 2, 1e-12);
}

TEST(SolvePoseGraph, AWrongRobustFactorMovesNothing) {
  const PoseGraph exact = ring(20);
  for (const bool robust : {true, false}) {
    PoseGraph graph = exact;
    RelativePoseFactor wrong = factorBetween(2, 12, Rigid3{}, 0.01, 0.01);  // 6 m off
    wrong.robust = robust;
    graph.factors.push_back(wrong);
    solvePoseGraph({}, graph);
    const double most = mostApart(graph.T_world_node, exact.T_world_node);
    if (robust) {
      EXPECT_LT(most, 0.02);
    } else {
      EXPECT_GT(most, 0.1) << "without the loss";
    }
  }
}

TEST(SolvePoseGraph, WithoutAnythingToSolvePosesStay) {
  PoseGraph empty;
  solvePoseGraph({}, empty);
  EXPECT_TRUE(empty.T_world_node.empty());

  std::mt19937 random(7);
  PoseGraph graph = ring(6);
  perturbFree(graph, 0.1, 0.1, random);
  const std::vector<Rigid3> before = graph.T_world_node;
  const auto unmoved = [&](PoseGraph changed, const char* why, bool solved = true) {
    EXPECT_EQ(solvePoseGraph({}, changed), solved) << why;
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_LT(metresApart(changed.T_world_node[i], before[i]), 1e-12) << why;
      EXPECT_LT(radiansApart(changed.T_world_node[i], before[i]), 1e-12) << why;
    }
  };
  PoseGraph no_factors = graph;
  no_factors.factors.clear();
  unmoved(no_factors, "no factors");
  PoseGraph all_fixed = graph;
  all_fixed.fixed.assign(6, true);
  unmoved(all_fixed, "everything fixed");
  PoseGraph says_nothing = graph;
  for (RelativePoseFactor& factor : says_nothing.factors) factor.sqrt_information.setZero();
  unmoved(says_nothing, "no information");
  for (int what = 0; what < 4; ++what) {
    PoseGraph not_a_number = graph;
    RelativePoseFactor& factor = not_a_number.factors[3];
    factor.robust = what % 2 == 1;
    if (what == 0) factor.T_from_to.translation.x() = kNan;
    if (what == 1) factor.sqrt_information(0, 0) = kNan;
    if (what == 2) factor.offset[4] = std::numeric_limits<double>::infinity();
    if (what == 3) factor.T_from_to.rotation.coeffs().setConstant(kNan);
    unmoved(not_a_number, "not a number", false);
  }
}

RC_GTEST_PROP(PoseCovariance, IsTheInverseOfTheNumericInformation, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  PoseGraph graph;
  for (int i = 0; i < 4; ++i) graph.T_world_node.push_back(drawPose(2, random));
  graph.fixed = {true, false, false, false};
  const std::vector<std::pair<std::size_t, std::size_t>> between = {{0, 1}, {1, 2}, {2, 3}, {3, 1}};
  for (const auto& [from, to] : between) {
    graph.factors.push_back({from, to, graph.T_world_node[from].inverse() * graph.T_world_node[to],
                             10 * drawMatrix<6>(random)});
  }
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(18, 18);
  for (const RelativePoseFactor& factor : graph.factors) {
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, 24);
    for (const std::size_t node : {factor.from, factor.to}) {
      const auto error = [&](const Rigid3& T_a_b) {
        std::vector<Rigid3> poses = graph.T_world_node;
        poses[node] = T_a_b;
        return errorVector(factor, poses[factor.from], poses[factor.to]);
      };
      jacobian.middleCols(6 * static_cast<int>(node), 6) =
          byMotions(error, graph.T_world_node[node], 1e-5);
    }
    information += jacobian.rightCols(18).transpose() * jacobian.rightCols(18);
  }
  const Eigen::MatrixXd expected = information.inverse();
  for (int node = 1; node < 4; ++node) {
    const auto covariance =
        poseCovariance(PoseGraphOptions(), graph, static_cast<std::size_t>(node));
    RC_ASSERT(covariance.has_value());
    const Matrix6d block = expected.block<6, 6>(6 * (node - 1), 6 * (node - 1));
    RC_ASSERT((*covariance - block).norm() < 1e-5 * block.norm());
  }
}

TEST(PoseCovariance, IsNothingWhereFactorsLeaveThePoseOpen) {
  PoseGraph graph = ring(4);
  EXPECT_FALSE(poseCovariance(PoseGraphOptions(), graph, 0)) << "it is fixed";
  EXPECT_TRUE(poseCovariance(PoseGraphOptions(), graph, 1));
  PoseGraph floating = graph;
  floating.fixed[0] = false;
  EXPECT_FALSE(poseCovariance(PoseGraphOptions(), floating, 1)) << "all may move together";
  PoseGraph alone = graph;
  alone.factors.clear();
  EXPECT_FALSE(poseCovariance(PoseGraphOptions(), alone, 1)) << "no factors";
  PoseGraph pair{{Rigid3{}, Rigid3{}}, {true, false}, {factorBetween(0, 1, {}, 0.01, 0.01)}};
  EXPECT_TRUE(poseCovariance(PoseGraphOptions(), pair, 1));
  pair.factors[0].sqrt_information(0, 0) = 0;
  EXPECT_FALSE(poseCovariance(PoseGraphOptions(), pair, 1)) << "one direction is open";
  graph.factors[1].sqrt_information(2, 2) = kNan;
  EXPECT_FALSE(poseCovariance(PoseGraphOptions(), graph, 1)) << "not finite";
}

}  // namespace

}  // namespace efm

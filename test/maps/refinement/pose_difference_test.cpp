// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/pose_refinement.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

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
  // As matrices: a quaternion and its negative are the same rotation.
  RC_ASSERT((back.rotation.matrix() - T_a_b.rotation.matrix()).norm() < 1e-14);
}

RC_GTEST_PROP(PoseDifference, IsFoundAgainUpToHalfARotation, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const Eigen::Vector3d axis = drawVector(1, random).normalized();
  // Near pi the angle depends on the scalar of the quaternion alone: 1e-9 is the limit.
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

RC_GTEST_PROP(SqrtInformation, ScalesErrorsToUnitCovariance, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  Matrix6d factor = drawMatrix<6>(random);
  factor.topRows<3>() *= 1e-2;  // metres and radians may differ
  const Matrix6d covariance = factor * factor.transpose();
  const Matrix6d unit = sqrtInformation(covariance);
  RC_ASSERT((unit * covariance * unit.transpose() - Matrix6d::Identity()).norm() < 1e-10);
}

RC_GTEST_PROP(SqrtInformation, OfThreeDimensionsScalesErrorsToUnitCovariance, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const Eigen::Matrix3d factor = drawMatrix<3>(random);
  const Eigen::Matrix3d covariance = factor * factor.transpose();
  const Eigen::Matrix3d unit = sqrtInformation(covariance);
  RC_ASSERT((unit * covariance * unit.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  RC_ASSERT(isPositiveDefinite(covariance));
  RC_ASSERT(!isPositiveDefinite(-covariance));
  RC_ASSERT(!isPositiveDefinite(covariance -
                                2 * maxEigenvalue(covariance) * Eigen::Matrix3d::Identity()));
}

}  // namespace
}  // namespace efm

#include "photocoag/mor/deim.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>
#include <set>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_matrix(Index rows, Index cols, std::uint64_t seed) {
  MatrixXd matrix(rows, cols);
  for (Index i = 0; i < matrix.size(); ++i) {
    matrix.data()[i] = standard_normal(seed, static_cast<std::uint64_t>(i), RandomStream::kTest);
  }
  return matrix;
}

// A family like the source: exp(-a x), smooth in the parameter.
MatrixXd exponentials(Index rows, int count) {
  MatrixXd snapshots(rows, count);
  for (int a = 0; a < count; ++a) {
    for (Index i = 0; i < rows; ++i) {
      snapshots(i, a) = std::exp(-(0.2 + 1.8 * a / (count - 1)) * 3.0 * double(i) / double(rows));
    }
  }
  return snapshots;
}

VectorXd interpolate(const Deim& points, const VectorXd& vector) {
  return points.interpolation * vector(points.dofs);
}

TEST(Deim, ReproducesTheSpanOfItsBasis) {
  const MatrixXd snapshots = random_matrix(60, 4, 1) * random_matrix(4, 9, 2);  // rank 4
  const Deim points = deim(snapshots, 7);
  ASSERT_EQ(points.dofs.size(), 4U);  // the rank, not what was allowed
  for (Index k = 0; k < snapshots.cols(); ++k) {
    EXPECT_LT((interpolate(points, snapshots.col(k)) - snapshots.col(k)).norm(),
              1e-12 * snapshots.col(k).norm());
  }
}

TEST(Deim, IsExactAtItsDofsForAnyVector) {
  const Deim points = deim(exponentials(80, 20), 5);
  ASSERT_EQ(points.dofs.size(), 5U);
  EXPECT_EQ(std::set<Index>(points.dofs.begin(), points.dofs.end()).size(), 5U);
  const VectorXd any = random_matrix(80, 1, 3);
  const VectorXd approximation = interpolate(points, any);
  for (const Index dof : points.dofs) EXPECT_NEAR(approximation[dof], any[dof], 1e-11);
}

// Error <= |(P'U)^-1| * best approximation (Chaturantabut and Sorensen, Lemma 3.2).
TEST(Deim, KeepsItsErrorBound) {
  const MatrixXd snapshots = exponentials(80, 20);
  for (const int terms : {1, 2, 3, 5}) {
    const Deim points = deim(snapshots, terms);
    const Eigen::JacobiSVD<MatrixXd> svd(snapshots, Eigen::ComputeThinU);
    const MatrixXd basis = svd.matrixU().leftCols(terms);
    const MatrixXd at_dofs = basis(points.dofs, Eigen::all);
    const double factor = 1.0 / Eigen::JacobiSVD<MatrixXd>(at_dofs).singularValues().tail(1)[0];
    for (Index k = 0; k < snapshots.cols(); ++k) {
      const VectorXd wanted = snapshots.col(k);
      const double best = (wanted - basis * (basis.transpose() * wanted)).norm();
      EXPECT_LE((interpolate(points, wanted) - wanted).norm(), factor * best + 1e-13) << terms;
    }
  }
}

TEST(Deim, FirstDofIsTheLargestEntryOfTheFirstVector) {
  MatrixXd snapshot = MatrixXd::Zero(10, 1);
  snapshot(3, 0) = 1.0;
  snapshot(7, 0) = -2.0;
  EXPECT_EQ(deim(snapshot, 3).dofs, std::vector<Index>{7});
}

TEST(Deim, RefusesNothing) { EXPECT_THROW(deim(MatrixXd::Zero(10, 3), 3), Error); }

}  // namespace
}  // namespace photocoag

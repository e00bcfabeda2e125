#include "photocoag/mor/majorant.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// decay^(k-1), with 0^0 = 1.
double power(double decay, double k) { return k == 1.0 ? 1.0 : std::pow(decay, k - 1.0); }

// min sum x, rows x >= 1, x >= 0, all entries not negative, by the simplex method on its dual
// max sum y, rows' y <= 1, y >= 0, for which y = 0 is a start. x are the dual's shadow prices.
VectorXd cover(const MatrixXd& rows) {
  constexpr int kMaxPivots = 2000;
  constexpr double kZero = 1e-9;
  const Index n = rows.cols();
  const Index m = rows.rows();
  MatrixXd tableau = MatrixXd::Zero(n + 1, m + n + 1);
  tableau.topLeftCorner(n, m) = rows.transpose();
  tableau.block(0, m, n, n).setIdentity();
  tableau.col(m + n).head(n).setOnes();
  tableau.row(n).head(m).setConstant(-1.0);
  for (int pivots = 0; pivots < kMaxPivots; ++pivots) {
    Index entering = 0;
    if (tableau.row(n).head(m + n).minCoeff(&entering) > -kZero) break;
    Index leaving = -1;
    double step = 0.0;
    for (Index i = 0; i < n; ++i) {
      if (tableau(i, entering) <= 1e-12) continue;
      const double ratio = tableau(i, m + n) / tableau(i, entering);
      if (leaving < 0 || ratio < step) {
        leaving = i;
        step = ratio;
      }
    }
    if (leaving < 0) throw Error("majorant: no sum of these exponentials lies above the sequence");
    tableau.row(leaving) /= tableau(leaving, entering);
    for (Index i = 0; i <= n; ++i) {
      if (i == leaving) continue;
      const double factor = tableau(i, entering);
      tableau.row(i) -= factor * tableau.row(leaving);
    }
  }
  return tableau.row(n).segment(m, n).transpose().cwiseMax(0.0);
}

}  // namespace

double majorant_value(const std::vector<double>& c, const std::vector<double>& decay, double k) {
  double sum = 0.0;
  for (std::size_t j = 0; j < c.size(); ++j) sum += c[j] * power(decay[j], k);
  return sum;
}

std::vector<double> exponential_majorant(const std::vector<double>& value,
                                         const std::vector<double>& decay, double last) {
  // The largest value of a run of neighbours must be reached at its end: the sum falls with k, so
  // that it is reached everywhere. Runs grow with k by a twentieth.
  struct Row {
    double k;
    double value;
  };
  std::vector<Row> wanted;
  for (std::size_t first = 0; first < value.size();) {
    const std::size_t end = std::min(value.size(), first + 1 + first / 20);
    const double largest = *std::max_element(value.begin() + static_cast<std::ptrdiff_t>(first),
                                             value.begin() + static_cast<std::ptrdiff_t>(end));
    wanted.push_back({static_cast<double>(end), largest});
    first = end;
  }
  const double beyond = static_cast<double>(value.size()) + 1.0;
  const auto n = static_cast<Index>(decay.size());
  std::vector<Row> rows;
  std::copy_if(wanted.begin(), wanted.end(), std::back_inserter(rows),
               [](const Row& row) { return row.value > 0.0; });
  if (rows.empty() && last <= 0.0) return std::vector<double>(decay.size(), 0.0);
  // In x_j = c_j / (1 - decay_j), each row divided by what it must reach.
  const auto count = static_cast<Index>(rows.size());
  MatrixXd cover_rows = MatrixXd::Zero(count + (last > 0.0 ? 1 : 0), n);
  for (Index j = 0; j < n; ++j) {
    const double weight = 1.0 - decay[j];
    for (Index i = 0; i < count; ++i) {
      cover_rows(i, j) = weight * power(decay[j], rows[i].k) / rows[i].value;
    }
  }
  if (last > 0.0) cover_rows(count, 0) = (1.0 - decay[0]) * power(decay[0], beyond) / last;
  const VectorXd x = cover(cover_rows);
  std::vector<double> c(decay.size());
  for (Index j = 0; j < n; ++j) c[j] = x[j] * (1.0 - decay[j]);
  // The simplex method stops within its tolerance of the vertex: scale up to satisfy every row.
  double lift = 1.0;
  for (std::size_t k = 0; k < value.size(); ++k) {
    const double reached = majorant_value(c, decay, static_cast<double>(k + 1));
    if (value[k] > reached) lift = std::max(lift, value[k] / reached);
  }
  if (last > 0.0) lift = std::max(lift, last / (c[0] * power(decay[0], beyond)));
  if (!std::isfinite(lift)) throw Error("majorant: the exponentials vanish before the sequence");
  for (double& coefficient : c) coefficient *= lift * (1.0 + 1e-12);
  return c;
}

}  // namespace photocoag

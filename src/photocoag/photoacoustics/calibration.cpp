#include "photocoag/photoacoustics/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

struct Fit {
  Eigen::VectorXd coefficients;  // of powers of s = (T - middle) / half
  double left_out = 0.0;         // rms, relative
};

Eigen::MatrixXd powers(const Eigen::VectorXd& s, int degree) {
  Eigen::MatrixXd columns(s.size(), degree + 1);
  columns.col(0).setOnes();
  for (int k = 1; k <= degree; ++k) {
    columns.col(k) = columns.col(k - 1).cwiseProduct(s);
  }
  return columns;
}

// Noise of a pulse is proportional to its signal: rows are divided by a first fit's value.
Fit fit(const Eigen::VectorXd& s, const Eigen::VectorXd& q, int degree) {
  const Eigen::MatrixXd columns = powers(s, degree);
  Fit result;
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(q.size());
  Eigen::MatrixXd weighted = columns;
  for (int pass = 0; pass < 3; ++pass) {
    weighted = weights.asDiagonal() * columns;
    result.coefficients = least_squares(weighted, Eigen::VectorXd(weights.cwiseProduct(q)));
    weights = (columns * result.coefficients).cwiseAbs().cwiseMax(1e-300).cwiseInverse();
  }
  // Leaving a point out changes its residual e to e / (1 - h), h its leverage.
  const Eigen::MatrixXd spread = inverse(weighted.transpose() * weighted);
  double squares = 0.0;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const double leverage = weighted.row(i) * spread * weighted.row(i).transpose();
    const double residual = q[i] / columns.row(i).dot(result.coefficients) - 1.0;
    squares += std::pow(residual / (1.0 - std::min(leverage, 0.999)), 2);
  }
  result.left_out = std::sqrt(squares / static_cast<double>(q.size()));
  return result;
}

// Powers of s = (T - middle) / half as powers of T.
std::vector<double> in_celsius(const Eigen::VectorXd& of_s, double middle, double half) {
  std::vector<double> result(static_cast<std::size_t>(of_s.size()), 0.0);
  std::vector<double> power = {1.0};  // (T - middle)^k / half^k
  for (Eigen::Index k = 0; k < of_s.size(); ++k) {
    for (std::size_t i = 0; i < power.size(); ++i) result[i] += of_s[k] * power[i];
    std::vector<double> next(power.size() + 1, 0.0);
    for (std::size_t i = 0; i < power.size(); ++i) {
      next[i] -= power[i] * middle / half;
      next[i + 1] += power[i] / half;
    }
    power = next;
  }
  return result;
}

void judge(const std::vector<CalibrationPoint>& points, const Eigen::VectorXd& q,
           Calibration& result) {
  const GrueneisenCurve curve(result.curve, "the fitted curve");
  constexpr double kBin = 10.0;  // K
  const double low = curve.low();
  const auto bins = static_cast<std::size_t>(std::ceil((curve.high() - low) / kBin));
  result.bins.resize(std::max<std::size_t>(bins, 1));
  double relative = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double celsius = points[i].celsius;
    const double value = curve.value(celsius);
    const double difference = q[static_cast<Eigen::Index>(i)] - value;
    // To first order: a measured value may lie outside the curve's range.
    const double error = difference / curve.slope(celsius);
    relative += std::pow(difference / value, 2);
    squares += error * error;
    result.residual_max = std::max(result.residual_max, std::abs(error));
    const auto bin = static_cast<std::size_t>(std::max(0.0, (celsius - low) / kBin));
    CalibrationBin& into = result.bins[std::min(bin, result.bins.size() - 1)];
    ++into.points;
    into.mean += error;
    into.sigma += error * error;
  }
  const auto count = static_cast<double>(points.size());
  result.residual_relative = std::sqrt(relative / count);
  result.residual = std::sqrt(squares / count);
  for (std::size_t i = 0; i < result.bins.size(); ++i) {
    CalibrationBin& bin = result.bins[i];
    bin.from_celsius = low + kBin * static_cast<double>(i);
    bin.to_celsius = std::min(bin.from_celsius + kBin, curve.high());
    const auto n = static_cast<double>(std::max<std::size_t>(bin.points, 1));
    bin.mean /= n;
    bin.sigma = std::sqrt(std::max(0.0, bin.sigma / n - bin.mean * bin.mean));
  }
}

}  // namespace

Calibration fit_calibration(const std::vector<CalibrationPoint>& points, int degree) {
  const auto refuse = [](std::string found, std::string accepted) {
    throw Error(ErrorParts{
        .where = "calibration data", .found = std::move(found), .accepted = std::move(accepted)});
  };
  if (points.size() < 8) refuse(fmt::format("{} rows", points.size()), "at least 8 rows");
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::VectorXd celsius(count);
  Eigen::VectorXd q(count);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CalibrationPoint& p = points[i];
    if (!std::isfinite(p.celsius) || !(p.energy > 0.0) || !std::isfinite(p.energy) ||
        !(p.amplitude > 0.0) || !std::isfinite(p.amplitude)) {
      refuse(fmt::format("row {}: {} deg C, amplitude {}, energy {} J", i + 1, p.celsius,
                         p.amplitude, p.energy),
             "finite numbers, amplitude and energy above 0");
    }
    celsius[static_cast<Eigen::Index>(i)] = p.celsius;
    q[static_cast<Eigen::Index>(i)] = p.amplitude / p.energy;
  }
  const double low = celsius.minCoeff();
  const double high = celsius.maxCoeff();
  if (high - low < 5.0) {
    refuse(fmt::format("{:g} to {:g} deg C", low, high), "temperatures at least 5 K apart");
  }
  const double middle = 0.5 * (low + high);
  const double half = 0.5 * (high - low);
  const Eigen::VectorXd s = (celsius.array() - middle) / half;
  Calibration result;
  std::vector<Fit> fits;
  for (int d = 1; d <= 3; ++d) {
    fits.push_back(fit(s, q, d));
    result.left_out.push_back(fits.back().left_out);
  }
  if (degree == 0) {
    const double best = *std::min_element(result.left_out.begin(), result.left_out.end());
    degree = 1;
    while (result.left_out[static_cast<std::size_t>(degree - 1)] > 1.02 * best) ++degree;
  }
  const Fit chosen = degree <= 3 ? fits[static_cast<std::size_t>(degree - 1)] : fit(s, q, degree);
  result.degree = degree;
  const double unit = chosen.coefficients[0];  // the value in the middle
  result.curve = {
      .source = fmt::format("photocoag calibrate: {} rows, degree {}", points.size(), degree),
      .coefficients = in_celsius(chosen.coefficients / unit, middle, half),
      .temperatures = {},
      .values = {},
      .valid_from_celsius = low,
      .valid_to_celsius = high};
  judge(points, q / unit, result);
  return result;
}

}  // namespace photocoag

#include "photocoag/export/c_model.hpp"

#include <fmt/format.h>

#include <cmath>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/export/c_numbers.hpp"
#include "photocoag/export/c_posterior.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/rom/intersample.hpp"

namespace photocoag {
namespace {

using Values = std::map<std::string, std::string>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Excess over the largest power that the gate accepts as rounding.
constexpr double kGateRounding = 1e-12;
constexpr double kGateRoundingSingle = 1e-6;

std::string flag(bool value) { return value ? "1" : "0"; }

// The checksum of the model file.
std::string checksum_of(const ReducedModel& model) {
  const std::string json = to_json(model);
  const std::string key = "\"checksum\": \"";
  const std::size_t start = json.rfind(key) + key.size();
  return json.substr(start, json.find('"', start) - start);
}

bool is_diagonal(const StateMatrix& A) {
  for (int j = 0; j < A.cols(); ++j) {
    for (int i = 0; i < A.rows(); ++i) {
      if (i != j && A(i, j) != 0.0) return false;
    }
  }
  return true;
}

// B_j and C_j as columns, with a second parameter at its constant value.
struct Terms {
  MatrixXd input;
  MatrixXd volume;
};

Terms terms_at(const ReducedModel& model, double beta) {
  const int terms = model.theta.terms;
  Terms all{MatrixXd(model.B_d).leftCols(terms),
            MatrixXd(model.C_volume).topRows(terms).transpose()};
  const int factors = model.theta.factors[1].terms;
  if (model.parameters.size() == 1 || model.theta.kind != ThetaKind::kChebyshev) return all;
  // sum over k of T_k(y): what is left depends on alpha alone.
  const int own = terms / factors;
  const double y = (beta - model.theta.factors[1].center) / model.theta.factors[1].half_width;
  Terms folded{MatrixXd::Zero(model.order(), own), MatrixXd::Zero(model.order(), own)};
  double factor = 1.0;
  double next = y;
  for (int k = 0; k < factors; ++k) {
    folded.input += factor * all.input.middleCols(k * own, own);
    folded.volume += factor * all.volume.middleCols(k * own, own);
    const double after = 2.0 * y * next - factor;
    factor = next;
    next = after;
  }
  return folded;
}

std::string layer(const AbsorbedFraction& between, double beta, const CNumbers& write) {
  const AbsorbedFraction s = between.of_alpha({1.0, beta});
  return write.list(std::vector<double>{s.fixed_front, s.front[0], s.fixed_back - s.fixed_front,
                                        s.back[0] - s.front[0]});
}

void add_model(const ReducedModel& model, double beta, const CNumbers& write, Values& out) {
  const bool diagonal = is_diagonal(model.A_d);
  const Terms terms = terms_at(model, beta);
  const bool deim = model.theta.kind == ThetaKind::kDeim;
  out["order"] = std::to_string(model.order());
  out["terms"] = std::to_string(terms.input.cols());
  out["diagonal"] = flag(diagonal);
  out["transition"] =
      diagonal ? write.list(VectorXd(model.A_d.diagonal())) : write.matrix(model.A_d);
  out["input_terms"] = write.matrix(terms.input);
  out["volume_terms"] = write.matrix(terms.volume);
  out["theta_deim"] = flag(deim);
  out["theta_chebyshev"] = flag(model.theta.kind == ThetaKind::kChebyshev);
  out["theta_center"] = write.number(model.theta.factors[0].center);
  out["theta_half_width"] = write.number(model.theta.factors[0].half_width);
  std::vector<std::string> points;
  for (int j = 0; deim && j < model.theta.terms; ++j) {
    points.push_back(layer(model.theta.points[static_cast<std::size_t>(j)], beta, write));
  }
  out["points"] = CNumbers::lines(points);
  out["volume_normalized"] = flag(model.volume_normalized);
  out["whole"] = layer(model.whole, beta, write);
}

void add_rows(const ReducedModel& model, int horizon, const CNumbers& write, Values& out) {
  MatrixXd rows(horizon, model.order());
  rows.row(0) = VectorXd(model.C_peak).transpose();
  for (int k = 1; k < horizon; ++k) rows.row(k) = rows.row(k - 1) * MatrixXd(model.A_d);
  out["peak_row"] = write.list(VectorXd(model.C_peak));
  out["peak_rows"] = write.matrix(rows);
  const Eigen::Index n = model.order();
  const MatrixXd rest = MatrixXd::Identity(n, n) - MatrixXd(model.A_d);
  out["steady_row"] = write.list(solve_transposed(rest, VectorXd(model.C_peak)));
}

// Points of the reference: whole periods and remainder, for single precision.
std::string reference_points(const ControlSettings& control, const CNumbers& write) {
  std::vector<std::string> points;
  const std::size_t count = control.reference_times.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double at = control.reference_times[i] / control.period;
    const double whole = std::abs(at - std::round(at)) < 1e-6 ? std::round(at) : std::floor(at);
    double slope = 0.0;
    if (i + 1 < count) {
      slope = (control.reference_values[i + 1] - control.reference_values[i]) /
              (control.reference_times[i + 1] - control.reference_times[i]) * control.period;
    }
    points.push_back(fmt::format("{{{:.0f}, {}, {}, {}}}", whole, write.number(at - whole),
                                 write.number(control.reference_values[i]), write.number(slope)));
  }
  return CNumbers::lines(points);
}

void add_control(const ControlSettings& control, const CNumbers& write, Values& out) {
  const double scale = control.power_max * control.power_max;
  out["horizon"] = std::to_string(control.horizon);
  out["delay"] = std::to_string(control.delay);
  out["solve_every"] = std::to_string(control.solve_every);
  out["delayed_weight"] = flag(control.state_weight == StateWeight::kDelayed);
  out["first_power_given"] = flag(control.first_power > 0.0);
  out["period"] = write.number(control.period);
  out["peak_reference"] = write.number(control.peak_reference);
  out["peak_max"] = write.number(control.peak_max);
  out["power_min"] = write.number(control.power_min);
  out["power_max"] = write.number(control.power_max);
  out["r1"] = write.number(control.power_weight * scale);
  out["r2"] = write.number(control.power_change_weight * scale);
  out["first_power"] = write.number(control.first_power);
  out["gate_rounding"] = write.number(write.single() ? kGateRoundingSingle : kGateRounding);
  out["robust_sigma"] = write.number(control.robust_sigma);
  out["reference_points"] = std::to_string(control.reference_times.size());
  out["reference"] = reference_points(control, write);
  out["shares_count"] = std::to_string(control.shares.size());
  out["shares"] = write.list(control.shares);
  // For comments, in the units of the configuration.
  out["period_ms"] = fmt::format("{:g}", control.period * 1e3);
  out["peak_reference_K"] = fmt::format("{:g}", control.peak_reference);
  out["peak_max_K"] = fmt::format("{:g}", control.peak_max);
  out["power_min_W"] = fmt::format("{:g}", control.power_min);
  out["power_max_W"] = fmt::format("{:g}", control.power_max);
}

void add_estimator(const EstimatorSettings& estimator, const CNumbers& write, Values& out) {
  const auto square = [&](double value) { return write.number(value * value); };
  out["outlier_gate"] = flag(estimator.outlier_sigma > 0.0);
  out["outlier_sigma"] = write.number(estimator.outlier_sigma);
  out["alpha_initial"] = write.number(estimator.absorption_initial);
  out["alpha_variance_initial"] = square(estimator.absorption_sigma_initial);
  out["alpha_min"] = write.number(estimator.absorption_min);
  out["alpha_max"] = write.number(estimator.absorption_max);
  out["alpha_drift_variance"] = square(estimator.absorption_process_noise);
  out["power_variance"] = square(estimator.power_process_noise);
  out["sample_variance"] = square(estimator.measurement_noise);
}

void add_certificate(const ReducedModel& model, const ControlSettings& control,
                     const CNumbers& write, Values& out) {
  const bool certified = control.robust == Robustness::kCertified;
  const ErrorCertificate none;
  const ErrorCertificate& certificate = certified ? *model.certificate : none;
  const auto terms = static_cast<Eigen::Index>(certificate.decay.size());
  MatrixXd majorant(control.horizon, terms);
  for (Eigen::Index i = 0; i < majorant.rows(); ++i) {
    for (Eigen::Index j = 0; j < terms; ++j) {
      const auto term = static_cast<std::size_t>(j);
      majorant(i, j) = certificate.peak.majorant[term] *
                       std::pow(certificate.decay[term], static_cast<double>(i));
    }
  }
  out["certified"] = flag(certified);
  out["certificate_nodes"] = std::to_string(certificate.absorption_factors.size());
  out["majorant_terms"] = std::to_string(terms);
  out["certificate_alpha"] = write.list(certificate.absorption_factors);
  out["certificate_scale"] = write.list(certificate.peak.scale);
  out["majorant_decay"] = write.list(certificate.decay);
  out["majorant"] = write.matrix(majorant);
}

}  // namespace

std::map<std::string, std::string> c_placeholders(const ReducedModel& model,
                                                  const ControlSettings& control,
                                                  const EstimatorSettings& estimator,
                                                  const CExportOptions& options) {
  const CNumbers write(options.single_precision);
  Values out;
  out["version"] = version();
  out["model_sha256"] = checksum_of(model);
  out["config_sha256"] = options.config_sha256;
  out["single"] = flag(options.single_precision);
  out["real"] = options.single_precision ? "float" : "double";
  const bool posterior = estimator.kind == EstimatorKind::kPosterior;
  // The posterior's modes have a control problem of their own.
  const ReducedModel told =
      posterior ? model.uncertain->control_model() : controller_model(model, estimator.timing);
  add_posterior(posterior ? model.uncertain.get() : nullptr, control, estimator, write, out);
  add_model(told, estimator.choroid_initial, write, out);
  add_rows(told, control.horizon, write, out);
  add_control(control, write, out);
  add_estimator(estimator, write, out);
  add_certificate(told, control, write, out);
  return out;
}

}  // namespace photocoag

#include "qp/exam.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <sstream>

namespace photocoag::qp_exam {
namespace {

double condition_number(const InputMatrix& hessian) {
  const Eigen::MatrixXd h = hessian;
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(h).eigenvalues();
  return values.maxCoeff() / values.minCoeff();
}

// H = A' A + shift I: condition numbers from 1 to about 1e4.
InputMatrix random_hessian(Random& random, int n) {
  Eigen::MatrixXd a(n, n);
  for (int i = 0; i < n * n; ++i) a.data()[i] = random.uniform(-1, 1);
  const double shift = std::pow(10.0, random.uniform(-3, 0));
  return a.transpose() * a + shift * Eigen::MatrixXd::Identity(n, n);
}

// max(|lower_j|, |upper_j|); 1 for an input that is fixed at 0 and gives no scale.
Real box_scale(const QpProblem& qp, int j) {
  const Real scale = std::max(std::fabs(qp.lower(j)), std::fabs(qp.upper(j)));
  return scale > 0 ? scale : 1;
}

}  // namespace

std::string judge(const Case& c, QpStatus returned, const QpSolution& s, const Tolerances& tol) {
  const QpProblem& qp = c.problem;
  const int n = int(qp.hessian.rows());
  const int m = int(qp.rows.rows());
  std::ostringstream complaint;
  complaint.precision(17);
  const auto say = [&](auto&&... words) {
    ((complaint << c.name << ": ") << ... << words) << "; ";
  };

  // At every exit: sizes, the box, one status.
  if (s.power.size() != n || s.bound_multiplier.size() != n || s.row_multiplier.size() != m) {
    say("wrong sizes");
    return complaint.str();
  }
  if (returned != s.status) say("two different statuses");
  for (int j = 0; j < n; ++j) {
    const double lower = qp.lower(j);
    const double u = s.power(j);
    if (!std::isfinite(u)) say("u", j, " is not finite");
    if (lower > qp.upper(j)) continue;  // an empty box
    if (u < lower || u > qp.upper(j)) say("u", j, " = ", u, " is outside the box");
  }
  if (returned != QpStatus::kSolved) {
    for (int j = 0; j < n; ++j) {
      const double safe =
          std::isfinite(qp.lower(j)) ? qp.lower(j) : (qp.upper(j) < 0 ? qp.upper(j) : 0);
      if (s.power(j) != safe)
        say("not solved, and u", j, " = ", s.power(j), " is not the safe value");
    }
  }

  const bool solved = returned == QpStatus::kSolved;
  const bool infeasible = returned == QpStatus::kInfeasible;
  const bool status_ok =
      (tol.may_give_up &&
       (returned == QpStatus::kIterationLimit || returned == QpStatus::kKktFailed)) ||
      (c.expected == Expected::kSolved && solved) ||
      (c.expected == Expected::kInfeasible && infeasible) ||
      (c.expected == Expected::kEither && (solved || infeasible)) ||
      (c.expected == Expected::kFailure &&
       (returned == QpStatus::kNumericalFailure || returned == QpStatus::kKktFailed));
  if (!status_ok) say("status ", to_string(returned), ", expected ", int(c.expected));
  if (!solved || c.expected == Expected::kFailure) return complaint.str();

  // The KKT conditions, each in units of its own terms.
  std::vector<Real> gradient(n);
  Real energy = 0;
  Real stationarity = 0;
  for (int j = 0; j < n; ++j) {
    Real sum = Real(qp.gradient(j)) + s.bound_multiplier(j);
    Real size = std::fabs(Real(qp.gradient(j))) + std::fabs(Real(s.bound_multiplier(j)));
    for (int k = 0; k < n; ++k) {
      sum += Real(qp.hessian(j, k)) * s.power(k);
      size += std::fabs(Real(qp.hessian(j, k))) * box_scale(qp, k);
    }
    for (int i = 0; i < m; ++i) {
      sum += Real(qp.rows(i, j)) * s.row_multiplier(i);
      size += std::fabs(Real(qp.rows(i, j)) * s.row_multiplier(i));
    }
    if (sum != 0) stationarity = std::max(stationarity, std::fabs(sum) / size);
    energy += size * box_scale(qp, j);
    if (!std::isfinite(s.bound_multiplier(j))) say("bound multiplier ", j, " is not finite");
  }
  if (!(stationarity <= tol.stationarity)) say("stationarity ", stationarity);

  const double feasibility = c.expected == Expected::kSolved ? tol.feasibility : tol.infeasibility;
  for (int i = 0; i < m; ++i) {
    const Real scale = row_scale(qp, i);
    if (!(s.row_multiplier(i) >= 0)) say("row multiplier ", i, " = ", s.row_multiplier(i));
    if (!std::isfinite(qp.limit(i))) {
      if (s.row_multiplier(i) != 0) say("multiplier of a row without limit");
      continue;
    }
    Real slack = qp.limit(i);
    for (int j = 0; j < n; ++j) slack -= Real(qp.rows(i, j)) * s.power(j);
    if (!(slack >= -feasibility * scale)) say("row ", i, " is violated by ", -slack / scale);
    const Real product = std::fabs(slack) * s.row_multiplier(i);
    if (!(product <= std::max(tol.stationarity, feasibility) * energy)) {
      say("row ", i, " is not complementary: ", product / energy);
    }
  }
  for (int j = 0; j < n; ++j) {
    const Real multiplier = s.bound_multiplier(j);
    const Real slack = multiplier > 0 ? qp.upper(j) - s.power(j) : s.power(j) - qp.lower(j);
    if (!(std::fabs(slack * multiplier) <= tol.stationarity * energy)) {
      say("bound ", j, " is not complementary: ", slack * multiplier / energy);
    }
  }

  // The minimizer itself. A problem relaxed by the rounding of its own data moves u by the
  // condition number times that: 1e3 costs nothing extra, beyond it the tolerance grows too.
  for (int j = 0; j < int(c.power.size()); ++j) {
    const Real allowed = tol.power * std::max(1.0, c.condition / 1e3) * box_scale(qp, j);
    const Real error = std::fabs(c.power[j] - s.power(j));
    if (!(error <= allowed)) say("u", j, " is wrong by ", error);
  }
  return complaint.str();
}

void consult_oracle(Case& c, const Tolerances& tol) {
  const Truth truth = Oracle(c.problem).solve();
  c.condition = condition_number(c.problem.hessian);
  if (truth.feasible) {
    const bool thin = tol.thin > 0 && !Oracle(c.problem, -tol.thin).solve().feasible;
    c.expected = thin ? Expected::kEither : Expected::kSolved;
    c.power = truth.power;
  } else {
    const bool clearly = !Oracle(c.problem, 1.001L * tol.infeasibility).solve().feasible;
    c.expected = clearly ? Expected::kInfeasible : Expected::kEither;
  }
}

Case random_case(Random& random, int n, int m) {
  Case c{.name = "random"};
  QpProblem& qp = c.problem;
  qp.resize(n, m);
  qp.hessian = random_hessian(random, n);
  InputVector inside(n);
  InputVector target(n);
  for (int j = 0; j < n; ++j) {
    qp.lower(j) = random.chance(0.5) ? 0.0 : random.uniform(-1, 1);
    const double width = random.chance(0.1) ? 0.0 : random.uniform(0.1, 2);
    qp.upper(j) = qp.lower(j) + width;
    inside(j) = random.uniform(qp.lower(j), qp.upper(j));
    target(j) = qp.lower(j) + random.uniform(-2, 3) * std::max(width, 0.1);
  }
  qp.gradient = -qp.hessian * target;
  for (int i = 0; i < m; ++i) {
    double value = 0;
    for (int j = 0; j < n; ++j) {
      qp.rows(i, j) = random.uniform(-1, 1);
      value += qp.rows(i, j) * inside(j);
    }
    qp.limit(i) = value + random.uniform(-0.15, 0.5);
    if (random.chance(0.05)) qp.limit(i) = std::numeric_limits<double>::infinity();
    qp = with_row_scaled(qp, i, std::pow(10.0, random.uniform(-6, 6)));
  }
  qp = with_objective_scaled(qp, std::pow(10.0, random.uniform(-8, 8)));
  return c;
}

Case degenerate_case(Random& random) {
  Case c{.name = "degenerate"};
  QpProblem& qp = c.problem;
  const int n = random.integer(1, 4);
  const int m = random.integer(0, 5);
  qp.resize(n, m);
  // Everything is a small multiple of 1/4, hence exact in double.
  Eigen::MatrixXd a(n, n);
  for (int i = 0; i < n * n; ++i) a.data()[i] = random.integer(-1, 1);
  qp.hessian = a.transpose() * a + Eigen::MatrixXd::Identity(n, n);
  InputVector target(n);
  for (int j = 0; j < n; ++j) {
    qp.lower(j) = random.chance(0.7) ? 0.0 : 0.25 * random.integer(-2, 2);
    qp.upper(j) = qp.lower(j) + 0.5 * random.integer(0, 2);
    target(j) = 0.5 * random.integer(-1, 3);
  }
  qp.gradient = -qp.hessian * target;
  for (int i = 0; i < m; ++i) {
    if (i > 0 && random.chance(0.3)) {  // the same row, perhaps in other units or turned around
      const double factor = random.chance(0.3) ? -1.0 : (random.chance(0.5) ? 1.0 : 3.0);
      qp.rows.row(i) = factor * qp.rows.row(i - 1);
      qp.limit(i) = factor * qp.limit(i - 1);
      continue;
    }
    const bool parallel_to_bound = random.chance(0.3);
    const int only = random.integer(0, n - 1);
    double value = 0;
    for (int j = 0; j < n; ++j) {
      qp.rows(i, j) = parallel_to_bound ? (j == only ? random.integer(0, 1) * 2 - 1 : 0)
                                        : random.integer(-1, 1);
      value += qp.rows(i, j) * (random.chance(0.5) ? qp.lower(j) : qp.upper(j));
    }
    qp.limit(i) = random.chance(0.6) ? value : 0.5 * random.integer(-1, 3);
  }
  return c;
}

// Either one row against the box: limit = gap above its least value. Or
// rows a_1, …, a_k and a last row -(y_1 a_1 + … + y_k a_k) with y > 0: together they say 0 <= gap.
Case nearly_infeasible_case(Random& random, double gap) {
  Case c = random_case(random, random.integer(2, 4), 0);
  c.name = "nearly infeasible";
  const int n = int(c.problem.gradient.size());
  const int k = random.integer(1, 3);
  QpProblem qp;
  qp.resize(n, k + 1);
  qp.hessian = c.problem.hessian;
  qp.gradient = c.problem.gradient;
  qp.lower = InputVector::Zero(n);
  qp.upper = InputVector::Ones(n);
  qp.rows.row(k).setZero();
  qp.limit(k) = gap;
  if (random.chance(0.3)) {
    qp.resize(n, 1);
    qp.hessian = c.problem.hessian;
    qp.gradient = c.problem.gradient;
    qp.lower = InputVector::Zero(n);
    qp.upper = InputVector::Ones(n);
    qp.limit(0) = gap;
    for (int j = 0; j < n; ++j) {
      qp.rows(0, j) = random.uniform(-1, 1);
      qp.limit(0) += std::min(qp.rows(0, j), 0.0);
    }
    c.problem = qp;
    return c;
  }
  for (int i = 0; i < k; ++i) {
    const double y = random.uniform(0.5, 2);
    qp.limit(i) = 0;
    for (int j = 0; j < n; ++j) {
      qp.rows(i, j) = random.uniform(-1, 1);
      qp.limit(i) += qp.rows(i, j) * random.uniform(0.3, 0.7);
    }
    qp.rows.row(k) -= y * qp.rows.row(i);
    qp.limit(k) -= y * qp.limit(i);
  }
  c.problem = qp;
  return c;
}

Case ill_conditioned_case(Random& random, double condition) {
  Case c = random_case(random, random.integer(2, 4), random.integer(0, 4));
  c.name = "ill-conditioned";
  const int n = int(c.problem.gradient.size());
  Eigen::MatrixXd a(n, n);
  for (int i = 0; i < n * n; ++i) a.data()[i] = random.uniform(-1, 1);
  const Eigen::MatrixXd q =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a + a.transpose()).eigenvectors();
  Eigen::VectorXd values(n);
  for (int j = 0; j < n; ++j) values(j) = std::pow(condition, -double(j) / (n - 1));
  const Eigen::MatrixXd h = q * values.asDiagonal() * q.transpose();
  c.problem.hessian = 0.5 * (h + h.transpose());
  for (int j = 0; j < n; ++j) c.problem.gradient(j) = random.uniform(-1, 1);
  return c;
}

Case large_case(Random& random, int n, int m) {
  Case c{.name = "large"};
  QpProblem& qp = c.problem;
  qp.resize(n, m);
  qp.hessian = random_hessian(random, n);
  InputVector target(n);
  for (int j = 0; j < n; ++j) {
    qp.lower(j) = 0;
    qp.upper(j) = 1;
    target(j) = random.uniform(-3, 4);
  }
  qp.gradient = -qp.hessian * target;
  for (int i = 0; i < m; ++i) {
    double value = 0;
    for (int j = 0; j < n; ++j) {
      qp.rows(i, j) = random.uniform(-1, 1);
      value += 0.5 * qp.rows(i, j);
    }
    qp.limit(i) = value + random.uniform(0, 0.3);
  }
  return c;
}

QpProblem with_row_scaled(QpProblem qp, int row, double factor) {
  for (int j = 0; j < qp.rows.cols(); ++j) qp.rows(row, j) *= factor;
  qp.limit(row) *= factor;
  return qp;
}

QpProblem with_objective_scaled(QpProblem qp, double factor) {
  qp.hessian *= factor;
  qp.gradient *= factor;
  return qp;
}

void run_application(const Application& a, std::uint64_t seed,
                     const std::function<double(const Case&)>& visit) {
  constexpr double kReference = 30.0;
  constexpr double kLimit = 32.0;
  // Peak temperature after a pulse of one cycle at full power (0.1 W), K.
  const auto response = [](int k) {
    constexpr double kFirst[] = {13.3, 6.4, 5.0, 4.4, 3.9};
    return k < 5 ? kFirst[k] : 3.9 * std::sqrt(5.0 / (k + 1)) * std::exp(-(k - 4) / 150.0);
  };
  const int n = a.horizon - 1;
  Random random(seed);
  std::vector<double> past;  // powers, oldest first

  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) g(i, j) = response(i - j);
  }
  Eigen::MatrixXd d = Eigen::MatrixXd::Identity(n, n);  // u_k - u_{k-1}
  for (int i = 1; i < n; ++i) d(i, i - 1) = -1;

  Case c{.name = "application N=" + std::to_string(a.horizon)};
  QpProblem& qp = c.problem;
  for (int cycle = 0; cycle < a.cycles; ++cycle) {
    Eigen::VectorXd free(n);  // peak temperature if the laser stayed off
    for (int k = 0; k < n; ++k) {
      free(k) = random.uniform(-a.disturbance_K, a.disturbance_K);
      for (int p = 0; p < int(past.size()); ++p)
        free(k) += past[p] * response(int(past.size()) - p + k);
    }
    Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
    if (a.delayed) {
      for (int k = 0; k < n; ++k) weight(k) = cycle + k + 1 <= 3 ? 0 : 1;
    }
    Eigen::VectorXd before = Eigen::VectorXd::Zero(n);
    before(0) = past.empty() ? 0 : past.back();

    qp.resize(n, n);
    const Eigen::MatrixXd h = 2 * (g.transpose() * weight.asDiagonal() * g +
                                   a.power_weight * Eigen::MatrixXd::Identity(n, n) +
                                   a.change_weight * d.transpose() * d);
    qp.hessian = 0.5 * (h + h.transpose());
    qp.gradient = 2 * (g.transpose() * weight.asDiagonal() * (free.array() - kReference).matrix() -
                       a.change_weight * d.transpose() * before);
    qp.lower.setZero();
    qp.upper.setOnes();
    qp.rows = g;
    qp.limit = (kLimit - free.array()).matrix();
    // g >= 0 and lower = 0: feasible exactly when u = 0 is.
    c.expected = (qp.limit.array() >= 0).all() ? Expected::kSolved : Expected::kInfeasible;
    c.condition = condition_number(qp.hessian);
    past.push_back(visit(c));
  }
}

void for_each_exam_case(const Tolerances& tol, const std::function<void(const Case&)>& visit) {
  const auto with_oracle = [&](Case c) {
    consult_oracle(c, tol);
    visit(c);
  };
  Random random(2024);
  for (int k = 0; k < 300; ++k)
    with_oracle(random_case(random, random.integer(1, 4), random.integer(0, 4)));
  for (int k = 0; k < 300; ++k) with_oracle(degenerate_case(random));
  for (int k = 0; k < 60; ++k) {
    const double gap = (k % 2 == 0 ? 1 : -1) * std::pow(10.0, random.uniform(-6, -2));
    with_oracle(nearly_infeasible_case(random, gap));
  }
  run_application({.horizon = 4, .cycles = 60}, 5, [&](Case c) {
    consult_oracle(c, tol);
    visit(c);
    return c.power.empty() ? 0.0 : double(c.power[0]);
  });
}

}  // namespace photocoag::qp_exam

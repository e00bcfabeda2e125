// Role: benchmarks; eiquadprog-rt, whose sizes are known when it is compiled: one for each horizon.
#pragma once

#include <array>
#include <eiquadprog/eiquadprog-rt.hpp>
#include <memory>

#include "qp_peer.hpp"

namespace photocoag::benchmarks {

// H x + g, CI x + ci >= 0: the box's bounds are rows.
template <int N>
class Eiquadprog : public Peer {
 public:
  std::string name() const override { return "eiquadprog-rt, C++, size fixed"; }

  void prepare(const Problem& p, std::size_t place) override {
    Data& data = data_[place];
    data.hessian = p.qp.hessian;
    data.gradient = p.qp.gradient;
    data.rows << Square::Identity(), -Square::Identity(), -p.qp.rows;
    data.limits << -p.qp.lower, p.qp.upper, p.qp.limit;
  }

  std::span<const double> solve(Problem&, std::size_t place) override {
    const Data& data = data_[place];
    const auto status = solver_.solve_quadprog(data.hessian, data.gradient, no_rows_, no_limits_,
                                               data.rows, data.limits, u_);
    if (status != eiquadprog::solvers::RT_EIQUADPROG_OPTIMAL) return {};
    return {u_.data(), static_cast<std::size_t>(N)};
  }

 private:
  using Square = Eigen::Matrix<double, N, N>;
  struct Data {
    Square hessian;
    Eigen::Matrix<double, N, 1> gradient;
    Eigen::Matrix<double, 3 * N, N> rows;
    Eigen::Matrix<double, 3 * N, 1> limits;
  };
  std::array<Data, kWindow> data_;
  eiquadprog::solvers::RtEiquadprog<N, 0, 3 * N> solver_;
  Eigen::Matrix<double, 0, N> no_rows_;
  Eigen::Matrix<double, 0, 1> no_limits_;
  Eigen::Matrix<double, N, 1> u_;
};

/// Null for a size that is none of `bench qp`'s.
inline std::unique_ptr<Peer> make_eiquadprog(const Problem& first) {
  const auto n = first.qp.hessian.rows();
  if (first.qp.rows.rows() != n) return nullptr;
  if (n == 1) return std::make_unique<Eiquadprog<1>>();
  if (n == 4) return std::make_unique<Eiquadprog<4>>();
  if (n == 9) return std::make_unique<Eiquadprog<9>>();
  if (n == 14) return std::make_unique<Eiquadprog<14>>();
  if (n == 19) return std::make_unique<Eiquadprog<19>>();
  if (n == 49) return std::make_unique<Eiquadprog<49>>();
  return nullptr;
}

}  // namespace photocoag::benchmarks

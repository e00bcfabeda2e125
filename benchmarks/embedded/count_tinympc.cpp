/* Instructions of the quadratic program alone, ours and TinyMPC's generated code on the same
 * problems: a closed loop of the exported controller (N = 5) on eyes of the absorption factor that
 * both know, with noise that keeps the estimate at the limit. SysTick as in tests/export. */
#include <cmath>
#include <cstdint>

extern "C" {
#include "pc_controller.h"
void print_number(const char* name, std::uint32_t value);
void* __dso_handle = nullptr;
void _init() {}
void _fini() {}
}
#include "states.h"
#include "tinympc/admm.hpp"
#include "tinympc/tiny_data.hpp"

namespace {

constexpr std::uint32_t kTick = 40;
constexpr int kPeriods = 1000;
constexpr float kUnit = 30.0F;  // K, as in tinympc_code.py

std::uint32_t ticks() { return *reinterpret_cast<volatile std::uint32_t*>(0xE000E018); }

struct Counter {
  std::uint64_t sum = 0;
  std::uint32_t worst = 0;

  void count(std::uint32_t before) {
    const std::uint32_t taken = (before - ticks()) & 0xFFFFFF;
    sum += taken;
    if (taken > worst) worst = taken;
  }
};

// Close to normal: the sum of twelve uniform numbers.
float normal() {
  static std::uint32_t seed = 12345;
  float sum = -6;
  for (int i = 0; i < 12; ++i) {
    seed = seed * 1664525U + 1013904223U;
    sum += static_cast<float>(seed >> 8) / 16777216.0F;
  }
  return sum;
}

pc_controller controller;

void period(int n) {
  static float eye[PC_ORDER], power;
  static pc_matrices matrices;
  if (n % 250 == 0) {
    pc_controller_init(&controller);
    for (float& state : eye) state = 0;
    pc_evaluate(PC_ALPHA_INITIAL, &matrices);
    power = pc_controller_start(&controller);
    return;
  }
  pc_propagate(eye);
  float volume = 0;
  for (int i = 0; i < PC_ORDER; ++i) {
    eye[i] += matrices.input[i] * power;
    volume += matrices.volume[i] * eye[i];
  }
  power = pc_controller_step(&controller, volume + 0.4F * normal(), power);
}

void solve_by_tinympc() {
  for (int i = 0; i < PC_ORDER; ++i) {
    tinytype state = 0;
    for (int j = 0; j < PC_ORDER; ++j) state += states_of[i][j] * controller.state[j];
    tiny_solver.work->x(i, 0) = state;
  }
  for (int k = 0; k < PC_INPUTS; ++k) {  // relaxed where no power meets it
    const float free = controller.free[k];
    tiny_solver.work->x_max(0, k + 1) = (free > PC_PEAK_MAX ? free : PC_PEAK_MAX) / kUnit;
  }
  solve(&tiny_solver);
}

}  // namespace

int main() {
  static pc_qp_workspace workspace;
  static pc_qp_solution solution;
  Counter ours, theirs;
  std::uint32_t unsolved = 0, iterations = 0, most = 0;
  float difference = 0;
  *reinterpret_cast<volatile std::uint32_t*>(0xE000E014) = 0xFFFFFF;
  *reinterpret_cast<volatile std::uint32_t*>(0xE000E010) = 5;
  for (int k = 0; k < PC_INPUTS; ++k) tiny_solver.work->Xref(0, k) = 1;
  for (int i = 0; i < PC_ORDER; ++i) tiny_solver.work->Xref(i, PC_INPUTS) = last_reference[i];
  for (int n = 0; n < kPeriods; ++n) {
    period(n);
    std::uint32_t before = ticks();
    pc_qp_solve(&controller.problem, &workspace, &solution);
    ours.count(before);
    before = ticks();
    solve_by_tinympc();
    theirs.count(before);
    const TinySolution& found = *tiny_solver.solution;
    if (found.solved == 0) ++unsolved;
    iterations += static_cast<std::uint32_t>(found.iter);
    if (static_cast<std::uint32_t>(found.iter) > most)
      most = static_cast<std::uint32_t>(found.iter);
    const float off = std::fabs(static_cast<float>(found.u(0, 0)) - solution.power[0]);
    if (off > difference) difference = off;
  }
  print_number("ours, mean", static_cast<std::uint32_t>(ours.sum * kTick / kPeriods));
  print_number("ours, worst", ours.worst * kTick);
  print_number("TinyMPC, mean", static_cast<std::uint32_t>(theirs.sum * kTick / kPeriods));
  print_number("TinyMPC, worst", theirs.worst * kTick);
  print_number("TinyMPC, iterations in all", iterations);
  print_number("TinyMPC, most iterations", most);
  print_number("TinyMPC, not solved, per mille", unsolved);
  print_number("first powers differ by at most, uW",
               static_cast<std::uint32_t>(1e6F * PC_POWER_MAX * difference));
}

#include "photocoag/core/random.hpp"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

namespace photocoag {
namespace {

struct Pair {
  double first;
  double second;
};

double to_unit(std::uint32_t high, std::uint32_t low) noexcept {
  const std::uint64_t bits = (static_cast<std::uint64_t>(high) << 32 | low) >> 11;  // 53 bits
  return (static_cast<double>(bits) + 0.5) * 0x1.0p-53;
}

Pair uniform_pair(std::uint64_t seed, std::uint64_t cycle, RandomStream stream) noexcept {
  const r123::Philox4x32::ctr_type counter{{static_cast<std::uint32_t>(cycle),
                                            static_cast<std::uint32_t>(cycle >> 32),
                                            static_cast<std::uint32_t>(stream), 0}};
  const r123::Philox4x32::key_type key{
      {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  const auto word = r123::Philox4x32{}(counter, key);
  return {to_unit(word[0], word[1]), to_unit(word[2], word[3])};
}

}  // namespace

double uniform(std::uint64_t seed, std::uint64_t cycle, RandomStream stream) noexcept {
  return uniform_pair(seed, cycle, stream).first;
}

double standard_normal(std::uint64_t seed, std::uint64_t cycle, RandomStream stream) noexcept {
  const Pair u = uniform_pair(seed, cycle, stream);
  return std::sqrt(-2.0 * std::log(u.first)) * std::cos(2.0 * std::numbers::pi * u.second);
}

}  // namespace photocoag

// Role: the program; the cycles of a treatment shown in a table.
#pragma once

#include <cstddef>
#include <vector>

namespace photocoag {

/// 1, 2, 4, … and the last one.
inline std::vector<std::size_t> doubling_cycles(std::size_t cycles) {
  std::vector<std::size_t> shown;
  for (std::size_t k = 1; k < cycles; k *= 2) shown.push_back(k);
  shown.push_back(cycles);
  return shown;
}

}  // namespace photocoag

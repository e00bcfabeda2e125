#include "photocoag/campaign/spot_rows.hpp"

#include <algorithm>

namespace photocoag {
namespace {

constexpr std::size_t kChunk = 4096;  // rows that are read at a time

}  // namespace

void SpotRows::for_each(const std::function<void(const double* block)>& see) const {
  const std::size_t size = block_size(inputs);
  std::vector<double> blocks;
  for (std::uint64_t first = 0; first < count; first += kChunk) {
    const auto rows = static_cast<std::size_t>(std::min<std::uint64_t>(kChunk, count - first));
    blocks.resize(rows * size);
    read(first, rows, blocks.data());
    for (std::size_t row = 0; row < rows; ++row) see(blocks.data() + row * size);
  }
}

SpotRows rows_of(const std::vector<SpotRecord>& spots) {
  return {.count = spots.size(),
          .inputs = spots.empty() ? 0 : spots.front().inputs.size(),
          .read = [&spots](std::uint64_t first, std::size_t rows, double* blocks) {
            for (std::size_t row = 0; row < rows; ++row) {
              const std::vector<double> block = to_block(spots[first + row]);
              blocks = std::copy(block.begin(), block.end(), blocks);
            }
          }};
}

}  // namespace photocoag

// Any bytes as a log segment: refused with an Error, or records that were complete blocks. With the
// checksums of its header and first block made to fit as well.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include "photocoag/core/error.hpp"
#include "photocoag/log/reader.hpp"
#include "photocoag/run/recover.hpp"
#include "photocoag/run/run_csv.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run_files/table.hpp"

namespace {

void read(std::string_view bytes) {
  try {
    const photocoag::LogContent log = photocoag::parse_segment(bytes, "fuzz");
    if (log.records.size() * 8 > bytes.size()) std::abort();  // more than there can be
    photocoag::table_of(log);
    photocoag::run_csv(photocoag::treatment_from(log));
  } catch (const photocoag::Error&) {
    // Refused, as it should be.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  std::string text(reinterpret_cast<const char*>(bytes), size);
  read(text);
  if (size < 64) return 0;
  std::uint32_t length = 0;
  std::memcpy(&length, text.data() + 12, 4);
  if (length > size - 24) return 0;
  const std::size_t head = 16 + std::size_t{length};
  const std::uint32_t crc = photocoag::crc32(std::as_bytes(std::span(text).first(head)));
  std::memcpy(text.data() + head, &crc, 4);
  if (text.size() - head - 8 >= sizeof(photocoag::BlockHeader)) {
    photocoag::seal_block(std::as_writable_bytes(std::span(text).subspan(head + 8)));
  }
  read(text);
  return 0;
}

#include "photocoag/rt/last_resort.hpp"

#include <cstdlib>
#include <exception>

namespace photocoag {
namespace {

void (*last_off)(void*) noexcept = nullptr;
void* last_device = nullptr;

[[noreturn]] void switch_off_and_abort() noexcept {
  if (last_off != nullptr) last_off(last_device);
  std::abort();
}

}  // namespace

void set_last_resort(void (*off)(void* device) noexcept, void* device) noexcept {
  last_off = off;
  last_device = device;
  std::set_terminate(switch_off_and_abort);
}

}  // namespace photocoag

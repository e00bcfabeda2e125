// Role: the Python package; one finished treatment. Threads: immutable once made.
#pragma once

#include <atomic>
#include <memory>

#include "common.hpp"

namespace photocoag::python {

struct OwnedRun {
  Config config;                             ///< as asked for
  Config controlled;                         ///< as the controller is told
  std::shared_ptr<Models> models = nullptr;  ///< null: the eye was one's own
  Treatment treatment;
};

/// One treatment in virtual time on the calling thread, without the GIL. Throws Error.
OwnedRun simulated(const Config& config, const std::shared_ptr<Models>& models,
                   std::atomic<bool>& stop);

}  // namespace photocoag::python

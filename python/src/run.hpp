// Role: the Python package; one finished treatment. Threads: immutable after construction.
#pragma once

#include <atomic>
#include <memory>

#include "common.hpp"

namespace photocoag::python {

struct OwnedRun {
  Config config;                             ///< as requested
  Config controlled;                         ///< the controller's
  std::shared_ptr<Models> models = nullptr;  ///< null: a user's plant
  Treatment treatment;
};

/// One treatment in virtual time on the calling thread, without the GIL. Throws Error.
OwnedRun simulated(const Config& config, const std::shared_ptr<Models>& models,
                   std::atomic<bool>& stop);

}  // namespace photocoag::python

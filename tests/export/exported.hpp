// Role: tests; an exported C controller, compiled and loaded into the test program.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "photocoag/export/c_export.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {

/// Everything that a C compiler has to accept without a word.
std::vector<std::string> strict_flags();

/// The exported files in a new folder.
class ExportedFolder {
 public:
  explicit ExportedFolder(const std::vector<ExportedFile>& files);
  std::string path(const std::string& name) const { return folder_.file(name); }
  /// The .c files of the controller, without the example.
  std::vector<std::string> sources() const;

 private:
  TemporaryFolder folder_;
  std::vector<std::string> names_;
};

/// What the shared object of tests/export/shim.c offers.
class Exported {
 public:
  /// Compiles with gcc. Throws Error with the compiler's words if it has any.
  explicit Exported(const std::vector<ExportedFile>& files,
                    const std::vector<std::string>& flags = {"-O0"});
  ~Exported();
  Exported(const Exported&) = delete;
  Exported& operator=(const Exported&) = delete;

  /// Memory for one controller, initialised.
  std::vector<std::max_align_t> controller() const;

  std::size_t (*size)();
  int (*inputs)();
  void (*init)(void*);
  double (*start)(void*);
  double (*step)(void*, double sample, double power);
  double (*step_without_sample)(void*, double power);
  double (*peak)(const void*);
  double (*peak_sigma)(const void*);
  double (*reference)(const void*);
  int (*status)(const void*);
  int (*changes)(const void*);
  int (*use)(const void*);
  int (*qp)(const double*, const double*, const double*, const double*, const double*,
            const double*, double*, double*, double*);

 private:
  ExportedFolder folder_;
  void* library_;
};

}  // namespace photocoag::testing

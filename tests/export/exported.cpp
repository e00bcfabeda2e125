#include "export/exported.hpp"

#include <dlfcn.h>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/process.hpp"

namespace photocoag::testing {
namespace {

template <typename Function>
void find(void* library, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(library, name));
  if (function == nullptr) throw Error(ErrorParts{.where = name, .problem = "not exported"});
}

}  // namespace

std::vector<std::string> strict_flags() {
  return {"-std=c99",        "-Wall",
          "-Wextra",         "-Wpedantic",
          "-Wconversion",    "-Wshadow",
          "-Werror",         "-Wdouble-promotion",
          "-fno-math-errno", "-ffp-contract=off"};
}

ExportedFolder::ExportedFolder(const std::vector<ExportedFile>& files) {
  for (const ExportedFile& file : files) {
    write_file(path(file.name), file.text);
    names_.push_back(file.name);
  }
}

std::vector<std::string> ExportedFolder::sources() const {
  std::vector<std::string> all;
  for (const std::string& name : names_) {
    if (name.ends_with(".c") && name != "example.c") all.push_back(path(name));
  }
  return all;
}

Exported::Exported(const std::vector<ExportedFile>& files, const std::vector<std::string>& flags)
    : folder_(files) {
  const std::string object = folder_.path("controller.so");
  std::vector<std::string> command = {"gcc", "-fPIC", "-shared", "-I", folder_.path("")};
  for (const std::string& flag : strict_flags()) command.push_back(flag);
  for (const std::string& flag : flags) command.push_back(flag);
  command.insert(command.end(), {"-o", object});
  for (const std::string& source : folder_.sources()) command.push_back(source);
  command.emplace_back(PHOTOCOAG_SOURCE_DIR "/tests/export/shim.c");
  command.emplace_back("-lm");
  const ProgramResult result = run_program(command);
  if (!result.found || result.exit_code != 0 || !result.errors.empty()) {
    throw Error(ErrorParts{.where = "gcc", .problem = result.found ? result.errors : "not found"});
  }
  library_ = dlopen(object.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library_ == nullptr) throw Error(ErrorParts{.where = "dlopen", .problem = dlerror()});
  find(library_, "shim_size", size);
  find(library_, "shim_inputs", inputs);
  find(library_, "shim_init", init);
  find(library_, "shim_start", start);
  find(library_, "shim_step", step);
  find(library_, "shim_step_without_sample", step_without_sample);
  find(library_, "shim_peak", peak);
  find(library_, "shim_peak_sigma", peak_sigma);
  find(library_, "shim_reference", reference);
  find(library_, "shim_status", status);
  find(library_, "shim_changes", changes);
  find(library_, "shim_use", use);
  find(library_, "shim_qp", qp);
}

Exported::~Exported() { dlclose(library_); }

std::vector<std::max_align_t> Exported::controller() const {
  std::vector<std::max_align_t> memory(size() / sizeof(std::max_align_t) + 1);
  init(memory.data());
  return memory;
}

}  // namespace photocoag::testing

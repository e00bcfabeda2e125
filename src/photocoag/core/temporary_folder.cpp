#include "photocoag/core/temporary_folder.hpp"

#include <stdlib.h>

#include <initializer_list>

#include "photocoag/core/error.hpp"

namespace photocoag {

std::string make_temporary_folder(const std::string& prefix) {
  const char* wanted = getenv("TMPDIR");
  for (const char* base : {wanted, "/tmp", "/var/tmp", "/dev/shm"}) {
    if (base == nullptr || *base == '\0') continue;
    std::string name = std::string(base) + "/" + prefix + "XXXXXX";
    if (mkdtemp(name.data()) != nullptr) return name;
  }
  throw Error(ErrorParts{.where = "TMPDIR",
                         .problem = "no temporary folder can be made",
                         .found = wanted != nullptr ? wanted : "not set",
                         .accepted = "a folder that you may write to"});
}

}  // namespace photocoag

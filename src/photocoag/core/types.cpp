#include "photocoag/core/types.hpp"

namespace photocoag {

template <int EigenWorld, int EigenMajor, int EigenMinor, std::size_t SizeOfIndex,
          std::size_t SizeOfState, std::size_t SizeOfVector>
const char Layout<EigenWorld, EigenMajor, EigenMinor, SizeOfIndex, SizeOfState,
                  SizeOfVector>::kIsTheLibrarys = 1;
template struct Layout<EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION,
                       sizeof(Eigen::Index), sizeof(StateVector), sizeof(std::vector<double>)>;

}  // namespace photocoag

/* How fmi3_unsupported.c says no; given by what holds the instances. C99 and C++. */
#ifndef PHOTOCOAG_FMI3_REFUSE_H
#define PHOTOCOAG_FMI3_REFUSE_H

#include "fmi3.h"

#define FMU_LOG_CATEGORY "logStatusError"

#ifdef __cplusplus
extern "C" {
#endif

/* Logs that `function` is not supported; fmi3Error. */
fmi3Status fmu_refuse(fmi3Instance instance, const char* function);
/* The same for access to `n` variables of a type that no variable has; fmi3OK if n is 0. */
fmi3Status fmu_refuse_access(fmi3Instance instance, const char* function, size_t n,
                             size_t n_values);

#ifdef __cplusplus
}
#endif
#endif

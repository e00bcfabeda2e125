/* The exported controller as an FMU (FMI 3.0, co-simulation) in C99: one communication step is one
 * control period. Research software, not a medical device; THE SUPERVISOR IS NOT IN IT. What is not
 * supported: fmi3_unsupported.c. The variables are those of modelDescription.xml, their references
 * are the places in the enumeration below. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3.h"
#include "fmi3_refuse.h"
#include "fmu_token.h"
#include "pc_controller.h"

enum {
  TIME,
  VOLUME_TEMPERATURE, /* inputs */
  APPLIED_POWER,
  POWER, /* outputs */
  POWER_REFERENCE,
  PEAK_ESTIMATE,
  PEAK_SIGMA,
  ABSORPTION_ESTIMATE,
  SOLVER_STATUS, /* whole numbers */
  SOLVER_ITERATIONS,
  LIMIT_ACTIVE, /* a Boolean */
  VARIABLES
};

typedef enum { INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED } fmu_mode;

/* Variable state of an instance. */
typedef struct {
  fmu_mode mode;
  double start; /* s */
  uint64_t steps;
  double sample;  /* K */
  double applied; /* W */
  pc_controller controller;
} fmu_state;

typedef struct saved {
  fmu_state state;
  struct saved* next;
} saved;

typedef struct {
  fmi3InstanceEnvironment environment;
  fmi3LogMessageCallback log;
  fmu_state now;
  saved* states;
} fmu;

static fmi3Status refuse(const fmu* self, const char* function, const char* why) {
  char text[200];
  if (self == NULL || self->log == NULL) return fmi3Error;
  snprintf(text, sizeof text, "%s: %s", function, why);
  self->log(self->environment, fmi3Error, FMU_LOG_CATEGORY, text);
  return fmi3Error;
}

fmi3Status fmu_refuse(fmi3Instance instance, const char* function) {
  return refuse(instance, function, "not supported by this FMU, which is for plain co-simulation");
}

fmi3Status fmu_refuse_access(fmi3Instance instance, const char* function, size_t n,
                             size_t n_values) {
  if (instance != NULL && n == 0 && n_values == 0) return fmi3OK;
  return refuse(instance, function, "no variable of this FMU has that type");
}

static void begin(fmu_state* now) {
  memset(now, 0, sizeof *now);
  pc_controller_init(&now->controller);
  (void)pc_controller_start(&now->controller);
}

static double now_s(const fmu_state* now) {
  return now->start + (double)now->steps * (double)PC_PERIOD;
}

const char* fmi3GetVersion(void) { return FMI3_VERSION; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[],
                                         size_t n_intermediate, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  fmu* self = NULL;
  const char* why = "no memory";
  const fmu importer = {.environment = environment, .log = log};
  (void)resources, (void)visible, (void)logging, (void)early_return, (void)intermediate;
  (void)update;
  if (name == NULL || token == NULL || strcmp(token, FMU_TOKEN) != 0) {
    why = "no name, or the token of another FMU";
  } else if (event_mode || n_intermediate > 0) {
    why = "no event mode, no intermediate variables";
  } else {
    self = calloc(1, sizeof *self);
  }
  if (self == NULL) {
    refuse(&importer, "fmi3InstantiateCoSimulation", why);
    return NULL;
  }
  self->environment = environment;
  self->log = log;
  begin(&self->now);
  return self;
}

void fmi3FreeInstance(fmi3Instance instance) {
  fmu* self = instance;
  if (self == NULL) return;
  while (self->states != NULL) {
    saved* next = self->states->next;
    free(self->states);
    self->states = next;
  }
  free(self);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t n,
                               const fmi3String categories[]) {
  (void)on;
  if (instance == NULL) return fmi3Error;
  for (size_t i = 0; i < n; ++i) {
    if (categories == NULL || categories[i] == NULL ||
        strcmp(categories[i], FMU_LOG_CATEGORY) != 0) {
      return refuse(instance, "fmi3SetDebugLogging", "unknown log category");
    }
  }
  return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stop_defined, fmi3Float64 stop) {
  fmu* self = instance;
  (void)tolerance_defined, (void)tolerance;
  if (self == NULL) return fmi3Error;
  if (self->now.mode != INSTANTIATED) {
    return refuse(self, "fmi3EnterInitializationMode", "called out of order");
  }
  if (!isfinite(start) || (stop_defined && !(stop >= start))) {
    return refuse(self, "fmi3EnterInitializationMode", "no span of time");
  }
  self->now.start = start;
  self->now.mode = INITIALIZATION;
  return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
  fmu* self = instance;
  if (self == NULL) return fmi3Error;
  if (self->now.mode != INITIALIZATION) {
    return refuse(self, "fmi3ExitInitializationMode", "called out of order");
  }
  self->now.mode = STEPPING;
  return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
  fmu* self = instance;
  if (self == NULL) return fmi3Error;
  if (self->now.mode != STEPPING) return refuse(self, "fmi3Terminate", "called out of order");
  self->now.mode = TERMINATED;
  return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
  fmu* self = instance;
  if (self == NULL) return fmi3Error;
  begin(&self->now);
  return fmi3OK;
}

static double number(const fmu_state* now, fmi3ValueReference reference) {
  const pc_controller* controller = &now->controller;
  switch (reference) {
    case TIME:
      return now_s(now);
    case VOLUME_TEMPERATURE:
      return now->sample;
    case APPLIED_POWER:
      return now->applied;
    case POWER:
      return (double)controller->decision.power;
    case POWER_REFERENCE:
      return (double)controller->decision.power_reference;
    case PEAK_ESTIMATE:
      return (double)pc_controller_peak(controller);
    case PEAK_SIGMA:
      return (double)pc_controller_peak_sigma(controller);
    default:
      return (double)controller->filter.alpha;
  }
}

/* Reads all variables or none. Outputs have no value before initialization. */
static fmi3Status check_get(const fmu* self, const char* function, const fmi3ValueReference* list,
                            size_t n, const void* values, size_t n_values, unsigned first,
                            unsigned last) {
  if (self == NULL) return fmi3Error;
  if (n != n_values || (n > 0 && (list == NULL || values == NULL))) {
    return refuse(self, function, "a null pointer, or another number of values than references");
  }
  for (size_t i = 0; i < n; ++i) {
    if (list[i] >= VARIABLES) return refuse(self, function, "unknown value reference");
    if (list[i] < first || list[i] > last) return refuse(self, function, "another type");
    if (list[i] >= POWER && self->now.mode == INSTANTIATED) {
      return refuse(self, function, "has no value before initialization");
    }
  }
  return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                          fmi3Float64 values[], size_t n_values) {
  const fmu* self = instance;
  const fmi3Status status =
      check_get(self, "fmi3GetFloat64", references, n, values, n_values, TIME, ABSORPTION_ESTIMATE);
  if (status != fmi3OK) return status;
  for (size_t i = 0; i < n; ++i) values[i] = number(&self->now, references[i]);
  return fmi3OK;
}

fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                        fmi3Int64 values[], size_t n_values) {
  const fmu* self = instance;
  const fmi3Status status = check_get(self, "fmi3GetInt64", references, n, values, n_values,
                                      SOLVER_STATUS, SOLVER_ITERATIONS);
  if (status != fmi3OK) return status;
  for (size_t i = 0; i < n; ++i) {
    values[i] = references[i] == SOLVER_STATUS ? (fmi3Int64)self->now.controller.decision.status
                                               : self->now.controller.decision.changes;
  }
  return fmi3OK;
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                          fmi3Boolean values[], size_t n_values) {
  const fmu* self = instance;
  const fmi3Status status = check_get(self, "fmi3GetBoolean", references, n, values, n_values,
                                      LIMIT_ACTIVE, LIMIT_ACTIVE);
  if (status != fmi3OK) return status;
  for (size_t i = 0; i < n; ++i) values[i] = self->now.controller.decision.limit_active;
  return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                          const fmi3Float64 values[], size_t n_values) {
  fmu* self = instance;
  const fmi3Status status =
      check_get(self, "fmi3SetFloat64", references, n, values, n_values, TIME, ABSORPTION_ESTIMATE);
  if (status != fmi3OK) return status;
  for (size_t i = 0; i < n; ++i) {
    const bool input = references[i] == VOLUME_TEMPERATURE || references[i] == APPLIED_POWER;
    if (!input || self->now.mode == TERMINATED) {
      return refuse(self, "fmi3SetFloat64", "cannot be set: inputs alone can, until the end");
    }
  }
  for (size_t i = 0; i < n; ++i) {
    *(references[i] == VOLUME_TEMPERATURE ? &self->now.sample : &self->now.applied) = values[i];
  }
  return fmi3OK;
}

/* No input is a whole number or a Boolean. */
#define REFUSE_SET(Type)                                                                           \
  fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference references[], size_t n, \
                           const fmi3##Type values[], size_t n_values) {                           \
    (void)references, (void)values;                                                                \
    return fmu_refuse_access(instance, "fmi3Set" #Type, n, n_values);                              \
  }
REFUSE_SET(Int64)
REFUSE_SET(Boolean)

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step,
                      fmi3Boolean no_set_state_prior, fmi3Boolean* event_needed,
                      fmi3Boolean* terminate, fmi3Boolean* early_return, fmi3Float64* last_time) {
  fmu* self = instance;
  const double period = (double)PC_PERIOD;
  (void)no_set_state_prior;
  if (self == NULL) return fmi3Error;
  if (event_needed == NULL || terminate == NULL || early_return == NULL || last_time == NULL) {
    return refuse(self, "fmi3DoStep", "a null pointer");
  }
  *event_needed = *terminate = *early_return = false;
  *last_time = now_s(&self->now);
  if (self->now.mode != STEPPING) return refuse(self, "fmi3DoStep", "called out of order");
  if (!(fabs(step - period) <= 1e-6 * period)) {
    return refuse(self, "fmi3DoStep", "another communication step size than the control period");
  }
  if (!(fabs(time - now_s(&self->now)) <= 1e-3 * period)) {
    return refuse(self, "fmi3DoStep", "another communication point");
  }
  /* NaN: the command was applied. */
  const pc_real applied = isfinite(self->now.applied) ? (pc_real)self->now.applied
                                                      : self->now.controller.decision.power;
  if (isfinite(self->now.sample)) {
    (void)pc_controller_step(&self->now.controller, (pc_real)self->now.sample, applied);
  } else {
    (void)pc_controller_step_without_sample(&self->now.controller, applied);
  }
  ++self->now.steps;
  *last_time = now_s(&self->now);
  return fmi3OK;
}

static saved* find(const fmu* self, const void* state) {
  saved* one = self->states;
  while (one != NULL && one != state) one = one->next;
  return one;
}

/* Into an existing state or a new one. */
static fmi3Status keep(fmu* self, const char* function, const fmu_state* what,
                       fmi3FMUState* where) {
  saved* one;
  if (where == NULL) return refuse(self, function, "a null pointer");
  one = *where == NULL ? calloc(1, sizeof *one) : find(self, *where);
  if (one == NULL)
    return refuse(self, function, "not a saved state of this instance, or no memory");
  one->state = *what;
  if (*where == NULL) {
    one->next = self->states;
    self->states = one;
  }
  *where = one;
  return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState* state) {
  fmu* self = instance;
  return self == NULL ? fmi3Error : keep(self, "fmi3GetFMUState", &self->now, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state) {
  fmu* self = instance;
  const saved* one = self == NULL ? NULL : find(self, state);
  if (one == NULL) return refuse(self, "fmi3SetFMUState", "not a saved state of this instance");
  self->now = one->state;
  return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState* state) {
  fmu* self = instance;
  if (self == NULL) return fmi3Error;
  if (state == NULL) return refuse(self, "fmi3FreeFMUState", "a null pointer");
  if (*state == NULL) return fmi3OK;
  for (saved** at = &self->states; *at != NULL; at = &(*at)->next) {
    saved* one = *at;
    if (one != *state) continue;
    *at = one->next;
    free(one);
    *state = NULL;
    return fmi3OK;
  }
  return refuse(self, "fmi3FreeFMUState", "not a saved state of this instance");
}

/* For this FMU on this machine: the token, then the memory as it is. */
static const size_t kSerialized = sizeof FMU_TOKEN + sizeof(fmu_state);

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t* size) {
  fmu* self = instance;
  if (self == NULL) return fmi3Error;
  if (size == NULL || find(self, state) == NULL) {
    return refuse(self, "fmi3SerializedFMUStateSize", "a null pointer, or not a saved state");
  }
  *size = kSerialized;
  return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[],
                                 size_t size) {
  fmu* self = instance;
  const saved* one = self == NULL ? NULL : find(self, state);
  if (one == NULL || bytes == NULL || size != kSerialized) {
    return refuse(self, "fmi3SerializeFMUState", "not a saved state, or another size");
  }
  memcpy(bytes, FMU_TOKEN, sizeof FMU_TOKEN);
  memcpy(bytes + sizeof FMU_TOKEN, &one->state, sizeof one->state);
  return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState* state) {
  fmu* self = instance;
  fmu_state read;
  if (self == NULL) return fmi3Error;
  if (bytes == NULL || size != kSerialized || memcmp(bytes, FMU_TOKEN, sizeof FMU_TOKEN) != 0) {
    return refuse(self, "fmi3DeserializeFMUState", "not a serialized state of this FMU");
  }
  memcpy(&read, bytes + sizeof FMU_TOKEN, sizeof read);
  return keep(self, "fmi3DeserializeFMUState", &read, state);
}

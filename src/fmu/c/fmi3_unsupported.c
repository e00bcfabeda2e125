/* What photocoag's FMUs do not have: other kinds of variables than Float64, Int64 and Boolean,
 * events and clocks, partial derivatives, model exchange, scheduled execution. Every one of these
 * functions exists, returns fmi3Error and names itself through the logger. C99. */
#include "fmi3.h"
#include "fmi3_refuse.h"

/* An access to no variables is valid: fmi3OK. */
#define REFUSE_ACCESS(Type)                                                                        \
  fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference references[], size_t n, \
                           fmi3##Type values[], size_t n_values) {                                 \
    (void)references, (void)values;                                                                \
    return fmu_refuse_access(instance, "fmi3Get" #Type, n, n_values);                              \
  }                                                                                                \
  fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference references[], size_t n, \
                           const fmi3##Type values[], size_t n_values) {                           \
    (void)references, (void)values;                                                                \
    return fmu_refuse_access(instance, "fmi3Set" #Type, n, n_values);                              \
  }
REFUSE_ACCESS(Float32)
REFUSE_ACCESS(Int8)
REFUSE_ACCESS(UInt8)
REFUSE_ACCESS(Int16)
REFUSE_ACCESS(UInt16)
REFUSE_ACCESS(Int32)
REFUSE_ACCESS(UInt32)
REFUSE_ACCESS(UInt64)
REFUSE_ACCESS(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                         size_t sizes[], fmi3Binary values[], size_t n_values) {
  (void)references, (void)sizes, (void)values;
  return fmu_refuse_access(instance, "fmi3GetBinary", n, n_values);
}
fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                         const size_t sizes[], const fmi3Binary values[], size_t n_values) {
  (void)references, (void)sizes, (void)values;
  return fmu_refuse_access(instance, "fmi3SetBinary", n, n_values);
}
fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                        fmi3Clock values[]) {
  (void)references, (void)values;
  return fmu_refuse_access(instance, "fmi3GetClock", n, n);
}
fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                        const fmi3Clock values[]) {
  (void)references, (void)values;
  return fmu_refuse_access(instance, "fmi3SetClock", n, n);
}

/* REFUSE(NAME, other parameters): the instance is the first one. */
#define REFUSE(name, ...) \
  fmi3Status name(fmi3Instance instance, __VA_ARGS__) { return fmu_refuse(instance, #name); }
#define REFUSE_BARE(name) \
  fmi3Status name(fmi3Instance instance) { return fmu_refuse(instance, #name); }
#define UNUSED __attribute__((unused))

REFUSE_BARE(fmi3EnterEventMode)
REFUSE_BARE(fmi3EnterConfigurationMode)
REFUSE_BARE(fmi3ExitConfigurationMode)
REFUSE_BARE(fmi3EvaluateDiscreteStates)
REFUSE_BARE(fmi3EnterContinuousTimeMode)
REFUSE_BARE(fmi3EnterStepMode)
REFUSE(fmi3GetNumberOfVariableDependencies, UNUSED fmi3ValueReference reference, UNUSED size_t* n)
REFUSE(fmi3GetVariableDependencies, UNUSED fmi3ValueReference dependent, UNUSED size_t elements[],
       UNUSED fmi3ValueReference independents[], UNUSED size_t elements_of_independents[],
       UNUSED fmi3DependencyKind kinds[], UNUSED size_t n)
REFUSE(fmi3GetDirectionalDerivative, UNUSED const fmi3ValueReference unknowns[],
       UNUSED size_t n_unknowns, UNUSED const fmi3ValueReference knowns[], UNUSED size_t n_knowns,
       UNUSED const fmi3Float64 seed[], UNUSED size_t n_seed, UNUSED fmi3Float64 sensitivity[],
       UNUSED size_t n_sensitivity)
REFUSE(fmi3GetAdjointDerivative, UNUSED const fmi3ValueReference unknowns[],
       UNUSED size_t n_unknowns, UNUSED const fmi3ValueReference knowns[], UNUSED size_t n_knowns,
       UNUSED const fmi3Float64 seed[], UNUSED size_t n_seed, UNUSED fmi3Float64 sensitivity[],
       UNUSED size_t n_sensitivity)
REFUSE(fmi3GetIntervalDecimal, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED fmi3Float64 intervals[], UNUSED fmi3IntervalQualifier qualifiers[])
REFUSE(fmi3GetIntervalFraction, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED fmi3UInt64 counters[], UNUSED fmi3UInt64 resolutions[],
       UNUSED fmi3IntervalQualifier qualifiers[])
REFUSE(fmi3GetShiftDecimal, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED fmi3Float64 shifts[])
REFUSE(fmi3GetShiftFraction, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED fmi3UInt64 counters[], UNUSED fmi3UInt64 resolutions[])
REFUSE(fmi3SetIntervalDecimal, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED const fmi3Float64 intervals[])
REFUSE(fmi3SetIntervalFraction, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED const fmi3UInt64 counters[], UNUSED const fmi3UInt64 resolutions[])
REFUSE(fmi3SetShiftDecimal, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED const fmi3Float64 shifts[])
REFUSE(fmi3SetShiftFraction, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED const fmi3UInt64 counters[], UNUSED const fmi3UInt64 resolutions[])
REFUSE(fmi3UpdateDiscreteStates, UNUSED fmi3Boolean* need_update, UNUSED fmi3Boolean* terminate,
       UNUSED fmi3Boolean* nominals_changed, UNUSED fmi3Boolean* values_changed,
       UNUSED fmi3Boolean* next_event_defined, UNUSED fmi3Float64* next_event)
REFUSE(fmi3CompletedIntegratorStep, UNUSED fmi3Boolean no_set_state_prior,
       UNUSED fmi3Boolean* enter_event_mode, UNUSED fmi3Boolean* terminate)
REFUSE(fmi3SetTime, UNUSED fmi3Float64 time)
REFUSE(fmi3SetContinuousStates, UNUSED const fmi3Float64 states[], UNUSED size_t n)
REFUSE(fmi3GetContinuousStateDerivatives, UNUSED fmi3Float64 derivatives[], UNUSED size_t n)
REFUSE(fmi3GetEventIndicators, UNUSED fmi3Float64 indicators[], UNUSED size_t n)
REFUSE(fmi3GetContinuousStates, UNUSED fmi3Float64 states[], UNUSED size_t n)
REFUSE(fmi3GetNominalsOfContinuousStates, UNUSED fmi3Float64 nominals[], UNUSED size_t n)
REFUSE(fmi3GetNumberOfEventIndicators, UNUSED size_t* n)
REFUSE(fmi3GetNumberOfContinuousStates, UNUSED size_t* n)
REFUSE(fmi3GetOutputDerivatives, UNUSED const fmi3ValueReference references[], UNUSED size_t n,
       UNUSED const fmi3Int32 orders[], UNUSED fmi3Float64 values[], UNUSED size_t n_values)
REFUSE(fmi3ActivateModelPartition, UNUSED fmi3ValueReference clock, UNUSED fmi3Float64 time)

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging;
  if (log != NULL) {
    log(environment, fmi3Error, FMU_LOG_CATEGORY,
        "fmi3InstantiateModelExchange: this FMU is for co-simulation");
  }
  return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging;
  (void)update, (void)lock, (void)unlock;
  if (log != NULL) {
    log(environment, fmi3Error, FMU_LOG_CATEGORY,
        "fmi3InstantiateScheduledExecution: this FMU is for co-simulation");
  }
  return NULL;
}

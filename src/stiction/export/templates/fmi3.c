/* FMI 3.0 for co-simulation. The declarations follow the standard, https://fmi-standard.org. */

#include "fmi_common.h"

#include <stdbool.h>

typedef void *fmi3Instance;
typedef double fmi3Float64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef uint32_t fmi3ValueReference;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*fmi3LogMessageCallback)(void *, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3Callback)(void);

#define COMMON(c) ((instance_t *)(c))
#define STATUS(wrong) ((wrong) ? fmi3Error : fmi3OK)
#define VALUES const fmi3ValueReference vr[], size_t n

static void complain(instance_t *c, const char *text) {
    fmi3LogMessageCallback log;
    memcpy(&log, &c->logger, sizeof log);
    if (log) log(c->environment, fmi3Error, "logStatusError", text);
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference needed[],
    size_t n_needed, void *environment, fmi3LogMessageCallback log, fmi3Callback update) {
    instance_t *c;
    if (!name || !token || strcmp(token, TOKEN)) return NULL;
    c = calloc(1, sizeof *c);
    if (!c) return NULL;
    memcpy(&c->logger, &log, sizeof log);
    c->environment = environment;
    c->logging = logging;
    snprintf(c->name, sizeof c->name, "%s", name);
    to_defaults(c);
    return c;
}
EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, void *environment, fmi3LogMessageCallback log) { return NULL; }
EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, void *environment, fmi3LogMessageCallback log, fmi3Callback update,
    fmi3Callback lock, fmi3Callback unlock) { return NULL; }
EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    COMMON(c)->logging = on;
    return fmi3OK;
}
EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                              fmi3Float64 start, fmi3Boolean stopDefined, fmi3Float64 stop) {
    COMMON(c)->s.values[TIME] = start;
    COMMON(c)->s.phase = INITIALISING;
    return fmi3OK;
}
EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return STATUS(begin(COMMON(c))); }
EXPORT fmi3Status fmi3Terminate(fmi3Instance c) { COMMON(c)->s.phase = ENDED; return fmi3OK; }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { to_defaults(COMMON(c)); return fmi3OK; }

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, VALUES, fmi3Float64 value[], size_t n_values) {
    return STATUS(n != n_values || get(COMMON(c), vr, n, value));
}
EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, VALUES, const fmi3Float64 value[], size_t n_values) {
    return STATUS(n != n_values || set(COMMON(c), vr, n, value));
}

/* The model has variables of one type only: nothing is there to get or set of another. */
#define NONE(NAME, TYPE) \
    EXPORT fmi3Status fmi3Get##NAME(fmi3Instance c, VALUES, TYPE value[], size_t n_values) { return STATUS(n > 0); } \
    EXPORT fmi3Status fmi3Set##NAME(fmi3Instance c, VALUES, const TYPE value[], size_t n_values) { return STATUS(n > 0); }
NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE(Int32, int32_t)
NONE(UInt32, uint32_t)
NONE(Int64, int64_t)
NONE(UInt64, uint64_t)
NONE(Boolean, fmi3Boolean)
NONE(String, fmi3String)
EXPORT fmi3Status fmi3GetBinary(fmi3Instance c, VALUES, size_t sizes[], fmi3Binary value[], size_t n_values) {
    return STATUS(n > 0);
}
EXPORT fmi3Status fmi3SetBinary(fmi3Instance c, VALUES, const size_t sizes[], const fmi3Binary value[], size_t n_values) {
    return STATUS(n > 0);
}
EXPORT fmi3Status fmi3GetClock(fmi3Instance c, VALUES, fmi3Clock value[]) { return STATUS(n > 0); }
EXPORT fmi3Status fmi3SetClock(fmi3Instance c, VALUES, const fmi3Clock value[]) { return STATUS(n > 0); }

EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n) {
    return fmi3Error;
}
EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t of[],
    fmi3ValueReference independents[], size_t elements[], int kinds[], size_t n) { return fmi3Error; }

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, void **state) { return STATUS(save(COMMON(c), state)); }
EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, void *state) { return STATUS(restore(COMMON(c), state)); }
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, void **state) { return STATUS(release(state)); }
EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, void *state, size_t *size) {
    *size = sizeof(state_t);
    return fmi3OK;
}
EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, void *state, fmi3Byte bytes[], size_t size) {
    return STATUS(write_state(state, bytes, size));
}
EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, void **state) {
    return STATUS(read_state(COMMON(c), bytes, size, state));
}

/* What the standard asks of every file and this model does not have: modes, clocks, derivatives, continuous states. */
#define KNOWN VALUES, const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[], size_t n_seed
EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, KNOWN, fmi3Float64 out[], size_t m) { return fmi3Error; }
EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, KNOWN, fmi3Float64 out[], size_t m) { return fmi3Error; }
#define PLAIN(NAME) EXPORT fmi3Status NAME(fmi3Instance c) { return fmi3Error; }
PLAIN(fmi3EnterEventMode)
PLAIN(fmi3EnterConfigurationMode)
PLAIN(fmi3ExitConfigurationMode)
PLAIN(fmi3EvaluateDiscreteStates)
PLAIN(fmi3EnterContinuousTimeMode)
PLAIN(fmi3EnterStepMode)
#define STATES(NAME, QUALIFIER) EXPORT fmi3Status NAME(fmi3Instance c, QUALIFIER fmi3Float64 x[], size_t n) { return fmi3Error; }
STATES(fmi3SetContinuousStates, const)
STATES(fmi3GetContinuousStates, )
STATES(fmi3GetContinuousStateDerivatives, )
STATES(fmi3GetEventIndicators, )
STATES(fmi3GetNominalsOfContinuousStates, )
#define CLOCKS(NAME, ...) EXPORT fmi3Status NAME(fmi3Instance c, VALUES, __VA_ARGS__) { return fmi3Error; }
CLOCKS(fmi3GetIntervalDecimal, fmi3Float64 intervals[], int qualifiers[])
CLOCKS(fmi3GetIntervalFraction, uint64_t counters[], uint64_t resolutions[], int qualifiers[])
CLOCKS(fmi3GetShiftDecimal, fmi3Float64 shifts[])
CLOCKS(fmi3GetShiftFraction, uint64_t counters[], uint64_t resolutions[])
CLOCKS(fmi3SetIntervalDecimal, const fmi3Float64 intervals[])
CLOCKS(fmi3SetIntervalFraction, const uint64_t counters[], const uint64_t resolutions[])
CLOCKS(fmi3SetShiftDecimal, const fmi3Float64 shifts[])
CLOCKS(fmi3SetShiftFraction, const uint64_t counters[], const uint64_t resolutions[])
CLOCKS(fmi3GetOutputDerivatives, const int32_t orders[], fmi3Float64 values[], size_t n_values)
EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *update, fmi3Boolean *end, fmi3Boolean *nominals,
    fmi3Boolean *values, fmi3Boolean *defined, fmi3Float64 *next) { return fmi3Error; }
EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *end) {
    return fmi3Error;
}
EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) { return fmi3Error; }
EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { *n = 0; return fmi3OK; }
EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) { *n = 0; return fmi3OK; }
EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time) {
    return fmi3Error;
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 from, fmi3Float64 step, fmi3Boolean final, fmi3Boolean *event,
                             fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    int wrong = advance(COMMON(c), from, step);
    *event = *terminate = *early = false;
    *last = COMMON(c)->s.values[TIME];
    return STATUS(wrong);
}

/* FMI 2.0 for co-simulation. The declarations follow the standard, https://fmi-standard.org. */

#include "fmi_common.h"

typedef void *fmi2Component;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef unsigned int fmi2ValueReference;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(void *, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(void *, fmi2Status);
    void *componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    instance_t common;
    fmi2CallbackFunctions callbacks;
} component_t;

#define COMMON(c) (&((component_t *)(c))->common)
#define STATUS(wrong) ((wrong) ? fmi2Error : fmi2OK)
#define VALUES const fmi2ValueReference vr[], size_t n

static void complain(instance_t *c, const char *text) {
    const fmi2CallbackFunctions *call = &((component_t *)c)->callbacks;
    if (call->logger) call->logger(call->componentEnvironment, c->name, fmi2Error, "logStatusError", "%s", text);
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean log) {
    component_t *c;
    if (type != fmi2CoSimulation || !functions || !name || !guid || strcmp(guid, TOKEN)) return NULL;
    c = calloc(1, sizeof *c);
    if (!c) return NULL;
    c->callbacks = *functions;
    c->common.logging = log;
    snprintf(c->common.name, sizeof c->common.name, "%s", name);
    to_defaults(&c->common);
    return c;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    COMMON(c)->logging = on;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                                      fmi2Real start, fmi2Boolean stopDefined, fmi2Real stop) {
    COMMON(c)->s.values[TIME] = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { COMMON(c)->s.phase = INITIALISING; return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return STATUS(begin(COMMON(c))); }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { COMMON(c)->s.phase = ENDED; return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) { to_defaults(COMMON(c)); return fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component c, VALUES, fmi2Real value[]) { return STATUS(get(COMMON(c), vr, n, value)); }
EXPORT fmi2Status fmi2SetReal(fmi2Component c, VALUES, const fmi2Real value[]) {
    return STATUS(set(COMMON(c), vr, n, value));
}

/* The model has real variables only: nothing is there to get or set of another type. */
#define NONE(NAME, TYPE) \
    EXPORT fmi2Status NAME(fmi2Component c, VALUES, TYPE value[]) { \
        \
        return n ? fmi2Error : fmi2OK; \
    }
NONE(fmi2GetInteger, fmi2Integer)
NONE(fmi2GetBoolean, fmi2Boolean)
NONE(fmi2GetString, fmi2String)
NONE(fmi2SetInteger, const fmi2Integer)
NONE(fmi2SetBoolean, const fmi2Boolean)
NONE(fmi2SetString, const fmi2String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, void **state) { return STATUS(save(COMMON(c), state)); }
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, void *state) { return STATUS(restore(COMMON(c), state)); }
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, void **state) { return STATUS(release(state)); }
EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, void *state, size_t *size) {
    *size = sizeof(state_t);
    return fmi2OK;
}
EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, void *state, fmi2Byte bytes[], size_t size) {
    return STATUS(write_state(state, (uint8_t *)bytes, size));
}
EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, void **state) {
    return STATUS(read_state(COMMON(c), (const uint8_t *)bytes, size, state));
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, VALUES, const fmi2ValueReference known[], size_t n_known,
                                               const fmi2Real seed[], fmi2Real sensitivity[]) {
    complain(COMMON(c), "the model has no derivatives: it slips.");
    return fmi2Error;
}
EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, VALUES, const fmi2Integer order[], const fmi2Real value[]) {
    return n ? fmi2Error : fmi2OK;
}
EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, VALUES, const fmi2Integer order[], fmi2Real value[]) {
    return n ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real from, fmi2Real step, fmi2Boolean final) {
    return STATUS(advance(COMMON(c), from, step));
}
EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    return fmi2Discard;
}
EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = COMMON(c)->s.values[TIME];
    return fmi2OK;
}
EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    return fmi2Discard;
}
EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = COMMON(c)->s.phase == ENDED;
    return fmi2OK;
}
EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    return fmi2Discard;
}

/* What both versions of FMI share: one instance, its variables and its time. Included once, after the glue. */

#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter" /* the standard gives functions more than this model needs */
#endif

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32 || defined __CYGWIN__
#define EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

#if defined __GNUC__
#define OUT_OF_LINE __attribute__((noinline))
#else
#define OUT_OF_LINE
#endif

/* Value references: parameters, inputs, outputs, sampling period, time, in this order. */
enum { FIRST_INPUT = N_PARAMETERS, FIRST_OUTPUT = FIRST_INPUT + N_INPUTS, DT = FIRST_OUTPUT + N_OUTPUTS, TIME, N_VALUES };
enum { CREATED, INITIALISING, RUNNING, ENDED };

typedef struct {
    MODEL model;
    double values[N_VALUES];
    double tolerance; /* Of times [s] */
    double due;       /* Time of the next sample and the tolerance [s] */
    double first;     /* Time of the first sample and the tolerance [s] */
    double taken;     /* Samples until now [-] */
    int phase;
} state_t;

typedef struct {
    state_t s; /* What an importer may save and restore */
    char name[128];
    void *environment;
    void *logger;
    int logging;
} instance_t;

static void complain(instance_t *c, const char *text);

static void to_defaults(instance_t *c) {
    memset(&c->s, 0, sizeof c->s);
    glue_defaults(&c->s.model, c->s.values);
    c->s.values[DT] = c->s.model.dt;
}

static int begin(instance_t *c) {
    int wrong = glue_start(&c->s.model, c->s.values);
    if (wrong) {
        char text[512];
        glue_refusal(wrong, c->s.values, text, sizeof text);
        complain(c, text);
        return 1;
    }
    glue_outputs(&c->s.model, c->s.values + FIRST_OUTPUT);
    c->s.tolerance = 1e-6 * c->s.values[DT];
    c->s.due = c->s.first = c->s.values[TIME] + c->s.tolerance;
    c->s.taken = 0.0;
    c->s.phase = RUNNING;
    return 0;
}

static int get(instance_t *c, const uint32_t *at, size_t n, double *value) {
    for (size_t k = 0; k < n; k++) {
        if (at[k] >= N_VALUES) {
            complain(c, "there is no variable with this value reference.");
            return 1;
        }
        value[k] = c->s.values[at[k]];
    }
    return 0;
}

static int set(instance_t *c, const uint32_t *at, size_t n, const double *value) {
    for (size_t k = 0; k < n; k++) {
        if (at[k] >= FIRST_OUTPUT || (c->s.phase >= RUNNING && at[k] < FIRST_INPUT)) {
            complain(c, at[k] < FIRST_INPUT ? "parameters cannot be changed after the initialisation."
                                            : "only parameters and inputs can be set.");
            return 1;
        }
        c->s.values[at[k]] = value[k];
    }
    return 0;
}

static void take_sample(state_t *s) {
    glue_step(&s->model, s->values + FIRST_INPUT);
    s->taken += 1.0;
    s->due = s->first + s->taken * s->values[DT];
}

/* Out of line: in a loop the compiler prepares for more samples than most steps of an importer have. */
OUT_OF_LINE static void take_samples(state_t *s, double end) {
    while (s->due < end) take_sample(s);
}

/* Take the samples whose time lies in [from, from + step), each once. The importer's own step may have any length. */
static int advance(instance_t *c, double from, double step) {
    const double end = from + step;
    if (c->s.phase != RUNNING || !(step >= 0.0) || !(fabs(from - c->s.values[TIME]) <= c->s.tolerance)) {
        complain(c, c->s.phase != RUNNING ? "the model is not initialised, or was terminated."
                    : !(step >= 0.0) ? "a step must not be negative."
                                     : "a step must begin where the last one ended; restore an earlier state first.");
        return 1;
    }
    if (c->s.due < end) {
        take_sample(&c->s);
        if (c->s.due < end) take_samples(&c->s, end);
    }
    glue_outputs(&c->s.model, c->s.values + FIRST_OUTPUT);
    c->s.values[TIME] = end;
    return 0;
}

static int save(const instance_t *c, void **state) {
    if (!*state) *state = malloc(sizeof(state_t));
    if (!*state) return 1;
    memcpy(*state, &c->s, sizeof(state_t));
    return 0;
}

static int restore(instance_t *c, const void *state) {
    memcpy(&c->s, state, sizeof(state_t));
    return 0;
}

static int release(void **state) {
    free(*state);
    *state = NULL;
    return 0;
}

static int write_state(const void *state, uint8_t *bytes, size_t size) {
    if (size < sizeof(state_t)) return 1;
    memcpy(bytes, state, sizeof(state_t));
    return 0;
}

static int read_state(const instance_t *c, const uint8_t *bytes, size_t size, void **state) {
    if (size != sizeof(state_t) || save(c, state)) return 1;
    memcpy(*state, bytes, sizeof(state_t));
    return 0;
}

/* What a C programmer would write by hand: the valve models and one loop, each specialised, to measure the kernels
   against. Same rules, same order of operations, so the outputs must agree bit for bit.
   Compiled by run.py with: cc -O3 -shared -fPIC -ffp-contract=off twin.c */

#include <math.h>
#include <stddef.h>

static const double TIE = 1e-9; /* a band is crossed by more than this fraction of itself */

static inline double clip(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

typedef struct { double x, u, rest, direction, trend; int moving; } kano_t;

static inline void kano_start(kano_t *s, double u, double x, double lag) {
    s->x = x; s->u = u; s->rest = x + lag; s->direction = 1.0; s->trend = 0.0; s->moving = 0;
}

static inline void kano_step(kano_t *s, double u, double S, double J, double lag) {
    double trend = u - s->u;
    if (s->moving && trend * s->trend <= 0.0) { s->rest = s->u; s->moving = 0; }
    if (!s->moving) {
        double travelled = s->direction * (u - s->rest);
        if (-travelled > S) { s->direction = -s->direction; s->moving = 1; }
        else if (travelled > J) s->moving = 1;
    }
    if (s->moving) s->x = u - s->direction * lag;
    s->u = u; s->trend = trend;
}

static inline double stenman_step(double x, double u, double d) { return fabs(u - x) > d ? u : x; }

static inline double he_step(double x, double u, double fs, double fd) {
    double force = u - x;
    return fabs(force) > fs ? u - copysign(fd, force) : x;
}

typedef struct { double x, u, direction; } srinivasan_t;

static inline void srinivasan_step(srinivasan_t *s, double u, double sb, double lag, double slow) {
    double trend = u - s->u, force = u - s->x;
    if (s->direction * trend > 0.0 && fabs(trend) >= slow) s->x = u - s->direction * lag;
    else if (fabs(force) > sb) { s->direction = copysign(1.0, force); s->x = u - s->direction * lag; }
    else s->direction = 0.0;
    s->u = u;
}

void stroke_kano(size_t n, const double *op, double S, double J, double low, double high, double *mv) {
    double lag = (S - J) / 2.0;
    kano_t s;
    kano_start(&s, op[0], op[0], lag);
    S *= 1.0 + TIE; J *= 1.0 + TIE;
    for (size_t k = 0; k < n; k++) {
        kano_step(&s, clip(op[k], low, high), S, J, lag);
        mv[k] = clip(s.x, low, high);
    }
}

void stroke_stenman(size_t n, const double *op, double d, double unused, double low, double high, double *mv) {
    double x = op[0];
    (void)unused;
    d *= 1.0 + TIE;
    for (size_t k = 0; k < n; k++) {
        x = stenman_step(x, clip(op[k], low, high), d);
        mv[k] = clip(x, low, high);
    }
}

void stroke_he(size_t n, const double *op, double fs, double fd, double low, double high, double *mv) {
    double x = op[0];
    fs *= 1.0 + TIE;
    for (size_t k = 0; k < n; k++) {
        x = he_step(x, clip(op[k], low, high), fs, fd);
        mv[k] = clip(x, low, high);
    }
}

/* The third parameter, r dt, stands in `slow`, set by the caller. */
void stroke_srinivasan(size_t n, const double *op, double sb, double sj, double slow, double low, double high,
                       double *mv) {
    double lag = sb - sj;
    srinivasan_t s = {op[0], op[0], 0.0};
    sb *= 1.0 + TIE; slow *= 1.0 - TIE;
    for (size_t k = 0; k < n; k++) {
        srinivasan_step(&s, clip(op[k], low, high), sb, lag, slow);
        mv[k] = clip(s.x, low, high);
    }
}

/* PI controller with output limits, Kano's valve, first order plus a whole number of samples of dead time. */
void loop_kano(size_t n, double Kc, double Ki_dt, double low, double high, double S, double J, double a, double b,
               double c, size_t delay, double sp, double *pv, double *op, double *mv) {
    double lag = (S - J) / 2.0, integral = 0.0, x = 0.0;
    kano_t s;
    kano_start(&s, 0.0, 0.0, lag);
    S *= 1.0 + TIE; J *= 1.0 + TIE;
    for (size_t k = 0; k < n; k++) {
        double y = c * x, error = sp - y, gain = Ki_dt * error, next = integral + gain, u = Kc * error + next;
        if (u > high) { u = high; if (gain > 0.0) next = integral; }
        else if (u < low) { u = low; if (gain < 0.0) next = integral; }
        integral = next;
        kano_step(&s, u, S, J, lag);
        pv[k] = y; op[k] = u; mv[k] = s.x;
        x = a * x + b * (k >= delay ? mv[k - delay] : 0.0);
    }
}

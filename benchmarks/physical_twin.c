/* What a C programmer would write by hand for a Karnopp valve behind a lag, without positioner: the twin that the
   kernel of the physical valve is measured against. Same rules, same order of operations; the outputs agree to
   rounding.
   Compiled by physical.py with: cc -O3 -shared -fPIC -ffp-contract=off physical_twin.c -lm */

#include <math.h>
static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
#include <stddef.h>

typedef struct {
    double h, keep, keep_sample, keep_mean, mass, spring_rate, viscous, coulomb, static_, stribeck_velocity, tolerance;
    double scale, bottom, top, rest_force, area, pressure, per_percent, low, high;
    long n, ramped;
} valve_t;

static inline double stribeck(double ratio, double coulomb, double static_) {
    double square = ratio * ratio;
    return square > 42.0 ? coulomb : coulomb + (static_ - coulomb) * exp(-square);
}

void stroke(const valve_t *q, const double *op, size_t samples, double position, double *mv) {
    double last = lesser(greater(op[0], q->low), q->high), v = 0.0, pressure = q->pressure + q->per_percent * last;
    const double ease = 1.0 / (q->mass + q->h * q->viscous), per_velocity = 1.0 / q->stribeck_velocity;
    for (size_t k = 0; k < samples; k++) {
        double u = lesser(greater(op[k], q->low), q->high), begin = q->ramped ? last : u;
        last = u;
        double x = q->scale * position;
        if (v == 0.0) {
            double one = q->area * (q->pressure + q->per_percent * lesser(begin, u));
            double other = q->area * (q->pressure + q->per_percent * greater(begin, u));
            double now = q->area * pressure, rest = q->rest_force - q->spring_rate * x;
            double least = rest + lesser(lesser(one, other), now), most = rest + greater(greater(one, other), now);
            if (!((least < -q->static_ && x > q->bottom) || (most > q->static_ && x < q->top))) {
                pressure = q->keep_sample * pressure + (1.0 - q->keep_sample) * q->pressure
                         + q->per_percent * ((q->keep_mean - q->keep_sample) * begin + (1.0 - q->keep_mean) * u);
                mv[k] = position;
                continue;
            }
        }
        double slope = (u - begin) / q->n, signal = u;
        for (long i = 0; i < q->n; i++) {
            if (slope != 0.0) signal = begin + slope * (i + 1);
            pressure = q->keep * pressure + (1.0 - q->keep) * (q->pressure + q->per_percent * signal);
            double force = q->rest_force + q->area * pressure - q->spring_rate * x;
            if (v == 0.0 && fabs(force) <= q->static_) continue;
            double direction = copysign(1.0, v == 0.0 ? force : v);
            double friction = direction * stribeck(v * per_velocity, q->coulomb, q->static_);
            double v_new = (q->mass * v + q->h * (force - friction)) * ease, speed = v_new * direction;
            if (speed <= 0.0 || (speed < q->tolerance && speed <= v * direction && fabs(force) <= q->static_)) v = 0.0;
            else { v = v_new; x += q->h * v; }
            if (x < q->bottom) { x = q->bottom; v = greater(v, 0.0); }
            else if (x > q->top) { x = q->top; v = lesser(v, 0.0); }
        }
        position = x / q->scale;
        mv[k] = position;
    }
}

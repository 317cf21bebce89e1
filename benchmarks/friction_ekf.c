/* The peer of cdtool/detectors/friction_ekf_kernel.py: the same filter, the same masks, the same order of events.
 * Build: gcc -O3 -march=native -shared -fPIC friction_ekf.c -lm
 * P is carried as its upper triangle; state (d, a, v). Status: 0 valid, 1 start-up, 2 not applicable, 3 missing. */
#include <math.h>
#include <stdint.h>

typedef struct {
    double p11, p12, p13, p22, p23, p33;
} covariance;

static inline covariance predict(covariance p, double f21, double f23, double step, double q_d, double q_a, double q_v)
{
    double row_a1 = f21 * p.p11 + f23 * p.p13;
    double row_a3 = f21 * p.p13 + f23 * p.p33;
    double row_v2 = step * p.p22 + p.p23;
    double row_v3 = step * p.p23 + p.p33;
    double row_v1 = step * p.p12 + p.p13;
    covariance next = {
        p.p11 + q_d,
        row_a1,
        row_v1,
        f21 * row_a1 + f23 * row_a3 + q_a,
        f21 * row_v1 + f23 * row_v3,
        step * row_v2 + row_v3 + q_v,
    };
    return next;
}

static inline covariance update_second(covariance p, double k1, double k2, double k3, double r)
{
    double m12 = p.p12 - k1 * p.p22, m22 = p.p22 - k2 * p.p22, m32 = p.p23 - k3 * p.p22;
    covariance next = {
        p.p11 - k1 * p.p12 - m12 * k1 + r * k1 * k1,
        m12 - m12 * k2 + r * k1 * k2,
        p.p13 - k1 * p.p23 - m12 * k3 + r * k1 * k3,
        m22 - m22 * k2 + r * k2 * k2,
        p.p23 - k2 * p.p23 - m22 * k3 + r * k2 * k3,
        p.p33 - k3 * p.p23 - m32 * k3 + r * k3 * k3,
    };
    return next;
}

static inline covariance update_third(covariance p, double k1, double k2, double k3, double r)
{
    double m13 = p.p13 - k1 * p.p33, m23 = p.p23 - k2 * p.p33, m33 = p.p33 - k3 * p.p33;
    covariance next = {
        p.p11 - k1 * p.p13 - m13 * k1 + r * k1 * k1,
        p.p12 - k1 * p.p23 - m13 * k2 + r * k1 * k2,
        m13 - m13 * k3 + r * k1 * k3,
        p.p22 - k2 * p.p23 - m23 * k2 + r * k2 * k2,
        m23 - m23 * k3 + r * k2 * k3,
        m33 - m33 * k3 + r * k3 * k3,
    };
    return next;
}

void run_filter(
    int64_t count, const double *time, const double *force, const double *speed, const uint8_t *missing,
    int64_t samples, const double *acceleration_time, const double *acceleration,
    double inertia, double viscous, double q_d, double q_a, double q_v, double r_a, double r_v,
    double initial_variance, double minimum_speed, double acceleration_hold, double glitch,
    double *friction, uint8_t *status)
{
    int64_t next_sample = 0;
    int started = 0, applicable = 0;
    covariance p = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    double d = viscous, a = 0.0, v = 0.0, now = 0.0, held_force = 0.0, settled = 0.0;
    double last_speed_time = 0.0, last_acceleration_time = -INFINITY, last_applicable = -INFINITY;
    int forward = 1, against = 0;
    const double inverse_inertia = 1.0 / inertia;
    const double bandwidth_scale = sqrt(q_d / (r_a + q_a)) * inverse_inertia;

    for (int64_t k = 0; k < count; k++) {
        int seen = isfinite(speed[k]);
        if (started && time[k] - last_speed_time > 1.0)
            started = 0;
        if (!started) {
            while (next_sample < samples && acceleration_time[next_sample] <= time[k]) {
                if (isfinite(acceleration[next_sample])) {
                    a = acceleration[next_sample];
                    last_acceleration_time = acceleration_time[next_sample];
                }
                next_sample++;
            }
            if (!seen || missing[k]) {
                status[k] = 3;
                friction[k] = d;
                continue;
            }
            started = 1;
            d = viscous;
            v = speed[k];
            p = (covariance){initial_variance, 0.0, 0.0, r_a, 0.0, r_v};
            settled = 0.0;
            last_applicable = -INFINITY;
            forward = v > 0.0;
            against = 0;
            applicable = fabs(v) >= minimum_speed;
            now = time[k];
            last_speed_time = now;
            held_force = force[k];
            friction[k] = d;
            status[k] = applicable ? 1 : 2;
            continue;
        }
        for (;;) {
            int own_sample = next_sample < samples && acceleration_time[next_sample] <= time[k];
            double until = own_sample ? acceleration_time[next_sample] : time[k];
            double step = until - now;
            if (step > 0.0) {
                double drift = applicable ? q_d * step : 0.0;
                p = predict(p, -v * inverse_inertia, -d * inverse_inertia, step, drift, q_a, q_v);
                double old_a = a;
                a = (held_force - d * v) * inverse_inertia;
                v += step * old_a;
                now = until;
            }
            if (!own_sample)
                break;
            double sample = acceleration[next_sample];
            if (isfinite(sample) && step >= 0.0) {
                double spread = 1.0 / (p.p22 + r_a);
                double k1 = applicable ? p.p12 * spread : 0.0, k2 = p.p22 * spread, k3 = p.p23 * spread;
                double surprise = sample - a;
                d += k1 * surprise;
                a += k2 * surprise;
                v += k3 * surprise;
                p = update_second(p, k1, k2, k3, r_a);
                last_acceleration_time = until;
            }
            next_sample++;
        }
        if (seen) {
            applicable = fabs(speed[k]) >= minimum_speed;
            double spread = 1.0 / (p.p33 + r_v);
            double k1 = applicable ? p.p13 * spread : 0.0, k2 = p.p23 * spread, k3 = p.p33 * spread;
            double surprise = speed[k] - v;
            d += k1 * surprise;
            a += k2 * surprise;
            v += k3 * surprise;
            p = update_third(p, k1, k2, k3, r_v);
            double since = time[k] - last_speed_time;
            if (applicable) {
                against = (speed[k] > 0.0) != forward ? against + 1 : 0;
                if (against == 3) {
                    forward = !forward;
                    against = 0;
                    settled = 0.0;
                }
                settled += bandwidth_scale * fabs(speed[k]) * sqrt(since);
                last_applicable = time[k];
            } else if (time[k] - last_applicable > glitch) {
                settled = 0.0;
            }
            last_speed_time = time[k];
        }
        held_force = force[k];
        friction[k] = d;
        if (missing[k] || !seen || time[k] - last_acceleration_time > acceleration_hold)
            status[k] = 3;
        else if (!applicable)
            status[k] = 2;
        else if (settled < 3.0)
            status[k] = 1;
    }
}

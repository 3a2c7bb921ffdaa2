/* The loop of `mrdamper.systems.kernel` in C: the same operations in the same order. What the elements and the
 * control law answer stands before it: `evaluate` and `command`. */

#define MOST_TRIES 60
#define MOST_SWEEPS 50
#define TOLERANCE 1e-8

static int search(whole j, const real *p, const real *d, const real *memory, real *later, real x0,
    real u0, real f0, real drift, real free, real compliance, real current, real dt, real *slope, real scale,
    real *force, real *flags)
{
    real low = -INFINITY, high = INFINITY, gap_low = 0.0, gap_high = 0.0, s = *slope;
    const real stiff = 1.0 / compliance;
    real u = (free * stiff + s * u0 - f0) / (s + stiff); /* as if the force went on along its slope */
    real last_u = u, last_gap = 0.0, f = f0;
    int k;
    *flags = 0.0;
    for (k = 0; k < MOST_TRIES; k++) {
        real line, gap;
        if (!evaluate(j, p, d, memory, later, x0 + 0.5 * dt * (u + u0) + drift, u, (u - u0) / dt, current, dt, &f,
                flags) || !isfinite(f)) {
            *slope = s;
            return 0;
        }
        line = (free - u) * stiff;
        gap = f - line;
        if (fabs(gap) <= TOLERANCE * scale || fabs(gap) * compliance <= 1e-14 * (fabs(u) + fabs(free))) {
            *slope = s;
            *force = line;
            return 1;
        }
        if (k > 0 && u != last_u) {
            s = greater((gap - last_gap) / (u - last_u) - stiff, -0.5 * stiff);
        }
        if (gap > 0.0) {
            high = u;
            gap_high = gap;
        } else {
            low = u;
            gap_low = gap;
        }
        last_u = u;
        last_gap = gap;
        u = u - gap / (s + stiff);
        if ((k >= 3 && !(low < u && u < high)) || k > 8) {
            if (isinf(low)) {
                u = high - 2.0 * gap_high * compliance;
            } else if (isinf(high)) {
                u = low - 2.0 * gap_low * compliance;
            } else {
                u = 0.5 * (low + high);
            }
        }
    }
    *slope = s;
    if (!(isinf(low) || isinf(high))) { /* a jump: the structure decides on the force */
        *force = (free - u) * stiff;
        return 1;
    }
    return 0;
}

/* One part of a record; `memory`, `slope`, `scale` and the last rows are what the next part goes on from. `work` has
 * room for 3 n + 3 count + signals + 1 + memory numbers. */
EXPORT whole walk(real dt, const whole *sizes, const real *const *in, real *const *out, real *work)
{
    const whole samples = sizes[0], n = sizes[1], count = sizes[2], seeing = sizes[3], every = sizes[4];
    const whole remembered = sizes[5];
    const real *P = in[0], *Q = in[1], *S = in[2], *G = in[3], *B = in[4], *loads = in[5], *road = in[6];
    const real *road_rate = in[7], *H = in[8], *seen = in[9], *p = in[10], *d = in[11], *cp = in[12], *cd = in[13];
    real *memory = out[0], *cm = out[1], *slope = out[2], *scale = out[3], *currents = out[4];
    real *x = out[5], *v = out[6], *f = out[7], *flags = out[8], *later = work, *mean = later + remembered;
    real *free = mean + n, *signals = free + count, *held = signals + seeing + 1, *state = held + count;
    whole i, j, k, r, s;
    int sweep;
    memcpy(later, memory, sizeof(real) * (size_t)remembered);
    memcpy(held, currents, sizeof(real) * (size_t)count);
    for (i = 1; i < samples; i++) {
        const real *x_before = x + (i - 1) * n, *v_before = v + (i - 1) * n, *f_before = f + (i - 1) * count;
        real *x_now = x + i * n, *v_now = v + i * n, *f_now = f + i * count;
        if (seeing > 0 && (i - 1) % every == 0) {
            for (k = 0; k < n; k++) {
                state[k] = x_before[k];
                state[n + k] = v_before[k];
            }
            for (k = 0; k < count; k++) {
                state[2 * n + k] = f_before[k];
            }
            for (s = 0; s < seeing; s++) {
                real total = seen[(i - 1) * seeing + s];
                for (k = 0; k < 2 * n + count; k++) {
                    total += H[s * (2 * n + count) + k] * state[k];
                }
                signals[s] = total;
            }
            signals[seeing] = (real)every * dt;
            if (!command(cp, cd, cm, signals, held)) {
                return i;
            }
        }
        for (j = 0; j < count; j++) {
            currents[i * count + j] = held[j];
        }
        for (r = 0; r < n; r++) {
            real total = loads[i * n + r];
            for (k = 0; k < n; k++) {
                total += P[r * n + k] * v_before[k] + Q[r * n + k] * x_before[k];
            }
            for (k = 0; k < count; k++) {
                total -= 0.5 * S[r * count + k] * f_before[k];
            }
            mean[r] = total;
        }
        for (j = 0; j < count; j++) {
            real total = road_rate[i * count + j];
            for (k = 0; k < n; k++) {
                total += B[j * n + k] * (2.0 * mean[k] - v_before[k]);
            }
            free[j] = total;
            f_now[j] = f_before[j];
        }
        for (sweep = 0; sweep < MOST_SWEEPS; sweep++) {
            real moved = 0.0;
            for (j = 0; j < count; j++) {
                const real height = road[i * count + j], height_before = road[(i - 1) * count + j];
                const real rate = road_rate[i * count + j], rate_before = road_rate[(i - 1) * count + j];
                real x0 = height_before, u0 = rate_before, drift, line, force;
                for (k = 0; k < n; k++) {
                    x0 += B[j * n + k] * x_before[k];
                    u0 += B[j * n + k] * v_before[k];
                }
                drift = height - height_before - 0.5 * dt * (rate + rate_before);
                line = free[j];
                for (k = 0; k < count; k++) {
                    if (k != j) {
                        line -= G[j * count + k] * f_now[k];
                    }
                }
                if (!search(j, p, d, memory, later, x0, u0, f_before[j], drift, line, G[j * count + j],
                        currents[i * count + j], dt, slope + j, scale[j], &force, flags + i * count + j)) {
                    return i;
                }
                scale[j] = greater(scale[j], fabs(force));
                if (j > 0) { /* those before it counted on the force that it had */
                    moved = greater(moved, fabs(force - f_now[j]) / scale[j]);
                }
                f_now[j] = force;
            }
            if (moved <= 10 * TOLERANCE) {
                break;
            }
        }
        memcpy(memory, later, sizeof(real) * (size_t)remembered);
        for (r = 0; r < n; r++) {
            real total = mean[r];
            for (k = 0; k < count; k++) {
                total -= 0.5 * S[r * count + k] * f_now[k];
            }
            v_now[r] = 2.0 * total - v_before[r];
            x_now[r] = x_before[r] + dt * total;
        }
    }
    return -1;
}

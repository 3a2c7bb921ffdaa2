EXPORT int prepare(const real *p, real *d)
{
    return prepare_0(p, d);
}

/* Outputs at every sample, or at the `count` samples whose ascending indices are picked, the only ones that a program
   without memory computes; the memory starts anew at `begins`, which ends with the number of samples. Each output is
   stored in one of the rows, or in none (-1), multiplied by a factor of each sample if there is one. */
EXPORT whole along(const real *p, const real *d, real *memory, whole samples, const real *const *inputs,
    const whole *strides, const whole *picked, whole count, const whole *begins, const whole *rows, const real *factor,
    real *outputs)
{
    real s[MEMORY], u[INPUTS], out[OUTPUTS], m[KEPT];
    whole i = 0, k, at = 0;
#ifdef LANES
    if (!begins && samples >= LANES * WARM_UP && __builtin_cpu_supports("avx2")
        && along_lanes(p, d, memory, samples / LANES, inputs, strides, picked, &at, count, rows, factor, outputs)) {
        i = samples / LANES * LANES;
    }
#endif
    memcpy(s, memory, sizeof s);
    for (k = 0; k < KEPT; k++) {
        m[k] = NAN;
    }
    for (; i < samples; i++) {
        if (!REMEMBERS && picked && (at == count || i != picked[at])) {
            continue;
        }
        if (begins && i == *begins) {
            memcpy(s, memory, sizeof s);
            begins++;
        }
        for (k = 0; k < INPUTS; k++) {
            u[k] = inputs[k][i * strides[k]];
        }
        if (!step_0(p, d, s, u, out, m)) {
            break;
        }
        if (at < count && i == (picked ? picked[at] : i)) {
            STORE(at, out[k])
            at++;
        }
    }
    memcpy(memory, s, sizeof s);
    return i < samples ? i : -1;
}

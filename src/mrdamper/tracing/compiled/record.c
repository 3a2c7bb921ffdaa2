EXPORT int prepare(const real *p, real *d)
{
    return prepare_0(p, d);
}

/* Outputs at every sample, or at the `count` samples whose ascending indices are picked, the only ones that a program
   without memory computes; the memory starts anew at `begins`, which ends with the number of samples. */
EXPORT whole along(const real *p, const real *d, real *memory, whole samples, const real *const *inputs,
    const whole *strides, const whole *picked, whole count, const whole *begins, real *outputs)
{
    real s[MEMORY], u[INPUTS], out[OUTPUTS], m[KEPT];
    whole i, k, at = 0;
    memcpy(s, memory, sizeof s);
    for (k = 0; k < KEPT; k++) {
        m[k] = NAN;
    }
    for (i = 0; i < samples; i++) {
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
            for (k = 0; k < OUTPUTS; k++) {
                outputs[k * count + at] = out[k];
            }
            at++;
        }
    }
    memcpy(memory, s, sizeof s);
    return i < samples ? i : -1;
}

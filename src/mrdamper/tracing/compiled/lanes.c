/* A program at four places of a record at once, by vector instructions. */
#if defined(__GNUC__) && defined(__x86_64__) && !defined(_WIN32)
#include <immintrin.h>

#define LANES 4
#define WARM_UP 512 /* samples before a chunk of a record, in which the effect of its start decays */
#define MAX_DIFFERENCE 1e-12 /* relative difference of the memory after a chunk and after the warm-up of the next */
#define SMALL 1e-48 /* memory value that has no effect */
#define FLUSH_TO_ZERO 0x8040u /* numbers below 1e-307, with which processors compute slowly */
#define VECTOR __attribute__((target("avx2"))) static inline
#define ALL(x) ((lanes)((x) - (lanes){0.0}))
#define CHOSEN(answer, a, b) _mm256_blendv_pd(b, a, (lanes)(answer))
#define FALL(x) (1.0 / (x))
typedef __m256d lanes;
typedef whole masks __attribute__((vector_size(32)));

VECTOR lanes sign_of(lanes x)
{
    return CHOSEN(x > 0.0, ALL(1.0), CHOSEN(x < 0.0, ALL(-1.0), ALL(0.0)));
}

/* 2^k e^r with |r| at most half of log(2); the series is that of e^r. */
VECTOR lanes exponential(lanes x)
{
    const lanes within = _mm256_min_pd(ALL(709.0), _mm256_max_pd(ALL(-708.0), x)), magic = ALL(6755399441055744.0);
    const lanes shifted = within * 1.4426950408889634 + magic, k = shifted - magic;
    const lanes r = (within - k * 0.693147180369123816490) - k * 1.90821492927058770002e-10, r2 = r * r, r4 = r2 * r2;
    const lanes low = (1.0 + r) + r2 * (FALL(2) + r * FALL(6));
    const lanes middle = (FALL(24) + r * FALL(120)) + r2 * (FALL(720) + r * FALL(5040));
    const lanes high = (FALL(40320) + r * FALL(362880)) + r2 * (FALL(3628800) + r * FALL(39916800));
    const lanes y = low + r4 * (middle + r4 * (high + r4 * (FALL(479001600) + r * FALL(6227020800))));
    return CHOSEN(x == x, (lanes)((masks)y + ((masks)shifted << 52)), x);
}

VECTOR void step_lanes(const real *p, const real *d, lanes *s, const lanes *u, lanes *out, lanes *m)
{
    STEP
}

/* Outputs of chunks of a record; 0 where the memory lasts longer than the warm-up of a chunk. */
VECTOR int along_lanes(const real *p, const real *d, real *memory, whole chunk, const real *const *inputs,
    const whole *strides, const whole *picked, whole *at, whole count, const whole *rows, const real *factor,
    real *outputs)
{
    lanes s[MEMORY], u[INPUTS], out[OUTPUTS], m[KEPT], begun[MEMORY];
    const unsigned mode = _mm_getcsr();
    whole places[LANES] = {0}, t;
    int k, l, fades = 1;
    _mm_setcsr(mode | FLUSH_TO_ZERO);
    for (l = 1; l < LANES; l++) {
        places[l] = picked ? places[l - 1] : l * chunk;
        while (picked && places[l] < count && picked[places[l]] < l * chunk) {
            places[l]++;
        }
    }
    for (k = 0; k < MEMORY; k++) {
        s[k] = ALL(memory[k]);
    }
    for (k = 0; k < KEPT; k++) {
        m[k] = ALL(NAN);
    }
    for (t = -WARM_UP; t < chunk; t++) {
        for (k = 0; t == 0 && k < MEMORY; k++) { /* before the first chunk is no sample */
            s[k][0] = memory[k];
            begun[k] = s[k];
        }
        for (k = 0; k < INPUTS; k++) {
            const real *here = inputs[k] + t * strides[k];
            const whole next = chunk * strides[k];
            u[k] = (lanes){t < 0 ? inputs[k][0] : here[0], here[next], here[2 * next], here[3 * next]};
        }
        step_lanes(p, d, s, u, out, m);
        for (l = 0; t >= 0 && l < LANES; l++) {
            if (places[l] < count && (!picked || picked[places[l]] == l * chunk + t)) {
                STORE(places[l], out[k][l])
                places[l]++;
            }
        }
    }
    _mm_setcsr(mode);
    for (k = 0; k < MEMORY; k++) {
        real largest = SMALL;
        for (l = 0; l < LANES; l++) {
            largest = greater(largest, greater(fabs(s[k][l]), fabs(begun[k][l])));
        }
        for (l = 1; l < LANES; l++) {
            fades &= fabs(s[k][l - 1] - begun[k][l]) <= MAX_DIFFERENCE * largest;
        }
    }
    for (k = 0; fades && k < MEMORY; k++) {
        memory[k] = s[k][LANES - 1];
    }
    *at = fades ? places[LANES - 1] : 0;
    return fades;
}
#endif

#include <math.h>
#include <string.h>

#if defined(_MSC_VER)
#define EXPORT __declspec(dllexport)
#define restrict __restrict
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define R(x) x
#define M(function) function
typedef double real;
typedef long long whole;

static inline real signum(real x)
{
    return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0);
}

static inline real lesser(real a, real b)
{
    return b < a ? b : a;
}

static inline real greater(real a, real b)
{
    return b > a ? b : a;
}

/* Value at x of polynomials of degree five between nodes; constant beyond the ends. */
static inline real read_table(const real *nodes, const real (*cells)[7], int count, real x)
{
    int low = 0, high = count - 1;
    real t;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (nodes[middle] <= x) {
            low = middle;
        } else {
            high = middle;
        }
    }
    x = lesser(greater(x, nodes[0]), nodes[count - 1]);
    t = (x - nodes[low]) * cells[low][6];
    return cells[low][0] + t * (cells[low][1] + t * (cells[low][2] + t * (cells[low][3]
        + t * (cells[low][4] + t * cells[low][5]))));
}

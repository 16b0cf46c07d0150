/* Several lanes: a value is a vector of doubles, a truth a vector of all ones or all zeros.
 *
 * Sines, exponentials, the logarithm and the arctangent follow the polynomials of Sun's fdlibm, without branches; their relative error is below
 * 1e-15.  NaN in, NaN out, in its own lane.  What is rare goes through the C library lane by lane.
 *
 * fdlibm: Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved.  Developed at SunPro, a Sun Microsystems, Inc. business.
 * Permission to use, copy, modify, and distribute this software is freely granted, provided that this notice is preserved.
 */
#include <math.h>
#if LANES == 8 && defined(__AVX512DQ__)
#define MASKS /* truths of eight lanes fit into a register of masks, which compilers do not see by themselves */
#include <immintrin.h>
#endif

typedef long long bits __attribute__((vector_size(8 * LANES)));
typedef bits truth;

#define LANE(x, k) ((x)[k])
#define INLINE static inline __attribute__((always_inline)) /* a call would empty all vector registers */
#define RARE static __attribute__((noinline, cold))
#define EACH for (int k = 0; k < LANES; k++)

static inline real spread(double x) { real r; EACH r[k] = x; return r; }
static inline real choose(truth t, real x, real y) { return (real)(((bits)x & t) | ((bits)y & ~t)); }
static inline real number(truth t) { return (real)((bits)spread(1.0) & t); }
static inline truth is_true(real x) { return x != 0.0; }
static inline truth negated(truth t) { return ~t; }
static inline truth both(truth s, truth t) { return s & t; }
static inline truth either(truth s, truth t) { return s | t; }

/* Whether any lane is true, which is rare wherever it is asked. */
static inline int any(truth t) {
#ifdef MASKS
    return __builtin_expect(_mm512_movepi64_mask((__m512i)t) != 0, 0);
#else
    long long r = 0;
    EACH r |= t[k];
    return __builtin_expect(r != 0, 0);
#endif
}

#define SIGN ((bits)spread(-0.0))
static inline real real_if_else_zero(truth t, real x) { return (real)((bits)x & t); }
static inline real real_fabs(real x) { return (real)((bits)x & ~SIGN); }
static inline real real_copysign(real x, real y) { return (real)(((bits)x & ~SIGN) | ((bits)y & SIGN)); }
static inline real real_fmin(real x, real y) { return choose((x < y) | (y != y), x, y); }
static inline real real_fmax(real x, real y) { return choose((x > y) | (y != y), x, y); }
static inline real real_sign(real x) { return choose((x < 0.0) | (x > 0.0), real_copysign(spread(1.0), x), x); }

/* Each of these three is one vector instruction where the processor has it. */
static inline real real_sqrt(real x) { real r; EACH r[k] = sqrt(x[k]); return r; }
static inline real real_floor(real x) { real r; EACH r[k] = floor(x[k]); return r; }
static inline real real_ceil(real x) { real r; EACH r[k] = ceil(x[k]); return r; }

/* x / d from the rounded inverse r of d: the product, and what is left of x by it, without rounding (Markstein).  It is the rounded quotient
 * itself where d, x and x / d have sizes between 1e-290 and 1e290, are zero, infinite or NaN. */
INLINE real quotient(real x, real d, real r) {
#ifdef MASKS
    const __m512d q = (__m512d)(x * r), left = _mm512_fnmadd_pd(q, (__m512d)d, (__m512d)x);
    const __m512d y = _mm512_fmadd_pd(left, (__m512d)r, q);
    return (real)_mm512_mask_mov_pd(y, _mm512_cmp_pd_mask(y, y, _CMP_UNORD_Q), q);
#elif defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    const real q = x * r;
    real left = x, y = x;
    EACH left[k] = fma(-q[k], d[k], x[k]);
    EACH y[k] = fma(left[k], r[k], q[k]);
    return choose(y == y, y, q);
#else
    (void)r;
    return x / d;
#endif
}

#define ROUND 6755399441055744.0 /* 1.5 * 2^52: its sum with a smaller number holds that number's nearest whole one in its last bits */

RARE real sine_by_lane(real x, real y, truth there, long long quarter) {
    EACH if (there[k]) y[k] = quarter ? cos(x[k]) : sin(x[k]);
    return y;
}

/* Sine of x plus a number of right angles.  Up to 1e6 the whole right angles are taken off in parts of 33 bits, without rounding. */
INLINE real sine(real x, long long quarter) {
    const real rounded = x * 0.63661977236758134308 + ROUND, n = rounded - ROUND;
    const bits turn = (bits)rounded + quarter;
    const real a = ((x - n * 1.57079632673412561417) - n * 6.07710050630396597660e-11) - n * 2.02226624871116645580e-21;
    const real r = a - n * 8.47842766036889956997e-32, z = r * r;
    const real s = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
    const real c = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05
        + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
    const real half = 0.5 * z, w = 1.0 - half;
    const real odd = r + z * r * (-1.66666666666666324348e-01 + z * s), even = w + (((1.0 - w) - half) + z * c);
    const real y = (real)((bits)choose(-(turn & 1), even, odd) ^ ((turn & 2) << 62));
    const truth far = real_fabs(x) > 1e6;
    return any(far) ? sine_by_lane(x, y, far, quarter) : y;
}

INLINE real real_sin(real x) { return sine(x, 0); }
INLINE real real_cos(real x) { return sine(x, 1); }

static inline real power_of_two(bits k) { return (real)((k + 1023) << 52); }

INLINE real real_exp(real x) {
    x = choose(x > 710.0, spread(710.0), choose(x < -750.0, spread(-750.0), x));
    const real rounded = x * 1.44269504088896338700 + ROUND, n = rounded - ROUND;
    const bits k = (bits)rounded - (bits)spread(ROUND), half = k >> 1;
    const real high = x - n * 6.93147180369123816490e-01, low = n * 1.90821492927058770002e-10, r = high - low, t = r * r;
    const real c = r - t * (1.66666666666666019037e-01 + t * (-2.77777777770155933842e-03 + t * (6.61375632143793436117e-05
        + t * (-1.65339022054652515390e-06 + t * 4.13813679705723846039e-08))));
    const real y = 1.0 - ((low - r * c / (2.0 - c)) - high);
    return y * power_of_two(half) * power_of_two(k - half);
}

INLINE real real_expm1(real x) {
    x = choose(x > 710.0, spread(710.0), choose(x < -60.0, spread(-60.0), x));
    const real rounded = x * 1.44269504088896338700 + ROUND, n = rounded - ROUND;
    const bits k = (bits)rounded - (bits)spread(ROUND), half = k >> 1;
    const real high = x - n * 6.93147180369123816490e-01, low = n * 1.90821492927058770002e-10, r = high - low;
    const real c = (high - r) - low, h = 0.5 * r, s = r * h;
    const real q = 1.0 + s * (-3.33333333333331316428e-02 + s * (1.58730158725481460165e-03 + s * (-7.93650757867487942473e-05
        + s * (4.00821782732936239552e-06 + s * -2.01099218183624371326e-07))));
    const real t = 3.0 - q * h, e = s * ((q - t) / (6.0 - r * t)), tail = (r * (e - c) - c) - s;
    const real y = (1.0 - power_of_two((bits)choose(n > 60.0, (real)(0 * k - 60), (real)-k))) - (tail - r);
    return y * power_of_two(half) * power_of_two(k - half);
}

RARE real log_by_lane(real x, real y, truth there) {
    EACH if (there[k]) y[k] = log(x[k]);
    return y;
}

/* x = 2^k (1 + f) with 1 + f between the roots of 1/2 and 2. */
INLINE real real_log(real x) {
    const bits root = (bits)spread(0.70710678118654752440), shifted = (bits)x + ((bits)spread(1.0) - root);
    const real n = (real)(((shifted >> 52) - 1023) + (bits)spread(ROUND)) - ROUND;
    const real f = (real)((shifted & 0x000FFFFFFFFFFFFF) + root) - 1.0, s = f / (2.0 + f), z = s * s, w = z * z, half = 0.5 * f * f;
    const real odd = z * (6.666666666666735130e-01 + w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01
        + w * 1.479819860511658591e-01)));
    const real even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
    const real y = n * 6.93147180369123816490e-01 - ((half - (s * (half + (odd + even)) + n * 1.90821492927058770002e-10)) - f);
    const truth unusual = ~((x >= 0x1p-1022) & (x < INFINITY));
    return any(unusual) ? log_by_lane(x, y, unusual) : y;
}

/* The smaller side over the larger one lies in [0, 1]; above tan(pi / 8) it is turned back by pi / 4, with one division in all. */
static real real_atan2(real y, real x) {
    const real up = real_fabs(y), along = real_fabs(x);
    const truth steep = up > along, back = ((bits)x & SIGN) != 0;
    real most = choose(steep, up, along), least = choose(steep, along, up);
    const truth infinite = (least == INFINITY) & (most == INFINITY), still = most == 0.0;
    most = choose(infinite | still, spread(1.0), most);
    least = choose(infinite, spread(1.0), least);
    const real scale = choose(most > 1e300, spread(0x1p-60), spread(1.0));
    most = most * scale, least = least * scale;
    const truth wide = least > 0.41421356237309503 * most;
    const real t = choose(wide, least - most, least) / choose(wide, least + most, most), z = t * t, w = z * z;
    const real s1 = z * (3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * (9.09088713343650656196e-02
        + w * (6.66107313738753120669e-02 + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))));
    const real s2 = w * (-1.99999999998764832476e-01 + w * (-1.11111104054623557880e-01 + w * (-7.69187620504482999495e-02
        + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02))));
    real angle = t - t * (s1 + s2);
    angle = choose(wide, 7.85398163397448278999e-01 + (angle + 3.06161699786838301793e-17), angle);
    angle = choose(steep, 1.57079632679489655800 - (angle - 6.12323399573676603587e-17), angle);
    angle = choose(back, 3.14159265358979311600 - (angle - 1.22464679914735317723e-16), angle);
    return real_copysign(angle, y);
}

static inline real real_atan(real x) { return real_atan2(x, spread(1.0)); }

#define BY_LANE(name) static real real_##name(real x) { real r; EACH r[k] = name(x[k]); return r; }
#define BY_LANE_OF_TWO(name) static real real_##name(real x, real y) { real r; EACH r[k] = name(x[k], y[k]); return r; }

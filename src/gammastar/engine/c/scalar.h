/* One lane: a value is a number, and functions are those of the C library. */
#include <math.h>

typedef int truth;

#define LANES 1
#define LANE(x, k) (x)

static inline real spread(real x) { return x; }
static inline real number(truth t) { return (real)t; }
static inline truth is_true(real x) { return x != 0; }
static inline truth negated(truth t) { return !t; }
static inline truth both(truth s, truth t) { return s && t; }
static inline truth either(truth s, truth t) { return s || t; }
static inline int any(truth t) { return t; }
static inline real choose(truth t, real x, real y) { return t ? x : y; }
static inline real real_if_else_zero(truth t, real x) { return t ? x : 0; }

/* NaN is passed over, as the C library's fmin and fmax do, which compilers call as functions. */
static inline real real_fmin(real x, real y) { return x < y || y != y ? x : y; }
static inline real real_fmax(real x, real y) { return x > y || y != y ? x : y; }
static inline real lesser(real x, real y) { return x < y ? x : y; } /* the same where y is never NaN, in one comparison */
static inline real greater(real x, real y) { return x > y ? x : y; }
static inline real real_sign(real x) { return x < 0 ? -1 : x > 0 ? 1 : x; }

/* Sine and cosine of a float, a quarter of the size that C libraries take for them.  The angle less whole quarters of a turn, in three parts of pi / 2,
 * goes through polynomials: S. Moshier, Cephes Mathematical Library, sinf.c.  Within 1e-7 up to 8000 rad; beyond 1e4 rad floats are a
 * thousandth of a radian apart or more, and the result is some number between -1 and 1. */
static real circular(real x, real quarter) {
    real turns = floorf(x * 0.63661977f + 0.5f), r = ((x - turns * 1.5703125f) - turns * 4.8375130e-4f) - turns * 7.5497899e-8f;
    r = r > 0.8f ? 0.8f : r < -0.8f ? -0.8f : r;
    turns += quarter;
    turns -= 4.0f * floorf(turns * 0.25f);
    const real z = r * r, half = turns < 2.0f ? 1.0f : -1.0f;
    const real sine = ((-1.9515296e-4f * z + 8.3321609e-3f) * z - 0.16666655f) * z * r + r;
    const real cosine = ((2.4433157e-5f * z - 1.3887316e-3f) * z + 4.1666646e-2f) * z * z - 0.5f * z + 1.0f;
    return half * (turns == 0.0f || turns == 2.0f ? sine : turns == 1.0f || turns == 3.0f ? cosine : x - x);
}
static inline real real_sin(real x) { return circular(x, 0.0f); }
static inline real real_cos(real x) { return circular(x, 1.0f); }


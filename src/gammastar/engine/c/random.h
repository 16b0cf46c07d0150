/* Random numbers by counting, as `engine/random.py` has them: Threefry-2x64 with 20 rounds, and the midpoint of one of 2^52 parts of (0, 1). */
#if LANES > 1
typedef unsigned long long words __attribute__((vector_size(8 * LANES)));
static inline real middle(words w) { return ((real)((w >> 12) | 0x3FF0000000000000) - 1.0) + 0x1p-53; }
#else
typedef unsigned long long words;
static inline real middle(words w) { return (real)(w >> 12) * 0x1p-52 + 0x1p-53; }
#endif

#define MIX(turn) x0 += x1, x1 = ((x1 << turn) | (x1 >> (64 - turn))) ^ x0
#define ADD(first, second, times) x0 += first, x1 += second + times

static inline void draw(words k0, words k1, words x0, words x1, real *first, real *second) {
    const words k2 = k0 ^ k1 ^ 0x1BD11BDAA9FC1A22;
    x0 += k0, x1 += k1;
    MIX(16), MIX(42), MIX(12), MIX(31), ADD(k1, k2, 1);
    MIX(16), MIX(32), MIX(24), MIX(21), ADD(k2, k0, 2);
    MIX(16), MIX(42), MIX(12), MIX(31), ADD(k0, k1, 3);
    MIX(16), MIX(32), MIX(24), MIX(21), ADD(k1, k2, 4);
    MIX(16), MIX(42), MIX(12), MIX(31), ADD(k2, k0, 5);
    *first = middle(x0), *second = middle(x1);
}


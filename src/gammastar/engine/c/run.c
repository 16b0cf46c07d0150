
/* Run the step on (SIZE, lanes) states in place, with (steps, OUTSIDE) numbers from outside, or (steps, OUTSIDE, lanes) by lane.
 * Lanes are numbers of the batch here; LANES of them at a time lie in a vector, and the last vector repeats the last lane. */
EXPORTED void run(long long lanes, long long steps, double *states, const double *outside, int by_lane) {
    const long long width = by_lane ? lanes : 1;
    for (long long first = 0; first < lanes; first += LANES) {
        real buffers[2][SIZE], from[OUTSIDE + 1], *now = buffers[0], *next = buffers[1];
        long long lane[LANES];
        for (int k = 0; k < LANES; k++) lane[k] = first + k < lanes ? first + k : lanes - 1;
        for (long long i = 0; i < SIZE; i++)
            for (int k = 0; k < LANES; k++) LANE(now[i], k) = states[i * lanes + lane[k]];
        for (long long t = 0; t < steps; t++) {
            const double *row = outside + t * OUTSIDE * width;
            if (by_lane) {
                for (long long i = 0; i < OUTSIDE; i++)
                    for (int k = 0; k < LANES; k++) LANE(from[i], k) = row[i * lanes + lane[k]];
            } else {
                for (long long i = 0; i < OUTSIDE; i++) from[i] = row[i] - (real){0}; /* to every lane */
            }
            step(now, from, next);
            real *last = now;
            now = next, next = last;
        }
        for (long long i = 0; i < SIZE; i++)
            for (int k = 0; k < LANES && first + k < lanes; k++) states[i * lanes + first + k] = LANE(now[i], k);
    }
}

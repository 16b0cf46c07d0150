/* Flies the flights of a job.  Several threads may work at one job: each takes the next flight as soon as one of its lanes is free, so lanes of a vector
 * are flights of their own, at steps of their own.  What a flight becomes depends on its own data and on nothing beside it. */

struct table { /* results at a variable x: see `Table` in lookup.py */
    const double *begins, *rows, *shifts;
    double period; /* infinite: none */
    long long count;
};

struct job {
    long long flights, steps, first;       /* first: number of the first step */
    const double *starts, *parameters;     /* (SIZE, flights), (PARAMETERS, flights) */
    const unsigned long long *numbers;     /* (flights,), keys of their random numbers beside the seed */
    const struct table *tables;
    const long long *table_of;             /* (LOOKUPS, flights), places in tables */
    double *ends, *states;                 /* (SIZE, flights); states after each step of the first flight (steps, SIZE), or none */
    long long *flown;                      /* (flights,) steps */
    unsigned long long seed;
    long long next;                        /* flight that no lane has taken yet */
    int stop;                              /* set from outside */
};

struct lane {
    long long flight;
    int counts; /* 0: nothing was left to take, and a flight that is done is flown again without being stored */
};

struct segments { /* of one table by lane: the stretch that holds the variable, whose results lie in the rows */
    real begin, period, divisor, whole, lower, upper;
};

struct worker {
    struct job *job;
    struct lane lanes[LANES];
    real states[2][SIZE], parameters[PARAMETERS + 1], column[1 + 2 * CHANNELS], rows[ROWS + 1], last;
    words number, step;
    struct segments segments[LOOKUPS + 1];
    long long flying, done;
};

static const struct table *table_of(const struct job *job, int j, long long flight) {
    return job->tables + job->table_of[j * job->flights + flight];
}

static void store(const struct job *job, long long flight, long long steps, const real *state, int k) {
    (void)k;
    for (long long i = 0; i < SIZE; i++) job->ends[i * job->flights + flight] = LANE(state[i], k);
    job->flown[flight] = steps;
}

static void load(struct worker *at, int k, real *state) {
    const struct job *job = at->job;
    const long long flight = at->lanes[k].flight;
    for (long long i = 0; i < SIZE; i++) LANE(state[i], k) = job->starts[i * job->flights + flight];
    for (long long i = 0; i < PARAMETERS; i++) LANE(at->parameters[i], k) = job->parameters[i * job->flights + flight];
    LANE(at->number, k) = job->numbers[flight];
    LANE(at->step, k) = (unsigned long long)job->first;
    LANE(at->column[0], k) = (double)job->first;
    for (int j = 0; j < LOOKUPS; j++) {
        const struct table *table = table_of(job, j, flight);
        struct segments *held = at->segments + j;
        LANE(held->begin, k) = table->begins[0];
        LANE(held->divisor, k) = table->period;
        LANE(held->period, k) = table->period < INFINITY ? table->period : 0.0;
        LANE(held->whole, k) = 0.0, LANE(held->lower, k) = INFINITY, LANE(held->upper, k) = -INFINITY;
    }
}

/* Give a lane the next flight that has steps to fly, or else let it repeat its last one. */
static void take(struct worker *at, int k, real *state) {
    struct job *job = at->job;
    at->flying -= at->lanes[k].counts;
    at->lanes[k].counts = 0;
    for (;;) {
        const long long flight = __atomic_fetch_add(&job->next, 1, __ATOMIC_RELAXED);
        if (flight >= job->flights) break;
        at->lanes[k].flight = flight;
        load(at, k, state);
        if (job->steps > 0 && (STATUS < 0 || LANE(state[STATUS < 0 ? 0 : STATUS], k) == 0.0)) {
            at->lanes[k].counts = 1;
            at->flying++;
            return;
        }
        store(job, flight, 0, state, k);
        at->done += job->steps;
    }
    load(at, k, state);
}

/* Results of a table in the lanes whose variable has left its stretch. */
static void look_up(struct worker *at, int j, const real *state) {
    struct segments *held = at->segments + j;
    real x[1];
    variable(j, state, at->parameters, at->column, at->rows, x);
    const real whole = choose(held->divisor < INFINITY, real_floor((x[0] - held->begin) / held->divisor), spread(0.0));
    const real local = x[0] - whole * held->period;
    const truth left = negated(both(whole == held->whole, both(held->lower <= local, local < held->upper)));
    if (!any(left)) return;
    for (int k = 0; k < LANES; k++) {
        if (!LANE(left, k)) continue;
        const struct table *table = table_of(at->job, j, at->lanes[k].flight);
        long long low = 0, high = table->count; /* begins[low] <= local < begins[high], but for the ends */
        while (high - low > 1) {
            const long long middle = low + (high - low) / 2;
            if (table->begins[middle] > LANE(local, k)) high = middle; else low = middle; /* NaN is sorted behind all numbers */
        }
        LANE(held->whole, k) = LANE(whole, k);
        LANE(held->lower, k) = low > 0 ? table->begins[low] : -INFINITY;
        LANE(held->upper, k) = high < table->count ? table->begins[high] : INFINITY;
        const long long width = FIRST_ROWS[j + 1] - FIRST_ROWS[j];
        for (long long i = 0; i < width; i++)
            LANE(at->rows[FIRST_ROWS[j] + i], k) = table->rows[low * width + i] + LANE(whole, k) * table->shifts[i];
    }
}

/* Work until every flight is taken and done, or until `stop`; `done` counts steps, a flight that ended early as all of its steps. */
EXPORTED void run(struct job *job, volatile long long *done) {
    struct worker at = {.job = job};
    real *now = at.states[0], *next = at.states[1];
    if (job->flights == 0) return;
    for (int k = 0; k < LANES; k++) take(&at, k, now);
    at.last = spread((double)(job->first + job->steps));
    const words seed = at.step * 0 + job->seed;
    while (at.flying && !__atomic_load_n(&job->stop, __ATOMIC_RELAXED)) {
        for (int c = 0; c < CHANNELS; c++)
            draw(seed, at.number, at.step, at.step * 0 + NUMBERS[c], at.column + 1 + 2 * c, at.column + 2 + 2 * c);
        for (int j = 0; j < LOOKUPS; j++) look_up(&at, j, now);
        core(now, at.parameters, at.column, at.rows, next);
        real *before = now;
        now = next, next = before;
        at.step += 1, at.column[0] += 1.0;
        at.done += at.flying;
        if (job->states && at.lanes[0].counts)
            for (int i = 0; i < SIZE; i++) *job->states++ = LANE(now[i], 0);
        truth ended = at.column[0] >= at.last;
        if (STATUS >= 0) ended = either(ended, negated(now[STATUS < 0 ? 0 : STATUS] == 0.0));
        if (any(ended)) {
            for (int k = 0; k < LANES; k++) {
                if (!LANE(ended, k)) continue;
                const long long steps = (long long)LANE(at.step, k) - job->first;
                if (at.lanes[k].counts) {
                    store(job, at.lanes[k].flight, steps, now, k);
                    at.done += job->steps - steps;
                }
                take(&at, k, now);
            }
        }
        *done = at.done;
    }
    *done = at.done;
}

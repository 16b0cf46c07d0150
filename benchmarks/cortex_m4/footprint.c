/* A program that calls the export, or, with EMPTY, one that does not: the difference is what the export takes of the flash. */
#include "race.h"

#ifndef EMPTY
static race_state state;
static race_measurement measurement;
static race_output output;
#endif

int main(void) {
#ifndef EMPTY
    race_start(&state, &measurement);
    race_step(&state, &measurement, &output);
#endif
    for (;;) {}
}

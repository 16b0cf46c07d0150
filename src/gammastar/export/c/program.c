/* @title@
 *
 * Written by gammastar @version@ from the graph that it flies itself.  Export the mission again instead of changing this file.
 *
 * A function here takes arrays x0, x1, ... and gives arrays y0, y1, ...; each line makes one value of earlier ones.
 *
 *   usable    measurement -> 1 or 0
 *   nearer    measurement, parameter, data of the path -> parameter a Newton step nearer to the vehicle
 *   start     measurement, parameter, data of the path -> memory
 *   interval  memory, measurement, time, data of the reference, data of the path -> memory, command, @told@
 */
#include "@NAME@.h"

#include <float.h>
#include <string.h>

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "compile without -ffast-math and -ffinite-math-only: numbers that are not finite have to be seen"
#endif
@include_tables@
@functions@
#define MEASURED 22
#define TOLD @told_size@
#define LARGEST @largest@

/* Whether all numbers are finite: zero times a number is zero, unless it is infinite or NaN. */
static int all_finite(const real *numbers, uint32_t count) {
    real sum = 0;
    for (uint32_t k = 0; k < count; k++) sum += 0 * numbers[k];
    return sum == 0;
}

/* The measurement as one array: of a channel that has nothing fresh, its last sample; the first measurement is taken whole.  How much of a
 * channel is fresh is told in sevenths. */
static void gather(const @NAME@_state *state, const @NAME@_measurement *from, real *measured) {
    const real *last = state->sample;
    const uint32_t first = state->is_started ? 0u : 1u;
    memcpy(measured, from->fresh[0] | first ? from->position : last, sizeof from->position);
    memcpy(measured + 3, from->fresh[1] | first ? from->velocity : last + 3, sizeof from->velocity);
    memcpy(measured + 6, from->fresh[2] | first ? from->attitude : last + 6, sizeof from->attitude);
    memcpy(measured + 15, from->fresh[3] | first ? from->angular_velocity : last + 15, sizeof from->angular_velocity);
    for (uint32_t k = 0; k < 4; k++) measured[18 + k] = (real)(from->fresh[k] & 7u) / (real)7;
}
@lookups@
@start_parameter@
static void hold(@NAME@_state *state, uint32_t flag, @NAME@_output *output) {
    const uint32_t kept = state->is_started ? @GUARD@_WAITING | @GUARD@_CONSTRAINED : 0u;
    *output = state->last;
    output->flags = (output->flags & kept) | flag | (state->is_started ? 0u : @GUARD@_NOT_STARTED);
    if (state->is_started && state->interval < UINT32_MAX) state->interval++;
}

static int is_usable(const real *measured) {
    real found;
    usable(measured, &found);
    return found > 0;
}

static void begin(@NAME@_state *state, const real *measured) {
@declare_path_data@
    const real parameter = start_parameter(measured);
@path_data_at_parameter@
    start(measured, &parameter, @path_data@, state->memory);
    memcpy(state->sample, measured, sizeof state->sample);
    state->is_started = all_finite(state->memory, @GUARD@_MEMORY) ? 1u : 0u;
}

void @NAME@_start(@NAME@_state *state, const @NAME@_measurement *measurement) {
    real measured[MEASURED];
    memset(state, 0, sizeof *state);
    gather(state, measurement, measured);
    if (is_usable(measured)) begin(state, measured);
}

void @NAME@_step(@NAME@_state *state, const @NAME@_measurement *measurement, @NAME@_output *output) {
    real measured[MEASURED], next[@GUARD@_MEMORY], told[TOLD], time;
@declare_data@
    gather(state, measurement, measured);
    if (!is_usable(measured)) {
        hold(state, @GUARD@_MEASUREMENT_REFUSED, output);
        return;
    }
    if (!state->is_started) begin(state, measured);
@data@
    interval(state->memory, measured, &time, @reference_data@, @path_data@, next, output->command, told);
    /* What is told consists of these numbers and of the measurement. */
    if (!state->is_started || !all_finite(next, @GUARD@_MEMORY) || !all_finite(output->command, @GUARD@_COMMANDS)) {
        hold(state, @GUARD@_RESULT_REFUSED, output);
        return;
    }
    memcpy(output->input, told, sizeof output->input);
    memcpy(output->acceleration, told + 7, sizeof output->acceleration);
    memcpy(output->jerk, told + 10, sizeof output->jerk);
    memcpy(output->snap, told + 13, sizeof output->snap);
    memcpy(output->angular_acceleration, told + 16, sizeof output->angular_acceleration);
    memcpy(output->position, told + 19, sizeof output->position);
    output->parameter = told[22];
    output->flags = (told[4] > 0 ? @GUARD@_WAITING : 0u) | (told[5] > 0 ? @GUARD@_CONSTRAINED : 0u);
    output->given_up = (uint32_t)told[6];
    output->laps = state->laps;
    state->last = *output;
@wrap@
    for (uint32_t k = 0; k < @GUARD@_MEMORY; k++) state->memory[k] = next[k];
    memcpy(state->sample, measured, sizeof state->sample);
    if (state->interval < UINT32_MAX) state->interval++;
}

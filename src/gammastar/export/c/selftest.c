/* Self-test of @NAME@: moments of a flight, computed by gammastar in float64, against what this computer makes of them.
 *
 * It prints one line and returns 0 if all agree to @tolerance@ of the size of each number, 1 if not.
 */
#include <math.h>
#include <stdio.h>

#include "@NAME@.h"

#define MOMENTS @moments@
#define TOLERANCE @tolerance@

typedef struct {
    uint32_t interval;
    @NAME@_real memory[@GUARD@_MEMORY];
    @NAME@_real measurement[18]; /* position, velocity, attitude, angular velocity */
    @NAME@_real after[@GUARD@_MEMORY];
    @NAME@_real command[@GUARD@_COMMANDS];
    @NAME@_real told[20]; /* input, what acts beside the model, position, parameter */
} moment;

static const moment moments[MOMENTS] = {
@moment_rows@
};
static const @NAME@_real memory_size[@GUARD@_MEMORY] = {@memory_sizes@};
static const @NAME@_real command_size[@GUARD@_COMMANDS] = {@command_sizes@};
static const @NAME@_real told_size[20] = {@told_sizes@};

static double worst = 0;

static void compare(const @NAME@_real *found, const @NAME@_real *wanted, const @NAME@_real *size, int count) {
    for (int k = 0; k < count; k++) {
        const double error = fabs((double)found[k] - (double)wanted[k]) / (double)size[k];
        if (!(error <= worst)) worst = error; /* NaN too */
    }
}

static void measure(const moment *now, @NAME@_measurement *measurement) {
    for (int k = 0; k < 3; k++) {
        measurement->position[k] = now->measurement[k];
        measurement->velocity[k] = now->measurement[3 + k];
        measurement->angular_velocity[k] = now->measurement[15 + k];
    }
    for (int k = 0; k < 9; k++) measurement->attitude[k] = now->measurement[6 + k];
    for (int k = 0; k < 4; k++) measurement->fresh[k] = 7;
}

static void compare_output(const @NAME@_output *output, const moment *now) {
    @NAME@_real told[20];
    for (int k = 0; k < 4; k++) told[k] = output->input[k];
    for (int k = 0; k < 3; k++) {
        told[4 + k] = output->acceleration[k];
        told[7 + k] = output->jerk[k];
        told[10 + k] = output->snap[k];
        told[13 + k] = output->angular_acceleration[k];
        told[16 + k] = output->position[k];
    }
    told[19] = output->parameter;
    compare(output->command, now->command, command_size, @GUARD@_COMMANDS);
    compare(told, now->told, told_size, 20);
}

/* Whether a measurement that is not finite leaves memory and command as they are and raises its flag. */
static int holds(@NAME@_state *state, const @NAME@_output *before) {
    @NAME@_measurement broken;
    @NAME@_output output;
    int is_same = 1;
    const @NAME@_state kept = *state;
    measure(&moments[0], &broken);
    broken.velocity[1] = (@NAME@_real)NAN;
    @NAME@_step(state, &broken, &output);
    for (int k = 0; k < @GUARD@_MEMORY; k++) is_same = is_same && !(state->memory[k] < kept.memory[k] || state->memory[k] > kept.memory[k]);
    for (int k = 0; k < @GUARD@_COMMANDS; k++)
        is_same = is_same && !(output.command[k] < before->command[k] || output.command[k] > before->command[k]);
    return is_same && (output.flags & @GUARD@_MEASUREMENT_REFUSED) != 0;
}

/* Whether a channel without a fresh sample is not looked at: NaN there gives what the sample before it gives. */
static int is_passed_over(const @NAME@_state *now) {
    @NAME@_measurement stale;
    @NAME@_state states[2] = {*now, *now};
    @NAME@_output outputs[2];
    int is_same = 1;
    measure(&moments[MOMENTS - 1], &stale);
    @NAME@_step(&states[0], &stale, &outputs[0]);
    states[1] = states[0];
    stale.fresh[0] = 0;
    @NAME@_step(&states[0], &stale, &outputs[0]);
    for (int k = 0; k < 3; k++) stale.position[k] = (@NAME@_real)NAN;
    @NAME@_step(&states[1], &stale, &outputs[1]);
    for (int k = 0; k < @GUARD@_COMMANDS; k++)
        is_same = is_same && !(outputs[0].command[k] < outputs[1].command[k] || outputs[0].command[k] > outputs[1].command[k]);
    return is_same && (outputs[1].flags & @GUARD@_MEASUREMENT_REFUSED) == 0;
}

int main(void) {
    @NAME@_state state;
    @NAME@_measurement measurement;
    @NAME@_output output;
    measure(&moments[0], &measurement);
    @NAME@_start(&state, &measurement);
    compare(state.memory, moments[0].memory, memory_size, @GUARD@_MEMORY);
    for (int m = 0; m < MOMENTS; m++) {
        for (int k = 0; k < @GUARD@_MEMORY; k++) state.memory[k] = moments[m].memory[k];
        state.interval = moments[m].interval;
        measure(&moments[m], &measurement);
        @NAME@_step(&state, &measurement, &output);
        compare(state.memory, moments[m].after, memory_size, @GUARD@_MEMORY);
        compare_output(&output, &moments[m]);
        if (output.flags & (@GUARD@_MEASUREMENT_REFUSED | @GUARD@_RESULT_REFUSED)) worst = INFINITY;
    }
    const int is_held = holds(&state, &output);
    const int is_passed = is_passed_over(&state);
    const int is_good = worst <= TOLERANCE && is_held && is_passed;
    printf("@NAME@: %s: %d moments agree to %.2g of their sizes (%.2g allowed), a broken measurement is %s, a missing one is %s\n",
           is_good ? "passed" : "FAILED", MOMENTS, worst, TOLERANCE, is_held ? "held" : "NOT held", is_passed ? "passed over" : "NOT passed over");
    return is_good ? 0 : 1;
}

/* @title@
 *
 * The autopilot of this mission as an out-of-tree controller of a Crazyflie, written by gammastar @version@.
 *
 * The firmware's world and body axes are those of the autopilot here: forward, left, up.  Its quaternion is (x, y, z, w), from body to world, its gyro in
 * degrees a second.  The answer is a force and torques in SI units, which the firmware shares out to its motors.
 */
#include <stdbool.h>
#include <stdint.h>

#include "FreeRTOS.h"
#include "app.h"
#include "controller.h"
#include "log.h"
#include "param.h"
#include "stabilizer_types.h"
#include "task.h"

#include "@NAME@.h"

#define RATE @rate@ /* Hz */
#define RADIANS 0.017453292519943295f /* a degree */
#define ALL_AXES 7u
@wrench@
static @NAME@_state pilot;
static @NAME@_output output;
static bool is_flying;
static float asked[4]; /* force [N] and torque [N m] */

static uint8_t fly; /* parameter: 1 flies, 0 stops the motors and forgets the flight */

static void measure(const state_t *state, const sensorData_t *sensors, @NAME@_measurement *measurement) {
    const quaternion_t *q = &state->attitudeQuaternion;
    const float x = q->x, y = q->y, z = q->z, w = q->w;
    const float rows[9] = {
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    };
    const float position[3] = {state->position.x, state->position.y, state->position.z};
    const float velocity[3] = {state->velocity.x, state->velocity.y, state->velocity.z};
    const float turning[3] = {sensors->gyro.x, sensors->gyro.y, sensors->gyro.z};
    for (int k = 0; k < 9; k++) measurement->attitude[k] = rows[k];
    for (int k = 0; k < 3; k++) {
        measurement->position[k] = position[k];
        measurement->velocity[k] = velocity[k];
        measurement->angular_velocity[k] = turning[k] * RADIANS;
    }
    for (int k = 0; k < 4; k++) measurement->fresh[k] = ALL_AXES;
}

void controllerOutOfTreeInit(void) {
    is_flying = false;
}

bool controllerOutOfTreeTest(void) {
    return true;
}

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                         const stabilizerStep_t stabilizerStep) {
    (void)setpoint; /* the mission is the only wish here */
    if (!fly) {
        is_flying = false;
        for (int k = 0; k < 4; k++) asked[k] = 0;
    } else if (RATE_DO_EXECUTE(RATE, stabilizerStep)) {
        @NAME@_measurement measurement;
        measure(state, sensors, &measurement);
        if (!is_flying) @NAME@_start(&pilot, &measurement);
        is_flying = true;
        @NAME@_step(&pilot, &measurement, &output);
        @asked@;
    }
    control->controlMode = controlModeForceTorque;
    control->thrustSi = asked[0];
    control->torqueX = asked[1];
    control->torqueY = asked[2];
    control->torqueZ = asked[3];
}

/* The firmware asks an app for a task; the work is done above, in the stabilizer's. */
void appMain(void) {
    for (;;) vTaskDelay(M2T(1000));
}

PARAM_GROUP_START(gammastar)
PARAM_ADD(PARAM_UINT8, fly, &fly)
PARAM_GROUP_STOP(gammastar)

LOG_GROUP_START(gammastar)
LOG_ADD(LOG_UINT32, flags, &output.flags)
LOG_ADD(LOG_UINT32, givenUp, &output.given_up)
LOG_ADD(LOG_FLOAT, parameter, &output.parameter)
LOG_ADD(LOG_FLOAT, thrust, &asked[0])
LOG_ADD(LOG_FLOAT, torqueX, &asked[1])
LOG_ADD(LOG_FLOAT, torqueY, &asked[2])
LOG_ADD(LOG_FLOAT, torqueZ, &asked[3])
LOG_GROUP_STOP(gammastar)

/* @title@
 *
 * The autopilot of this mission, written by gammastar @version@.  Export the mission again instead of changing this file.
 *
 * @NAME@_start once, with the first measurement; then @NAME@_step once every @seconds@ s, beginning with that same measurement.
 * All that is remembered lies in @NAME@_state, which the caller owns: several of them fly independently.
 *
 * Units are SI, angles radians.  @axes@
 */
#ifndef @GUARD@_H
#define @GUARD@_H

#include <stdint.h>

typedef @c_real@ @NAME@_real;

#define @GUARD@_INTERVAL @interval@ /* s */
#define @GUARD@_MEMORY @memory@ /* numbers that the autopilot remembers */
#define @GUARD@_COMMANDS @commands@ /* numbers of a command */

/* Flags of an output. */
#define @GUARD@_MEASUREMENT_REFUSED 1u /* not finite, absurd, or an attitude that is no rotation: the last output is held */
#define @GUARD@_RESULT_REFUSED 2u /* something was not finite: the last output is held, the memory stays as it was */
#define @GUARD@_NOT_STARTED 4u /* no measurement could be used so far: the command is zero */
#define @GUARD@_WAITING 8u /* a point of the path waits as a target, until the vehicle is near enough to follow */
#define @GUARD@_CONSTRAINED 16u /* limits act: of the approach, of the rotors, or of the thrust */

/* What the sensors tell. */
typedef struct {
    @NAME@_real position[3]; /* m, world */
    @NAME@_real velocity[3]; /* m/s, world */
    @NAME@_real attitude[9]; /* rotation matrix from body to world, row by row: [3 * i + j] is component i of body axis j */
    @NAME@_real angular_velocity[3]; /* rad/s, about the body axes */
    uint8_t fresh[4]; /* of these four: bit k is set where axis k was measured since the last call, 7 for all; a channel with 0 is not looked at */
} @NAME@_measurement;

/* What is to be done, and what the autopilot thinks of it. */
typedef struct {
    @NAME@_real command[@GUARD@_COMMANDS]; /* @command_names@ */
    @NAME@_real input[4]; /* of the law: @input_names@ */
    @NAME@_real acceleration[3]; /* m/s^2, world: what acts beside the model, as observed; zero without an observer */
    @NAME@_real jerk[3]; /* m/s^3, its derivative */
    @NAME@_real snap[3]; /* m/s^4, and the next */
    @NAME@_real angular_acceleration[3]; /* rad/s^2, body: likewise */
    @NAME@_real position[3]; /* m, world: where the vehicle is believed to be */
    @NAME@_real parameter; /* of the point of the path that is followed, @parameter@ */
    int32_t laps; /* periods of a closed path that have been taken off the parameter */
    uint32_t given_up; /* by the rotors: 0 nothing, 1 speed along the path, 2 yaw, 3 thrust, 4 roll and pitch */
    uint32_t flags;
} @NAME@_output;

/* What is remembered from call to call. */
typedef struct {
    @NAME@_real memory[@GUARD@_MEMORY]; /* @memory_names@ */
    uint32_t interval; /* control intervals since the start; it stops at its end, after @years@ */
    int32_t laps;
    uint32_t is_started;
    @NAME@_real sample[18]; /* what was last measured: position, velocity, attitude, angular velocity */
    @NAME@_output last;
} @NAME@_state;

#ifdef __cplusplus
extern "C" {
#endif

/* Begin to fly from a first measurement.  If it cannot be used, the first usable one of a later step is taken. */
void @NAME@_start(@NAME@_state *state, const @NAME@_measurement *measurement);

/* Do what one control interval takes: from the measurement at its beginning to the command that is to be held until its end. */
void @NAME@_step(@NAME@_state *state, const @NAME@_measurement *measurement, @NAME@_output *output);

#ifdef __cplusplus
}
#endif

#endif

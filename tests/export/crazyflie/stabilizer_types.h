/* A stand-in for the firmware's header of this name: what an out-of-tree controller sees of the types, in their units. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

typedef uint32_t stabilizerStep_t; /* of 1 ms */

typedef struct { float x, y, z; } Axis3f;
typedef struct { uint32_t timestamp; float x, y, z; } point_t;    /* m */
typedef struct { uint32_t timestamp; float x, y, z; } velocity_t; /* m/s */
typedef struct { uint32_t timestamp; float x, y, z, w; } quaternion_t;
typedef struct { uint32_t timestamp; float roll, pitch, yaw; } attitude_t; /* deg, pitch of the other sign */
typedef struct { point_t position; velocity_t velocity; attitude_t attitude; quaternion_t attitudeQuaternion; } state_t;
typedef struct { Axis3f acc, gyro; } sensorData_t; /* g and deg/s */
typedef struct { point_t position; } setpoint_t;
typedef enum { controlModeLegacy = 0, controlModeForceTorque = 1, controlModeForce = 2 } control_mode_t;
typedef struct { float thrustSi, torqueX, torqueY, torqueZ; control_mode_t controlMode; } control_t; /* N, N m */

#define RATE_MAIN_LOOP 1000
#define RATE_DO_EXECUTE(RATE_HZ, STEP) ((STEP) % (RATE_MAIN_LOOP / (RATE_HZ)) == 0)

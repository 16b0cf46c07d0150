/* A stand-in for the firmware's header of this name: a table of names and addresses, which a test can read. */
#pragma once
#include <stdint.h>
struct variable { int type; const char *name; void *address; };
enum { PARAM_UINT8 };
#define PARAM_GROUP_START(GROUP) struct variable GROUP##_parameters[] = {
#define PARAM_ADD(TYPE, NAME, ADDRESS) {TYPE, #NAME, ADDRESS},
#define PARAM_GROUP_STOP(GROUP) {-1, #GROUP, 0}};

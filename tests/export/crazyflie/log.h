/* A stand-in for the firmware's header of this name: a table of names and addresses, which a test can read. */
#pragma once
#include "param.h"
enum { LOG_UINT32, LOG_FLOAT };
#define LOG_GROUP_START(GROUP) struct variable GROUP##_logs[] = {
#define LOG_ADD(TYPE, NAME, ADDRESS) {TYPE, #NAME, ADDRESS},
#define LOG_GROUP_STOP(GROUP) {-1, #GROUP, 0}};

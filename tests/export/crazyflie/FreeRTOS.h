/* A stand-in for the header of this name. */
#pragma once
#include <stdint.h>
#define M2T(MILLISECONDS) ((uint32_t)(MILLISECONDS))

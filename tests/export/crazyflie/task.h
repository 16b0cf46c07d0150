/* A stand-in for the header of this name. */
#pragma once
#include <stdint.h>
static inline void vTaskDelay(uint32_t ticks) { (void)ticks; }

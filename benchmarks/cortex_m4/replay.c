/* Fly recorded measurements, each call from the memory that was recorded with them, and print for each call: instructions, bytes of stack, flags, and the numbers of the output as they are in memory. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "flight.h"
#include "race.h"

#define SYSTICK ((volatile uint32_t *)0xE000E010)
#define TICKS 0xFFFFFFu
#define MARK 0xA5A5A5A5u
#define PAINTED 1024 /* words */

static race_state state;
static race_measurement measurement;
static race_output output;

typedef void called(void);
static void nothing(void) { __asm volatile(""); }
static void start(void) { race_start(&state, &measurement); }
static void step(void) { race_step(&state, &measurement, &output); }

/* The ticks of 40 ns, of 32 ns an instruction, that a call takes, and how deep its stack goes. */
static uint32_t timed(called *function, uint32_t *stack) {
    volatile uint32_t *top, *deepest;
    __asm volatile("mov %0, sp" : "=r"(top));
    for (deepest = top - PAINTED; deepest < top; deepest++) *deepest = MARK;
    const uint32_t before = SYSTICK[2];
    function();
    const uint32_t after = SYSTICK[2];
    for (deepest = top - PAINTED; deepest < top && *deepest == MARK; deepest++) {}
    *stack = (uint32_t)((const volatile char *)top - (const volatile char *)deepest);
    return (before - after) & TICKS;
}

static void told(const race_real *numbers, int count) {
    for (int k = 0; k < count; k++) {
        uint32_t bits;
        memcpy(&bits, &numbers[k], sizeof bits);
        printf(" %lx", (unsigned long)bits);
    }
}

int main(void) {
    uint32_t stack, empty_stack;
    SYSTICK[1] = TICKS;
    SYSTICK[2] = 0;
    SYSTICK[0] = 5; /* on, from the processor's clock */
    timed(nothing, &empty_stack);
    const uint32_t empty = timed(nothing, &empty_stack);
    for (int k = -1; k < CALLS; k++) {
        const float *row = flight[k < 0 ? 0 : k];
        if (k >= 0) memcpy(state.memory, memories[k], sizeof state.memory);
        memcpy(measurement.position, row, sizeof measurement.position);
        memcpy(measurement.velocity, row + 3, sizeof measurement.velocity);
        memcpy(measurement.attitude, row + 6, sizeof measurement.attitude);
        memcpy(measurement.angular_velocity, row + 15, sizeof measurement.angular_velocity);
        memset(measurement.fresh, 7, sizeof measurement.fresh);
        const uint32_t ticks = timed(k < 0 ? start : step, &stack);
        printf("%lu %lu %lx", (unsigned long)(ticks - empty), (unsigned long)(stack - empty_stack), (unsigned long)output.flags);
        told(output.command, RACE_COMMANDS);
        told(output.input, 4);
        told(&output.parameter, 1);
        printf("\n");
    }
    return 0;
}

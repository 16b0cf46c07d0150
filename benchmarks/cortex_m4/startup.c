/* What runs before main: the floating-point unit on, memory cleared, and output through the emulator. */
#include <stdint.h>
#include <stdlib.h>

#define COPROCESSORS (*(volatile uint32_t *)0xE000ED88)

extern char __bss_start__[], __bss_end__[], __stack_top[];
extern void initialise_monitor_handles(void);
extern int main(void);

void reset(void) {
    COPROCESSORS |= 0xFu << 20;
    __asm volatile("dsb\n\tisb");
    for (char *each = __bss_start__; each < __bss_end__; each++) *each = 0;
#ifdef REPLAY
    initialise_monitor_handles();
    exit(main());
#else
    main();
#endif
}

static void fault(void) {
#ifdef REPLAY
    _Exit(3);
#else
    for (;;) {}
#endif
}

__attribute__((section(".vectors"), used)) void *const vectors[16] = {
    __stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault,
};

/* What a Cortex-M with a unit for float does before main: no operating system is there. printf goes to the debugger. */
#include <stdint.h>

extern int main(void);
extern void _exit(int) __attribute__((noreturn));
extern void initialise_monitor_handles(void);
extern char __stack[], __bss_start__[], __bss_end__[];
void reset(void);

__attribute__((section(".vectors"), used)) static void *const vectors[] = {__stack, (void *)reset};

void reset(void) {
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* CPACR: the unit for float */
    __asm__ volatile("dsb; isb");
    for (char *p = __bss_start__; p < __bss_end__; p++) {
        *p = 0;
    }
    initialise_monitor_handles();
    _exit(main());
}

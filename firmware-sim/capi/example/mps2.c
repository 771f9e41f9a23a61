// The example on the metal: a Cortex-M4F as QEMU emulates it (-M mps2-an386), without a C library.
//
// The blob and the recording lie where external flash would, put there by QEMU's loader (-device loader,file=...). The
// blob is read in place; its length stands in its header. Text goes to the debugger (semihosting).

#include "example.h"

static const uint8_t *const BLOB = (const uint8_t *)0x21000000;
static const uint8_t *const RECORDING = (const uint8_t *)0x21800000;
// What the loader has put there: the lengths of both, u32 each.
static const volatile uint32_t *const LENGTHS = (const volatile uint32_t *)0x217ffff0;

static int semihosting(int operation, const void *argument) {
  register int r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void say(const char *text) { semihosting(0x04, text); }

static void leave(int status) {
  // SYS_EXIT_EXTENDED: ADP_Stopped_ApplicationExit and the status.
  const uint32_t reason[2] = {0x20026, (uint32_t)status};
  semihosting(0x20, reason);
  for (;;) {
  }
}

static void fault(void) {
  say("fault\n");
  leave(3);
}

static void reset(void) {
  // The FPU, before anything uses it: full access to coprocessors 10 and 11.
  *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20;
  __asm__ volatile("dsb\n isb");
  leave(stylize(BLOB, LENGTHS[0], RECORDING, LENGTHS[1]));
}

extern uint32_t stack_top[];

// What the processor starts from, and goes to when something is wrong.
__attribute__((section(".vectors"), used)) static const struct {
  uint32_t *stack;
  void (*handlers[15])(void);
} vectors = {stack_top, {reset, fault, fault, fault, fault, fault}};

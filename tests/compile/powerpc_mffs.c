/* For runs under an emulator alone: glibc for 32-bit PowerPC sets the rounding mode by variants of
   the instruction mffs that a processor without them takes for plain mffs, while qemu-ppc calls
   them illegal. This reads a status of 0 (round to nearest) in their place and goes on. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdint.h>
#include <string.h>
#include <ucontext.h>

static void on_illegal(int number, siginfo_t *info, void *context)
{
    mcontext_t *machine = ((ucontext_t *)context)->uc_mcontext.uc_regs;
    const uint32_t *at = (const uint32_t *)machine->gregs[32];
    (void)info;
    if (*at >> 26 != 63 || (*at >> 1 & 0x3ff) != 583)
        signal(number, SIG_DFL);
    else {
        machine->fpregs.fpregs[*at >> 21 & 31] = 0.0;
        machine->gregs[32] += 4;
    }
}

__attribute__((constructor)) static void catch_illegal(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = on_illegal;
    action.sa_flags = SA_SIGINFO;
    sigaction(SIGILL, &action, NULL);
}

/* A gyro with a fault, see FAULTS: at step AT, or where its name says.  Otherwise the pickoff is u = 2 i + f_I, with
   direct feedthrough of f.  Compiled with -DON_LOADING it ends the process when it is loaded. */

#define _GNU_SOURCE
enum { W1, W2, W3, F1, F2, F3, CURRENT, U, FAULT, AT, NV };
enum FAULTS {
    NONE, CRASH, HANG, ERROR, NOT_A_NUMBER, CRASH_IN_INITIALIZATION, EXIT_0, EXIT_7, ABORT, RECURSION, ARITHMETIC,
    CHANGE_DIRECTORY, WRITE_TO_DESCRIPTORS, CLOSE_DESCRIPTORS, MEMORY, KILL_ITSELF, HANG_IN_INITIALIZATION,
    CRASH_IN_TERMINATE, EXIT_IN_GET, LEAVE_A_PROCESS, UNKNOWN_STATUS, SIGNAL_THE_GROUP, END_THE_THREAD, PRINT_WITHOUT_END,
    ALARM, HANG_IN_TERMINATE
};
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <threads.h>
#include <unistd.h>

#define OWN_TERMINATE
#include "fmu.h"

#ifdef ON_LOADING
__attribute__((constructor)) static void on_loading(void) { exit(0); }
#endif
static const double start[NV] = {[AT] = 100};
static char junk[65536];

static void crash(void) {
    volatile int *nowhere = NULL;
    *nowhere = 1;
}

static void hang(void) {
    volatile int waiting = 1;
    while (waiting) thrd_sleep(&(struct timespec){.tv_sec = 1}, NULL); /* leaves the core to others */
}

static int deeper(volatile char *before) {
    volatile char here[4096];
    here[0] = before[0];
    return deeper(here) + here[0];
}

static fmi2Status initialize(instance *m) {
    if (m->v[FAULT] == CRASH_IN_INITIALIZATION) crash();
    if (m->v[FAULT] == HANG_IN_INITIALIZATION) hang();
    return fmi2OK;
}

static fmi2Status fault(instance *m) {
    switch ((int)m->v[FAULT]) {
    case CRASH: crash(); break;
    case HANG: hang(); break;
    case ERROR: return say(m, fmi2Error, "the wheel has stopped after %g steps", m->v[AT]);
    case EXIT_0: exit(0);
    case EXIT_7: _exit(7);
    case ABORT:
        fprintf(stderr, "assertion failed: wheel > 0\n");
        abort();
    case RECURSION: return deeper(junk);
    case ARITHMETIC: raise(SIGFPE); break;
    case CHANGE_DIRECTORY: return chdir("/") ? fmi2Error : fmi2OK;
    case WRITE_TO_DESCRIPTORS:
        memset(junk, '#', sizeof junk);
        for (int d = 0; d < 256; d++)
            if (write(d, junk, sizeof junk) < 0) continue;
        break;
    case CLOSE_DESCRIPTORS:
        for (int d = 0; d < 1024; d++) close(d);
        break;
    case MEMORY:
        for (;;) memset(malloc(1 << 24), 1, 1 << 24);
    case KILL_ITSELF: kill(getpid(), SIGKILL); break;
    case LEAVE_A_PROCESS:
        if (fork() == 0)
            for (;;) pause();
        crash();
        break;
    case UNKNOWN_STATUS: return (fmi2Status)-1;
    case SIGNAL_THE_GROUP: kill(0, SIGTERM); break;
    case END_THE_THREAD: pthread_exit(NULL);
    case PRINT_WITHOUT_END:
        for (;;) {
            puts("the wheel turns");
            usleep(10);
        }
    case ALARM:
        alarm(1);
        hang();
    }
    return fmi2OK;
}

static fmi2Status step(instance *m, double h) {
    (void)h;
    m->state[0] = 2.0 * m->v[CURRENT];
    return m->steps == (long)m->v[AT] ? fault(m) : fmi2OK;
}

static void outputs(instance *m) {
    m->v[U] = m->state[0] + m->v[F1];
    if (m->v[FAULT] == NOT_A_NUMBER && m->steps > (long)m->v[AT]) m->v[U] = NAN;
    if (m->v[FAULT] == EXIT_IN_GET && m->steps > (long)m->v[AT]) exit(0);
}

fmi2Status fmi2Terminate(fmi2Component c) {
    instance *m = c;
    if (m->v[FAULT] == CRASH_IN_TERMINATE) crash();
    if (m->v[FAULT] == HANG_IN_TERMINATE) hang();
    return fmi2OK;
}

/* Runs the library of an FMI 2.0 FMU from its own process and prints what comes out, bit for bit:
 *
 *     host LIBRARY GUID STEPS STEP REFERENCE...
 *
 * A line for each step, with the outputs as hexadecimal numbers.  For Windows and for systems with dlopen.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#define OPEN(file) (void *)LoadLibraryA(file)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#else
#include <dlfcn.h>
#define OPEN(file) dlopen(file, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

#define CALL(name) ((name##TYPE *)FIND(library, #name))
#define CHECK(call)                             \
    if ((call) != fmi2OK) {                     \
        fprintf(stderr, "%s failed\n", #call);  \
        return 1;                               \
    }

static void say(void *environment, const char *instance, int status, const char *category, const char *format, ...) {
    va_list a;
    (void)environment; (void)status; (void)category;
    va_start(a, format);
    fprintf(stderr, "%s: ", instance);
    vfprintf(stderr, format, a);
    va_end(a);
}

int main(int count, char **words) {
    fmi2CallbackFunctions callbacks = {(fmi2CallbackLogger)say, calloc, free, NULL, NULL};
    fmi2ValueReference references[64];
    double values[64], step;
    void *library, *fmu;
    long k, steps;
    int i, n = count - 5;
    if (n < 1 || n > 64 || !(library = OPEN(words[1]))) {
        fprintf(stderr, "no library, or no references\n");
        return 1;
    }
    steps = atol(words[3]);
    step = atof(words[4]);
    for (i = 0; i < n; i++) references[i] = (fmi2ValueReference)atol(words[5 + i]);
    fmu = CALL(fmi2Instantiate)("host", fmi2CoSimulation, words[2], "", &callbacks, fmi2False, fmi2False);
    if (!fmu) return 1;
    CHECK(CALL(fmi2SetupExperiment)(fmu, fmi2False, 0.0, 0.0, fmi2False, 0.0))
    CHECK(CALL(fmi2EnterInitializationMode)(fmu))
    CHECK(CALL(fmi2ExitInitializationMode)(fmu))
    for (k = 0; k < steps; k++) {
        CHECK(CALL(fmi2DoStep)(fmu, (double)k * step, step, fmi2True))
        CHECK(CALL(fmi2GetReal)(fmu, references, (size_t)n, values))
        for (i = 0; i < n; i++) {
            unsigned long long bits;
            memcpy(&bits, &values[i], sizeof bits);
            printf("%016llx%c", bits, i + 1 < n ? ' ' : '\n');
        }
    }
    CALL(fmi2FreeInstance)(fmu);
    return 0;
}

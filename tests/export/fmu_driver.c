/* Opens an FMU's binary without any FMI library, for both versions of the standard.
 *
 *   fmu_driver LIBRARY 2|3 TOKEN STEP run|cycle DRIVE VR VR VR VR VR < rows
 *
 * Value references: displacement, velocity, current, force, drive. Rows: the three inputs.
 * `run` prints the force at rest and after every row. `cycle` walks many short lives: it
 * instantiates, steps, resets, saves, serializes and restores, with two instances interleaved,
 * and fails if any force differs from that of an instance which is alone. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define RTLD_NOW 0
#define RTLD_LOCAL 0
#define dlopen(path, how) ((void *)LoadLibraryA(path))
#define dlsym(from, name) ((void *)(size_t)GetProcAddress((HMODULE)(from), name))
#define dlclose(from) (FreeLibrary((HMODULE)(from)) == 0)
#define dlerror() "the library cannot be loaded"
#else
#include <dlfcn.h>
#endif

enum { MOST_ROWS = 20000, CYCLES = 1000, STEPS = 6 };
enum { DISPLACEMENT, VELOCITY, CURRENT, FORCE, DRIVE };

typedef void *instance;
typedef void (*any)(void);

static void *library;
static int version;
static const char *token;
static double dt;
static unsigned vr[5];
static long drive;
static double rows[MOST_ROWS][3];
static int row_count;
static bool quiet; /* refusals are expected */

static void fail(const char *what)
{
    fprintf(stderr, "failed: %s\n", what);
    exit(1);
}

static void logger2(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    (void)environment;
    if (!quiet) {
        fprintf(stderr, "%s %d %s: %s\n", name, status, category, message);
    }
}

static void logger3(void *environment, int status, const char *category, const char *message)
{
    (void)environment;
    if (!quiet) {
        fprintf(stderr, "%d %s: %s\n", status, category, message);
    }
}

static any find(const char *word2, const char *word3)
{
    char name[80];
    void *found;
    any function;
    (void)snprintf(name, sizeof name, "fmi%d%s", version, version == 2 ? word2 : word3);
    found = dlsym(library, name);
    if (found == NULL) {
        fail(name);
    }
    memcpy(&function, &found, sizeof function);
    return function;
}

static instance instantiate(void)
{
    static const struct {
        void (*logger)(void *, const char *, int, const char *, const char *, ...);
        void *(*allocate)(size_t, size_t);
        void (*release)(void *);
        void (*finished)(void *, int);
        void *environment;
    } callbacks = {logger2, calloc, free, NULL, NULL};
    const any function = find("Instantiate", "InstantiateCoSimulation");
    instance made;
    if (version == 2) {
        made = ((void *(*)(const char *, int, const char *, const char *, const void *, int, int))function)(
            "driver", 1, token, "", &callbacks, 0, 0);
    } else {
        made = ((void *(*)(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *,
            void (*)(void *, int, const char *, const char *), any))function)(
            "driver", token, "", false, false, false, false, NULL, 0, NULL, logger3, (any)0);
    }
    if (made == NULL) {
        fail("instantiate");
    }
    return made;
}

static int set_reals(instance c, const double *row)
{
    const any function = find("SetReal", "SetFloat64");
    return version == 2 ? ((int (*)(void *, const unsigned *, size_t, const double *))function)(c, vr, 3, row)
                        : ((int (*)(void *, const unsigned *, size_t, const double *, size_t))function)(c, vr, 3, row, 3);
}

static void begin(instance c)
{
    int status;
    if (version == 2) {
        const int choice = (int)drive;
        status = ((int (*)(void *, int, double, double, int, double))find("SetupExperiment", ""))(c, 0, 0.0, 0.0, 0, 0.0);
        status |= ((int (*)(void *, const unsigned *, size_t, const int *))find("SetInteger", ""))(c, &vr[DRIVE], 1, &choice);
        status |= ((int (*)(void *))find("EnterInitializationMode", ""))(c);
    } else {
        const int64_t choice = drive;
        status = ((int (*)(void *, const unsigned *, size_t, const int64_t *, size_t))find("", "SetInt64"))(c, &vr[DRIVE], 1, &choice, 1);
        status |= ((int (*)(void *, bool, double, double, bool, double))find("", "EnterInitializationMode"))(c, false, 0.0, 0.0, false, 0.0);
    }
    status |= set_reals(c, rows[0]);
    status |= ((int (*)(void *))find("ExitInitializationMode", "ExitInitializationMode"))(c);
    if (status != 0) {
        fail("initialization");
    }
}

static double force(instance c)
{
    double value = 0.0;
    const any function = find("GetReal", "GetFloat64");
    const int status = version == 2
        ? ((int (*)(void *, const unsigned *, size_t, double *))function)(c, &vr[FORCE], 1, &value)
        : ((int (*)(void *, const unsigned *, size_t, double *, size_t))function)(c, &vr[FORCE], 1, &value, 1);
    if (status != 0) {
        fail("force");
    }
    return value;
}

static int try_step(instance c, int row)
{
    const any function = find("DoStep", "DoStep");
    bool event, end, early;
    double last;
    return version == 2
        ? ((int (*)(void *, double, double, int))function)(c, row * dt, dt, 1)
        : ((int (*)(void *, double, double, bool, bool *, bool *, bool *, double *))function)(
              c, row * dt, dt, true, &event, &end, &early, &last);
}

static double step(instance c, int row)
{
    if (set_reals(c, rows[row]) != 0 || try_step(c, row) != 0) {
        fail("step");
    }
    return force(c);
}

static int call(const char *word2, const char *word3, instance c)
{
    return ((int (*)(void *))find(word2, word3))(c);
}

static void release(instance c)
{
    ((void (*)(void *))find("FreeInstance", "FreeInstance"))(c);
}

/* The state through bytes and back; the one given is freed. */
static void *carried(instance c, void *state)
{
    size_t size = 0;
    void *again = NULL;
    unsigned char *bytes;
    int status = ((int (*)(void *, void *, size_t *))find("SerializedFMUstateSize", "SerializedFMUStateSize"))(c, state, &size);
    bytes = malloc(size);
    if (bytes == NULL) {
        fail("memory");
    }
    status |= ((int (*)(void *, void *, void *, size_t))find("SerializeFMUstate", "SerializeFMUState"))(c, state, bytes, size);
    status |= ((int (*)(void *, const void *, size_t, void **))find("DeSerializeFMUstate", "DeserializeFMUState"))(c, bytes, size, &again);
    bytes[0] ^= 1u;
    if (((int (*)(void *, const void *, size_t, void **))find("DeSerializeFMUstate", "DeserializeFMUState"))(c, bytes, size, &again) == 0) {
        fail("bytes of another FMU were taken for a state");
    }
    free(bytes);
    status |= ((int (*)(void *, void **))find("FreeFMUstate", "FreeFMUState"))(c, &state);
    if (status != 0) {
        fail("serialization");
    }
    return again;
}

static void restore(instance c, void **state)
{
    int status = ((int (*)(void *, void *))find("SetFMUstate", "SetFMUState"))(c, *state);
    status |= ((int (*)(void *, void **))find("FreeFMUstate", "FreeFMUState"))(c, state);
    if (status != 0) {
        fail("restore");
    }
}

static void expect(double found, double wanted, const char *what)
{
    if (found != wanted) {
        fail(what);
    }
}

/* Two instances, one a row behind the other; saved in the middle, walked on, put back, walked again. */
static void live(const double *alone, instance a, instance b)
{
    void *state = NULL;
    int i;
    begin(a);
    begin(b);
    expect(step(a, 0), alone[0], "first step");
    for (i = 1; i < STEPS; i++) {
        if (i == STEPS / 2) {
            const int status = ((int (*)(void *, void **))find("GetFMUstate", "GetFMUState"))(a, &state);
            if (status != 0) {
                fail("state");
            }
        }
        expect(step(a, i), alone[i], "a is disturbed by b");
        expect(step(b, i - 1), alone[i - 1], "b is disturbed by a");
    }
    state = carried(a, state);
    restore(a, &state);
    for (i = STEPS / 2; i < STEPS; i++) {
        expect(step(a, i), alone[i], "the restored state is another");
    }
}

/* Every byte of a serialized state is changed once: the state is refused, or it gives a number or an error. */
static void garble(instance c)
{
    const any read = find("DeSerializeFMUstate", "DeserializeFMUState");
    const any set = find("SetFMUstate", "SetFMUState");
    void *good = NULL;
    unsigned char *bytes;
    size_t size = 0, i;
    int status = ((int (*)(void *, void **))find("GetFMUstate", "GetFMUState"))(c, &good);
    status |= ((int (*)(void *, void *, size_t *))find("SerializedFMUstateSize", "SerializedFMUStateSize"))(c, good, &size);
    bytes = malloc(size);
    if (bytes == NULL || status != 0) {
        fail("state");
    }
    status |= ((int (*)(void *, void *, void *, size_t))find("SerializeFMUstate", "SerializeFMUState"))(c, good, bytes, size);
    for (i = 0; i < 8 * size; i++) {
        void *state = NULL;
        bytes[i / 8] ^= (unsigned char)(1u << i % 8);
        if (((int (*)(void *, const void *, size_t, void **))read)(c, bytes, size, &state) == 0) {
            status |= ((int (*)(void *, void *))set)(c, state);
            (void)set_reals(c, rows[0]);
            if (try_step(c, 0) == 0 && !(force(c) - force(c) == 0.0)) {
                fail("a garbled state gives no number and no error");
            }
            status |= ((int (*)(void *, void **))find("FreeFMUstate", "FreeFMUState"))(c, &state);
        }
        bytes[i / 8] ^= (unsigned char)(1u << i % 8);
    }
    free(bytes);
    if (((int (*)(void *, const void *, size_t, void **))read)(c, rows, 7, &good) == 0) {
        fail("seven bytes were taken for a state");
    }
    restore(c, &good);
    if (status != 0) {
        fail("garbled");
    }
}

static void cycle(void)
{
    double alone[STEPS];
    int i;
    instance c = instantiate();
    begin(c);
    for (i = 0; i < STEPS; i++) {
        alone[i] = step(c, i);
    }
    quiet = true;
    garble(c);
    quiet = false;
    release(c);
    for (i = 0; i < CYCLES; i++) {
        instance a = instantiate();
        instance b = instantiate();
        live(alone, a, b);
        if (call("Reset", "Reset", a) != 0 || call("Terminate", "Terminate", b) != 0 || call("Reset", "Reset", b) != 0) {
            fail("reset");
        }
        live(alone, b, a);
        release(a);
        release(b);
    }
    printf("%d cycles\n", CYCLES);
}

int main(int argc, char **argv)
{
    int i;
    if (argc != 12) {
        fail("arguments");
    }
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        fail(dlerror());
    }
    version = atoi(argv[2]);
    token = argv[3];
    dt = strtod(argv[4], NULL);
    drive = strtol(argv[6], NULL, 10);
    for (i = 0; i < 5; i++) {
        vr[i] = (unsigned)strtoul(argv[7 + i], NULL, 10);
    }
    while (row_count < MOST_ROWS && scanf("%lf,%lf,%lf", &rows[row_count][0], &rows[row_count][1], &rows[row_count][2]) == 3) {
        row_count++;
    }
    if (row_count < STEPS) {
        fail("rows");
    }
    if (strcmp(argv[5], "cycle") == 0) {
        cycle();
    } else {
        instance c = instantiate();
        begin(c);
        printf("%.17g\n", force(c));
        for (i = 0; i < row_count; i++) {
            printf("%.17g\n", step(c, i));
        }
        release(c);
    }
    return dlclose(library);
}

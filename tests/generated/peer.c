/* The side of generated C in tests/compare_generated: checks that both programs compute the same, and times its own.

   peer check FILE...    compares with what this project computed
   peer times FILE...    prints one line a function: arm, function, nanoseconds a sample

   The generated functions are in files of their own and take one sample a call. */
#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "real.h"

#ifdef SINGLE
#define SUFFIX "_f32"
/* A row's largest entry is right to half of the 24 bits. */
#define TOLERANCE 1e-4
#else
#define SUFFIX ""
#define TOLERANCE 1e-11
#endif

typedef void function(const real *q, const real *qd, const real *qdd, real *out);
function UR5e_inverse_dynamics, UR5e_inertia_matrix, UR5e_inverse_dynamics_derivatives;
function Panda_inverse_dynamics, Panda_inertia_matrix, Panda_inverse_dynamics_derivatives;

static const struct {
    const char *arm;
    function *functions[3];
} ARMS[] = {
    {"UR5e", {UR5e_inverse_dynamics, UR5e_inertia_matrix, UR5e_inverse_dynamics_derivatives}},
    {"Panda", {Panda_inverse_dynamics, Panda_inertia_matrix, Panda_inverse_dynamics_derivatives}},
};
static const char *const NAMES[3] = {"inverse_dynamics", "inertia_matrix", "inverse_dynamics_derivatives"};

enum { JOINTS = 7, SAMPLES = 1000, CHECKED = 64 };
/* Results of a sample, in the order of the file: torques, inertia matrix, accelerations, derivatives. */
enum { MOST = 2 * JOINTS * JOINTS + JOINTS * (JOINTS + 1) / 2 };

static real motion[3][SAMPLES][JOINTS];
static double expected[3][CHECKED][MOST];
static real results[SAMPLES][MOST];

static void fail(const char *what, const char *of) {
    fprintf(stderr, "peer: %s: %s\n", of, what);
    exit(1);
}

static double number(FILE *file, const char *name) {
    double x;
    if (fscanf(file, "%lf", &x) != 1) fail("a number is missing", name);
    return x;
}

static void skip(FILE *file, const char *name, int count) {
    while (count-- > 0) number(file, name);
}

/* Reads an arm's motion and results, repeats the motion over all samples, and returns the arm's place. */
static int read_arm(const char *path, int *joints) {
    FILE *file = fopen(path, "r");
    char arm[16];
    int n, count;
    if (!file || fscanf(file, "%15s %d %d", arm, &n, &count) != 3) fail("cannot be read", path);
    int place = 0;
    while (place < 2 && strcmp(ARMS[place].arm, arm)) place++;
    if (place == 2 || n > JOINTS || count != CHECKED) fail("is not one of the arms", path);
    skip(file, path, 3 + 14 * n);
    int triangle = n * (n + 1) / 2;
    for (int k = 0; k < CHECKED; k++) {
        for (int s = 0; s < 3; s++)
            for (int i = 0; i < n; i++) motion[s][k][i] = number(file, path);
        for (int i = 0; i < n; i++) expected[0][k][i] = number(file, path);
        for (int i = 0; i < triangle; i++) expected[1][k][i] = number(file, path);
        skip(file, path, n);
        for (int i = 0; i < 2 * n * n; i++) expected[2][k][i] = number(file, path);
        memcpy(expected[2][k] + 2 * n * n, expected[1][k], triangle * sizeof(double));
        skip(file, path, 2 * n * n + triangle + 10 * n * n);
    }
    fclose(file);
    for (int s = 0; s < 3; s++)
        for (int k = CHECKED; k < SAMPLES; k++) memcpy(motion[s][k], motion[s][k % CHECKED], sizeof motion[s][k]);
    *joints = n;
    return place;
}

static void check(const char *path) {
    int n, place = read_arm(path, &n);
    double worst = 0;
    for (int f = 0; f < 3; f++) {
        int count = (const int[]){n, n * (n + 1) / 2, 2 * n * n + n * (n + 1) / 2}[f];
        for (int k = 0; k < CHECKED; k++) {
            double scale = 1;
            ARMS[place].functions[f](motion[0][k], motion[1][k], motion[2][k], results[k]);
            for (int i = 0; i < count; i++) scale = fmax(scale, fabs(expected[f][k][i]));
            for (int i = 0; i < count; i++) {
                double error = fabs(results[k][i] - expected[f][k][i]) / scale;
                worst = fmax(worst, error);
                if (!(error <= TOLERANCE)) {
                    fprintf(stderr, "peer: %s %s, sample %d, entry %d: %.17g here, %.17g there\n", ARMS[place].arm,
                            NAMES[f], k, i, (double)results[k][i], expected[f][k][i]);
                    exit(1);
                }
            }
        }
    }
    printf("%s%s: both compute the same, within %.0e of a row's largest entry\n", ARMS[place].arm, SUFFIX, worst);
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1e9 + t.tv_nsec;
}

/* The least time of many calls over a quarter of a second, as on the other side. */
static void times(const char *path) {
    int n, place = read_arm(path, &n);
    for (int f = 0; f < 3; f++) {
        function *volatile call = ARMS[place].functions[f];
        double begin = now(), least = INFINITY;
        do {
            double start = now();
            for (int k = 0; k < SAMPLES; k++) call(motion[0][k], motion[1][k], motion[2][k], results[k]);
            least = fmin(least, (now() - start) / SAMPLES);
        } while (now() - begin < 250e6);
        printf("%s %s%s %.1f\n", ARMS[place].arm, NAMES[f], SUFFIX, least);
    }
}

int main(int count, char **arguments) {
    for (int k = 2; k < count; k++) {
        if (!strcmp(arguments[1], "check")) check(arguments[k]);
        else times(arguments[k]);
    }
}

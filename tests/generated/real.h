/* The number of the generated code: double, or float with -DSINGLE. */
#include <math.h>

#ifdef SINGLE
typedef float real;
#define SIN sinf
#define COS cosf
#else
typedef double real;
#define SIN sin
#define COS cos
#endif

#ifndef RIG_FRICTION_H
#define RIG_FRICTION_H

#include <math.h>

/* Numbers are float; define RIG_DOUBLE before the header for double. */
#ifdef RIG_DOUBLE
typedef double rig_real;
#define RIG_EXP exp
#define RIG_ABS fabs
#define RIG_COS cos
#define RIG_SIN sin
#else
typedef float rig_real;
#define RIG_EXP expf
#define RIG_ABS fabsf
#define RIG_COS cosf
#define RIG_SIN sinf
#endif

/* One instant of a joint, on the side of the joint, in SI units (m for rad and N for N*m of a prismatic joint). Fields that no
   effect of the joint reads may stay 0. */
typedef struct {
    rig_real position;             /* rad */
    rig_real velocity;             /* rad/s */
    rig_real direction;            /* -1 to 1; the sign of the velocity, and near rest what the caller decides */
    rig_real motor_angle;          /* rad */
    rig_real drive_torque;         /* torque by the motor current and its nominal constant, times the ratio, N*m */
    rig_real load;                 /* torque that the gear transmits to the link, N*m */
    rig_real friction;             /* set by rig_joint<k>_torque */
    rig_real time;                 /* running time, s */
    rig_real temperature_rise;     /* above that at the start, K */
    rig_real other_velocity;       /* of the other joint that inertia_coupling names, rad/s */
    rig_real other_acceleration;   /* the same, rad/s^2 */
    rig_real period;               /* time since the last instant, s */
    rig_real extra_friction_ratio; /* friction of other effects over the Coulomb friction, for presliding; 0 if not known */
} rig_instant;

/* Friction through a contact over that of the joint alone; effects leave at least a tenth. */
static inline rig_real rig_friction_ratio(const rig_instant *at)
{
    const rig_real ratio = 1 + at->extra_friction_ratio;
    return ratio > (rig_real)0.1 ? ratio : (rig_real)0.1;
}

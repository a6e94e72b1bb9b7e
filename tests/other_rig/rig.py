"""One link on a geared motor, simulated by a program that shares no line with this project.

Rigid gear, position x of the motor divided by the gear ratio:

    (Jm + Jl) x'' = N Kt i k(i, x) + waves(x) - mgl sin(x + tilt) - spring - drag - Fv x' - friction + disturbance

Two masses, motor x and link xl, with s = stiffness (x - xl) + damping (x' - xl'), zero within the play:

    Jm x''  = N Kt i k(i, x) + waves(x) - s - (motor's share of friction)
    Jl xl'' = s - mgl sin(xl + tilt) - spring - (link's share of friction) + disturbance

A PD controller at 1 kHz with a limit of the current, its speed from the encoder's counts by a low-pass of 100 Hz, with or
without feed-forward, follows the reference. The current follows the command with a lag. The disturbance is an
Ornstein-Uhlenbeck process, so that repeats of one motion differ by more than the sensors' noise.

Dry friction is exact at its event: a step whose impulse would carry the speed through zero ends at zero, and the joint
stays there until the other torques exceed the level. Nothing is smoothed.

Sources of the laws:
  Stribeck, breakaway after rest, lag of friction   Armstrong-Helouvry, Dupont and Canudas de Wit 1994
  friction before sliding                           Dahl 1968; with damping of the bristles: Canudas de Wit et al. 1995,
                                                    without its Stribeck curve
  friction with the load, with the position         Hamon, Gautier and Garrec 2010; Bittencourt and Gunnarsson 2012
  viscous friction of a warming gear                Bittencourt and Gunnarsson 2012; Simoni et al. 2015
  play                                              Nordin and Gutman 2002
  elastic joint                                     Spong 1987
  stiffness with hysteresis                         Maxwell's slip element: Seyfferth, Maghzal and Angeles 1995
  error of the gear over a turn                     Tuttle 1992; Ghorbel, Gandhi and Alpeter 2001
Left out: winding temperature, switching of the bridge, more than one resonance, axial play, anything across joints.
With two masses also all that is hidden in a rigid gear alone: friction with the load, asymmetry, drag, presliding,
rest and lag of friction.

All quantities are SI and on the joint's side of the gear unless a comment says otherwise.
"""
import math
from typing import NamedTuple

import numba
import numpy as np

RATIO = 50.0  # motor turns per turn of the joint
COUNTS_PER_RAD = 4096 * RATIO / (2 * math.pi)
ROW = 1e-3  # s, between rows of a recording and between commands
# Steps in a row. A rigid gear has no fast mode; the bristles and the meshing teeth have.
STEPS, STEPS_PRESLIDING, STEPS_TWO_MASSES = 10, 20, 40
FINE = 10  # values of the current kept in a row, for late and differentiated readings
SPEED_CORNER = 100.0  # Hz, low-pass of the controller's speed
DISTURBANCE_TIME = 0.05  # s, correlation time
BURST = 0.4  # s, length of a touch
FEED_FORWARD_SPEED = 0.02  # rad/s, over which the feed-forward's friction changes sign
LOAD_TIME = 5e-4  # s, over which friction with the load takes the mean of the acceleration
FORGET = 0.002  # rad, of sliding, in which what a rest added is lost
COGGING_ORDER = 24  # waves a motor turn
RESISTANCE, INDUCTANCE = 0.6, 0.5e-3  # ohm, H
VOLTAGE_NOISE = 0.03  # V
SUPPLY = 24.0  # V
DEAD_CURRENT = 0.02  # A, over which the dead zone's voltage changes sign


class Rig(NamedTuple):
    """What the simulator knows; the second part is zero unless an effect is hidden."""

    motor_inertia: float = 0.05  # kg m2
    link_inertia: float = 0.15  # kg m2
    gravity: float = 3.4  # N m, mgl
    viscous: float = 0.25  # N m s/rad
    coulomb: float = 0.8  # N m
    torque_constant: float = 0.05  # N m/A, of the motor
    position_gain: float = 200.0  # N m/rad
    velocity_gain: float = 8.0  # N m s/rad
    feed_forward: float = 0.0  # 0 or 1
    current_limit: float = 9.0  # A
    current_lag: float = 4e-4  # s
    disturbance: float = 0.03  # N m RMS
    begin: float = 0.0  # s, the first row's time

    stribeck: float = 0.0  # N m, breakaway beyond Coulomb
    stribeck_speed: float = 1.0  # rad/s
    friction_lag: float = 0.0  # s
    rest: float = 0.0  # N m, breakaway that rest adds in the end
    rest_time: float = 1.0  # s
    asymmetry: float = 0.0  # of Coulomb
    load_friction: float = 0.0  # N m a N m of load
    position_friction: float = 0.0  # N m
    position_friction_order: float = 1.0  # waves a turn of the joint
    position_friction_phase: float = 0.0  # rad
    stroke: float = 0.0  # rad, Coulomb friction over the bristles' stiffness; 0: no presliding
    micro_damping: float = 0.0  # N m s/rad, of the bristles; 0: Dahl's law
    warm_drop: float = 0.0  # of viscous friction, when warm
    warm_time: float = 1.0  # s
    drag: float = 0.0  # N m s2/rad2
    cogging: float = 0.0  # N m
    cogging_phase: float = 0.0  # rad
    eccentricity: float = 0.0  # N m, once a motor turn
    eccentricity_phase: float = 0.0  # rad
    ripple: float = 0.0  # of the torque constant
    ripple_order: float = 14.0  # waves a motor turn
    ripple_phase: float = 0.0  # rad
    saturation: float = 0.0  # 1/A2, loss of torque constant
    torque_offset: float = 0.0  # N m
    tilt: float = 0.0  # rad
    spring: float = 0.0  # N m/rad
    spring_zero: float = 0.0  # rad
    encoder_motor: float = 0.0  # rad, once a motor turn
    encoder_motor_phase: float = 0.0  # rad
    encoder_joint: float = 0.0  # rad, once a turn of the joint
    encoder_joint_phase: float = 0.0  # rad
    stiffness: float = 0.0  # N m/rad; 0: a rigid gear
    damping: float = 0.0  # N m s/rad
    play: float = 0.0  # rad, from flank to flank
    motor_share: float = 1.0  # of friction
    slip_stiffness: float = 0.0  # N m/rad
    slip_limit: float = 0.0  # N m


class Readings(NamedTuple):
    """What the sensors make of it."""

    noise: float = 0.05  # A, each row
    offset: float = 0.0  # A
    delay: float = 0.0  # s, of the current
    voltage: bool = False  # whether it is recorded
    dead_zone: float = 0.0  # V
    sag: float = 0.0  # ohm, of the supply, whose voltage nobody recorded


@numba.njit(cache=True)
def _encoder(p, x):
    return np.round((x + p.encoder_motor * math.sin(RATIO * x + p.encoder_motor_phase)
                     + p.encoder_joint * math.sin(x + p.encoder_joint_phase)) * COUNTS_PER_RAD) / COUNTS_PER_RAD


@numba.njit(cache=True)
def _command(p, ref, ref_speed, ref_acceleration, q, speed):
    """The controller's current."""
    torque = p.position_gain * (ref - q) + p.velocity_gain * (ref_speed - speed)
    if p.feed_forward > 0:
        torque += p.feed_forward * ((p.motor_inertia + p.link_inertia) * ref_acceleration + p.gravity * math.sin(ref)
                                    + p.viscous * ref_speed + p.coulomb * math.tanh(ref_speed / FEED_FORWARD_SPEED))
    return min(max(torque / (RATIO * p.torque_constant), -p.current_limit), p.current_limit)


@numba.njit(cache=True)
def _viscous(p, t):
    if p.warm_drop == 0:
        return p.viscous
    return p.viscous * (1 - p.warm_drop * (1 - math.exp(-t / p.warm_time)))


@numba.njit(cache=True)
def _touch(t, at, height):
    torque = 0.0
    for k in range(len(at)):
        if at[k] <= t < at[k] + BURST:
            torque += height[k] * math.sin(math.pi * (t - at[k]) / BURST)
    return torque


@numba.njit(cache=True)
def _motor(p, i, x):
    """Torque of motor and gear."""
    turn = RATIO * x
    gain = 1 - p.saturation * i * i + p.ripple * math.sin(p.ripple_order * turn + p.ripple_phase)
    torque = RATIO * p.torque_constant * i * gain
    torque += p.cogging * math.sin(COGGING_ORDER * turn + p.cogging_phase)
    return torque + p.eccentricity * math.sin(turn + p.eccentricity_phase) + p.torque_offset


@numba.njit(cache=True)
def _load(p, x):
    return p.gravity * math.sin(x + p.tilt) + p.spring * (x - p.spring_zero)


@numba.njit(cache=True)
def _level(p, x, v):
    """Level of dry friction."""
    level = p.coulomb
    if p.stribeck != 0:
        level += p.stribeck * math.exp(-(v / p.stribeck_speed) ** 2)
    if p.position_friction != 0:
        level += p.position_friction * math.cos(p.position_friction_order * x + p.position_friction_phase)
    return level


@numba.njit(cache=True)
def _slide(v, torque, inertia, viscous, forward, backward, dt):
    """One step of a speed: viscous friction implicit, dry friction as an impulse that stops and does not turn round."""
    damped = 1 + dt * viscous / inertia
    free = (v + dt * torque / inertia) / damped
    forward, backward = dt * forward / inertia / damped, dt * backward / inertia / damped
    if free > forward:
        return free - forward
    if free < -backward:
        return free + backward
    return 0.0


@numba.njit(cache=True)
def _rub(p, share, v, torque, inertia, viscous, level, bristle, dt):
    """One step of a speed and of the bristles of its share of all friction."""
    viscous, level = share * viscous, share * level
    if p.stroke == 0:
        return _slide(v, torque, inertia, viscous, level * (1 + p.asymmetry), level * (1 - p.asymmetry), dt), bristle
    # The bristles' law solved over the step's distance, so that no step is too long for it.
    end = 1.0 if v >= 0 else -1.0
    bent = end + (bristle - end) * math.exp(-abs(v) * dt / p.stroke)
    friction = level * (bent + p.asymmetry) + share * p.micro_damping * (bent - bristle) / dt * p.stroke
    return (v + dt * (torque - friction) / inertia) / (1 + dt * viscous / inertia), bent


@numba.njit(cache=True)
def _factors(p, dt):
    """Of one step: what the disturbance keeps, what it is pushed by, how far the current follows its command."""
    keep = math.exp(-dt / DISTURBANCE_TIME)
    return keep, p.disturbance * math.sqrt(1 - keep * keep), 1 - math.exp(-dt / p.current_lag)


@numba.njit(cache=True)
def _measured_speed(last, q, before):
    """The controller's speed: the encoder's difference through a low-pass."""
    return last + (1 - math.exp(-ROW * 2 * math.pi * SPEED_CORNER)) * ((q - before) / ROW - last)


@numba.njit(cache=True)
def _controller(p, x, before, measured_speed, wanted):
    """The encoder's reading at a row, the speed that follows from it, and the current that the controller asks for."""
    q = _encoder(p, x)
    measured_speed = _measured_speed(measured_speed, q, before)
    return q, measured_speed, _command(p, wanted[0], wanted[1], wanted[2], q, measured_speed)


@numba.njit(cache=True)
def _rigid(p, ref, ref_speed, ref_acceleration, seed, touch_at, touch_of):
    np.random.seed(seed)
    steps = STEPS_PRESLIDING if p.stroke > 0 else STEPS
    dt = ROW / steps
    rows = len(ref)
    position, speed, current = np.empty(rows), np.empty(rows), np.empty(rows * FINE)
    inertia = p.motor_inertia + p.link_inertia
    keep, kick, follow = _factors(p, dt)
    x, v, disturbance, bristle = ref[0], 0.0, 0.0, 0.0
    lagged, mean_acceleration, rested, added = 0.0, 0.0, 0.0, 0.0
    i = p.gravity * math.sin(x + p.tilt) / (RATIO * p.torque_constant)
    before, measured_speed = np.round(x * COUNTS_PER_RAD) / COUNTS_PER_RAD, 0.0
    for row in range(rows):
        t = p.begin + row * ROW
        wanted = (ref[row], ref_speed[row], ref_acceleration[row])
        q, measured_speed, command = _controller(p, x, before, measured_speed, wanted)
        before = q
        position[row], speed[row] = q, v
        viscous = _viscous(p, t)
        touch = _touch(t, touch_at, touch_of)
        for step in range(steps):
            if step % (steps // FINE) == 0:
                current[row * FINE + step // (steps // FINE)] = i
            i += (command - i) * follow
            disturbance = keep * disturbance + kick * np.random.normal()
            load = _load(p, x)
            torque = _motor(p, i, x) - load + disturbance + touch - p.drag * v * abs(v)
            if p.friction_lag > 0:
                lagged += (v - lagged) * dt / p.friction_lag
            level = _level(p, x, lagged if p.friction_lag > 0 else v) + added
            if p.load_friction > 0:
                level += p.load_friction * abs(load + p.link_inertia * mean_acceleration)
            v_before = v
            v, bristle = _rub(p, 1.0, v, torque, inertia, viscous, level, bristle, dt)
            x += dt * v
            mean_acceleration += ((v - v_before) / dt - mean_acceleration) * dt / LOAD_TIME
            if p.rest > 0:
                if v == 0.0:
                    rested += dt
                    added = p.rest * (1 - math.exp(-rested / p.rest_time))
                else:
                    added *= math.exp(-abs(v) * dt / FORGET)
                    rested = -p.rest_time * math.log(max(1e-9, 1 - added / p.rest))
    return position, speed, current


@numba.njit(cache=True)
def _two_masses(p, ref, ref_speed, ref_acceleration, seed, touch_at, touch_of):
    np.random.seed(seed)
    steps = STEPS_TWO_MASSES
    dt = ROW / steps
    rows = len(ref)
    position, speed, current = np.empty(rows), np.empty(rows), np.empty(rows * FINE)
    keep, kick, follow = _factors(p, dt)
    x, v, vl, disturbance, slip = ref[0], 0.0, 0.0, 0.0, 0.0
    bristle_of_motor, bristle_of_link = 0.0, 0.0
    # The link hangs on the flank that carries it.
    weight = p.gravity * math.sin(x)
    xl = x - (p.play / 2 if weight > 0 else -p.play / 2) - weight / p.stiffness
    i = p.gravity * math.sin(x + p.tilt) / (RATIO * p.torque_constant)
    before, measured_speed = np.round(x * COUNTS_PER_RAD) / COUNTS_PER_RAD, 0.0
    for row in range(rows):
        t = p.begin + row * ROW
        wanted = (ref[row], ref_speed[row], ref_acceleration[row])
        q, measured_speed, command = _controller(p, x, before, measured_speed, wanted)
        before = q
        position[row], speed[row] = q, v
        viscous = _viscous(p, t)
        touch = _touch(t, touch_at, touch_of)
        for step in range(steps):
            if step % (steps // FINE) == 0:
                current[row * FINE + step // (steps // FINE)] = i
            i += (command - i) * follow
            disturbance = keep * disturbance + kick * np.random.normal()
            twist, twist_speed = x - xl, v - vl
            if p.play == 0:
                shaft = p.stiffness * twist + p.damping * twist_speed
            elif twist > p.play / 2:  # teeth push and never pull
                shaft = max(0.0, p.stiffness * (twist - p.play / 2) + p.damping * twist_speed)
            elif twist < -p.play / 2:
                shaft = min(0.0, p.stiffness * (twist + p.play / 2) + p.damping * twist_speed)
            else:
                shaft = 0.0
            if p.slip_limit > 0:
                slip = min(max(slip + dt * twist_speed * p.slip_stiffness, -p.slip_limit), p.slip_limit)
                shaft += slip
            level = _level(p, x, v) + p.load_friction * abs(shaft)
            v, bristle_of_motor = _rub(p, p.motor_share, v, _motor(p, i, x) - shaft, p.motor_inertia, viscous, level,
                                       bristle_of_motor, dt)
            torque = shaft - _load(p, xl) + disturbance + touch - p.drag * vl * abs(vl)
            vl, bristle_of_link = _rub(p, 1 - p.motor_share, vl, torque, p.link_inertia, viscous, level,
                                       bristle_of_link, dt)
            x += dt * v
            xl += dt * vl
    return position, speed, current


def record(p, readings, ref, seed, touches=None):
    """Columns of one recording of the reference `ref`, a value a row."""
    touch_at, touch_of = touches or (np.zeros(0), np.zeros(0))
    ref_speed = np.gradient(ref, ROW)
    simulate = _two_masses if p.stiffness > 0 else _rigid
    q, v, fine = simulate(p, ref, ref_speed, np.gradient(ref_speed, ROW), seed, touch_at, touch_of)
    t = np.arange(len(ref)) * ROW
    random = np.random.default_rng(seed + 77)
    now = fine[::FINE]
    late = np.interp(t - readings.delay, np.arange(len(fine)) * ROW / FINE, fine)
    columns = {"t": t + p.begin, "q1": q, "i1": late + readings.offset + readings.noise * random.standard_normal(len(t)),
               "ref1": ref}
    if readings.voltage:
        slope = np.diff(fine, prepend=fine[0])[::FINE] / (ROW / FINE)
        u = RESISTANCE * now + INDUCTANCE * slope + p.torque_constant * RATIO * v
        u += readings.dead_zone * np.sign(now) * np.minimum(1, np.abs(now) / DEAD_CURRENT)
        # The drive asks for a share of the supply, and the recording multiplies it by the supply's nominal voltage.
        u *= SUPPLY / (SUPPLY - readings.sag * np.maximum(u * now / SUPPLY, -0.5))
        columns["u1"] = u + VOLTAGE_NOISE * random.standard_normal(len(t))
    return columns

"""What is hidden in a recording, how large, and what a right answer is.

Sizes are drawn log-uniform over the ranges usual for such rigs: a motor of 50 to 100 W at 24 V with a gear of 1 : 50
and a link of 3.4 N m. Lag of friction and sag of the supply are drawn larger than usual.
Every draw comes from the effect's name and the seed, so that a case is the same whatever else runs.
"""
import zlib
from typing import NamedTuple

import numpy as np

from motion import motion
from rig import RATIO, Readings, Rig

COUNTS = 4096
TRAIN, HOLDOUT = 90.0, 60.0  # s of excitation
NOISES = (0.02, 0.05, 0.2)  # A
PLAIN = Rig()
AMPERE = RATIO * PLAIN.torque_constant  # N m of joint torque

EFFECTS = """stribeck asymmetric_coulomb load_friction cogging gear_eccentricity payload backlash backlash_link_friction
joint_elasticity viscous_warmup presliding_dahl presliding_lugre current_offset torque_offset gravity_tilt quadratic_drag
spring measurement_delay torque_saturation position_friction torque_ripple encoder_motor encoder_joint
drive_deadzone""".split()
OUTSIDE = "dwell_breakaway frictional_lag hysteretic_stiffness link_flex contact_burst supply_sag".split()
# Of each of these one at most is hidden beside others: one function of the motion, or one name.
ONE_OF = [set(group.split()) for group in (
    "asymmetric_coulomb current_offset torque_offset spring",
    "backlash backlash_link_friction joint_elasticity",
    "presliding_dahl presliding_lugre",
    "encoder_motor encoder_joint",
)]
FAULTS = "sign degrees ratio_2 ratio_half described_ratio_2 rpm late_20ms too_short still".split()


class Hidden(NamedTuple):
    rig: dict = {}
    readings: dict = {}
    name: str = ""  # the library's; empty where it has none
    truth: dict = {}  # the library's parameters by name; compared by magnitude
    touches: tuple = (None, None)  # in training and hold-out


class Case(NamedTuple):
    title: str
    kind: str  # effect, combined, outside, nothing or fault
    effect: str
    noise: float
    seed: int
    hidden: list  # of Hidden, empty where nothing is
    description: dict  # values of the robot's description
    rig: Rig
    readings: Readings
    train: np.ndarray
    holdout: np.ndarray


def _draw(random, low, high):
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _phase(random):
    return random.uniform(0, 6.28)


def _either(random):
    return float(random.choice([-1, 1]))


def _hide_in_friction(effect, r):
    coulomb, viscous = PLAIN.coulomb, PLAIN.viscous
    if effect == "stribeck":
        rise, speed = coulomb * _draw(r, 0.1, 1.0), _draw(r, 0.01, 0.3)
        return Hidden(dict(stribeck=rise, stribeck_speed=speed), {}, effect, dict(breakaway=rise, velocity=speed))
    if effect == "asymmetric_coulomb":
        share = _draw(r, 0.05, 0.3) * _either(r)
        return Hidden(dict(asymmetry=share), {}, effect, dict(asymmetry=share * coulomb))
    if effect == "load_friction":
        share = _draw(r, 0.05, 0.22)
        return Hidden(dict(load_friction=share), {}, effect, dict(coefficient=share))
    if effect == "position_friction":
        size, order = coulomb * _draw(r, 0.05, 0.2), float(r.integers(1, 4))
        rig = dict(position_friction=size, position_friction_order=order, position_friction_phase=_phase(r))
        return Hidden(rig, {}, effect, dict(amplitude=size))
    if effect == "viscous_warmup":
        drop, time = r.uniform(0.3, 0.6), _draw(r, 20, 100)
        return Hidden(dict(warm_drop=drop, warm_time=time), {}, effect, dict(drop=drop * viscous, time_constant=time))
    if effect in ("presliding_dahl", "presliding_lugre"):
        stroke = _draw(r, 0.005, 0.03)
        rig = dict(stroke=stroke)
        if effect == "presliding_lugre":
            critical = 2 * np.sqrt(coulomb / stroke * (PLAIN.motor_inertia + PLAIN.link_inertia))
            rig["micro_damping"] = _draw(r, 0.01, 0.1) * critical
        return Hidden(rig, {}, "presliding", dict(stroke=stroke))
    if effect == "quadratic_drag":
        drag = _draw(r, 0.02, 0.1)
        return Hidden(dict(drag=drag), {}, effect, dict(coefficient=drag))
    if effect == "dwell_breakaway":
        return Hidden(dict(rest=coulomb * _draw(r, 0.3, 1.0), rest_time=_draw(r, 0.5, 3)))
    if effect == "frictional_lag":
        lag = _draw(r, 0.01, 0.05)
        return Hidden(dict(friction_lag=lag, stribeck=coulomb * _draw(r, 0.4, 1), stribeck_speed=_draw(r, 0.03, 0.3)))
    return None


def _hide_in_gear(effect, r):
    if effect == "cogging":
        size = _draw(r, 0.1, 0.5)
        return Hidden(dict(cogging=size, cogging_phase=_phase(r)), {}, effect, dict(amplitude=size))
    if effect == "gear_eccentricity":
        size = _draw(r, 0.1, 0.4)
        return Hidden(dict(eccentricity=size, eccentricity_phase=_phase(r)), {}, effect, dict(amplitude=size))
    if effect in ("backlash", "backlash_link_friction"):
        rig = dict(stiffness=3000.0, damping=_draw(r, 1, 4), play=np.deg2rad(_draw(r, 0.2, 1.0)))
        if effect != "backlash":
            rig["motor_share"] = 0.5
        return Hidden(rig, {}, "backlash", dict(gap=rig["play"], stiffness=rig["stiffness"]))
    if effect == "joint_elasticity":
        stiffness = _draw(r, 300, 1500)
        reduced = PLAIN.motor_inertia * PLAIN.link_inertia / (PLAIN.motor_inertia + PLAIN.link_inertia)
        rig = dict(stiffness=stiffness, damping=2 * _draw(r, 0.01, 0.05) * np.sqrt(stiffness * reduced))
        return Hidden(rig, {}, effect, dict(stiffness=stiffness))
    if effect == "hysteretic_stiffness":
        stiffness = _draw(r, 600, 1500)
        slip = dict(slip_stiffness=_draw(r, 0.7, 2) * stiffness, slip_limit=_draw(r, 0.4, 1.2))
        return Hidden(dict(stiffness=stiffness, damping=0.5, **slip))
    if effect == "link_flex":
        # The hub moves with the motor, the rest of the link hangs on it by a spring.
        hub, rest = PLAIN.motor_inertia + 0.07, PLAIN.link_inertia - 0.07
        reduced = hub * rest / (hub + rest)
        stiffness = (2 * np.pi * _draw(r, 12, 40)) ** 2 * reduced
        damping = 2 * 0.01 * np.sqrt(stiffness * reduced)
        return Hidden(dict(motor_inertia=hub, link_inertia=rest, stiffness=stiffness, damping=damping))
    return None


def _hide_elsewhere(effect, r):
    if effect == "payload":
        mass, distance = _draw(r, 0.05, 0.5), r.uniform(0.2, 0.4)
        rig = dict(link_inertia=PLAIN.link_inertia + mass * distance**2, gravity=PLAIN.gravity + mass * 9.81 * distance)
        return Hidden(rig, {}, effect, dict(mass=mass, distance=distance))
    if effect == "current_offset":
        offset = _draw(r, 0.05, 0.2) * _either(r)
        return Hidden({}, dict(offset=offset), effect, dict(offset=offset * AMPERE))
    if effect == "torque_offset":
        offset = -_draw(r, 0.1, 0.4) * _either(r)
        return Hidden(dict(torque_offset=offset), {}, effect, dict(offset=offset))
    if effect == "gravity_tilt":
        tilt = np.deg2rad(_draw(r, 2, 6)) * _either(r)
        return Hidden(dict(tilt=tilt), {}, effect, dict(cosine=PLAIN.gravity * np.sin(tilt)))
    if effect == "spring":
        stiffness, zero = _draw(r, 0.05, 0.5), r.uniform(-0.5, 0.5)
        truth = dict(stiffness=stiffness, preload=stiffness * zero)
        return Hidden(dict(spring=stiffness, spring_zero=zero), {}, effect, truth)
    if effect == "measurement_delay":
        delay = _draw(r, 0.002, 0.006)
        return Hidden({}, dict(delay=delay), effect, dict(delay=delay))
    if effect == "torque_saturation":
        loss = _draw(r, 0.03, 0.15) / 6.0**2  # this share at 6 A
        return Hidden(dict(saturation=loss), {}, effect, dict(coefficient=loss / AMPERE**2))
    if effect == "torque_ripple":
        size, order = _draw(r, 0.01, 0.08), float(r.choice([14, 42]))  # 2 and 6 waves a pole pair
        return Hidden(dict(ripple=size, ripple_order=order, ripple_phase=_phase(r)), {}, effect, dict(amplitude=size))
    if effect == "encoder_motor":
        size = np.deg2rad(_draw(r, 0.2, 1)) / RATIO
        rig = dict(encoder_motor=size, encoder_motor_phase=_phase(r))
        return Hidden(rig, {}, "encoder_eccentricity", dict(amplitude=size))
    if effect == "encoder_joint":
        size = np.deg2rad(_draw(r, 0.05, 0.5))
        rig = dict(encoder_joint=size, encoder_joint_phase=_phase(r))
        return Hidden(rig, {}, "encoder_eccentricity", dict(amplitude=size))
    if effect == "drive_deadzone":
        volts = _draw(r, 0.25, 1.9)
        return Hidden({}, dict(dead_zone=volts, voltage=True), effect, dict(volts=volts))
    if effect == "supply_sag":
        return Hidden({}, dict(sag=_draw(r, 0.3, 1.5), voltage=True))
    if effect == "contact_burst":
        def touches(count, last):
            return np.sort(r.uniform(3, last, count)), r.choice([-1, 1], count) * r.uniform(1, 3, count)
        return Hidden(touches=(touches(5, TRAIN - 5), touches(3, HOLDOUT - 5)))
    return None


def hide(effect, seed):
    random = np.random.default_rng([zlib.crc32(effect.encode()), seed])
    return _hide_in_friction(effect, random) or _hide_in_gear(effect, random) or _hide_elsewhere(effect, random)


def combination(count, seed):
    """So many effects that can be told apart, their names joined by `+`."""
    random = np.random.default_rng([zlib.crc32(b"combination"), count, seed])
    chosen = []
    for effect in random.permutation(EFFECTS):
        if len(chosen) < count and not any(effect in group and group & set(chosen) for group in ONE_OF):
            chosen.append(str(effect))
    return "+".join(chosen)


def case(kind, effect, seed, noise=0.05):
    """One case; `effect` is the fault's name where that is what is hidden, several joined by `+` where they are combined."""
    effects = effect.split("+") if kind in ("effect", "combined", "outside") else []
    hidden = [hide(each, seed) for each in effects]
    key = zlib.crc32(f"{effect if effects else 'none'}@{seed}".encode())
    random = np.random.default_rng([999, key])
    reach = _draw(random, 1.2, 2.2)
    train, holdout = motion(random, TRAIN, reach), motion(random, HOLDOUT, reach)
    rig, readings = PLAIN._replace(feed_forward=float(random.integers(0, 2))), Readings(noise=noise)
    for each in hidden:
        rig, readings = rig._replace(**each.rig), readings._replace(**each.readings)
    if effect == "still":
        train = np.full(20000, 0.3)
    description = PLAIN._asdict()
    # A description is never quite right. Where a payload or the split of the link is what is hidden, it is otherwise.
    if not {"payload", "link_flex"} & set(effects):
        random = np.random.default_rng([5, key])
        wrong = dict(motor_inertia=0.03, link_inertia=0.03, gravity=0.03, viscous=0.06, coulomb=0.06)
        for name, off in wrong.items():
            description[name] *= 1 + off * random.uniform(-1, 1)
    description["gear_ratio"] = 2 * RATIO if effect == "described_ratio_2" else RATIO
    title = f"{effect} {seed}" if noise == 0.05 or kind != "nothing" else f"{effect} {seed} at {noise} A"
    return Case(title, kind, effect, noise, seed, hidden, description, rig, readings, train, holdout)


def spoil(columns, fault, training):
    """Puts a fault of the data into a recording."""
    if fault == "sign":
        columns["i1"] = -columns["i1"]
    factor = {"degrees": 180 / np.pi, "ratio_2": 2.0, "ratio_half": 0.5}.get(fault, 1.0)
    columns["q1"], columns["ref1"] = factor * columns["q1"], factor * columns["ref1"]
    if fault == "rpm":
        columns["qd1"] = np.gradient(columns["q1"], columns["t"]) * 60 / (2 * np.pi)
    if fault == "late_20ms":
        columns["i1"] = np.concatenate([np.full(20, columns["i1"][0]), columns["i1"][:-20]])
    if fault == "too_short" and training:
        columns = {name: values[5000:5800] for name, values in columns.items()}
    return columns


def description_text(values):
    """The robot as the program is told it."""
    return f"""name = "one link"
gravity = [0.0, 0.0, -9.81]
[[joint]]
name = "link"
kind = "revolute"
alpha = {np.pi / 2}
a = 0.0
theta = {-np.pi / 2}
d = 0.0
[joint.inertial]
mass = 1.2
first_moment = [{values["gravity"] / 9.81:.6f}, 0.0, 0.0]
inertia = [0.0, 0.0, 0.0, 0.0, 0.0, {values["link_inertia"]:.6f}]
[joint.limits]
position = [-3.1, 3.1]
velocity = 8.0
acceleration = 120.0
torque = 25.0
[joint.friction]
coulomb = {values["coulomb"]:.5f}
viscous = {values["viscous"]:.5f}
offset = 0.0
[joint.drive]
gear_ratio = {values["gear_ratio"]}
rotor_inertia = {values["motor_inertia"] / RATIO**2:.9f}
torque_constant = {values["torque_constant"]:.6f}
resistance = 0.6
inductance = 0.5e-3
encoder_counts_per_rev = {COUNTS}
pole_pairs = 7
"""

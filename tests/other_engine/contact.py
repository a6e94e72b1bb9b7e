#!/usr/bin/env python3
"""Repeats a contact that this project simulated, with dynamics engines that share no line with it.

    contact.py laws FOLDER       torques of the laws in operational space, by Pinocchio
    contact.py motion FOLDER     a recorded contact: inverse dynamics by Pinocchio, and the motion again by another engine

FOLDER holds robot.toml (the description), for `laws` laws.json (states of the arm with the torques of the impedance law),
for `motion` task.json (surface, tool, directions) and motion.csv (t, q, qd, tau, pressed; exact positions and velocities).
One line of JSON with what was found goes to standard output.

Links are built joint by joint from the description's Denavit-Hartenberg parameters. Drives are geometry: a screw is the
distance between its anchor and the tip of its crank, and a rotor turns as the drive's positions say. The surface pushes
with stiffness times depth and rubs with Coulomb friction. Dry friction obeys |torque| <= c at rest, c against the motion
otherwise. Where every drive has its own joint (EDDA), MuJoCo integrates: armature, damping, frictionloss. Where drives are
coupled (IRp-6), the equations of motion are Pinocchio's, and this script integrates them with an implicit friction.
"""
import argparse
import csv
import json
import pathlib
import sys
import tomllib

import numpy as np
import pinocchio as pin

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "docs" / "urdf"))
from check import from_description  # noqa: E402

# Speed of the tool at which friction of the surface is full, m/s.
CREEP = 1e-3
# Length of a repeated stretch of the motion, s: each starts at a recorded state.
STRETCH = 0.1


class Arm:
    """The equations of motion of a described arm: tau = M*a + h + viscous friction + dry friction - J'*f."""

    def __init__(self, path):
        self.described = tomllib.loads(path.read_text())
        self.model = from_description(str(path))
        self.data = self.model.createData()
        joints = self.described["joint"]
        self.n = len(joints)
        self.names = [joint["name"] for joint in joints]
        self.drives = [joint.get("drive", {}) for joint in joints]
        self.rotor = np.array([drive.get("rotor_inertia", 0.0) for drive in self.drives])
        friction = [joint.get("friction", {}) for joint in joints]
        of = lambda key: np.array([own.get(key, 0.0) for own in friction] + [drive.get(key, 0.0) for drive in self.drives])
        # Of the joints, then of the motors along their own motion.
        self.viscous, self.coulomb = of("viscous"), of("coulomb")
        self.offset = np.array([own.get("offset", 0.0) for own in friction])

    def weights(self, by_name):
        return np.array([by_name.get(name, 0.0) for name in self.names])

    def motor_rows(self, q):
        """Jacobian of the motor positions: radians of motor k for a unit of each joint."""
        rows = np.zeros((self.n, self.n))
        for k, drive in enumerate(self.drives):
            if "screw" in drive:
                screw = drive["screw"]
                along = self.weights(screw["angle"])
                angle = along @ q + screw["offset"]
                arm = screw["crank"] * np.array([np.cos(angle), np.sin(angle)])
                reach = arm - np.array(screw["anchor"])
                # The tip moves at right angles to the crank; its share along the screw lengthens it.
                lengthening = reach @ np.array([-arm[1], arm[0]]) / np.linalg.norm(reach)
                rows[k] = 2.0 * np.pi / screw["lead"] * lengthening * along
            elif drive:
                rows[k, k] = drive["gear_ratio"]
                rows[k] += self.weights(drive.get("couples", {}))
        return rows

    def mass(self, q):
        rows = self.motor_rows(q)
        links = pin.crba(self.model, self.data, q)
        links = np.triu(links) + np.triu(links, 1).T
        return links + rows.T @ (self.rotor[:, None] * rows)

    def bias(self, q, v):
        """Coriolis, centrifugal and gravity torques, and constant ones."""
        step = 1e-6
        rate = (self.motor_rows(q + step * v) - self.motor_rows(q - step * v)) / (2.0 * step)
        rows = self.motor_rows(q)
        return pin.nle(self.model, self.data, q, v) + rows.T @ (self.rotor * (rate @ v)) + self.offset

    def directions(self, q):
        """Directions of friction, one a row: joints, then motors."""
        return np.vstack([np.eye(self.n), self.motor_rows(q)])

    def tool(self, q, point):
        """Position of a point of the last link and its Jacobian, 3 by n."""
        pin.computeJointJacobians(self.model, self.data, q)
        place = self.data.oMi[self.n]
        jacobian = pin.getJointJacobian(self.model, self.data, self.n, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        lever = place.rotation @ point
        linear = jacobian[:3] + np.cross(jacobian[3:].T, lever).T
        return place.translation + lever, linear

    def bend(self, q, v, point):
        """Acceleration of the point at zero joint accelerations, by Pinocchio's forward kinematics."""
        pin.forwardKinematics(self.model, self.data, q, v, np.zeros(self.n))
        frame = pin.SE3(np.eye(3), point)
        velocity = frame.actInv(self.data.v[self.n])
        spatial = frame.actInv(self.data.a[self.n])
        return self.data.oMi[self.n].rotation @ (spatial.linear + np.cross(velocity.angular, velocity.linear))


class Surface:
    def __init__(self, task):
        own = task["surface"]
        self.stiffness, self.damping = own["stiffness"], own["damping"]
        self.friction, self.gap = own["friction"], own["gap"]
        self.origin = np.array(task["origin"])
        self.normal = np.array(task["directions"][0])

    def pressure(self, position, velocity):
        depth = self.normal @ (position - self.origin) - self.gap
        return max(0.0, self.stiffness * depth + self.damping * (self.normal @ velocity)) if depth > 0.0 else 0.0

    def creeps(self, position, velocity):
        """True if the tool is on the surface and so slow that friction is not full."""
        slip = velocity - self.normal * (self.normal @ velocity)
        return self.pressure(position, velocity) > 0.0 and np.linalg.norm(slip) < CREEP

    def force(self, position, velocity):
        """Force on the tool in the base frame."""
        pressure = self.pressure(position, velocity)
        slip = velocity - self.normal * (self.normal @ velocity)
        return -pressure * self.normal - self.friction * pressure * slip / max(np.linalg.norm(slip), CREEP)


def boxed(matrix, right, low, high, sweeps=400):
    """x within low and high that makes |matrix*x - right| smallest, by coordinate descent."""
    square, inner = matrix.T @ matrix, matrix.T @ right
    x = np.clip(np.zeros(len(inner)), low, high)
    for _ in range(sweeps):
        before = x.copy()
        for i in range(len(x)):
            if square[i, i] > 0.0:
                x[i] = np.clip(x[i] + (inner[i] - square[i] @ x) / square[i, i], low[i], high[i])
        if np.abs(x - before).max() < 1e-12:
            break
    return x


def laws(folder):
    """Torques of the impedance law, from Pinocchio's inertia matrix, Jacobian and accelerations."""
    arm = Arm(folder / "robot.toml")
    found = json.loads((folder / "laws.json").read_text())
    point, directions = np.array(found["tool"]), np.array(found["directions"])
    kp, kd = found["posture"]
    targets = np.array(found["targets"])
    worst = {"torque": 0.0, "inertia": 0.0, "jacobian": 0.0, "bend": 0.0}
    largest = 0.0
    for case in found["cases"]:
        q, v, force = (np.array(case[key]) for key in ("q", "qd", "force"))
        position, full = arm.tool(q, point)
        along = directions @ full
        bend = directions @ arm.bend(q, v, point)
        mass = arm.mass(q)
        x = directions @ (position - np.array(found["origin"]))
        reference = np.array(case["task"])
        pressed = -directions @ force
        pull = targets[:, 2] * (reference[:, 0] - x) - pressed
        wanted = reference[:, 2] + (targets[:, 1] * (reference[:, 1] - along @ v) + pull) / targets[:, 0]
        held = np.array(case["posture"])
        own = held[:, 2] + kp * (held[:, 0] - q) + kd * (held[:, 1] - v)
        response = np.linalg.solve(mass, along.T)
        inertia = np.linalg.inv(along @ response)
        acceleration = own + response @ inertia @ (wanted - bend - along @ own)
        slow = arm.directions(q)
        torque = mass @ acceleration + arm.bias(q, v) + slow.T @ (arm.viscous * (slow @ v)) + along.T @ pressed
        worst["torque"] = max(worst["torque"], np.abs(torque - case["torque"]).max())
        worst["jacobian"] = max(worst["jacobian"], np.abs(along - np.array(case["jacobian"])).max())
        worst["bend"] = max(worst["bend"], np.abs(bend - np.array(case["convective"])).max() / (1.0 + np.abs(bend).max()))
        ratio = np.array(case["inertia"]) / mass - 1.0
        worst["inertia"] = max(worst["inertia"], np.abs(ratio[np.abs(mass) > 1e-6]).max())
        largest = max(largest, np.abs(torque).max())
    worst["torque"] /= largest
    return worst | {"cases": len(found["cases"]), "largest_torque": largest}


def read(path, n):
    with open(path, newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        table = [{key: float(value) for key, value in row.items()} for row in rows]
    column = lambda name: np.array([row[name] for row in table])
    several = lambda name: np.array([column(f"{name}{k + 1}") for k in range(n)]).T
    return column("t"), several("q"), several("qd"), several("tau"), column("pressed")


def inverse(arm, surface, point, motion):
    """Torque that the recorded motion lacks after inverse dynamics, contact and friction within its bounds, one tick at a time.

    It is a share of the largest torque of its joint: the largest share while all joints and the tool slide, and while some may
    rest, or the tool creeps on the surface, where the friction of the surface follows its speed.
    """
    t, q, v, tau, pressed = motion
    h = t[1] - t[0]
    out = {"sliding": 0.0, "sticking": 0.0, "pressed": 0.0, "sliding_ticks": 0, "sticking_ticks": 0}
    all_ticks = []
    scale = np.abs(tau).max(axis=0)
    for k in range(0, len(t) - 1, 4):
        position, jacobian = arm.tool(q[k], point)
        out["pressed"] = max(out["pressed"], abs(surface.pressure(position, jacobian @ v[k]) - pressed[k]))
        # Mean acceleration of the tick, state in its middle, and mean force by Simpson's rule.
        mean, a = 0.5 * (v[k] + v[k + 1]), (v[k + 1] - v[k]) / h
        middle = 0.5 * (q[k] + q[k + 1]) + h / 8.0 * (v[k] - v[k + 1])
        directions = arm.directions(middle)
        speeds = np.array([directions @ v[k], directions @ v[k + 1]])
        force, creeps = np.zeros(arm.n), False
        for at, speed, share in ((q[k], v[k], 1.0), (middle, mean, 4.0), (q[k + 1], v[k + 1], 1.0)):
            position, jacobian = arm.tool(at, point)
            force += share / 6.0 * jacobian.T @ surface.force(position, jacobian @ speed)
            creeps |= surface.creeps(position, jacobian @ speed)
        left = tau[k] - arm.mass(middle) @ a - arm.bias(middle, mean) + force
        left -= directions.T @ (arm.viscous * (directions @ mean))
        # Friction acts against the motion where the speed keeps its sign through the tick, and is within its bounds elsewhere.
        sure = (np.sign(speeds[0]) == np.sign(speeds[1])) & (np.abs(speeds).min(axis=0) > 1e-4 * np.abs(directions).max(axis=1))
        low = np.where(sure & (speeds[0] > 0), arm.coulomb, -arm.coulomb)
        high = np.where(sure & (speeds[0] < 0), -arm.coulomb, arm.coulomb)
        if (sure | (arm.coulomb == 0.0)).all():
            off, kind = left - directions.T @ low, "sticking" if creeps else "sliding"
        else:
            weight = 1.0 / scale
            friction = boxed(weight[:, None] * directions.T, weight * left, low, high)
            off, kind = left - directions.T @ friction, "sticking"
        all_ticks.append(float((np.abs(off) / scale).max()))
        out[kind] = max(out[kind], all_ticks[-1])
        out[kind + "_ticks"] += 1
    return out | {"in_99_of_100": float(np.quantile(all_ticks, 0.99))}


def with_mujoco(arm, surface, point, substeps=10):
    """A function that integrates a tick with MuJoCo; every drive has its own joint."""
    import mujoco

    ratio = np.array([drive.get("gear_ratio", 1.0) for drive in arm.drives])
    n = arm.n
    damping = arm.viscous[:n] + arm.viscous[n:] * ratio**2
    dry = arm.coulomb[:n] + arm.coulomb[n:] * np.abs(ratio)
    text = ['<mujoco><compiler angle="radian" inertiafromgeom="false"/>']
    gravity = " ".join(repr(float(g)) for g in arm.described["gravity"])
    text.append(f'<option timestep="{1e-3 / substeps!r}" gravity="{gravity}" integrator="implicitfast" iterations="200" tolerance="1e-14"/><worldbody>')
    number = lambda values: " ".join(repr(float(value)) for value in values)
    for k in range(n):
        joint, place, body = arm.described["joint"][k], arm.model.jointPlacements[k + 1], arm.model.inertias[k + 1]
        w = pin.Quaternion(place.rotation)
        kind = "hinge" if joint["kind"] == "revolute" else "slide"
        inertia = body.inertia
        six = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        text.append(
            f'<body pos="{number(place.translation)}" quat="{number([w.w, w.x, w.y, w.z])}">'
            f'<joint type="{kind}" axis="0 0 1" armature="{float(arm.rotor[k] * ratio[k] ** 2)!r}" damping="{float(damping[k])!r}" '
            f'frictionloss="{float(dry[k])!r}" solreffriction="0.0005 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"/>'
            f'<inertial pos="{number(body.lever)}" mass="{float(body.mass)!r}" fullinertia="{number(six)}"/>'
        )
    text.append("</body>" * n + "</worldbody></mujoco>")
    model = mujoco.MjModel.from_xml_string("".join(text))
    data = mujoco.MjData(model)
    jacobian = np.zeros((3, n))

    def tick(q, v, tau, h):
        model.opt.timestep = h / substeps
        data.qpos[:], data.qvel[:] = q, v
        for _ in range(substeps):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            place = data.xpos[n] + data.xmat[n].reshape(3, 3) @ point
            mujoco.mj_jac(model, data, jacobian, None, place, n)
            velocity = jacobian @ data.qvel
            # In the middle of the step.
            force = surface.force(place + 0.5 * model.opt.timestep * velocity, velocity)
            data.qfrc_applied[:] = tau + jacobian.T @ force - arm.offset
            mujoco.mj_step(model, data)
        return data.qpos.copy(), data.qvel.copy()

    return tick


def with_pinocchio(arm, surface, point, substeps=4):
    """A function that integrates a tick of Pinocchio's equations of motion; friction is implicit, solved by coordinate descent."""

    def tick(q, v, tau, h):
        dt = h / substeps
        for _ in range(substeps):
            middle = q + 0.5 * dt * v
            position, jacobian = arm.tool(middle, point)
            directions = arm.directions(middle)
            mass = arm.mass(middle) + dt * directions.T @ (arm.viscous[:, None] * directions)
            smooth = tau - arm.bias(middle, v) + jacobian.T @ surface.force(position, jacobian @ v)
            response = np.linalg.solve(mass, directions.T)
            free = v + np.linalg.solve(mass, dt * smooth - dt * directions.T @ (arm.viscous * (directions @ v)))
            # Friction ends the motion along its direction within the step, or acts with its bound.
            coupling = directions @ response
            friction, speeds = np.zeros(len(arm.coulomb)), directions @ free
            for _ in range(200):
                before = friction.copy()
                for i in np.flatnonzero(arm.coulomb):
                    rest = speeds[i] - coupling[i] @ friction + coupling[i, i] * friction[i]
                    friction[i] = np.clip(rest / coupling[i, i], -dt * arm.coulomb[i], dt * arm.coulomb[i])
                if np.abs(friction - before).max() < 1e-10 * dt:
                    break
            after = free - response @ friction
            q, v = q + 0.5 * dt * (v + after), after
        return q, v

    return tick


def again(arm, surface, point, motion, starts, tick):
    """Stretches of the motion again with the recorded torques, each from a recorded state: largest differences at all ticks."""
    t, q, v, tau, pressed = motion
    h = t[1] - t[0]
    out = {"force": 0.0, "tool": 0.0, "moved": 0.0, "stretches": len(starts)}
    for start in starts:
        own, speed = q[start].copy(), v[start].copy()
        for k in range(start, min(start + round(STRETCH / h), len(t) - 1)):
            own, speed = tick(own, speed, tau[k], h)
            position, jacobian = arm.tool(own, point)
            recorded, _ = arm.tool(q[k + 1], point)
            out["tool"] = max(out["tool"], float(np.linalg.norm(position - recorded)))
            out["force"] = max(out["force"], abs(surface.pressure(position, jacobian @ speed) - pressed[k + 1]))
        first, _ = arm.tool(q[start], point)
        out["moved"] = max(out["moved"], float(np.linalg.norm(recorded - first)))
    return out


def motion(folder):
    arm = Arm(folder / "robot.toml")
    task = json.loads((folder / "task.json").read_text())
    surface, point = Surface(task), np.array(task["tool"])
    recorded = read(folder / "motion.csv", arm.n)
    t, pressed = recorded[0], recorded[4]
    coupled = any("screw" in drive or "couples" in drive for drive in arm.drives)
    engine, tick = ("pinocchio", with_pinocchio) if coupled else ("mujoco", with_mujoco)
    # First contact, force at rest, start of the slide, slide, return.
    touch, slide = t[np.flatnonzero(pressed > 0.0)[0]], task["slide_start"]
    times = [touch - 0.03, touch + 0.05, slide - 0.2, slide - 0.02, slide + 0.08, slide + 0.5, slide + 1.45, slide + 2.0]
    starts = [int(round(time / (t[1] - t[0]))) for time in times if 0.0 <= time < t[-1] - STRETCH]
    return {
        "engine": engine,
        "inverse": inverse(arm, surface, point, recorded),
        "again": again(arm, surface, point, recorded, starts, tick(arm, surface, point)),
        "largest_force": float(pressed.max()),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["laws", "motion"])
    parser.add_argument("folder", type=pathlib.Path)
    chosen = parser.parse_args()
    print(json.dumps({"laws": laws, "motion": motion}[chosen.what](chosen.folder)))


if __name__ == "__main__":
    main()

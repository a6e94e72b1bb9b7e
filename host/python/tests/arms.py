"""Robots and motions that the tests share, with equations of their own."""

import numpy as np

ARM = """<robot name="arm">
  <link name="base"/>
  {links}
</robot>
"""

LINK = """
  <link name="l{k}">
    <inertial>
      <origin xyz="{c[0]} {c[1]} {c[2]}" rpy="{r[0]} {r[1]} {r[2]}"/>
      <mass value="{m}"/>
      <inertia ixx="{i[0]}" iyy="{i[1]}" izz="{i[2]}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="j{k}" type="{kind}">
    <parent link="{parent}"/>
    <child link="l{k}"/>
    <origin xyz="{o[0]} {o[1]} {o[2]}" rpy="{t[0]} {t[1]} {t[2]}"/>
    <axis xyz="{a[0]} {a[1]} {a[2]}"/>
    <limit lower="-2" upper="2" velocity="5" effort="100"/>
  </joint>
"""


def random_urdf(joints, seed, prismatic=()):
    """Return the URDF text of an arm with random geometry and possible bodies."""
    random = np.random.default_rng(seed)
    links = []
    for k in range(joints):
        axis = random.normal(size=3)
        principal = random.uniform(0.02, 0.04, 3)
        links.append(
            LINK.format(
                k=k,
                parent=f"l{k - 1}" if k else "base",
                kind="prismatic" if k in prismatic else "revolute",
                c=random.uniform(-0.2, 0.2, 3),
                r=random.uniform(-1, 1, 3),
                m=random.uniform(1, 4),
                i=principal,
                o=random.uniform(-0.4, 0.4, 3),
                t=random.uniform(-1.5, 1.5, 3),
                a=axis / np.linalg.norm(axis),
            )
        )
    return ARM.format(links="".join(links))


def states(joints, samples, seed):
    """Return random positions, velocities and accelerations, each (samples, joints)."""
    random = np.random.default_rng(seed)
    return [random.uniform(-s, s, (samples, joints)) for s in (1.5, 3.0, 10.0)]


TWO_LINK = """name = "two links"
gravity = [0.0, -9.81, 0.0]

[[joint]]
name = "shoulder"
kind = "revolute"
alpha = 0.0
a = 0.0
theta = 0.0
d = 0.0

[joint.limits]
position = [-3.1, 3.1]
velocity = 8.0

[[joint]]
name = "elbow"
kind = "revolute"
alpha = 0.0
a = 0.4
theta = 0.0
d = 0.0

[joint.limits]
position = [-3.1, 3.1]
velocity = 8.0
"""


class TwoLink:
    """A planar arm in a vertical plane, by its closed-form equations (Spong, Hutchinson and Vidyasagar 2006, sec. 7.4)."""

    m1, m2 = 4.0, 2.5  # kg
    l1 = 0.4  # m
    c1, c2 = 0.17, 0.15  # m, from the joint to the centre of mass
    i1, i2 = 0.09, 0.05  # kg*m^2, about the centre of mass
    viscous = np.array([0.9, 0.4])  # N*m*s/rad
    coulomb = np.array([1.3, 0.6])  # N*m
    gravity = 9.81

    def torque(self, q, qd, qdd):
        """Return the torque (n, 2)."""
        (q1, q2), (v1, v2), (a1, a2) = q.T, qd.T, qdd.T
        coupling = self.m2 * self.l1 * self.c2
        m11 = (
            self.i1 + self.i2 + self.m1 * self.c1**2
            + self.m2 * (self.l1**2 + self.c2**2) + 2 * coupling * np.cos(q2)
        )
        m12 = self.i2 + self.m2 * self.c2**2 + coupling * np.cos(q2)
        m22 = self.i2 + self.m2 * self.c2**2
        h = coupling * np.sin(q2)
        weight2 = self.m2 * self.c2 * self.gravity * np.cos(q1 + q2)
        weight1 = (self.m1 * self.c1 + self.m2 * self.l1) * self.gravity * np.cos(q1) + weight2
        link = np.column_stack(
            [
                m11 * a1 + m12 * a2 - h * (2 * v1 * v2 + v2**2) + weight1,
                m12 * a1 + m22 * a2 + h * v1**2 + weight2,
            ]
        )
        return link + self.viscous * qd + self.coulomb * np.sign(qd)

    def standard_parameters(self):
        """Return the 28 parameters in the order of the regressor."""
        rows = []
        for k, (m, c, i) in enumerate([(self.m1, self.c1, self.i1), (self.m2, self.c2, self.i2)]):
            # Flat links: Iyy has the part of the mass, and Izz is about the joint.
            inertia = [0.0, 0.0, 0.0, m * c**2, 0.0, i + m * c**2]
            rows += [m, m * c, 0.0, 0.0, *inertia, 0.0, self.viscous[k], self.coulomb[k], 0.0]
        return np.array(rows)


def motion(t, seed, joints, slowest=5.0, harmonics=5, size=0.9):
    """Return position, velocity and acceleration (n, joints) of a random Fourier series."""
    random = np.random.default_rng(seed)
    base = 2 * np.pi / slowest
    q, qd, qdd = (np.zeros((len(t), joints)) for _ in range(3))
    for joint in range(joints):
        for k in range(1, harmonics + 1):
            amplitude, phase = random.uniform(0.3, 1) * size / k**1.5, random.uniform(0, 6.28)
            w = k * base
            q[:, joint] += amplitude * np.sin(w * t + phase)
            qd[:, joint] += amplitude * w * np.cos(w * t + phase)
            qdd[:, joint] -= amplitude * w**2 * np.sin(w * t + phase)
    return q, qd, qdd


def two_link_recording(seed, noise=0.05, seconds=20.0, rate=500.0):
    """Return the columns of a recording of the two links, with white noise on positions and torques."""
    t = np.arange(0, seconds, 1 / rate)
    q, qd, qdd = motion(t, seed, 2)
    random = np.random.default_rng(1000 + seed)
    tau = TwoLink().torque(q, qd, qdd) + noise * random.normal(size=q.shape)
    return {"t": t, "q": q + 1e-5 * random.normal(size=q.shape), "tau": tau}


class Pendulum:
    """One link with gravity, viscous friction and a friction that falls with speed (Stribeck)."""

    inertia, weight = 0.12, 1.6  # kg*m^2, N*m
    viscous, coulomb = 0.3, 0.5  # N*m*s/rad, N*m
    breakaway, speed = 0.35, 0.12  # N*m above Coulomb friction, rad/s

    def torque(self, q, qd, qdd, stribeck=True):
        """Return the torque of positions, velocities and accelerations of any shape."""
        above = self.breakaway * np.exp(-((qd / self.speed) ** 2)) if stribeck else 0.0
        friction = self.viscous * qd + (self.coulomb + above) * np.sign(qd)
        return self.inertia * qdd + self.weight * np.cos(q) + friction


def pendulum_recording(motion_seed, noise_seed, stribeck=True, seconds=12.0, rate=250.0):
    """Return the columns of a recording of the pendulum, with white noise on position and torque."""
    t = np.arange(0, seconds, 1 / rate)
    q, qd, qdd = motion(t, motion_seed, 1, slowest=6.0, harmonics=4, size=0.5)
    random = np.random.default_rng(noise_seed)
    tau = Pendulum().torque(q, qd, qdd, stribeck) + 0.02 * random.normal(size=q.shape)
    return {"t": t, "q": q + 1e-5 * random.normal(size=q.shape), "tau": tau}


ONE_LINK = """name = "pendulum"
gravity = [0.0, -9.81, 0.0]

[[joint]]
name = "link"
kind = "revolute"
alpha = 0.0
a = 0.0
theta = 0.0
d = 0.0

[joint.inertial]
mass = 1.0
first_moment = [0.16, 0.0, 0.0]
inertia = [0.0, 0.0, 0.0, 0.1, 0.0, 0.1]

[joint.friction]
coulomb = 0.4
viscous = 0.25
offset = 0.0
"""
